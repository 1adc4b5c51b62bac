"""Points of a branch that the mesh of the walk did not resolve, corrected on finer meshes.

Along a branch the error is estimated where the mesh moves, every few steps. Where an estimate exceeds what is accepted,
the points since the one before are in doubt: each of them is settled by itself, and those that no mesh improves keep
the error that was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rodatlas.continuation.curve.doubt import Doubt, marked
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, first_frame
from rodatlas.continuation.curve.settle import across, at_own_parameter, at_value, settled
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.results.branch import Branch, Point, SpecialPoint, Status

MOST = 100  # points of one branch
NEAR = 0.1  # distance, in scaled variables, within which a corrected state is still the same point


def doubted(points: Sequence[Point], special: Sequence[SpecialPoint], doubts: Sequence[Doubt]) -> tuple[
    list[Point], list[SpecialPoint]
]:  # fmt: skip
    """The points and zeros with the errors that were found after them; folds and branch points have their own."""
    if not doubts:
        return list(points), list(special)

    zeros = [x.is_zero for x in special]
    return (
        [replace(p, solution=marked(p.solution, p.arclength, doubts)) for p in points],
        [replace(x, solution=marked(x.solution, x.arclength, doubts)) if zero else x
         for x, zero in zip(special, zeros, strict=True)],
    )  # fmt: skip


def resolved(branch: Branch, frame: Frame, options: TraceOptions) -> Branch:
    """The branch with its doubtful points and zeros settled, and a record of those that miss the tolerance.

    Parameters
    ----------
    frame : any of the branch, for its problem, free parameters and units.
    """
    control = options.mesh
    points, special, left = list(branch.points), list(branch.special), MOST
    for i, point in enumerate(points):
        if control.accepts(point.solution.error) or point.branch_test == 0.0 or not left:
            continue
        left -= 1
        points[i] = replace(point, solution=_settled(point.solution, "", frame, options))
    for i, item in enumerate(special):
        name = item.name
        if control.accepts(item.solution.error) or item.status is Status.BRACKETED:
            continue
        solution = item.solution
        if item.is_zero and left:
            left -= 1
            solution = _settled(solution, name, frame, options)
        status = Status.CONVERGED if control.accepts(solution.error) else Status.UNRESOLVED
        special[i] = replace(item, solution=solution, status=status)
    errors = [p.solution.error for p in points] + [x.solution.error for x in special]
    record = replace(
        branch.verification, unresolved=sum(not control.accepts(error) for error in errors),
        converged=sum(x.status is Status.CONVERGED and not x.is_zero for x in special),
    )  # fmt: skip
    return replace(branch, points=tuple(points), special=tuple(special), verification=record)


def _settled(solution: Solution, name: str, frame: Frame, options: TraceOptions) -> Solution:
    """A solution on a mesh that meets the tolerance, at its own parameter or its value of an observable."""
    bvp, free, scale = frame.colloc.bvp, list(frame.colloc.free), frame.colloc.scale
    start, _ = first_frame(bvp, solution, free, options, scale)
    if start is None or start.branch_test[0] == 0.0:
        return solution
    hold = at_value(name, solution[name]) if name else at_own_parameter(start)
    found = settled(start, options, (hold, across)).frame
    colloc: Collocation = found.colloc
    if not colloc.norm(add(found.x, (-1.0, colloc.state(solution)))) < NEAR:
        return solution
    return colloc.solution(found.x, found.error)
