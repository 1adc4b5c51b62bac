"""Smooth curves of a bifurcation diagram through the computed points, split where stability or the name changes.

Along a branch the shear and the height are interpolated by cubic splines over the arclength of the continuation, with
knots at every computed point and every special point. With the steps of a usual run this stays within 5e-4 of the
axes' extent of the exact curve (checked against runs with steps of 0.02), less than half a line width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.protocols import EventLike, SliceBranchLike, SliceLike, StateLike

if TYPE_CHECKING:
    from rodatlas.continuation import Solution

_Place = tuple[float, float]
_Piece = tuple[np.ndarray, bool, StateLike | None]
SAMPLES = 12  # drawn points for each interval between knots
MERGE = 1e-9  # knots closer than this in arclength are one
SAME_POINT = 1e-6  # special points closer than this in the diagram are one


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of a branch with one line style.

    Attributes
    ----------
    xy : (n, 2) shear and height, in order along the branch.
    stable : whether its index is zero. name : of the stable state it belongs to, if any.
    branch : id of its branch.
    touching : whether the band of this state touches itself all along.
    """

    xy: np.ndarray
    stable: bool
    name: str | None
    branch: str
    touching: bool = False

    def __repr__(self) -> str:
        kind = ("stable" if self.stable else "unstable") + (", touching itself" if self.touching else "")
        return f"Stretch({kind} {self.name or ''} of {self.branch}, {len(self.xy)} points)"


@dataclass(frozen=True, eq=False)
class _Knot:
    arclength: float
    solution: Solution
    index: tuple[int | None, int | None]  # before, after
    special: bool

    @property
    def place(self) -> _Place:
        return self.solution["dD"], self.solution["height"]


def slice_stretches(slice_: SliceLike) -> list[Stretch]:
    """All curves of a slice."""
    return [s for b in slice_.branches for s in branch_stretches(b, slice_.states)]


def branch_stretches(b: SliceBranchLike, states: Sequence[StateLike]) -> list[Stretch]:
    """The curve of one branch, cut where stability or the name of the state changes, or a band touches itself."""
    knots = _knots(b)
    if len(knots) < 2:
        return []
    xy = _interpolate(b, knots)
    named = _states_of_steps(b.id, states)
    pieces: list[_Piece] = []
    for k, (one, two) in enumerate(pairwise(knots)):
        state = named.get((one.place, two.place))
        step = xy[k * SAMPLES : (k + 1) * SAMPLES + 1]
        first, last = _index_after(one, two), _index_before(one, two)
        cuts = _cuts_between(one.place, two.place, named) if state is None else []
        if cuts:
            pieces += _pieces(step, [one.place, *cuts, two.place], named)
        elif state is None and (first == 0) != (last == 0):  # the index changes with no event: cut half-way
            middle = SAMPLES // 2
            pieces += [(step[: middle + 1], first == 0, None), (step[middle:], last == 0, None)]
        else:
            pieces.append((step, first == 0, state))
    return _joined(pieces, b.id)


def unique_events(slice_: SliceLike) -> list[EventLike]:
    """Events at different places of the diagram; a numbered one is kept rather than its copy on another branch."""
    kept: list[EventLike] = []
    every = [e for b in slice_.branches for e in b.events]
    for event in sorted(every, key=lambda e: (e.number is None, e.number or 0)):
        here = np.array(_place(event))
        if not any(
            np.abs(here - _place(other)).max() < SAME_POINT and (event.kind == "fold") == (other.kind == "fold")
            for other in kept
        ):
            kept.append(event)
    return kept


def _place(event: EventLike) -> _Place:
    return event.special.solution["dD"], event.special.solution["height"]


def _knots(b: SliceBranchLike) -> list[_Knot]:
    """Points and special points of a branch in order of arclength, each place once."""
    branch = b.followed.branch
    every = [_Knot(p.arclength, p.solution, (p.index, p.index), False) for p in branch.points]
    every += [_Knot(e.special.arclength, e.special.solution, e.special.index, True) for e in b.events]
    kept: list[_Knot] = []
    for knot in sorted(every, key=lambda k: (k.arclength, not k.special)):
        if kept and knot.arclength - kept[-1].arclength < MERGE:
            if knot.special and not kept[-1].special:
                kept[-1] = knot
            continue
        kept.append(knot)
    return kept


def _index_after(one: _Knot, two: _Knot) -> int | None:
    """Index just after the first of two neighboring knots; a computed point is trusted before a special one."""
    order = (two.index[0], one.index[1]) if one.special and not two.special else (one.index[1], two.index[0])
    return next((i for i in order if i is not None), None)


def _index_before(one: _Knot, two: _Knot) -> int | None:
    """Index just before the second of two neighboring knots."""
    order = (one.index[1], two.index[0]) if two.special and not one.special else (two.index[0], one.index[1])
    if one.special and two.special:
        order = (one.index[1], two.index[0])
    return next((i for i in order if i is not None), None)


def _interpolate(b: SliceBranchLike, knots: list[_Knot]) -> np.ndarray:
    """(SAMPLES (n-1) + 1, 2) samples of the spline, the knots among them exactly."""
    from scipy.interpolate import CubicSpline

    sigma = np.array([k.arclength for k in knots])
    xy = np.array([k.place for k in knots])
    before, after = _continuations(b, knots)
    extended = np.concatenate([before[0], sigma, after[0]])
    order = np.argsort(extended)
    values = np.concatenate([before[1], xy, after[1]])[order]
    fine = (sigma[:-1, None] + np.diff(sigma)[:, None] * np.arange(SAMPLES) / SAMPLES).ravel()
    fine = np.append(fine, sigma[-1])
    if len(extended) > 2:
        out = CubicSpline(extended[order], values)(fine)
    else:
        out = np.column_stack([np.interp(fine, sigma, column) for column in xy.T])
    out[::SAMPLES] = xy
    return out


def _continuations(
    b: SliceBranchLike, knots: list[_Knot]
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Arclengths (k,) and places (k, 2) of knots beyond the two ends.

    A closed branch goes on at its other end. At a pitchfork a reversal-broken branch goes on as its own reversal, with
    the same shear and height: both are even functions of the distance from there.
    """
    from rodatlas.rods.symmetry import is_symmetric

    sigma = np.array([k.arclength for k in knots])
    xy = np.array([k.place for k in knots])
    none = np.empty(0), np.empty((0, 2))
    if len(knots) < 3:
        return none, none
    if b.followed.branch.closed and np.abs(xy[0] - xy[-1]).max() < SAME_POINT:
        period = sigma[-1] - sigma[0]
        return (sigma[-4:-1] - period, xy[-4:-1]), (sigma[1:4] + period, xy[1:4])
    broken = not b.followed.symmetric
    start = (2 * sigma[0] - sigma[1:4], xy[1:4]) if broken and is_symmetric(knots[0].solution) else none
    end = (2 * sigma[-1] - sigma[-4:-1], xy[-4:-1]) if broken and is_symmetric(knots[-1].solution) else none
    return start, end


def _states_of_steps(ident: str, states: Sequence[StateLike]) -> dict[tuple[_Place, _Place], StateLike]:
    """The state on the step from one place of the branch to the next, in both directions."""
    named: dict[tuple[_Place, _Place], StateLike] = {}
    for state in states:
        if state.branch != ident:
            continue
        keys = [(s["dD"], s["height"]) for s in state.solutions]
        for one, two in pairwise(keys):
            named[one, two] = named[two, one] = state
    return named


def _cuts_between(one: _Place, two: _Place, named: dict[tuple[_Place, _Place], StateLike]) -> list[_Place]:
    """Places at which a state becomes the next one between two neighboring knots, in order."""
    shears = sorted((one[0], two[0]))
    inside = sorted({a for a, _ in named if shears[0] < a[0] < shears[1]}, reverse=one[0] > two[0])
    route = [one, *inside, two]
    return inside if all(pair in named for pair in pairwise(route)) else []


def _pieces(step: np.ndarray, route: list[_Place], named: dict[tuple[_Place, _Place], StateLike]) -> list[_Piece]:
    """The samples of one step cut at the places of the route, each piece with its state."""
    sign = np.sign(route[-1][0] - route[0][0])
    along = sign * step[:, 0]
    pieces: list[_Piece] = []
    for one, two in pairwise(route):
        between = step[(along > sign * one[0]) & (along < sign * two[0])]
        pieces.append((np.vstack([one, between, two]), True, named[one, two]))
    return pieces


def _joined(pieces: list[_Piece], ident: str) -> list[Stretch]:
    """Neighboring pieces of one kind put together, those of touching bands apart from the others."""
    out: list[Stretch] = []
    for whole, stable, state in pieces:
        name = state.name if state is not None else None
        for xy, touching in _cut_at_contact(whole, state.contact if state is not None else ()):
            if out and (out[-1].stable, out[-1].name, out[-1].touching) == (stable, name, touching):
                out[-1] = Stretch(np.concatenate([out[-1].xy, xy[1:]]), stable, name, ident, touching)
            else:
                out.append(Stretch(xy, stable, name, ident, touching))
    return out


def _cut_at_contact(xy: np.ndarray, ranges: Sequence[tuple[float, float]]) -> list[tuple[np.ndarray, bool]]:
    """A piece cut where the shear passes the ends of ranges, and whether it lies in one of them in each part."""
    if not ranges:
        return [(xy, False)]
    number = np.arange(len(xy))
    cuts = [0.0, len(xy) - 1.0]
    for edge in (end for span in ranges for end in span):
        off = xy[:, 0] - edge
        at = np.flatnonzero(off[:-1] * off[1:] < 0.0)
        cuts += (at + off[at] / (off[at] - off[at + 1])).tolist()
    parts = []
    for one, two in pairwise(np.unique(cuts)):
        ends = [[np.interp(at, number, column) for column in xy.T] for at in (one, 0.5 * (one + two), two)]
        inside = any(low <= ends[1][0] <= high for low, high in ranges)
        parts.append((np.vstack([ends[0], xy[(number > one) & (number < two)], ends[2]]), inside))
    return parts
