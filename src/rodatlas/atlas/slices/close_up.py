"""A window of a slice, followed again with small steps: what happens in a corner of the diagram."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.atlas.slices.contact import contact_warnings, with_contact
from rodatlas.atlas.slices.follow import Followed, trace_options
from rodatlas.atlas.slices.match import FREE, crossings, same_state
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.segments import stable_segments
from rodatlas.continuation import NotConverged, Solution, StepControl, trace
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.symmetry import is_symmetric

Window = tuple[tuple[float, float], tuple[float, float]]
"""Least and largest shear, least and largest height."""

PARTS = (0.03, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97)  # of the window's width, where branches are picked up
SAME = 2e-3  # of the window: a solution that is this near to a branch of the same symmetry lies on it
FINE = StepControl(initial=0.002, maximum=1.0, target=2e-6)  # a tenth of the usual steps


def close_up(slice_: Slice, window: Window) -> Slice:
    """All branches of a slice inside a window of shear and height.

    Branches of the slice that pass through the window are followed again from where they cross some shears, in both
    directions, to its border. Bifurcations keep their numbers and stable stretches the names of their states.

    Returns
    -------
    a slice with the same settings whose branches end at the border of the window.
    """
    (low, high), (bottom, top) = window
    if not (low < high and bottom < top):
        raise ValueError(f"window: expected least and largest shear and height, got {window}")
    options = replace(trace_options(slice_.settings), step=FINE, bounds={"dD": window[0], "height": window[1]})
    branches: list[SliceBranch] = []
    warnings: list[str] = []
    for b in slice_.branches:
        for k, start in enumerate(_starts(b, window, slice_)):
            if any(_on(f.followed, start, window) for f in branches):
                continue
            ident = f"{b.id}:{k + 1}"
            try:
                branch = trace(rod_problem(), start, FREE, options)
            except NotConverged as error:
                warnings.append(f"branch {ident}: {error}")
                continue
            followed = Followed(ident, branch, is_symmetric(start))
            branches.append(SliceBranch(followed, _events(followed, slice_)))
    states = with_contact((s for b in branches for s in _states(b.followed, slice_)), slice_.settings)
    warnings += contact_warnings(states)
    return Slice(slice_.settings, tuple(branches), tuple(states), tuple(warnings), 0.0)


def _starts(b: SliceBranch, window: Window, slice_: Slice) -> list[Solution]:
    """Solutions of a branch inside the window: computed ones, and where it crosses some shears."""
    (low, high), (bottom, top) = window
    shears = [low + part * (high - low) for part in PARTS]
    found = [p.solution for p in b.followed.branch.points[1:-1]]  # the first and the last may be branch points
    found += crossings(b.followed.branch, shears, slice_.settings, most=99)
    return [s for s in found if low < s["dD"] < high and bottom < s["height"] < top]


def _on(followed: Followed, solution: Solution, window: Window) -> bool:
    """Whether a solution lies on a branch, by its distance from the polygon of shear, height and energy.

    Newton at fixed shear would not tell near a fold.
    """
    if followed.symmetric != is_symmetric(solution):
        return False
    values = np.array([_place(p.solution) for p in followed.branch.points])
    scale = np.array([window[0][1] - window[0][0], window[1][1] - window[1][0], max(np.ptp(values[:, 2]), 1e-3)])
    corners, point = values / scale, np.array(_place(solution)) / scale
    sides, to_point = np.diff(corners, axis=0), point - corners[:-1]
    along = np.clip(np.sum(to_point * sides, axis=1) / np.maximum(np.sum(sides**2, axis=1), 1e-30), 0.0, 1.0)
    return bool(np.min(np.linalg.norm(to_point - along[:, None] * sides, axis=1)) < SAME)


def _place(solution: Solution) -> tuple[float, float, float]:
    return solution["dD"], solution["height"], solution["energy"]


def _events(followed: Followed, slice_: Slice) -> tuple[Event, ...]:
    """Events of a branch, with kind, number and criticality of those of the slice at the same places."""
    known = [e for b in slice_.branches for e in b.events]
    events = []
    for special in followed.bifurcations:
        same = [
            e for e in known
            if e.special.kind == special.kind and same_state(e.special.solution, special.solution, 2e-5)
        ]  # fmt: skip
        best = max(same, key=lambda e: e.number is not None, default=None)
        if best is None:
            events.append(Event(special.kind, special))
        else:
            events.append(Event(best.kind, special, best.number, best.criticality))
    return tuple(events)


def _states(followed: Followed, slice_: Slice) -> list[State]:
    """Stable stretches with the names of the states of the slice that are next to their middles."""
    states = []
    for segment in stable_segments(followed, None):
        solutions = tuple(segment.solutions)
        name = _name_at(solutions[len(solutions) // 2], slice_)
        if name is not None:
            low, high = (StateEnd(end.kind, end.solution) for end in (segment.low, segment.high))
            states.append(State(name, followed.id, followed.pair, name, solutions, low, high))
    return states


def _name_at(solution: Solution, slice_: Slice) -> str | None:
    """Name of the stable state of a slice with nearly the same height at a shear."""
    shear, best, name = solution["dD"], np.inf, None
    for state in slice_.states:
        if state.pair == is_symmetric(solution) or not state.shear[0] - 1e-6 <= shear <= state.shear[1] + 1e-6:
            continue
        heights = [s["height"] for s in state.solutions]
        gap = abs(np.interp(shear, [s["dD"] for s in state.solutions], heights) - solution["height"])
        if gap < best:
            best, name = gap, state.name
    return name
