"""Stable states that a slice has missed: followed into it through a face from a slice that has them.

Within a face no bifurcation of a stable state happens, so that a state found at one point of it exists at every other.
A slice can miss one that is connected to nothing else in its range.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rodatlas.atlas.phase.arrangement import Rings, chords, polygon_of
from rodatlas.atlas.phase.cover import THIN
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.states.coexisting import solve_state
from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve
from rodatlas.model import Model
from rodatlas.model.orbit import is_alone, same_state

FIRST, LEAST = 1 / 8, 1 / 1024  # steps, as parts of the way
JUMP = 0.03  # largest change of the response on a step, of 1 + its size; another state may be behind a larger one

Point = tuple[float, float]
"""Second control, and control along slices."""


@dataclass(frozen=True)
class Completion:
    """A stable state that a slice lacks between two values, and from where it was followed there.

    `along` and `second` are the names of the controls.
    """

    name: str
    place: float
    low: float
    high: float
    start: Point
    along: str
    second: str

    def __str__(self) -> str:
        return (
            f"{self.name} at {self.second} {self.place:g}, {self.along} {self.low:.5g} to {self.high:.5g}: "
            f"followed there from {self.second} {self.start[0]:g}, {self.along} {self.start[1]:.5g}"
        )


def stable_names(
    one: Slice, value: float, settings: PhaseSettings, completions: Sequence[Completion] = ()
) -> tuple[str, ...]:
    """Names of the stable states of a slice at a value, sorted, each as often as there are such states."""
    second = one.settings.setting[settings.second]
    called = settings.nomenclature.in_plane
    names = [called(s.name) for s in one.states if s.span[0] <= value <= s.span[1]]
    return tuple(sorted(names + [c.name for c in completions if c.place == second and c.low <= value <= c.high]))


def complete(rings: Sequence[Rings], slices: Sequence[Slice], settings: PhaseSettings) -> list[Completion]:
    """The states that slices lack in faces in which others have them, as far as they can be followed there."""
    found: list[Completion] = []
    thin = THIN * settings.units[1]
    for ring in rings:
        spans = [
            (one, span) for one in slices for span in chords(ring, one.settings.setting[settings.second])
            if span[1] - span[0] >= thin
        ]  # fmt: skip
        names = [Counter(stable_names(one, _middle(span), settings)) for one, span in spans]
        most: Counter[str] = Counter()
        for here in names:
            most |= here
        for (one, span), here in zip(spans, names, strict=True):
            for name in sorted(most - here):
                donors = [(o, _middle(s)) for (o, s), n in zip(spans, names, strict=True) if n[name] > here[name]]
                place = (one.settings.setting[settings.second], _middle(span))
                held = [solve_state(s, place[1], one.settings) for s in _called(one, place[1], name, settings)]
                missing = most[name] - here[name]
                starts = _reach(name, missing, donors, place, ring, [s for s in held if s is not None], settings)
                found += [Completion(name, place[0], *span, start, settings.along, settings.second)
                          for start in starts]  # fmt: skip
    return found


def _called(one: Slice, value: float, name: str, settings: PhaseSettings) -> list[State]:
    """The states of a slice at a value that have a name in the plane."""
    return [s for s in one.states_at(value) if settings.nomenclature.in_plane(s.name) == name]


def _middle(span: tuple[float, float]) -> float:
    return 0.5 * (span[0] + span[1])


def _reach(
    name: str, most: int, donors: Sequence[tuple[Slice, float]], place: Point, ring: Rings, held: Sequence[Solution],
    settings: PhaseSettings,
) -> list[Point]:  # fmt: skip
    """Where states of a name, so many at most, could be followed from to a place, through the face.

    The nearest slices are tried first.

    Parameters
    ----------
    held : the states of that name that are known at the place; what arrives at one of them is no other state.
    """
    known, starts = list(held), list[Point]()
    for one, value in sorted(donors, key=lambda d: abs(d[0].settings.setting[settings.second] - place[0]))[:3]:
        start = (one.settings.setting[settings.second], value)
        path = _path(ring, start, place, settings)
        for state in _called(one, value, name, settings) if path is not None else ():
            if len(starts) == most:
                break
            end = _follow(state, one, path or (), settings)
            if end is not None and not any(same_state(one.settings.local, end, other) for other in known):
                known.append(end)
                starts.append(start)
    return starts


def _path(ring: Rings, start: Point, end: Point, settings: PhaseSettings) -> list[Point] | None:
    """A way inside a face: straight, or by the middles of the face at values between."""
    import shapely

    polygon = polygon_of(ring)
    if polygon.covers(shapely.LineString([start, end])):
        return [start, end]
    between = np.linspace(start[0], end[0], 18)[1:-1]
    layers = [[(float(a), _middle(span)) for span in chords(ring, float(a))] for a in between]
    ways: dict[Point, list[Point]] = {start: [start]}
    for layer in [*layers, [end]]:
        following: dict[Point, list[Point]] = {}
        for point in layer:
            free = [p for p in ways if polygon.covers(shapely.LineString([p, point]))]
            if free:
                best = min(free, key=lambda p: _length([*ways[p], point], settings))
                following[point] = [*ways[best], point]
        ways = following
    return ways.get(end)


def _length(way: Sequence[Point], settings: PhaseSettings) -> float:
    return sum(math.hypot((b[0] - a[0]) / settings.second_scale, b[1] - a[1]) for a, b in pairwise(way))


def _follow(state: State, one: Slice, path: Sequence[Point], settings: PhaseSettings) -> Solution | None:
    """What a state becomes along a path, from its first point to its last; None where it does not stay stable."""
    here = solve_state(state, path[0][1], one.settings)
    for start, end in pairwise(path):
        done, step = 0.0, FIRST
        while done < 1.0 and here is not None:
            part = min(done + step, 1.0)
            second, value = (a + part * (b - a) for a, b in zip(start, end, strict=True))
            there = _next(here, second, value, state.pair, settings, one.settings.local)
            if there is None:
                step *= 0.5
                here = here if step >= LEAST else None
            else:
                here, done, step = there, part, min(2 * step, FIRST)
    return here


def _next(
    here: Solution, second: float, value: float, pair: bool, settings: PhaseSettings, local: Model
) -> Solution | None:
    """The state a little further, if it is found, near by, of the same symmetry and stable."""
    model = settings.model
    guess = model.with_value(settings.along, model.with_value(settings.second, here, second), value)
    free = model.free_with(settings.along)
    try:
        there = solve(model.problem, guess, free, TraceOptions(mesh=MeshControl(tolerance=settings.tolerance)))
    except NotConverged:
        return None
    before, after = settings.response(here), settings.response(there)
    same = abs(after - before) < JUMP * max(1.0, abs(before)) and is_alone(local, there) != pair
    return there if same and model.index is not None and model.index(there) == 0 else None
