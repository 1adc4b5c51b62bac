"""Stable states that coexist at one shear, each solved exactly there."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rodatlas.atlas.slices.match import state_at_shear
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_each, check_type
from rodatlas.rods.symmetry import is_symmetric, plus_member

NEAREST = 4  # computed solutions from which one at a given shear is solved for
ROUND = 0.005  # a chosen shear is a multiple of this where the range allows it


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
    counts = np.array([len({x.name for x in states if x.shear[0] < m < x.shear[1]}) for m in middles])
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
    name -> solution exactly at that shear; of a +/- pair the member +, named 'US+' for instance.

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
    found: dict[str, Solution] = {}
    for state in slice_.states:
        if not state.shear[0] <= shear <= state.shear[1]:
            continue
        solution = solve_state(state, shear, slice_.settings)
        if solution is None:
            continue
        name = state.name
        if state.pair:
            name = name.removesuffix("+-") + "+"
            solution = plus_member(solution)
        found.setdefault(name, solution)
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
