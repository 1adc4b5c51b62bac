"""Stable states that coexist at one shear, each solved exactly there; and what those are called that share a name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rodatlas.atlas.slices.match import same_state, state_at_shear
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_each, check_type
from rodatlas.rods.symmetry import is_symmetric, plus_member
from rodatlas.states.labels import SEPARATOR, Wanted, chosen, in_order, labels, look, slope
from rodatlas.states.names import NAMES, OTHER

NEAREST = 4  # computed solutions from which one at a given shear is solved for
ROUND = 0.005  # a chosen shear is a multiple of this where the range allows it
TOUCH = 1e-6  # shear: ranges that share less than this touch, and do not overlap


def richest_shear(states: Iterable[State]) -> float:
    """A shear at which the largest number of named stable states coexist, each +/- pair counted once.

    The middle of the longest such interval of shear, rounded to a multiple of 0.005 when that stays well inside.
    Intervals shorter than 0.005 count only when there is no longer one.
    """
    check_each("states", states, State, "states of a Slice")
    states = list(states)
    if not states:
        raise ValueError("states: expected at least one stable state, got none")
    edges = np.unique([x for state in states for x in state.shear])
    middles = 0.5 * (edges[1:] + edges[:-1])
    counts = np.array([sum(x.shear[0] < m < x.shear[1] for x in states) for m in middles])
    if not len(counts):
        return float(edges[0])
    lengths = np.diff(edges)
    counts[lengths < ROUND] -= 1000 * int((lengths >= ROUND).any())
    lengths = np.where(counts == counts.max(), lengths, 0.0)
    best = int(np.argmax(lengths))
    rounded = ROUND * round(middles[best] / ROUND)
    inside = abs(rounded - middles[best]) <= 0.4 * lengths[best]
    return float(round(rounded, 6)) if inside else float(middles[best])


def coexisting_states(slice_: Slice, shear: float | None = None) -> dict[str, Solution]:
    """The stable states of a slice at one shear, by default one at which the most coexist.

    Returns
    -------
    label -> solution exactly at that shear; of a +/- pair the member +, named 'US+' for instance. Where several states
    have one name they are called 'W:1', 'W:2' (:mod:`rodatlas.states.labels`).

    Raises
    ------
    ValueError
        when the shear is outside the range of the slice.
    """
    check_type("slice", slice_, Slice, "a Slice, see compute_slice and Slice.load")
    low, high = slice_.settings.shear_min, slice_.settings.shear_max
    if shear is None:
        shear = richest_shear(slice_.states)
    elif not low <= shear <= high:
        raise ValueError(f"shear: expected a number from {low:g} to {high:g}, the range of the slice, got {shear}")
    there = present(slice_, shear)
    names = [p.state.name.removesuffix("+-") + ("+" if p.state.pair else "") for p in there]
    called = labels(names, [p.solution["energy"] for p in there], [slope(p.solution) for p in there])
    told = sorted(zip(called, names, there, strict=True), key=lambda x: (names.index(x[1]), x[0]))
    return {str(label): plus_member(p.solution) if p.state.pair else p.solution for label, _, p in told if p.exact}


class Present(NamedTuple):
    """A state at a shear, with its solution there; `exact` is off where only the nearest computed one is known."""

    state: State
    solution: Solution
    exact: bool


def present(slice_: Slice, shear: float, name: str = "") -> list[Present]:
    """The states at a shear, or those of one name, each once: stretches that touch there share a state."""
    found: list[Present] = []
    for state in slice_.states_at(shear, name):
        solution = solve_state(state, shear, slice_.settings)
        near = min(state.solutions, key=lambda s: abs(s["dD"] - shear))
        one = Present(state, near if solution is None else solution, solution is not None)
        if not any(p.state.name == state.name and same_state(p.solution, one.solution) for p in found):
            found.append(one)
    return found


def numbered_state(slice_: Slice, wanted: Wanted, shear: float) -> Present | None:
    """The state of a slice that a label means; see :meth:`rodatlas.atlas.Slice.state`."""
    there = present(slice_, shear, wanted.name)
    order = in_order([p.solution["energy"] for p in there], [slope(p.solution) for p in there])
    told = [
        (there[i], f"{look(there[i].solution)}, stable from {there[i].state.low.shear:.5f} to "
                   f"{there[i].state.high.shear:.5f}") for i in order
    ]  # fmt: skip
    return chosen(wanted, told)


def wanted_in_slice(text: str) -> Wanted:
    """A label with the name of a state of a slice, 'US+-', 'W:2' or 'other:1'.

    Raises
    ------
    ValueError
        when no state can have the name.
    """
    name, separator, number = text.partition(SEPARATOR)
    if name not in (*NAMES, OTHER) or (separator and not (number.isdecimal() and int(number) > 0)):
        raise ValueError(f"name: expected one of {', '.join((*NAMES, OTHER))}, got '{text}'")
    return Wanted(name, "", int(number) if separator else None)


def overlaps(states: Sequence[State]) -> list[str]:
    """A warning for every two states of one name that exist at the same shears; 'other' is no name."""
    found = []
    for one, two in combinations(states, 2):
        low, high = max(one.shear[0], two.shear[0]), min(one.shear[1], two.shear[1])
        if one.name == two.name != OTHER and high - low > TOUCH:
            name = one.name.removesuffix("+-")
            found.append(
                f"names: two states called {one.name} exist from shear {low:.5f} to {high:.5f} (branches {one.branch}, "
                f"{two.branch}); at one shear {name}{SEPARATOR}1 is that of less energy, {name}{SEPARATOR}2 the next"
            )
    return found


def solve_state(state: State, shear: float, settings: SliceSettings) -> Solution | None:
    """The solution of a state exactly at a shear inside its range, solved from the computed one nearest to it.

    Close to a pitchfork Newton's method may leave for the other branch, which has the other symmetry: then the next
    nearest are tried.
    """
    check_type("state", state, State, "a state of a Slice")
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    near = sorted(state.solutions, key=lambda s: abs(s["dD"] - shear))
    if near[0]["dD"] == shear:
        return near[0]
    solved = (state_at_shear(guess, shear, settings) for guess in near[:NEAREST])
    return next((s for s in solved if s is not None and is_symmetric(s) != state.pair), None)
