"""Curves along which a stable state changes its name without a bifurcation, as a nomenclature tells."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, Roles, joined_states
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve

STEP = 0.025  # of the range of loci, between two points of such a curve at most
REACH = 0.02  # units within which the change lies at the next place
PARTS = 10  # of this range, for a first look at where the number is least
TOLERANCE = 1e-8
NOT_FOUND = 1e3  # far above any curvature; not infinite, for the sake of interpolating minimizers
ZERO = 1e-3  # a number that is smaller at a change vanishes there
PRECISE = 1e-7  # units to which a change is solved for


Number = Callable[[Solution], float]


@dataclass(frozen=True)
class _Place:
    """A change at one value of the second control: it, the value along slices, and the state there."""

    second: float
    value: float
    solution: Solution

    @property
    def point(self) -> tuple[float, float]:
        return self.second, self.value


def change_lines(
    slices: Sequence[Slice], events: Sequence[PlaneEvent], roles: Roles, settings: PhaseSettings
) -> tuple[list[Line], list[str]]:
    """The curves of smooth changes of name that slices meet, and warnings.

    Such a curve ends on the frame, or where the two states first join at a bifurcation: there a line at one value of
    the second control goes on to that special point, since on its other side the whole range has one name.

    Parameters
    ----------
    slices : in order of the second control.
    events, roles : special points of the loci, and what the loci bound.
    """
    found: dict[tuple[str, str], list[_Place]] = {}
    for one in slices:
        for before, after in _changes(one):
            place = _Place(one.settings.setting[settings.second], before.high.value, before.high.solution)
            found.setdefault((before.name, after.name), []).append(place)
    lines, warnings = [], []
    seconds = [s.settings.setting[settings.second] for s in slices]
    for names, places in found.items():
        for chain in _chains(places, seconds):
            line, missing = _line(names, chain, seconds, events, roles, settings)
            lines.append(line)
            warnings += missing
    return lines, warnings


def _changes(one: Slice) -> list[tuple[State, State]]:
    """Neighbors on a stable stretch of a slice, the one of smaller values first."""
    smooth = [s for s in one.states if "smooth" in (s.low.kind, s.high.kind)]
    return [
        (a, b) for a in smooth for b in smooth
        if a.branch == b.branch and a.high.kind == b.low.kind == "smooth" and abs(a.high.value - b.low.value) < 1e-9
    ]  # fmt: skip


def _chains(places: Sequence[_Place], seconds: Sequence[float]) -> list[list[_Place]]:
    """Places of one kind at successive slices."""
    chains: list[list[_Place]] = []
    for place in sorted(places, key=lambda p: p.second):
        at = seconds.index(place.second)
        if chains and seconds.index(chains[-1][-1].second) == at - 1:
            chains[-1].append(place)
        else:
            chains.append([place])
    return chains


def _line(
    names: tuple[str, str], chain: list[_Place], seconds: Sequence[float], events: Sequence[PlaneEvent], roles: Roles,
    settings: PhaseSettings,
) -> tuple[Line, list[str]]:  # fmt: skip
    """One curve, solved for between the slices and up to its ends."""
    place_at = _solver(names, chain, settings)
    points = [p.point for p in chain]
    step = STEP * (settings.loci.second_high - settings.loci.second_low)
    for one, two in pairwise(chain):
        points += [p.point for p in _march(place_at, one, two.second, step)[:-1]]
    warnings = []
    tails = []
    for side, end in ((-1, chain[0]), (1, chain[-1])):
        at = seconds.index(end.second) + side
        beyond = seconds[at] if 0 <= at < len(seconds) else settings.frame[0 if side < 0 else 1]
        target, event = beyond, None
        if 0 <= at < len(seconds):
            low, high = sorted((end.second, beyond))
            event = _joint(names, events, roles, low, high, settings.along)
            if event is None:
                warnings.append(
                    f"change of {names[0]} to {names[1]}: it ends between {settings.second} {end.second:g} and "
                    f"{beyond:g}, where no locus of either does"
                )
                continue
            target = event.second
        path = _march(place_at, end, target, step)
        if not path or path[-1].second != target:
            warnings.append(f"change of {names[0]} to {names[1]}: not found from {settings.second} {end.second:g} to "
                            f"{target:g}")  # fmt: skip
        points += [p.point for p in path]
        if event is not None and path:
            tails.append((side, (event.second, event.value)))
    curve = np.array(sorted(set(points)))
    for side, tail in tails:
        curve = np.vstack([[tail], curve] if side < 0 else [curve, [tail]])
    return Line("|".join(names), "smooth", curve), warnings


def _joint(
    names: tuple[str, str], events: Sequence[PlaneEvent], roles: Roles, low: float, high: float, along: str
) -> PlaneEvent | None:
    """The special point between two places at which two states join."""
    inside = [e for e in events if low < e.second < high and e.parameter != along]
    return next((e for e in inside if joined_states(e, roles) == names), None)


def _march(
    place_at: Callable[[_Place, float], _Place | None], start: _Place, target: float, step: float
) -> list[_Place]:
    """The change at places from a known one up to a target, as far as it is found."""
    count = max(1, math.ceil(abs(target - start.second) / step))
    found: list[_Place] = []
    for second in np.linspace(start.second, target, count + 1)[1:]:
        place = place_at(found[-1] if found else start, float(second))
        if place is None:
            break
        found.append(place)
    return found


def _solver(
    names: tuple[str, str], chain: Sequence[_Place], settings: PhaseSettings
) -> Callable[[_Place, float], _Place | None]:
    """How a change is found at a place: where the number of the nomenclature vanishes, or is least.

    Which of the two is told by the number at a change that is known.
    """
    number = settings.nomenclature.change(*names)
    vanishes = number is not None and abs(number(chain[0].solution)) < ZERO

    def place_at(near: _Place, second: float) -> _Place | None:
        if number is None:
            return None
        bend = _Numbered(number, near.solution, second, settings)
        reach = REACH * settings.units[1]
        value = (_zero if vanishes else _least)(bend, near.value, reach, PRECISE * settings.units[1])
        if value is None or bend(value) >= NOT_FOUND:
            return None
        return _Place(second, value, bend.last)

    return place_at


def _zero(bend: _Numbered, near: float, reach: float, precise: float) -> float | None:
    """The value at which the number vanishes."""
    from scipy.optimize import brentq

    low, high = near - reach, near + reach
    ends = bend(low), bend(high)
    good = ends[0] * ends[1] < 0 and max(ends) < NOT_FOUND
    return brentq(bend, low, high, xtol=precise) if good else None


def _least(bend: _Numbered, near: float, reach: float, precise: float) -> float | None:
    """The value at which the number is least, looked for downward: close below it the state may end in a cusp."""
    from scipy.optimize import minimize_scalar

    step = reach / PARTS
    values = [bend(near + reach)]
    while values[-1] == min(values) and len(values) <= 2 * PARTS:
        values.append(bend(near + reach - len(values) * step))
    last = near + reach - (len(values) - 1) * step
    if len(values) < 3 or values[-1] == min(values):
        return None
    options = {"xatol": precise}
    return float(minimize_scalar(bend, bounds=(last, last + 2 * step), method="bounded", options=options).x)


class _Numbered:
    """A number of a state as a function of the value along a slice, `NOT_FOUND` where there is no state.

    `last` is the last state that was.
    """

    def __init__(self, number: Number, near: Solution, second: float, settings: PhaseSettings):
        self.last = settings.model.with_value(settings.second, near, second)
        self._number, self._settings = number, settings
        self._known: list[Solution] = []

    def __call__(self, value: float) -> float:
        s = self._settings
        guess = min(self._known, key=lambda x: abs(s.value(x) - value), default=self.last)
        options = TraceOptions(mesh=MeshControl(tolerance=TOLERANCE))
        try:
            guess = s.model.with_value(s.along, guess, value)
            self.last = solve(s.model.problem, guess, s.model.free_with(s.along), options)
        except NotConverged:
            return NOT_FOUND
        self._known.append(self.last)
        return self._number(self.last)
