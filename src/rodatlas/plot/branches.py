"""Branches and loci of any boundary value problem, in the plane of two of their parameters or observables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation import Branch, Locus
from rodatlas.continuation.checks import check_type, shown
from rodatlas.continuation.results.branch import SpecialPoint
from rodatlas.plot.look.style import (
    INK,
    MARKERS,
    ONE_COLUMN,
    STABLE_WIDTH,
    UNSTABLE_DASHES,
    UNSTABLE_WIDTH,
    check_axes,
    check_color,
    new_figure,
    styled,
)
from rodatlas.plot.planes.loci import EVENTS, LINES, MARK, NAMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INCHES = 2.7  # height of a figure of its own
BOX = (0.175, 0.155, 0.795, 0.815)
SAMPLES = 16  # drawn places for each step
APART = 0.1  # of a step: special points nearer to a computed one are no knots, for their arclength is not so well known
OTHERS: dict[str, dict[str, Any]] = {
    "extremum": {"marker": "^", "ms": 4.4, "mfc": "white"},
    "zero": {"marker": "|", "ms": 6.0},
    "pitchfork": {"marker": "o", "ms": 3.8, "mfc": INK},
}


def draw_branch(branch: Branch, x: str, y: str, color: Any = None, ax: Axes | None = None) -> Axes:
    """Draw a branch: stable parts solid, unstable ones dashed, folds open disks, branch points filled disks.

    Extrema are triangles, zeros small bars. All is solid where no index is known (see `TraceOptions.index`); an index
    of zero means stable.

    Parameters
    ----------
    branch : what :func:`rodatlas.trace` or :func:`rodatlas.switch` returned.
    x, y : parameters, observables, or 'arclength'.
    color : of the line, any color of matplotlib; ink by default.
    ax : where to draw, a figure of its own by default. Several branches go on one.

    Returns
    -------
    the axes drawn on.

    Examples
    --------
    >>> ax = draw_branch(branch, "lam", "mean")
    >>> ax = draw_branch(side, "lam", "mean", ax=ax)
    """
    check_type("branch", branch, Branch, "a Branch, see trace and Branch.load")
    check_axes(ax)
    color = INK if color is None else check_color(color)
    places = [[_value(p, name) for name in (x, y)] for p in branch.points]
    with styled():
        ax = _axes(x, y) if ax is None else ax
        for piece, stable in _pieces(branch, np.array(places), (x, y)):
            width = STABLE_WIDTH if stable else UNSTABLE_WIDTH
            ax.plot(*piece.T, color=color, lw=width, ls="-" if stable else (0, UNSTABLE_DASHES))
        for special in branch.special:
            ax.plot(*(_value(special, name) for name in (x, y)), zorder=4, **_marker(special))
    return ax


def draw_locus(locus: Locus, x: str | None = None, y: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw a locus with its special points: folds solid, pitchforks dashed, other branch points dotted.

    Parameters
    ----------
    locus : what :func:`rodatlas.follow_locus` returned.
    x, y : parameters, observables, or 'arclength'; the two parameters of the locus by default, the second one across.
    ax : where to draw, a figure of its own by default. Several loci go on one.

    Returns
    -------
    the axes drawn on.
    """
    check_type("locus", locus, Locus, "a Locus, see follow_locus and Locus.load")
    check_axes(ax)
    x, y = locus.free[1] if x is None else x, locus.free[0] if y is None else y
    places = np.array([[_value(p, name) for name in (x, y)] for p in locus.points])
    arclength = np.array([p.arclength for p in locus.points])
    kind = "pitchfork" if locus.pitchfork else locus.kind.removeprefix("unprotected ")
    with styled():
        ax = _axes(x, y) if ax is None else ax
        _plot(ax, kind, *_smooth(arclength, places)[1].T, **LINES.get(kind, {"color": INK, "lw": 1.2, "ls": "-"}))
        for event in locus.events:
            style = (OTHERS | EVENTS).get(event.kind, OTHERS["zero"])
            label = NAMES.get(event.kind, event.kind)
            _plot(ax, label, *(_value(event, name) for name in (x, y)), zorder=4, **(MARK | style))
        ax.legend(handlelength=2.4, fontsize=7.5)
    return ax


def _plot(ax: Axes, label: str, *places: Any, **style: Any) -> None:
    """Draw with a label, unless that is in the legend already."""
    known = ax.get_legend_handles_labels()[1]
    ax.plot(*places, label=None if label in known else label, **style)


def _axes(x: str, y: str) -> Axes:
    ax = new_figure(ONE_COLUMN, INCHES).add_axes(BOX)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    return ax


def _value(at: Any, name: str) -> float:
    """A parameter, observable or the arclength of a point."""
    solution = at.solution
    if name == "arclength":
        return float(at.arclength)
    known = (*solution.parameter_names, *solution.observables)
    if name not in known:
        raise ValueError(f"x, y: expected one of {', '.join((*known, 'arclength'))}, got {shown(name)}")
    return float(solution[name])


def _marker(special: SpecialPoint) -> dict[str, Any]:
    kind = special.kind.partition(" of ")[0]
    return MARKERS[kind] if kind in MARKERS else MARK | OTHERS[kind]


def _pieces(branch: Branch, places: np.ndarray, names: tuple[str, str]) -> list[tuple[np.ndarray, bool]]:
    """The smooth curve of a branch, cut where its stability changes."""
    arclength = branch.column("arclength")
    where = [(s.arclength, [_value(s, name) for name in names]) for s in branch.special]
    fine, curve = _smooth(*_with_knots(arclength, places, where))
    cuts = [(float(arclength[0]), _is_stable(branch.points[0].index))]
    for one, two in pairwise(branch.points):
        inside = [
            s for s in branch.special if one.arclength <= s.arclength <= two.arclength and s.index[0] != s.index[1]
        ]
        if _is_stable(one.index) != _is_stable(two.index):
            middle = (one.arclength + two.arclength) / 2
            cuts.append((inside[0].arclength if inside else middle, _is_stable(two.index)))
    edges = [*(place for place, _ in cuts), float(arclength[-1])]
    out = []
    for (low, high), (_, stable) in zip(pairwise(edges), cuts, strict=True):
        within = np.unique(np.concatenate([[low, high], fine[(fine > low) & (fine < high)]]))
        out.append((np.column_stack([np.interp(within, fine, column) for column in curve.T]), stable))
    return out


def _is_stable(index: int | None) -> bool:
    return index is None or index == 0


def _with_knots(
    arclength: np.ndarray, places: np.ndarray, special: Sequence[tuple[float, list[float]]]
) -> tuple[np.ndarray, np.ndarray]:
    """The points with those special points that lie well between them."""
    at, values = list(arclength), list(places)
    for place, value in special:
        i = int(np.searchsorted(at, place))
        if 0 < i < len(at) and min(place - at[i - 1], at[i] - place) > APART * (at[i] - at[i - 1]):
            at.insert(i, place)
            values.insert(i, np.array(value))
    return np.array(at), np.array(values)


def _smooth(arclength: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Arclengths and places of a spline through some points, straight lines where there are fewer than four."""
    keep = np.concatenate([[True], np.diff(arclength) > 0.0])
    arclength, places = arclength[keep], places[keep]
    if len(arclength) < 4:
        return arclength, places
    from scipy.interpolate import CubicSpline

    parts = np.arange(SAMPLES) / SAMPLES
    fine = np.append((arclength[:-1, None] + np.diff(arclength)[:, None] * parts).ravel(), arclength[-1])
    return fine, CubicSpline(arclength, places)(fine)
