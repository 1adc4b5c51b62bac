"""Stable states that coexist at one place, each solved exactly there; and what those are called that share a name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rodatlas.atlas.slices.branches.match import state_at
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_each, check_type
from rodatlas.model.orbit import is_alone, same_state
from rodatlas.states.labels import SEPARATOR, Wanted, chosen, in_order, labels

NEAREST = 4  # computed solutions from which one at a given value is solved for
ROUND = 0.005  # of the scale of the range: a chosen value is a multiple of this where the range allows it
TOUCH = 1e-6  # of that scale: ranges that share less than this touch, and do not overlap


def richest_value(states: Iterable[State]) -> float:
    """A value of what varies at which the largest number of named stable states coexist, each pair counted once.

    The middle of the longest such interval, rounded to a multiple of `ROUND` when that stays well inside. Shorter
    intervals than this count only when there is no longer one.
    """
    check_each("states", states, State, "states of a Slice")
    states = list(states)
    if not states:
        raise ValueError("states: expected at least one stable state, got none")
    edges = np.unique([x for state in states for x in state.span])
    middles = 0.5 * (edges[1:] + edges[:-1])
    counts = np.array([sum(x.span[0] < m < x.span[1] for x in states) for m in middles])
    if not len(counts):
        return float(edges[0])
    step = ROUND * _scale(edges[-1] - edges[0])
    lengths = np.diff(edges)
    counts[lengths < step] -= 1000 * int((lengths >= step).any())
    lengths = np.where(counts == counts.max(), lengths, 0.0)
    best = int(np.argmax(lengths))
    rounded = step * round(middles[best] / step)
    inside = abs(rounded - middles[best]) <= 0.4 * lengths[best]
    return float(round(rounded, 6)) if inside else float(middles[best])


def _scale(length: float) -> float:
    """The power of ten next to the length of a range: 1 for the shear of a band, 100 for its angle in degrees."""
    return 10.0 ** round(math.log10(length)) if length > 0 else 1.0


def coexisting_states(slice_: Slice, value: float | None = None) -> dict[str, Solution]:
    """The stable states of a slice at one value of what varies, by default one at which the most coexist.

    Returns
    -------
    label -> solution exactly there; of a +/- pair the member +, named 'US+' for instance. Where several states have one
    name they are called 'W:1', 'W:2' (:mod:`rodatlas.states.labels`).

    Raises
    ------
    ValueError
        when the value is outside the range of the slice.
    """
    check_type("slice", slice_, Slice, "a Slice, see compute_slice and Slice.load")
    s = slice_.settings
    if value is None:
        value = richest_value(slice_.states)
    elif not s.low <= value <= s.high:
        raise ValueError(
            f"{s.along}: expected a number from {s.low:g} to {s.high:g}, the range of the slice, got {value}"
        )
    there = present(slice_, value)
    names = [p.state.name.removesuffix("+-") + ("+" if p.state.pair else "") for p in there]
    called = labels(names, *s.model.measures([p.solution for p in there]))
    told = sorted(zip(called, names, there, strict=True), key=lambda x: (names.index(x[1]), x[0]))
    return {str(label): s.model.member(p.solution, "+") if p.state.pair else p.solution for label, _, p in told
            if p.exact}  # fmt: skip


class Present(NamedTuple):
    """A state at a value, with its solution there; `exact` is off where only the nearest computed one is known."""

    state: State
    solution: Solution
    exact: bool


def present(slice_: Slice, value: float, name: str = "") -> list[Present]:
    """The states at a value, or those of one name, each once: stretches that touch there share a state."""
    found: list[Present] = []
    settings = slice_.settings
    for state in slice_.states_at(value, name):
        solution = solve_state(state, value, settings)
        near = min(state.solutions, key=lambda s: abs(settings.value(s) - value))
        one = Present(state, near if solution is None else solution, solution is not None)
        same = (p for p in found if p.state.name == state.name)
        if not any(same_state(settings.local, p.solution, one.solution) for p in same):
            found.append(one)
    return found


def numbered_state(slice_: Slice, wanted: Wanted, value: float) -> Present | None:
    """The state of a slice that a label means; see :meth:`rodatlas.atlas.Slice.state`."""
    there = present(slice_, value, wanted.name)
    model = slice_.settings.model
    told = [
        (there[i], f"{model.look(there[i].solution)}, stable from {there[i].state.low.value:.5f} to "
                   f"{there[i].state.high.value:.5f}")
        for i in in_order(*model.measures([p.solution for p in there]))
    ]  # fmt: skip
    return chosen(wanted, told)


def wanted_in_slice(text: str, slice_: Slice) -> Wanted:
    """A label with the name of a state of a slice, 'S+-', 'W:2' or 'other:1'.

    Raises
    ------
    ValueError
        when no state can have the name.
    """
    name, separator, number = text.partition(SEPARATOR)
    if name not in slice_.known_names or (separator and not (number.isdecimal() and int(number) > 0)):
        raise ValueError(f"name: expected one of {', '.join(slice_.known_names)}, got '{text}'")
    return Wanted(name, "", int(number) if separator else None)


def overlaps(states: Sequence[State], settings: SliceSettings) -> list[str]:
    """A warning for every two states of one name that exist at the same values; states without a name have none."""
    found = []
    known = settings.model.nomenclature
    touch = TOUCH * _scale(settings.high - settings.low)
    for one, two in combinations(states, 2):
        low, high = max(one.span[0], two.span[0]), min(one.span[1], two.span[1])
        unnamed = known is not None and one.name == known.other
        if one.name == two.name and not unnamed and high - low > touch:
            name = one.name.removesuffix("+-")
            found.append(
                f"names: two states called {one.name} exist from {settings.along} {low:.5f} to {high:.5f} (branches "
                f"{one.branch}, {two.branch}); at one {settings.along} {name}{SEPARATOR}1 is that of less energy, "
                f"{name}{SEPARATOR}2 the next"
            )
    return found


def solve_state(state: State, value: float, settings: SliceSettings) -> Solution | None:
    """The solution of a state exactly at a value inside its range, solved from the computed one nearest to it.

    Close to a pitchfork Newton's method may leave for the other branch, which has the other symmetry: then the next
    nearest are tried.
    """
    check_type("state", state, State, "a state of a Slice")
    check_type("settings", settings, SliceSettings, "SliceSettings, see SliceSettings.of")
    near = sorted(state.solutions, key=lambda s: abs(settings.value(s) - value))
    if settings.value(near[0]) == value:
        return near[0]
    solved = (state_at(guess, value, settings) for guess in near[:NEAREST])
    return next((s for s in solved if s is not None and is_alone(settings.local, s) != state.pair), None)
