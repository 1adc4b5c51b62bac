"""Where the curves of two stable states run on each other in a diagram, and how both are made to be seen there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.curves import Stretch
from rodatlas.plot.placement import axes_box, dense, to_points
from rodatlas.plot.style import STABLE_WIDTH, color_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    xy : (n, 2) shear and height along the hidden one.
    over : (m, 2) shear and height along the other one.
    """

    hidden: Stretch
    top: Stretch
    xy: np.ndarray
    over: np.ndarray

    def __repr__(self) -> str:
        return f"Overlap({self.top.name} over {self.hidden.name}, shear {self.xy[0, 0]:.4g} to {self.xy[-1, 0]:.4g})"


def overlaps_of(stretches: Sequence[Stretch], ax: Axes) -> list[Overlap]:
    """Runs of differently named stable states that look like one line on axes whose limits and place are final."""
    box = np.array(axes_box(ax, 0.0))
    stable = [(s, dense(to_points(ax, s.xy), SPACING)) for s in stretches if s.stable and len(s.xy) > 1]
    found = []
    for (hidden, below), (top, above) in combinations(stable, 2):
        if color_of(hidden.name) != color_of(top.name):
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
    names = list(dict.fromkeys(o.hidden.name for o in overlaps))
    for overlap in overlaps:
        k = names.index(overlap.hidden.name) + 1
        ax.plot(
            *overlap.xy.T, color=color_of(overlap.hidden.name), lw=STABLE_WIDTH, zorder=3, gid="alternating",
            ls=(-k * DASH, (DASH, len(names) * DASH)), dash_capstyle="butt",
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
