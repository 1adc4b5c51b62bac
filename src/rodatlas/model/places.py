"""Solutions exactly at values of a control: near another solution, and where a branch passes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rodatlas.continuation import BVP, Branch, MeshControl, NotConverged, Point, Solution, TraceOptions, solve


def solved_at(
    problem: BVP, near: Solution, parameter: str, value: float, tolerance: float, free: tuple[str, ...] = ()
) -> Solution | None:
    """Newton from a neighboring solution to an exact value of a parameter; None when it does not converge.

    Parameters
    ----------
    free : parameters that are unknown on every branch.
    """
    options = TraceOptions(mesh=MeshControl(tolerance=tolerance))
    try:
        return solve(problem, near.with_parameters(**{parameter: value}), (parameter, *free), options)
    except NotConverged:
        return None


def crossings(
    problem: BVP, branch: Branch, parameter: str, values: Sequence[float], tolerance: float,
    free: tuple[str, ...] = (), most: int = 1,
) -> list[Solution]:  # fmt: skip
    """Solutions of a branch exactly at values of a parameter, where the index is at most `most` on one side."""
    found = []
    for one, two in pairwise(branch.points):
        for value in values:
            a, b = one.solution[parameter] - value, two.solution[parameter] - value
            low = min((p.index for p in (one, two) if p.index is not None), default=0)
            if a * b < 0 and low <= most:
                state = solved_at(problem, nearer(one, two, parameter, value), parameter, value, tolerance, free)
                if state is not None:
                    found.append(state)
    return found


def nearer(one: Point, two: Point, parameter: str, value: float) -> Solution:
    """The solution of two points whose parameter is nearer to a value."""
    return min((two.solution, one.solution), key=lambda s: abs(s[parameter] - value))
