"""A window of a slice, followed again with small steps: what happens in a corner of the diagram."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.atlas.slices.branches.follow import trace_options
from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.atlas.slices.branches.match import crossings
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.contact import contact_warnings, with_contact
from rodatlas.atlas.slices.states.segments import stable_segments
from rodatlas.continuation import NotConverged, Solution, StepControl, trace
from rodatlas.model.orbit import own_symmetries, same_state

Window = tuple[tuple[float, float], tuple[float, float]]
"""Least and largest value of what varies, least and largest response."""

PARTS = (0.03, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97)  # of the window's width, where branches are picked up
SAME = 2e-3  # of the window: a solution that is this near to a branch of the same symmetry lies on it
FINE = StepControl(initial=0.002, maximum=1.0, target=2e-6)  # a tenth of the usual steps


def close_up(slice_: Slice, window: Window) -> Slice:
    """All branches of a slice inside a window of its diagram.

    Branches of the slice that pass through the window are followed again from where they cross some values, in both
    directions, to its border. Bifurcations keep their numbers and stable stretches the names of their states.

    Returns
    -------
    a slice with the same settings whose branches end at the border of the window.
    """
    (low, high), (bottom, top) = window
    if not (low < high and bottom < top):
        raise ValueError(f"window: expected least and largest value and response, got {window}")
    settings = slice_.settings
    seen = settings.model.quantity(settings.against)
    if not seen.observable:
        raise ValueError(f"window: expected a slice against an observable of the problem, got one against {seen.name}")
    inside = sorted((settings.raw(low), settings.raw(high)))
    bounds = {settings.parameter: (inside[0], inside[1]), seen.observable: window[1]}
    options = replace(trace_options(settings), step=FINE, bounds=bounds)
    branches: list[SliceBranch] = []
    warnings: list[str] = []
    for b in slice_.branches:
        for k, start in enumerate(_starts(b, window, slice_)):
            if any(_on(f.followed, start, window, settings) for f in branches):
                continue
            ident = f"{b.id}:{k + 1}"
            try:
                branch = trace(settings.model.problem, start, settings.free, options)
            except NotConverged as error:
                warnings.append(f"branch {ident}: {error}")
                continue
            followed = Followed.by(settings.local, ident, branch, start)
            branches.append(SliceBranch(followed, _events(followed, slice_)))
    states = with_contact((s for b in branches for s in _states(b.followed, slice_)), settings)
    warnings += contact_warnings(states, settings)
    return Slice(settings, tuple(branches), tuple(states), tuple(warnings), 0.0)


def _starts(b: SliceBranch, window: Window, slice_: Slice) -> list[Solution]:
    """Solutions of a branch inside the window: computed ones, and where it crosses some values."""
    (low, high), (bottom, top) = window
    settings = slice_.settings
    values = [low + part * (high - low) for part in PARTS]
    found = [p.solution for p in b.followed.branch.points[1:-1]]  # the first and the last may be branch points
    found += crossings(b.followed.branch, values, settings, most=99)
    return [s for s in found if low < settings.value(s) < high and bottom < settings.response(s) < top]


def _on(followed: Followed, solution: Solution, window: Window, settings: SliceSettings) -> bool:
    """Whether a solution lies on a branch, by its distance from the polygon of value, response and other invariants.

    Newton at a fixed value would not tell near a fold.
    """
    if followed.symmetries != own_symmetries(settings.local, solution):
        return False
    values = np.array([_place(p.solution, settings) for p in followed.branch.points])
    scale = np.maximum(np.ptp(values, axis=0), 1e-3)
    scale[:2] = window[0][1] - window[0][0], window[1][1] - window[1][0]
    corners, point = values / scale, np.array(_place(solution, settings)) / scale
    sides, to_point = np.diff(corners, axis=0), point - corners[:-1]
    along = np.clip(np.sum(to_point * sides, axis=1) / np.maximum(np.sum(sides**2, axis=1), 1e-30), 0.0, 1.0)
    return bool(np.min(np.linalg.norm(to_point - along[:, None] * sides, axis=1)) < SAME)


def _place(solution: Solution, settings: SliceSettings) -> tuple[float, ...]:
    """Value, response, and what else tells states apart well."""
    told = [x.name for x in settings.model.invariants if x.slack == 1.0 and x.name != settings.against]
    return settings.value(solution), settings.response(solution), *(float(solution[name]) for name in told)


def _events(followed: Followed, slice_: Slice) -> tuple[Event, ...]:
    """Events of a branch, with kind, number and criticality of those of the slice at the same places."""
    settings = slice_.settings
    known = [e for b in slice_.branches for e in b.events]
    events = []
    for special in followed.bifurcations:
        same = [
            e for e in known
            if e.special.kind == special.kind
            and same_state(settings.local, e.special.solution, special.solution, 2e-5)
        ]  # fmt: skip
        best = max(same, key=lambda e: e.number is not None, default=None)
        kind, number, criticality = (special.kind, None, None) if best is None else (best.kind, best.number,
                                                                                    best.criticality)  # fmt: skip
        events.append(Event.at(settings, kind, special, number, criticality))
    return tuple(events)


def _states(followed: Followed, slice_: Slice) -> list[State]:
    """Stable stretches with the names of the states of the slice that are next to their middles."""
    states = []
    settings = slice_.settings
    for segment in stable_segments(followed, None, settings.value):
        solutions = tuple(segment.solutions)
        name = _name_at(solutions[len(solutions) // 2], followed.pair, slice_)
        if name is not None:
            low, high = (StateEnd.at(settings, end.kind, end.solution) for end in (segment.low, segment.high))
            states.append(State(name, followed.id, followed.pair, name, solutions, low, high))
    return states


def _name_at(solution: Solution, pair: bool, slice_: Slice) -> str | None:
    """Name of the stable state of a slice with nearly the same response at a value."""
    settings = slice_.settings
    value, best, name = settings.value(solution), np.inf, None
    for state in slice_.states:
        if state.pair != pair or not state.span[0] - 1e-6 <= value <= state.span[1] + 1e-6:
            continue
        responses = [settings.response(s) for s in state.solutions]
        there = np.interp(value, [settings.value(s) for s in state.solutions], responses)
        gap = abs(there - settings.response(solution))
        if gap < best:
            best, name = gap, state.name
    return name
