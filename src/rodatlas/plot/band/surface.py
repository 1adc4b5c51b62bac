"""The surface of a band: the centerline widened along the director d1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.rods.band import NARROW
from rodatlas.rods.kinematics import ribbon

if TYPE_CHECKING:
    from rodatlas.continuation import Solution


@dataclass(frozen=True, eq=False)
class BandSurface:
    """A ribbon sampled across and along.

    Attributes
    ----------
    s : (n,) arclength of the cross-sections, from 0 to 1.
    vertices : (n, 2, 3) the edges X - (w/2) d1 and X + (w/2) d1, in units of the rod length.
    directors : (3, n, 3) d1 (width), d2 (surface normal), d3 (tangent).
    width : w.
    """

    s: np.ndarray
    vertices: np.ndarray
    directors: np.ndarray
    width: float

    def __repr__(self) -> str:
        return f"BandSurface({len(self.s)} cross-sections, width {self.width:g})"

    @property
    def centerline(self) -> np.ndarray:
        """(n, 3) points X(s)."""
        return self.vertices.mean(axis=1)

    @property
    def faces(self) -> np.ndarray:
        """(n-1, 4) corners of the quadrilaterals, as indices into `vertices.reshape(-1, 3)`, seen from +d2 in
        counterclockwise order."""
        first = 2 * np.arange(len(self.s) - 1)
        return np.column_stack([first, first + 2, first + 3, first + 1])

    def across(self, v: float) -> np.ndarray:
        """(n, 3) the curve at the coordinate v across the width, from -1/2 to 1/2 between the edges."""
        return self.vertices[:, 0] * (0.5 - v) + self.vertices[:, 1] * (0.5 + v)


def band_surface(solution: Solution, width: float = NARROW, samples: int = 241) -> BandSurface:
    r"""The ribbon :math:`X(s) + v\,d_1(s)`, :math:`|v| \le w/2`.

    Parameters
    ----------
    solution : of a rod problem, with unknowns q0..q3 and x, y, z.
    width : w, in units of the length.
    samples : number of cross-sections, evenly spaced, at least 2.
    """
    check_has("solution", solution, ("unknowns", "stages"), "a Solution such as state_at(Ends(15.0))")
    if not width > 0:
        raise ValueError(f"width: expected a positive number, got {width}")
    if samples < 2:
        raise ValueError(f"samples: expected at least 2, got {samples}")
    s = np.linspace(0.0, 1.0, samples)
    center, frame = ribbon(solution, s)
    half = 0.5 * width * frame[0]
    return BandSurface(s, np.stack([center - half, center + half], axis=1), frame, width)
