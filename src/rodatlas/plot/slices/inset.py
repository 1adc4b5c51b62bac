"""A small panel inside a diagram, in which the response is stretched so far that two states are told apart."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.look.placement import axes_box, dense, to_points
from rodatlas.plot.look.style import INK, UNSTABLE
from rodatlas.plot.slices.overlaps import Overlap, overlaps_of
from rodatlas.plot.slices.panel import NOTE_SIZE, Drawn, draw_part, label_states, whole_states

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from scipy.spatial import KDTree

Window = tuple[tuple[float, float], tuple[float, float]]
"""Ranges of value and of response."""

SIZES = ((112.0, 60.0), (96.0, 48.0), (84.0, 40.0))  # widths and heights of a panel in points, the wanted one first
NUMBERS, BESIDE, BELOW, ABOVE = 29.0, 8.0, 12.0, 10.0  # room around it: at the side of its numbers, at the other one
STEP = 4.0  # between the places that are tried, in points
AIR = 0.4  # of the extent of both curves, above and below them
LEAST = 3.0  # responses are stretched at least so many times
MOST = 2  # panels in a diagram
PER_POINT = 0.1  # price of a point of distance between a window and its panel
ROUND_OFF = 1e-6  # curves nearer than this are not told apart by stretching


def draw_insets(drawn: Drawn, ax: Axes, *, leaders: np.ndarray | None = None) -> list[Axes]:
    """Where two stable states run on each other, show that window with the responses stretched, if there is room.

    Parameters
    ----------
    drawn : the diagram, with all that a panel must not cover.
    leaders : (n, 2) samples of further lines that a panel must not cover, in points.

    Returns
    -------
    the axes of the panels; none where nothing coincides or no place is free.
    """
    from matplotlib.patches import Rectangle

    panels: list[Axes] = []
    extent = np.ptp(np.concatenate([np.zeros((1, 2)), *(s.xy for s in drawn.stretches)]), axis=0)
    lines = np.empty((0, 2)) if leaders is None else leaders
    for overlap in sorted(overlaps_of(whole_states(drawn.stretches), ax), key=lambda o: -np.ptp(o.xy[:, 0])):
        window = _window(overlap, extent)
        if window is None or len(panels) == MOST:
            continue
        (x0, x1), (y0, y1) = window
        seen = to_points(ax, np.array([[x0, y0], [x1, y1]]))
        box = _free_place(seen, np.concatenate([drawn.obstacles.points, lines]), drawn)
        if box is None or box[1, 1] - box[0, 1] < LEAST * (seen[1, 1] - seen[0, 1]):
            continue
        ax.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fc="none", ec=INK, lw=0.45, zorder=4.2, gid="window"))
        _draw_connectors(seen, box, ax)
        panels.append(_draw_panel(drawn, overlap, window, box, ax))
        low, high = _with_numbers(box, _at_right(seen, box))
        drawn.obstacles.take(0.5 * (low + high), (float(high[0] - low[0]), float(high[1] - low[1])))
    return panels


def _window(overlap: Overlap, extent: np.ndarray) -> Window | None:
    """The ranges that hold both curves; none where they run upward, or are the same but for round-off.

    Parameters
    ----------
    extent : (2,) of the whole diagram.
    """
    both = np.concatenate([overlap.xy, overlap.over])
    low, high = both.min(axis=0), both.max(axis=0)
    order = np.argsort(overlap.over[:, 0])
    apart = np.abs(np.interp(overlap.xy[:, 0], *overlap.over[order].T) - overlap.xy[:, 1]).max()
    share = (high - low) / extent
    if apart < ROUND_OFF * extent[1] or share[1] > share[0]:
        return None
    margin = np.array([0.02, AIR]) * (high - low)
    low, high = low - margin, high + margin
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def _free_place(seen: np.ndarray, points: np.ndarray, drawn: Drawn) -> np.ndarray | None:
    """Lower left and upper right corner (2, 2) of a panel where nothing is covered, near its window `seen`."""
    from scipy.spatial import KDTree

    left, bottom, right, top = drawn.obstacles.border
    taken, tree = np.array(drawn.obstacles.boxes).reshape(-1, 4), KDTree(points)
    for size in SIZES:
        xs = np.arange(left + BESIDE, right - size[0] - BESIDE, STEP)
        ys = np.arange(bottom + BELOW, top - size[1] - ABOVE, STEP)
        boxes = [np.array([corner, np.add(corner, size)]) for corner in product(xs, ys)]
        best, chosen = np.inf, None
        for length, box in sorted(((_length(seen, box), box) for box in boxes), key=lambda pair: pair[0]):
            if PER_POINT * length >= best:  # those that follow are farther away
                break
            low, high = _with_numbers(box, _at_right(seen, box))
            if low[0] < left or high[0] > right or ((points > low) & (points < high)).all(axis=1).any():
                continue
            if _touched(taken, low, high).any():
                continue
            price = PER_POINT * length + _crossed(_connectors(seen, box), tree, taken)
            if price < best:
                best, chosen = price, box
        if chosen is not None:
            return chosen
    return None


def _at_right(seen: np.ndarray, box: np.ndarray) -> bool:
    """Whether the numbers of the responses stand at the right: the side away from the window, where no line comes."""
    return bool(box[:, 0].mean() > seen[:, 0].mean())


def _with_numbers(box: np.ndarray, at_right: bool) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of a panel with its numbers and its title."""
    left, right = (BESIDE, NUMBERS) if at_right else (NUMBERS, BESIDE)
    return box[0] - [left, BELOW], box[1] + [right, ABOVE]


def _touched(boxes: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which of the boxes (n, 4) share area with a rectangle."""
    return np.all((boxes[:, :2] < high) & (boxes[:, 2:] > low), axis=1)


def _length(seen: np.ndarray, box: np.ndarray) -> float:
    """Distance of the middles of the window and the panel."""
    return float(np.hypot(*(box.mean(axis=0) - seen.mean(axis=0))))


def _crossed(lines: list[np.ndarray], tree: KDTree, taken: np.ndarray) -> float:
    """Price of the curves and labels that the lines from the window to the panel cross."""
    samples = np.concatenate([np.empty((0, 2)), *(dense(line, 3.0)[2:] for line in lines)])
    near = tree.query(samples, distance_upper_bound=2.0)[0] < 2.0
    labels = sum(bool(_touched(taken, p - 1.5, p + 1.5).any()) for p in samples)
    return 0.3 * float(near.sum()) + 8.0 * labels


def _connectors(seen: np.ndarray, box: np.ndarray) -> list[np.ndarray]:
    """The two lines (2, 2) between equal corners of two rectangles that leave both on one side."""
    lines = []
    for i, j in product((0, 1), (0, 1)):
        line = np.array([(seen[i, 0], seen[j, 1]), (box[i, 0], box[j, 1])])
        way = line[1] - line[0]
        corners = np.array([(r[a, 0], r[b, 1]) for r in (seen, box) for a in (0, 1) for b in (0, 1)]) - line[0]
        side = way[0] * corners[:, 1] - way[1] * corners[:, 0]
        if (side > -1e-6).all() or (side < 1e-6).all():
            lines.append(line)
    return lines


def _draw_connectors(seen: np.ndarray, box: np.ndarray, ax: Axes) -> None:
    back = ax.transData.inverted()
    for line in _connectors(seen, box):
        ax.plot(*back.transform(line * ax.figure.dpi / 72.0).T, color=UNSTABLE, lw=0.35, zorder=1.6, gid="zoom")


def _draw_panel(drawn: Drawn, overlap: Overlap, window: Window, box: np.ndarray, ax: Axes) -> Axes:
    """Curves and names in the panel, and how much responses are enlarged."""
    whole = np.array(axes_box(ax, 0.0)).reshape(2, 2)
    share = (box - whole[0]) / (whole[1] - whole[0])
    panel = ax.inset_axes((*share[0], *(share[1] - share[0])), zorder=6)
    part = draw_part(drawn.stretches, *window, panel)
    shown = [replace(s, xy=_clipped(s.xy, window)) for s in (overlap.hidden, overlap.top)]
    label_states(replace(part, stretches=shown), panel)
    panel.locator_params(axis="x", nbins=4)
    panel.locator_params(axis="y", nbins=3)
    panel.tick_params(labelsize=NOTE_SIZE, length=2.0, pad=2.0)
    seen = to_points(ax, np.array(window).T)
    if _at_right(seen, box):
        panel.yaxis.tick_right()
    for spine in panel.spines.values():
        spine.set_linewidth(0.45)
    larger = (box[1, 1] - box[0, 1]) / (seen[1, 1] - seen[0, 1])
    panel.set_title(f"enlarged {larger:.2g} times vertically", fontsize=NOTE_SIZE, pad=2.0)
    return panel


def _clipped(xy: np.ndarray, window: Window) -> np.ndarray:
    """The samples inside a window."""
    low, high = np.array(window).T
    return xy[((xy >= low) & (xy <= high)).all(axis=1)]
