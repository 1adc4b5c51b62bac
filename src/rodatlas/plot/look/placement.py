"""Free places for labels: rectangles that stay clear of curves, of each other and of the border.

All lengths are in points (1/72 inch) and all positions are relative to the lower left corner of the figure, so that
the result does not depend on the resolution or the backend.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.look.style import FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PADDING = 1.6
DIRECTIONS = 24  # in which a label may stand from its marker


@dataclass
class Obstacles:
    """What labels must not cover.

    Attributes
    ----------
    points : (n, 2) dense samples of curves.
    border : rectangle (left, bottom, right, top) within which labels must lie.
    boxes : rectangles that are taken.
    weights : (n,) price of covering each of the points; 1 by default.
    """

    points: np.ndarray
    border: tuple[float, float, float, float]
    boxes: list[tuple[float, float, float, float]] = field(default_factory=list)
    weights: np.ndarray | None = None

    def cost(self, center: np.ndarray, size: tuple[float, float]) -> float:
        """Zero for a free place; grows with what is covered."""
        half = 0.5 * np.asarray(size) + PADDING
        low, high = center - half, center + half
        inside = ((self.points > low) & (self.points < high)).all(axis=1)
        covered = float(inside.sum() if self.weights is None else self.weights[inside].sum())
        shared = sum(
            max(0.0, min(high[0], b[2]) - max(low[0], b[0])) * max(0.0, min(high[1], b[3]) - max(low[1], b[1]))
            for b in self.boxes
        )
        left, bottom, right, top = self.border
        outside = sum(max(0.0, float(d)) for d in (left - low[0], bottom - low[1], high[0] - right, high[1] - top))
        return covered + 3.0 * shared + 50.0 * outside

    def take(self, center: np.ndarray, size: tuple[float, float], pad: float = 0.0) -> None:
        """Let a rectangle be taken, widened by `pad` on all sides."""
        half = 0.5 * np.asarray(size) + pad
        low, high = center - half, center + half
        self.boxes.append((float(low[0]), float(low[1]), float(high[0]), float(high[1])))


def best_place(
    obstacles: Obstacles, size: tuple[float, float], candidates: Iterable[tuple[np.ndarray, float]]
) -> tuple[np.ndarray, int]:
    """The candidate (center, penalty) of least cost, and its position in the list."""
    best, chosen, at = np.inf, None, 0
    for i, (center, penalty) in enumerate(candidates):
        if penalty >= best:
            continue
        cost = penalty + obstacles.cost(center, size)
        if cost < best:
            best, chosen, at = cost, center, i
    if chosen is None:
        raise ValueError("candidates: expected at least one place, got none")
    return chosen, at


def around(anchor: np.ndarray, size: tuple[float, float], gaps: Iterable[float]) -> list[tuple[np.ndarray, float]]:
    """Places for a label around a marker, the near ones first: the label's box is `gap` away from the anchor."""
    out = []
    for gap in gaps:
        for angle in np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS + np.pi / 4:
            way = np.array([np.cos(angle), np.sin(angle)])
            reach = min(
                (0.5 * length / abs(c) for length, c in zip(size, way, strict=True) if abs(c) > 1e-9), default=0.0
            )
            out.append((anchor + way * (gap + reach), 0.35 * gap))
    return out


@lru_cache(maxsize=512)
def text_size(text: str, size: float) -> tuple[float, float]:
    """Width and height of a line of text in the figures' type, from its outlines."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    box = TextPath((0, 0), text, prop=FontProperties(family=FONT, size=size)).get_extents()
    return float(box.width), float(max(box.height, 0.62 * size))


def to_points(ax: Axes, xy: np.ndarray) -> np.ndarray:
    """Data coordinates (n, 2) to points from the lower left corner of the figure."""
    return ax.transData.transform(xy) * 72.0 / ax.figure.dpi


def axes_box(ax: Axes, inset: float = 2.0) -> tuple[float, float, float, float]:
    """The axes' rectangle in points, a little smaller."""
    box = ax.get_window_extent()
    scale = 72.0 / ax.figure.dpi
    return (box.x0 * scale + inset, box.y0 * scale + inset, box.x1 * scale - inset, box.y1 * scale - inset)


def dense(polyline: np.ndarray, spacing: float = 1.5) -> np.ndarray:
    """Samples of a polyline (n, 2) that are at most `spacing` apart."""
    if len(polyline) < 2:
        return polyline
    lengths = np.hypot(*np.diff(polyline, axis=0).T)
    total = np.concatenate([[0.0], np.cumsum(lengths)])
    if total[-1] == 0:
        return polyline[:1]
    even = np.linspace(0.0, total[-1], int(np.ceil(total[-1] / spacing)) + 1)
    return np.column_stack([np.interp(even, total, column) for column in polyline.T])


def uncovered(xy: np.ndarray, points: np.ndarray, drawn: np.ndarray, run: float = 6.0) -> list[np.ndarray]:
    """Pieces of a curve that do not lie on what is drawn already; mere crossings count as free.

    Parameters
    ----------
    xy : (n, 2) the curve in any coordinates. points : (n, 2) the same in points.
    drawn : (m, 2) dense samples of what is drawn, in points.
    run : shortest length that is left out, in points.
    """
    from scipy.spatial import KDTree

    if not len(drawn):
        return [xy]
    covered = KDTree(drawn).query(points, distance_upper_bound=0.35)[0] < 0.35
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], covered, [False]]).astype(int)))
    pieces, first = [], 0
    for start, stop in edges.reshape(-1, 2):
        if along[stop - 1] - along[start] < run:
            continue
        if start > first:
            pieces.append(xy[first : start + 1])
        first = stop - 1
    if first < len(xy) - 1:
        pieces.append(xy[first:])
    return pieces
