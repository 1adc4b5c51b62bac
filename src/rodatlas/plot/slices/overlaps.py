"""Where curves run on each other, and how all of them are made to be seen there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.look.placement import axes_box, dense, to_points
from rodatlas.plot.look.style import STABLE_WIDTH
from rodatlas.plot.slices.curves import Stretch

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

NEAR = 1.5 * STABLE_WIDTH  # points: curves nearer than this look like one line
RUN = 12.0  # points: a shorter run is a crossing, or the place where one branch leaves another
DASH = 5.0  # points of each color where two curves are drawn as one line
SPACING = 0.5  # points between the samples that are compared


@dataclass(frozen=True, eq=False)
class Overlap:
    """A run over which the curve of one stable state hides that of another.

    Attributes
    ----------
    hidden, top : the stretches, in the order in which they are drawn.
    xy : (n, 2) value and response along the hidden one.
    over : (m, 2) value and response along the other one.
    """

    hidden: Stretch
    top: Stretch
    xy: np.ndarray
    over: np.ndarray

    def __repr__(self) -> str:
        return f"Overlap({self.top.name} over {self.hidden.name}, at {self.xy[0, 0]:.4g} to {self.xy[-1, 0]:.4g})"


def overlaps_of(stretches: Sequence[Stretch], ax: Axes) -> list[Overlap]:
    """Runs of two stable states, of one name or of two, that look like one line on axes whose limits are final."""
    box = np.array(axes_box(ax, 0.0))
    stable = [(s, dense(to_points(ax, s.xy), SPACING)) for s in stretches if s.stable and len(s.xy) > 1]
    found = []
    for (hidden, below), (top, above) in combinations(stable, 2):
        for run in _runs(below, above, box):
            over = np.concatenate([run[:0], *_runs(above, run, box, 0.0)])
            found.append(Overlap(hidden, top, _to_data(run, ax), _to_data(over, ax)))
    return found


def draw_overlaps(overlaps: Sequence[Overlap], ax: Axes) -> None:
    """Where a stretch that was just drawn hides others, let all colors alternate; each curve stays at its own place,
    and no gap is left.

    Parameters
    ----------
    overlaps : all those with that stretch on top.
    """
    _alternate([(o.xy, o.hidden.color) for o in overlaps], ax, lw=STABLE_WIDTH, zorder=3, gid="alternating")


def draw_coinciding(lines: Sequence[Line2D], ax: Axes) -> None:
    """Where solid lines of different colors hide each other, let their colors alternate.

    Parameters
    ----------
    lines : on axes whose limits and place are final; those that come later lie above the others.
    """
    box = np.array(axes_box(ax, 0.0))
    points = [dense(to_points(ax, np.asarray(line.get_xydata())), SPACING) for line in lines]
    for k, line in enumerate(lines):
        order = 2.0 + 0.01 * k
        line.set_zorder(order)
        below = [(p, str(x.get_color())) for p, x in zip(points[:k], lines, strict=False)]
        runs = [
            (_to_data(run, ax), color) for p, color in below if color != line.get_color()
            for run in _runs(p, points[k], box)
        ]  # fmt: skip
        _alternate(runs, ax, lw=line.get_linewidth(), zorder=order)


def _alternate(
    runs: Sequence[tuple[np.ndarray, str]], ax: Axes, *, lw: float, zorder: float, gid: str | None = None
) -> None:  # fmt: skip
    """Dashes along hidden runs (n, 2), one color after the other, with one dash of the curve on top between."""
    colors = list(dict.fromkeys(color for _, color in runs))
    for xy, color in runs:
        k = colors.index(color) + 1
        ax.plot(
            *xy.T, color=color, lw=lw, zorder=zorder, dash_capstyle="butt", gid=gid,
            ls=(-k * DASH, (DASH, len(colors) * DASH)),
        )  # fmt: skip


def _runs(points: np.ndarray, others: np.ndarray, box: np.ndarray, least: float = RUN) -> list[np.ndarray]:
    """Parts of a densely sampled curve (n, 2) that are near another one, inside a box (left, bottom, right, top), and
    at least so long; all in points."""
    from scipy.spatial import KDTree

    near = KDTree(others).query(points, distance_upper_bound=NEAR)[0] < NEAR
    near &= ((points >= box[:2]) & (points <= box[2:])).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    runs = [points[start:stop] for start, stop in edges.reshape(-1, 2)]
    return [run for run in runs if len(run) > 1 and np.hypot(*np.diff(run, axis=0).T).sum() >= least]


def _to_data(points: np.ndarray, ax: Axes) -> np.ndarray:
    return ax.transData.inverted().transform(points * ax.figure.dpi / 72.0)
