"""Points and events of a locus on meshes that meet the tolerance: the first one, and those that the walk left in doubt.

Along a locus the error is estimated where the mesh moves, every few steps. Where an estimate exceeds what is accepted,
the points since the one before are in doubt: each of them is settled by itself. An event has an estimate of its own,
and is located again on the mesh that its place needs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.orbit import member_near
from rodatlas.continuation.curve.settle import Settled, settle
from rodatlas.continuation.curve.start import NotConverged, on_allowed_mesh
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.mesh import ErrorEstimate
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.locus.events import Watched, locate
from rodatlas.continuation.locus.point import LocusFrame, Sought, correct, density_of, error_of, frame_at, on_mesh
from rodatlas.continuation.locus.segment import Stretch
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import SpecialPoint, Status
from rodatlas.continuation.results.locus import Locus, LocusEvent
from rodatlas.continuation.symmetric.isotropy import restrict, symmetric_mesh

MOST = 100  # points of one locus
NEAR = 0.1  # distance, in scaled variables, within which a corrected state is still the same point


@dataclass(frozen=True)
class _OnLocus:
    """Points of a locus, which are held in the plane across its tangent."""

    sought: Sought
    options: TraceOptions

    def measured(self, frame: LocusFrame) -> ErrorEstimate:
        return error_of(self.sought, frame, self.options.mesh.tolerance)

    def density(self, frame: LocusFrame) -> np.ndarray:
        return density_of(frame)

    def corrected(self, frame: LocusFrame, mesh: np.ndarray, finer: bool) -> tuple[LocusFrame | None, int]:
        moved = on_mesh(frame, mesh)
        found = correct(self.sought, moved, moved.x, moved.tangent, self.options, exact=True)
        if found is None or not moved.colloc.norm(add(found[0].x, (-1.0, moved.x))) < NEAR:
            return None, 0
        return replace(found[0], behind=moved.behind, distance=moved.distance), len(found[1])


def settled(sought: Sought, frame: LocusFrame, options: TraceOptions) -> Settled[LocusFrame]:
    """Adapt the mesh at one point of a locus until its size and error have settled."""
    return settle(frame, options.mesh, _OnLocus(sought, options))


def first_frame(
    bvp: BVP, sought: Sought, start: SpecialPoint, free: list[int], options: TraceOptions
) -> LocusFrame | None:
    """Frame at the start on a mesh that meets the tolerance, looking to larger values of the second parameter.

    None when Newton does not converge; NotConverged when it does, but no mesh allowed meets the tolerance.
    """
    solution = on_allowed_mesh(start.solution, options)
    if options.within:
        solution = solution.remesh(symmetric_mesh(solution.mesh))
    colloc = Collocation.at(bvp, solution, free, start.scale or Scale.of(bvp, start.solution), options.backend)
    near = member_near(bvp.plain, start) if bvp.phases else None
    colloc.hold(colloc.state(solution), away=None if near is None else colloc.state(near))
    frame = frame_at(sought, colloc, restrict(colloc, options.within, colloc.state(solution), controls=2), options)
    if frame is None:
        return None
    frame = replace(frame, tangent=scaled(frame.tangent, 1.0 if frame.tangent.scalars[1] >= 0 else -1.0))
    found = settled(sought, frame, options)
    if found.missed is not None:
        solution = found.frame.colloc.solution(found.frame.x, found.frame.error)
        raise NotConverged(found.missed, f"start of the locus at {solution!r}", solution)
    return found.frame


def resolved_event(stretch: Stretch, what: Watched, event: LocusEvent, names: tuple[str, ...]) -> LocusEvent:
    """The event with an error of its own, located again on a finer mesh where that is more than accepted.

    Where the equations of the locus are singular at the event, the error is that at the end of its step.
    """
    control, sought, colloc = stretch.options.mesh, stretch.sought, stretch.right.colloc
    if control.is_fixed_size or event.status is Status.BRACKETED:
        return event
    at = None if what.singular else frame_at(sought, colloc, colloc.state(event.solution), stretch.options)
    at = at or stretch.right
    at = replace(at, error=error_of(sought, at, control.tolerance).error)
    if not control.accepts(at.error):
        at = settled(sought, at, stretch.options).frame
        fine = _on_mesh_of(at, stretch)
        again = locate(fine, what, names) if fine is not None and what.is_passed(fine) else event
        event = again if again.status is Status.CONVERGED else event
    status = (
        Status.CONVERGED
        if control.accepts(at.error) and event.solution.intervals == len(at.colloc.step)
        else (Status.UNRESOLVED)
    )
    return replace(event, status=status, solution=replace(event.solution, error=at.error))


def _on_mesh_of(at: LocusFrame, stretch: Stretch) -> Stretch | None:
    """The step with both ends corrected on the mesh of a frame; None where Newton fails."""
    curve = _OnLocus(stretch.sought, stretch.options)
    left, right = (curve.corrected(frame, at.colloc.mesh, True)[0] for frame in (stretch.left, stretch.right))
    return None if left is None or right is None else replace(stretch, left=left, right=right)


def resolved(locus: Locus, frame: LocusFrame, sought: Sought, options: TraceOptions) -> Locus:
    """The locus with its doubtful points settled, and the number of those that miss the tolerance.

    Parameters
    ----------
    frame : any of the locus, for its problem, free parameters and units.
    """
    control, points, left = options.mesh, list(locus.points), MOST
    for i, point in enumerate(points):
        if not control.accepts(point.solution.error) and left:
            left -= 1
            points[i] = replace(point, solution=_settled(point.solution, frame, sought, options))
    errors = [p.solution.error for p in points] + [e.solution.error for e in locus.events]
    return replace(locus, points=tuple(points), unresolved=sum(not control.accepts(error) for error in errors))


def _settled(solution: Solution, frame: LocusFrame, sought: Sought, options: TraceOptions) -> Solution:
    """A solution on a mesh that meets the tolerance, on the locus across from it."""
    there = frame.colloc.on(solution.mesh)
    start = frame_at(sought, there, there.state(solution), options)
    if start is None:
        return solution
    found = settled(sought, start, options).frame
    colloc: Collocation = found.colloc
    near = colloc.norm(add(found.x, (-1.0, colloc.state(solution)))) < NEAR
    return colloc.solution(found.x, found.error) if near else solution
