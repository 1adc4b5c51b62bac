"""Solutions of one slice compared with branches; solutions exactly at a value of what varies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Branch, Point, Solution
from rodatlas.model import Model, places
from rodatlas.model.orbit import same_state

FILTERED = 0.01  # of invariants that are not relative: a solution lies that near to the segment between two points
FILTERED_RELATIVE = 1.0


def state_at(near: Solution, value: float, settings: SliceSettings) -> Solution | None:
    """Newton from a neighboring solution to an exact value of what varies; None when it does not converge."""
    model = settings.model
    return places.solved_at(
        model.problem, near, settings.parameter, settings.raw(value), settings.tolerance, model.free
    )


def crossings(branch: Branch, values: Sequence[float], settings: SliceSettings, most: int = 1) -> list[Solution]:
    """Solutions of a branch exactly at some values, where its index is at most `most` on one side at least."""
    model = settings.model
    raw = [settings.raw(value) for value in values]
    return places.crossings(
        model.problem, branch, settings.parameter, raw, settings.tolerance, model.free, most
    )  # fmt: skip


def lies_on(branch: Branch, solution: Solution, settings: SliceSettings) -> bool:
    """Whether a solution, or another member of its state, is on a branch."""
    model, name = settings.local, settings.parameter
    raw = solution[name]
    for one, two in pairwise(branch.points):
        if (one.solution[name] - raw) * (two.solution[name] - raw) > 0 or not _between(model, one, two, solution):
            continue
        near = places.nearer(one, two, name, raw)
        exact = near[name] == raw
        state = near if exact else places.solved_at(model.problem, near, name, raw, settings.tolerance, model.free)
        if state is not None and same_state(model, state, solution):
            return True
    return False


def _between(model: Model, one: Point, two: Point, solution: Solution) -> bool:
    """Cheap filter: the invariants lie near the segment between two points."""
    for invariant in model.invariants:
        if invariant.slack != 1.0:
            continue  # known too loosely to be of use
        slack = FILTERED_RELATIVE if invariant.relative else FILTERED
        low, high = sorted((one.solution[invariant.name], two.solution[invariant.name]))
        if not low - slack <= solution[invariant.name] <= high + slack:
            return False
    return True
