"""A second look at the intervals of a branch on which something does not add up, with much smaller steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.curve.join import is_same
from rodatlas.continuation.curve.modes import with_resolved_mode
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, first_frame
from rodatlas.continuation.curve.walker import Walker
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.results.branch import Branch, Point, SpecialPoint, Status

PARTS = 12  # of an interval, in steps of the second look
MOST = 20  # intervals of one branch


def rechecked(branch: Branch, frame: Frame, options: TraceOptions) -> Branch:
    """The branch after a second look at its suspicious intervals.

    Suspicious is an interval with a discrepancy, or with a fold or branch point that was only bracketed. It is traced
    again from its first point, at a twelfth of its length and less. When everything adds up then, the special points
    found replace those of the interval, and its discrepancy is dropped.

    Parameters
    ----------
    frame : any of the branch, for its problem, free parameters and units.
    """
    record = branch.verification
    places = suspicious(branch)[:MOST]
    if not places:
        return branch
    special, discrepancies = list(branch.special), list(branch.discrepancies)
    cleared = spent = 0
    for left, right in places:
        found, iterations = _second_look(left, right, frame, options)
        spent += iterations
        if found is None:
            continue
        cleared += 1
        low, high = left.arclength, right.arclength
        kept = [x for x in special if not low <= x.arclength <= high]
        special = kept + [x for x in found if not any(is_same(x, y) for y in kept)]
        discrepancies = [d for d in discrepancies if not _overlap(d.bracket, (low, high))]
    special.sort(key=lambda x: x.arclength)
    events = [x.status for x in special if not x.is_zero]
    record = replace(
        record, retraced=len(places), cleared=cleared, converged=sum(s is Status.CONVERGED for s in events),
        bracketed=sum(s is Status.BRACKETED for s in events),
        untrusted=tuple(u for u in record.untrusted if any(_overlap(u, d.bracket) for d in discrepancies)),
    )  # fmt: skip
    return replace(
        branch, special=tuple(special), discrepancies=tuple(discrepancies), verification=record,
        newton_iterations=branch.newton_iterations + spent,
    )  # fmt: skip


def suspicious(branch: Branch) -> list[tuple[Point, Point]]:
    """Neighboring points of a branch between which something does not add up."""
    brackets = [d.bracket for d in branch.discrepancies]
    doubtful = [x for x in branch.special if x.status is Status.BRACKETED and not x.is_zero]
    brackets += [(x.arclength, x.arclength) for x in doubtful]
    pairs = zip(branch.points[:-1], branch.points[1:], strict=True)
    return [
        (a, b) for a, b in pairs
        if any(_overlap(pair, (a.arclength, b.arclength)) for pair in brackets)
    ]  # fmt: skip


def _overlap(one: tuple[float, float], two: tuple[float, float]) -> bool:
    """Whether two intervals share more than an end."""
    low, high = max(one[0], two[0]), min(one[1], two[1])
    return low < high or (low == high and one[0] == one[1])


def _second_look(
    left: Point, right: Point, frame: Frame, options: TraceOptions
) -> tuple[list[SpecialPoint] | None, int]:
    """Special points between two points, None when it fails or does not add up; and Newton iterations spent."""
    old, length = frame.colloc, right.arclength - left.arclength
    control = options.step
    step = max(length / PARTS, 4 * control.minimum)
    fine = replace(
        control, initial=step, maximum=step, minimum=min(control.minimum, step) / 64, target=control.target / PARTS
    )
    closer = replace(options, step=fine, bounds={}, stop_at=None, max_folds=None, max_points=64 * PARTS)
    start, _ = first_frame(old.bvp, left.solution, list(old.free), closer, old.scale)
    if start is None or start.branch_test[0] == 0.0:
        return None, 0
    start, spent = with_resolved_mode(start, closer)
    if start.tangent.scalars @ left.tangent < 0:
        start = start.reversed()
    walker, found = Walker(start, closer, looks_back=False), list[SpecialPoint]()
    walker.newton_iterations += spent
    for taken in walker:
        if taken.discrepancy is not None:
            return None, walker.newton_iterations
        found += taken.special
        if taken.point.arclength >= length * (1 - 1e-6):
            break
    reached = walker.last.arclength >= length * (1 - 1e-6) and _passes(walker, right, length)
    inside = [_moved(x, left.arclength) for x in found if x.arclength <= length * (1 + 1e-9)]
    doubtful = any(x.status is Status.BRACKETED for x in inside)
    if doubtful or not reached or walker.unseen:
        return None, walker.newton_iterations
    return inside, walker.newton_iterations


def _passes(walker: Walker, right: Point, length: float) -> bool:
    """Whether a walk went by the second point: it overshoots by no more than a step."""
    colloc: Collocation = walker.frame.colloc
    there = colloc.state(right.solution)
    ahead = walker.last.arclength - length
    gap = np.abs(walker.frame.x.scalars - there.scalars).max()
    return bool(gap < 2 * ahead + 0.05 * length)


def _moved(x: SpecialPoint, by: float) -> SpecialPoint:
    return replace(x, arclength=x.arclength + by, bracket=(x.bracket[0] + by, x.bracket[1] + by))
