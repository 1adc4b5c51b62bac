"""Smooth curves of a bifurcation diagram through the computed points, split where stability or the name changes.

Along a branch the value of what varies and the response are interpolated by cubic splines over the arclength of the
continuation, with knots at every computed point and every special point. With the steps of a usual run this stays
within 5e-4 of the axes' extent of the exact curve (checked against runs with steps of 0.02), less than half a line
width.

A branch of pairs stands for its images too. Where these have the same response, as the height of a band and of its
reversal, one curve is that of all; otherwise each has its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation import Solution, image
from rodatlas.model.orbit import group, own_symmetries
from rodatlas.plot.look.protocols import SettingsLike, SliceBranchLike, SliceLike, StateLike
from rodatlas.plot.look.style import UNSTABLE, color_of, colors_of

if TYPE_CHECKING:
    from rodatlas.model import Model

See = Callable[[Solution], Solution]
"""Gives an image of a solution."""
_Place = tuple[float, float]
_Beyond = tuple[np.ndarray, np.ndarray]
_Piece = tuple[np.ndarray, bool, StateLike | None]
SAMPLES = 12  # drawn points for each interval between knots
MERGE = 1e-9  # knots closer than this in arclength are one
SAME_POINT = 1e-6  # special points closer than this in the diagram are one, as parts of its extent
EQUAL = 1e-6  # responses of two images of a state differ by less, relative to 1 + their size


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of a branch with one line style.

    Attributes
    ----------
    xy : (n, 2) value and response, in order along the branch.
    stable : whether its index is zero. name : of the stable state it belongs to, if any.
    branch : id of its branch.
    touching : whether the band of this state touches itself all along.
    """

    xy: np.ndarray
    stable: bool
    name: str | None
    branch: str
    touching: bool = False
    color: str = UNSTABLE

    def __repr__(self) -> str:
        kind = ("stable" if self.stable else "unstable") + (", touching itself" if self.touching else "")
        return f"Stretch({kind} {self.name or ''} of {self.branch}, {len(self.xy)} points)"


@dataclass(frozen=True)
class Mark:
    """A special point in the diagram: its kind, its number if it has one, and its value and response."""

    kind: str
    number: int | None
    place: _Place


@dataclass(frozen=True, eq=False)
class _Knot:
    arclength: float
    solution: Solution
    index: tuple[int | None, int | None]  # before, after
    special: bool
    place: _Place


def slice_stretches(slice_: SliceLike) -> list[Stretch]:
    """All curves of a slice, in the colors of their states."""
    colors, settings = colors_of(slice_), slice_.settings
    found = []
    for b in slice_.branches:
        for see in _images(b, settings):
            found += branch_stretches(b, slice_.states, settings, see)
    return [replace(s, color=color_of(s.name, colors)) if s.stable else s for s in found]


def branch_stretches(
    b: SliceBranchLike, states: Sequence[StateLike], settings: SettingsLike, see: See | None = None
) -> list[Stretch]:
    """The curve of one branch, cut where stability or the name of the state changes, or a band touches itself.

    Parameters
    ----------
    see : the image of a solution whose curve is wanted; the solution itself by default.
    """
    place = _reader(settings, see or _itself)
    knots = _knots(b, place)
    if len(knots) < 2:
        return []
    xy = _interpolate(b, knots, settings, place)
    named = _states_of_steps(b.id, states, place)
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


def unique_events(slice_: SliceLike) -> list[Mark]:
    """Events at different places of the diagram; a numbered one is kept rather than its copy on another branch."""
    every = []
    for b in slice_.branches:
        for see in _images(b, slice_.settings) if b.events else ():
            place = _reader(slice_.settings, see)
            every += [Mark(e.kind, e.number, place(e.special.solution)) for e in b.events]
    same = SAME_POINT * np.maximum(np.ptp([e.place for e in every], axis=0), 1.0) if every else np.ones(2)
    kept: list[Mark] = []
    for event in sorted(every, key=lambda e: (e.number is None, e.number or 0)):
        alike = (other for other in kept if (event.kind == "fold") == (other.kind == "fold"))
        if not any((np.abs(np.subtract(event.place, other.place)) < same).all() for other in alike):
            kept.append(event)
    return kept


def _itself(solution: Solution) -> Solution:
    return solution


def _reader(settings: SettingsLike, see: See) -> Callable[[Solution], _Place]:
    """Reads the place of an image of a solution."""

    def place(solution: Solution) -> _Place:
        seen = see(solution)
        return settings.value(seen), settings.response(seen)

    return place


def _images(b: SliceBranchLike, settings: SettingsLike) -> list[See]:
    """The images of the states of a branch under the symmetries of the setting that have curves of their own."""
    model, points = settings.model, b.followed.branch.points
    tried = [points[i].solution for i in sorted({len(points) * k // 7 for k in (2, 4, 5)})]
    found: list[tuple[See, list[float]]] = [(_itself, [settings.response(s) for s in tried])]
    for see, _ in found if b.followed.pair else ():  # grows while it is walked over
        for name in group(model, tried[0]):
            new = _compound(see, model, name)
            responses = [settings.response(new(s)) for s in tried]
            if not any(np.allclose(responses, known, rtol=EQUAL, atol=EQUAL) for _, known in found):
                found.append((new, responses))
    return [see for see, _ in found]


def _compound(see: See, model: Model, name: str) -> See:
    """The image under a symmetry of what is seen."""
    return lambda solution: image(model.problem, name, see(solution))


def _knots(b: SliceBranchLike, place: Callable[[Solution], _Place]) -> list[_Knot]:
    """Points and special points of a branch in order of arclength, each place once."""
    branch = b.followed.branch
    every = [_Knot(p.arclength, p.solution, (p.index, p.index), False, place(p.solution)) for p in branch.points]
    every += [
        _Knot(x.arclength, x.solution, x.index, True, place(x.solution)) for x in (e.special for e in b.events)
    ]  # fmt: skip
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


def _interpolate(
    b: SliceBranchLike, knots: list[_Knot], settings: SettingsLike, place: Callable[[Solution], _Place]
) -> np.ndarray:
    """(SAMPLES (n-1) + 1, 2) samples of the spline, the knots among them exactly."""
    from scipy.interpolate import CubicSpline

    sigma = np.array([k.arclength for k in knots])
    xy = np.array([k.place for k in knots])
    before, after = _continuations(b, knots, settings, place)
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
    b: SliceBranchLike, knots: list[_Knot], settings: SettingsLike, place: Callable[[Solution], _Place]
) -> tuple[_Beyond, _Beyond]:
    """Arclengths (k,) and places (k, 2) of knots beyond the two ends.

    A closed branch goes on at its other end. At a pitchfork a branch without some symmetry goes on as its own image.
    """
    sigma = np.array([k.arclength for k in knots])
    xy = np.array([k.place for k in knots])
    none = np.empty(0), np.empty((0, 2))
    if len(knots) < 3:
        return none, none
    if b.followed.branch.closed and (np.abs(xy[0] - xy[-1]) < SAME_POINT * np.maximum(np.ptp(xy, axis=0), 1.0)).all():
        period = sigma[-1] - sigma[0]
        return (sigma[-4:-1] - period, xy[-4:-1]), (sigma[1:4] + period, xy[1:4])
    start = _mirrored(b, knots[0], knots[1:4], settings, place)
    end = _mirrored(b, knots[-1], knots[-4:-1], settings, place)
    return start or none, end or none


def _mirrored(
    b: SliceBranchLike, edge: _Knot, inner: list[_Knot], settings: SettingsLike, place: Callable[[Solution], _Place]
) -> _Beyond | None:
    """The images of the knots next to an end, mirrored there, when the end has a symmetry that the branch has not."""
    broken = own_symmetries(settings.model, edge.solution) - b.followed.symmetries if b.followed.pair else ()
    if not broken:
        return None
    name = min(broken)
    images = [place(image(settings.model.problem, name, knot.solution)) for knot in inner]
    return np.array([2 * edge.arclength - knot.arclength for knot in inner]), np.array(images)


def _states_of_steps(
    ident: str, states: Sequence[StateLike], place: Callable[[Solution], _Place]
) -> dict[tuple[_Place, _Place], StateLike]:
    """The state on the step from one place of the branch to the next, in both directions."""
    named: dict[tuple[_Place, _Place], StateLike] = {}
    for state in states:
        if state.branch != ident:
            continue
        keys = [place(s) for s in state.solutions]
        for one, two in pairwise(keys):
            named[one, two] = named[two, one] = state
    return named


def _cuts_between(one: _Place, two: _Place, named: dict[tuple[_Place, _Place], StateLike]) -> list[_Place]:
    """Places at which a state becomes the next one between two neighboring knots, in order."""
    low, high = sorted((one[0], two[0]))
    inside = sorted({a for a, _ in named if low < a[0] < high}, reverse=one[0] > two[0])
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
    """A piece cut where the value passes the ends of ranges, and whether it lies in one of them in each part."""
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
