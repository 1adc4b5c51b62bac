"""Meshes of a band: its middle surface as quadrilaterals, and the band with its thickness as a closed solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.plot.band.surface import BandSurface

ACROSS = 6  # strips side by side


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh of triangles or quadrilaterals.

    Attributes
    ----------
    vertices : (n, 3) in the unit of length that was asked for.
    faces : (m, 3) or (m, 4) corners, counterclockwise seen from outside (a sheet: from +d2).
    normals : (n, 3) unit normals at the vertices, of a sheet; None for a solid, whose edges are sharp.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"

    @property
    def triangles(self) -> np.ndarray:
        """(k, 3) the faces as triangles; each quadrilateral is cut along the same diagonal."""
        if self.faces.shape[1] == 3:
            return self.faces
        return np.concatenate([self.faces[:, [0, 1, 2]], self.faces[:, [0, 2, 3]]])

    @property
    def volume(self) -> float:
        r"""Enclosed volume, :math:`\frac16\sum a\cdot(b\times c)`; of closed meshes only."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return float(np.einsum("ka,ka->k", a, np.cross(b, c)).sum() / 6.0)

    @property
    def area(self) -> float:
        """Total area."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def sheet(surface: BandSurface, length: float = 1.0) -> Mesh:
    r"""The middle surface of a band, in `ACROSS` strips: `ACROSS` + 1 vertices for each cross-section.

    A single strip would have the width times the mean length of its edges for its area. The surface of a twisted rod
    has less, :math:`\int\!\int\sqrt{1 + v^2\tau^2}\,dv\,ds`; the error falls with the square of the number of strips.

    Parameters
    ----------
    length : the rod length L in the unit of the mesh, in mm say.
    """
    check_type("surface", surface, BandSurface, "a BandSurface, see band_surface")
    rows, columns = len(surface.s), ACROSS + 1
    first = columns * np.arange(rows - 1)[:, None] + np.arange(ACROSS)
    faces = np.stack([first, first + columns, first + columns + 1, first + 1], axis=-1).reshape(-1, 4)
    normals = np.repeat(surface.directors[1], columns, axis=0)
    return Mesh(length * _grid(surface).reshape(-1, 3), faces, normals)


def box(surface: BandSurface, thickness: float, length: float = 1.0) -> Mesh:
    r"""The band with its thickness: a closed mesh of quadrilaterals.

    The cross-sections are rectangles :math:`X + v\,d_1 + u\,d_2` with :math:`|v| \le w/2`, :math:`|u| \le t/2`. Since
    :math:`\partial_s(X + v d_1 + u d_2) \cdot d_3 = 1 + u\kappa_1`, the volume is w t exactly, however the band is bent
    and twisted, but for the length of the steps along s.

    Parameters
    ----------
    thickness : t, in units of the rod length.
    length : the rod length L in the unit of the mesh.
    """
    check_type("surface", surface, BandSurface, "a BandSurface, see band_surface")
    if not thickness > 0:
        raise ValueError(f"thickness: expected a positive number, got {thickness}")
    half, middle = 0.5 * thickness * surface.directors[1][:, None], _grid(surface)
    rings = np.concatenate([middle - half, (middle + half)[:, ::-1]], axis=1)  # turn about +d3
    rows, around = rings.shape[:2]
    first = around * np.arange(rows - 1)[:, None] + np.arange(around)
    following = around * np.arange(rows - 1)[:, None] + np.roll(np.arange(around), -1)
    sides = np.stack([first, following, following + around, first + around], axis=-1)
    # opposite sides are cut along corresponding diagonals: what one loses by the twist of its corners, the other gains
    sides[:, around // 2 :] = np.roll(sides[:, around // 2 :], -1, axis=-1)
    j = np.arange(ACROSS)
    cap = np.column_stack([j, j + 1, around - 2 - j, around - 1 - j])
    faces = np.concatenate([sides.reshape(-1, 4), cap[:, ::-1], cap + around * (rows - 1)])
    return Mesh(length * rings.reshape(-1, 3), faces)


def _grid(surface: BandSurface) -> np.ndarray:
    """(n, ACROSS + 1, 3) points of the middle surface, across from -w/2 to w/2."""
    return np.stack([surface.across(v) for v in np.linspace(-0.5, 0.5, ACROSS + 1)], axis=1)
