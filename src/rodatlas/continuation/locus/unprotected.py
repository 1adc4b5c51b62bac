"""Where the locus of a branch point that nothing protects may start, besides at one found on a branch."""

from __future__ import annotations

from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.locus.point import LocusFrame
from rodatlas.continuation.results.branch import SpecialPoint
from rodatlas.continuation.results.locus import LocusEvent

ON_FOLDS = ("extremum", "coalescence", "cusp")  # of a locus of folds; Newton's method tells which are branch points
NEAR = 1e-2  # distance, in scaled variables, of the branch point from where it was told to be


def branch_point_of(event: LocusEvent, in_three: bool) -> SpecialPoint:
    """An event of a locus of folds as the branch point that it is, to be followed in three parameters."""
    if not in_three or event.kind not in ON_FOLDS:
        raise ValueError(f"start: expected {', '.join(ON_FOLDS)} and three parameters of a locus, got {event.kind}")
    return SpecialPoint("branch point", event.solution, event.arclength, event.status, event.bracket, (0.0, 0.0))


def is_near(frame: LocusFrame, start: SpecialPoint) -> bool:
    """Whether Newton's method has found the branch point that was meant, and not one further away."""
    return frame.colloc.norm(add(frame.x, (-1.0, frame.colloc.state(start.solution)))) < NEAR
