"""Solutions at one setting compared with each other and with branches; solutions exactly at a given shear."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Branch, MeshControl, NotConverged, Point, Solution, TraceOptions, solve
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.states.labels import slope

FREE = ("dD",)
"""The free parameter of every branch of a slice."""
SLOPE = 0.05  # of energy with shear [GJ/L^2], relative; a bifurcation that two branches locate has it to about 0.01


def same_state(one: Solution, two: Solution, tolerance: float = 1e-5) -> bool:
    """Whether two solutions at one setting are equal up to reversal: same shear, height, energy and its slope.

    The slope dE/d(dD) tells a state without shear from its image in the shear mirror, which has all else in common.
    """
    return (
        abs(one["dD"] - two["dD"]) < tolerance
        and abs(one["height"] - two["height"]) < tolerance
        and abs(one["energy"] - two["energy"]) < tolerance * max(1.0, abs(one["energy"]))
        and abs(slope(one) - slope(two)) < SLOPE * max(1.0, abs(slope(one)))
    )


def state_at_shear(near: Solution, shear: float, settings: SliceSettings) -> Solution | None:
    """Newton from a neighboring solution to an exact shear; None when it does not converge."""
    options = TraceOptions(mesh=MeshControl(tolerance=settings.tolerance))
    try:
        return solve(rod_problem(), near.with_parameters(dD=shear), FREE, options)
    except NotConverged:
        return None


def crossings(branch: Branch, shears: Sequence[float], settings: SliceSettings, most: int = 1) -> list[Solution]:
    """Solutions of a branch exactly at given shears, where its index is at most `most` on one side at least."""
    found = []
    for one, two in pairwise(branch.points):
        for shear in shears:
            a, b = one.solution["dD"] - shear, two.solution["dD"] - shear
            low = min((p.index for p in (one, two) if p.index is not None), default=0)
            if a * b < 0 and low <= most:
                state = state_at_shear(_nearer(one, two, shear), shear, settings)
                if state is not None:
                    found.append(state)
    return found


def lies_on(branch: Branch, solution: Solution, settings: SliceSettings) -> bool:
    """Whether a solution (or its reversal, which has the same height and energy) is on a branch."""
    shear = solution["dD"]
    for one, two in pairwise(branch.points):
        if (one.solution["dD"] - shear) * (two.solution["dD"] - shear) > 0 or not _between(one, two, solution):
            continue
        near = _nearer(one, two, shear)
        state = near if near["dD"] == shear else state_at_shear(near, shear, settings)
        if state is not None and same_state(state, solution):
            return True
    return False


def _nearer(one: Point, two: Point, shear: float) -> Solution:
    """The solution of two points whose shear is nearer to the given one."""
    return min((two.solution, one.solution), key=lambda s: abs(s["dD"] - shear))


def _between(one: Point, two: Point, solution: Solution) -> bool:
    """Cheap filter: height and energy lie near the segment between two points."""
    for name, slack in (("height", 0.01), ("energy", 1.0)):
        low, high = sorted((one.solution[name], two.solution[name]))
        if not low - slack <= solution[name] <= high + slack:
            return False
    return True
