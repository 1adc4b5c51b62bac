"""Runs of problems with continuous symmetries: phase conditions are added where a state needs them, and hidden after.

A state that a generator moves is one of a curve of states, its orbit, and the equations are singular along it. The run
is one of the problem with phase conditions, see :mod:`rodatlas.continuation.discrete.phase`; their unfolding parameters
stand behind the user's free ones, and results do not show them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.phase import fitted, moved_by, orbit_directions
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import Branch, Point, SpecialPoint


def orbit_of(bvp: BVP, solution: Solution, free: Sequence[int]) -> tuple[str, ...]:
    """Names of the continuous symmetries that move a state."""
    colloc = Collocation.at(bvp, solution, free)
    return moved_by(colloc, colloc.state(solution))


def member_near(bvp: BVP, at: SpecialPoint) -> Solution | None:
    """A state near a branch point, on the first of the branches that continuous symmetries move around."""
    if not at.continuum or len(at.nearby) < 3:
        return None
    colloc = Collocation.at(bvp, at.solution, free_indices(bvp, at.free), at.scale)
    return next((colloc.solution(x) for x in at.nearby[2:] if orbit_directions(colloc, x)), None)


def bare(branch: Branch, bvp: BVP) -> Branch:
    """A branch of a problem with phase conditions as one of the user's problem."""
    if not bvp.phases:
        return branch
    k = len(branch.free) - bvp.unfoldings
    orbit = orbit_of(bvp.plain, branch.points[-1].solution, free_indices(bvp.plain, branch.free[:k]))
    return replace(
        branch, orbit=orbit, free=branch.free[:k], points=tuple(bare_point(p, k) for p in branch.points),
        special=tuple(bare_special(x, k, bvp) for x in branch.special),
    )  # fmt: skip


def bare_point(point: Point, free: int) -> Point:
    """A point with as many components of the tangent as there are free parameters."""
    return replace(point, tangent=point.tangent[:free])


def bare_special(x: SpecialPoint, free: int, bvp: BVP) -> SpecialPoint:
    """A special point whose vectors know the user's free parameters only."""
    directions, nearby = (tuple(fitted(v, free) for v in vectors) for vectors in (x.directions, x.nearby))
    scale, bend = x.scale and bare_scale(x.scale, bvp), x.bend and fitted(x.bend, free)
    return replace(x, free=x.free[:free], scale=scale, directions=directions, nearby=nearby, bend=bend)


def bare_scale(scale: Scale, bvp: BVP) -> Scale:
    """Units of the user's parameters only."""
    return replace(scale, parameters=scale.parameters[: len(bvp.own_parameters)])
