"""Shaded drawings of a band in ordinary axes: own projection, painter's order, one collection of polygons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.plot.band.surface import BandSurface, band_surface
from rodatlas.plot.look.style import INK, ONE_COLUMN, UNNAMED, check_axes, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rodatlas.continuation import Solution

# The narrow band of 1/80 is hardly a line in a small drawing: it is drawn wider, and captions say so.
DISPLAY_WIDTH = 1.0 / 16.0
EDGE = 0.045  # part of the width that is drawn dark at each edge
CLAMP_LENGTH, CLAMP_THICKNESS, CLAMP_OVERHANG = 0.055, 0.022, 1.3
CLAMP_COLOR = np.array([0.56, 0.58, 0.61])
TRIAD = 0.6  # width and height of a figure of the three directions, in inches
LIGHT = np.array([-0.45, 0.75, 0.55])  # in the frame of the viewer: right, up, toward


@dataclass(frozen=True)
class View:
    """Where the viewer stands; x points right, y up, z (the width direction) roughly toward the viewer.

    Attributes
    ----------
    azimuth_deg : turn of the viewer about y, from the z axis toward +x.
    elevation_deg : height of the viewer above the x-z plane.
    distance : from the origin, in units of the rod length, for a perspective; None for parallel projection.
    """

    azimuth_deg: float = -38.0
    elevation_deg: float = 24.0
    distance: float | None = None

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) rows: unit vectors to the right, up, and toward the viewer."""
        a, e = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        toward = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        return np.array([right, np.cross(toward, right), toward])

    def project(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) points to (..., 3): right and up on the page, and depth toward the viewer."""
        seen = np.asarray(points) @ self.axes.T
        if self.distance is None:
            return seen
        scale = self.distance / (self.distance - seen[..., 2:])
        return np.concatenate([seen[..., :2] * scale, seen[..., 2:]], axis=-1)


DEFAULT_VIEW = View()


def render_band(
    solution: Solution, width: float = DISPLAY_WIDTH, view: View = DEFAULT_VIEW, ax: Axes | None = None, *,
    color: str | None = None, clamps: bool = True, samples: int = 241, margin: float = 0.02,
) -> Axes:  # fmt: skip
    """Draw a band as a shaded ribbon with clamp blocks at both ends.

    The side of the director d2 has the full color, the other one is pale.

    Parameters
    ----------
    solution : of a rod problem.
    width : drawn width, in units of the length.
    ax : axes that this drawing has for itself, set to equal scales, without frame; a figure of one column by default.
    color : of the front; gray by default.
    clamps : whether to draw the blocks that hold the ends.
    samples : number of cross-sections.
    margin : free border, in units of the length.

    Returns
    -------
    the axes drawn on, with one collection of polygons more.
    """
    check_axes(ax)
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    surface = band_surface(solution, width, samples)
    parts = _ribbon(surface, view, np.array(to_rgb(color or UNNAMED)))
    if clamps:
        parts += [p for end in (0, 1) for p in _clamp(surface, view, end)]
    parts.sort(key=lambda p: p.depth)
    corners = [p.corners for p in parts]
    colors, lines = [p.color for p in parts], [p.line for p in parts]
    low, high = bounds(corners)
    if ax is None:
        across, up = high - low + 2.0 * margin
        ax = new_figure(ONE_COLUMN, ONE_COLUMN * up / across).add_axes((0.0, 0.0, 1.0, 1.0))
    with styled():
        drawn = PolyCollection(
            corners, facecolors=colors, edgecolors=colors, linewidths=lines, antialiaseds=True, joinstyle="round"
        )
        ax.add_collection(drawn, autolim=False)
        ax.set_aspect("equal")
        ax.set_axis_off()
        ax.set_xlim(low[0] - margin, high[0] + margin)
        ax.set_ylim(low[1] - margin, high[1] + margin)
    return ax


def draw_triad(view: View = DEFAULT_VIEW, ax: Axes | None = None, *, size: float = 7.5) -> Axes:
    """Draw the directions of x, y and z as three small arrows.

    Parameters
    ----------
    view : where the viewer stands.
    ax : axes that the arrows have for themselves; a small figure by default.
    size : of the letters, in points.

    Returns
    -------
    the axes drawn on.
    """
    check_type("view", view, View, "a View such as View()")
    check_axes(ax)
    if ax is None:
        ax = new_figure(TRIAD, TRIAD).add_axes((0.0, 0.0, 1.0, 1.0))
    with styled():
        for name, axis in zip("xyz", np.eye(3), strict=True):
            tip = view.project(axis)[:2]
            ax.annotate(
                "", xy=(tip[0], tip[1]), xytext=(0, 0),
                arrowprops={"arrowstyle": "-|>,head_length=0.22,head_width=0.09", "lw": 0.6, "color": INK,
                            "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip
            x, y = tip + 0.28 * tip / np.hypot(*tip)
            ax.text(x, y, f"${name}$", ha="center", va="center", fontsize=size)
        ax.set_aspect("equal")
        ax.set_axis_off()
        ax.set_xlim(-0.9, 1.4)
        ax.set_ylim(-0.9, 1.4)
    return ax


def bounds(corners: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of a set of polygons."""
    every = np.concatenate(list(corners))
    return every.min(axis=0), every.max(axis=0)


@dataclass(frozen=True)
class _Polygon:
    corners: np.ndarray
    depth: float
    color: np.ndarray
    line: float


def _ribbon(surface: BandSurface, view: View, base: np.ndarray) -> list[_Polygon]:
    """Quadrilaterals of the ribbon: the middle in two tones, a thin dark strip at each edge."""
    toward = view.axes[2]
    normal = surface.directors[1]
    normal = 0.5 * (normal[:-1] + normal[1:])
    front = normal @ toward > 0
    facing = np.where(front[:, None], normal, -normal)
    tones = np.where(front[:, None], _lift(base, 0.15), _lift(base, 0.6))
    shaded = _shade(tones, facing, view)
    dark = np.broadcast_to(0.45 * base, shaded.shape)
    cuts = (-0.5, -0.5 + EDGE, 0.5 - EDGE, 0.5)
    seen = [view.project(surface.across(v)) for v in cuts]
    out = []
    for k, colors in ((1, shaded), (0, dark), (2, dark)):
        one, two = seen[k], seen[k + 1]
        quads = np.stack([one[:-1], one[1:], two[1:], two[:-1]], axis=1)
        depth = quads[..., 2].mean(axis=1) + (0.0 if k == 1 else 2e-3)
        out += [
            _Polygon(q[:, :2], float(d), c, 0.25 if k == 1 else 0.35)
            for q, d, c in zip(quads, depth, colors, strict=True)
        ]
    return out


def _clamp(surface: BandSurface, view: View, end: int) -> list[_Polygon]:
    """Visible faces of the block that holds one end."""
    at = -1 if end else 0
    d1, d2, d3 = surface.directors[:, at]
    edges = np.array([
        d1 * surface.width * CLAMP_OVERHANG, d2 * CLAMP_THICKNESS, d3 * (CLAMP_LENGTH if end else -CLAMP_LENGTH)
    ])  # fmt: skip
    middle = surface.centerline[at] + 0.5 * edges[2]
    out = []
    for axis in range(3):
        across = [edges[k] for k in range(3) if k != axis]
        for sign in (-1.0, 1.0):
            outward = sign * edges[axis] / np.linalg.norm(edges[axis])
            if outward @ view.axes[2] <= 1e-9:
                continue
            color = _shade(CLAMP_COLOR[None], outward[None], view)[0]
            corner = middle + 0.5 * (sign * edges[axis] - across[0] - across[1])
            out += _patches(corner, across[0], across[1], color, view)
    return out


def _patches(corner: np.ndarray, one: np.ndarray, two: np.ndarray, color: np.ndarray, view: View) -> list[_Polygon]:
    """A face cut in small pieces, so that each has a depth of its own."""
    out, n = [], 4
    for i in range(n):
        for j in range(n):
            quad = np.array([
                corner + one * a / n + two * b / n for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
            ])  # fmt: skip
            seen = view.project(quad)
            out.append(_Polygon(seen[:, :2], float(seen[:, 2].mean()), color, 0.25))
    return out


def _lift(color: np.ndarray, part: float) -> np.ndarray:
    """A color mixed with white."""
    return color + part * (1.0 - color)


def _shade(colors: np.ndarray, normals: np.ndarray, view: View) -> np.ndarray:
    """Lambert's law with a bright ambient part and a soft highlight; normals (n, 3) point to the viewer's side."""
    light = LIGHT / np.linalg.norm(LIGHT)
    cosine = (normals @ view.axes.T) @ light
    level = 0.62 + 0.38 * np.clip(0.5 + 0.5 * cosine, 0.0, 1.0) ** 1.2
    gloss = 0.22 * np.clip(cosine, 0.0, 1.0) ** 6
    lit = colors * level[:, None]
    return np.clip(lit + gloss[:, None] * (1.0 - lit), 0.0, 1.0)
