"""Stable states that a slice has missed: followed into it through a face from a slice that has them.

Within a face no bifurcation of a stable state happens, so that a state found at one point of it exists at every other.
A slice can miss one that is connected to nothing else in its range of shear.
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
from rodatlas.atlas.phase.lines import ANGLE_SCALE
from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.match import FREE, same_state
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.stability import morse_index_of
from rodatlas.rods.symmetry import is_symmetric

FIRST, LEAST = 1 / 8, 1 / 1024  # steps, as parts of the way
JUMP = 0.03  # largest change of height on a step; another state may be behind a larger one

Point = tuple[float, float]
"""Angle in degrees and shear."""


@dataclass(frozen=True)
class Completion:
    """A stable state that a slice lacks between two shears, and from where it was followed there."""

    name: str
    angle: float
    low: float
    high: float
    start: Point

    def __str__(self) -> str:
        return (
            f"{self.name} at {self.angle:g} deg, shear {self.low:.5g} to {self.high:.5g}: "
            f"followed there from {self.start[0]:g} deg, shear {self.start[1]:.5g}"
        )


def stable_names(one: Slice, shear: float, completions: Sequence[Completion] = ()) -> tuple[str, ...]:
    """Names of the stable states of a slice at a shear, sorted, each as often as there are such states."""
    angle = one.settings.angle_deg
    names = [s.name for s in one.states if s.shear[0] <= shear <= s.shear[1]]
    return tuple(sorted(names + [c.name for c in completions if c.angle == angle and c.low <= shear <= c.high]))


def complete(rings: Sequence[Rings], slices: Sequence[Slice]) -> list[Completion]:
    """The states that slices lack in faces in which others have them, as far as they can be followed there."""
    found: list[Completion] = []
    for ring in rings:
        spans = [
            (one, span) for one in slices for span in chords(ring, one.settings.angle_deg) if span[1] - span[0] >= THIN
        ]  # fmt: skip
        names = [Counter(stable_names(one, _middle(span))) for one, span in spans]
        most: Counter[str] = Counter()
        for here in names:
            most |= here
        for (one, span), here in zip(spans, names, strict=True):
            for name in sorted(most - here):
                donors = [(o, _middle(s)) for (o, s), n in zip(spans, names, strict=True) if n[name] > here[name]]
                place = (one.settings.angle_deg, _middle(span))
                held = [solve_state(s, place[1], one.settings) for s in one.states_at(place[1], name)]
                missing = most[name] - here[name]
                starts = _reach(name, missing, donors, place, ring, [s for s in held if s is not None])
                found += [Completion(name, place[0], *span, start) for start in starts]
    return found


def _middle(span: tuple[float, float]) -> float:
    return 0.5 * (span[0] + span[1])


def _reach(
    name: str, most: int, donors: Sequence[tuple[Slice, float]], place: Point, ring: Rings, held: Sequence[Solution]
) -> list[Point]:
    """Where states of a name, so many at most, could be followed from to a place, through the face.

    The nearest slices are tried first.

    Parameters
    ----------
    held : the states of that name that are known at the place; what arrives at one of them is no other state.
    """
    known, starts = list(held), list[Point]()
    for one, shear in sorted(donors, key=lambda d: abs(d[0].settings.angle_deg - place[0]))[:3]:
        start = (one.settings.angle_deg, shear)
        path = _path(ring, start, place)
        for state in one.states_at(shear, name) if path is not None else ():
            if len(starts) == most:
                break
            end = _follow(state, one, path or ())
            if end is not None and not any(same_state(end, other) for other in known):
                known.append(end)
                starts.append(start)
    return starts


def _path(ring: Rings, start: Point, end: Point) -> list[Point] | None:
    """A way inside a face: straight, or by the middles of the face at angles between."""
    import shapely

    polygon = polygon_of(ring)
    if polygon.covers(shapely.LineString([start, end])):
        return [start, end]
    angles = np.linspace(start[0], end[0], 18)[1:-1]
    layers = [[(float(a), _middle(span)) for span in chords(ring, float(a))] for a in angles]
    ways: dict[Point, list[Point]] = {start: [start]}
    for layer in [*layers, [end]]:
        following: dict[Point, list[Point]] = {}
        for point in layer:
            free = [p for p in ways if polygon.covers(shapely.LineString([p, point]))]
            if free:
                best = min(free, key=lambda p: _length([*ways[p], point]))
                following[point] = [*ways[best], point]
        ways = following
    return ways.get(end)


def _length(way: Sequence[Point]) -> float:
    return sum(math.hypot((b[0] - a[0]) / ANGLE_SCALE, b[1] - a[1]) for a, b in pairwise(way))


def _follow(state: State, one: Slice, path: Sequence[Point]) -> Solution | None:
    """What a state becomes along a path, from its first point to its last; None where it does not stay stable."""
    here = solve_state(state, path[0][1], one.settings)
    options = TraceOptions(mesh=MeshControl(tolerance=one.settings.tolerance))
    for start, end in pairwise(path):
        done, step = 0.0, FIRST
        while done < 1.0 and here is not None:
            part = min(done + step, 1.0)
            angle, shear = (a + part * (b - a) for a, b in zip(start, end, strict=True))
            there = _next(here, math.radians(angle), shear, state.pair, options)
            if there is None:
                step *= 0.5
                here = here if step >= LEAST else None
            else:
                here, done, step = there, part, min(2 * step, FIRST)
    return here


def _next(here: Solution, angle: float, shear: float, pair: bool, options: TraceOptions) -> Solution | None:
    """The state a little further, if it is found, near by, of the same symmetry and stable."""
    try:
        there = solve(rod_problem(), here.with_parameters(psi0=angle, dD=shear), FREE, options)
    except NotConverged:
        return None
    same = abs(there["height"] - here["height"]) < JUMP and is_symmetric(there) != pair
    return there if same and morse_index_of(there) == 0 else None
