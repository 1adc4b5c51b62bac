"""The fold or branch point that a walk starts on: there a test function is zero and changes no sign on the way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rodatlas.continuation.curve.events import branch_point_from, locate_fold
from rodatlas.continuation.curve.extrema import SHARE
from rodatlas.continuation.curve.multiple_events import multiple_at_start
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.segment import AT_START, FOLD_NOISE, Located, Segment, begins
from rodatlas.continuation.results.branch import Status


@dataclass(frozen=True)
class Beginning:
    """What lies right at the start of a first segment; `doubtful` when a shorter one should tell more.

    It should when the parameter does not change along the segment as the fold at its start would have it: that is no
    fold but an inflection, or a second fold lies close to it.
    """

    events: tuple[Located, ...] = ()
    doubtful: bool = False


def singular_start(segment: Segment, options: TraceOptions, events: Iterable[Located]) -> Beginning:
    """The fold or branch point at the very start of a walk, unless it is among the events known.

    A fold of higher order, such as that of lam = x^4, does not count: nothing tells it from an inflection there.
    """
    if not segment.is_first or any(e.is_singular and _is_there(segment, e) for e in events):
        return Beginning()
    if segment.left.branch_test[0] == 0.0:
        if "branch point" not in options.locate:
            return Beginning()
        found = multiple_at_start(segment, options) or branch_point_from(segment, 0.0, segment.left.x, options)
        return Beginning((found,)) if found is not None and _is_there(segment, found) else Beginning()
    if "fold" not in options.locate or not begins(segment, *segment.fold_tests, FOLD_NOISE):
        return Beginning()
    fold, slope = locate_fold(segment, options), segment.right.fold_test
    if fold.special.status is Status.BRACKETED or not _is_there(segment, fold):
        return Beginning()
    if fold.special.curvature * slope * segment.step < SHARE * slope**2:
        return Beginning(doubtful=True)
    return Beginning((fold,))


def _is_there(segment: Segment, event: Located) -> bool:
    return abs(event.special.arclength - segment.start) < AT_START
