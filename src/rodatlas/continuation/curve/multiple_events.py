"""Branch points that crowd on a segment, or coincide: all of them told apart at once, as events of the branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.events import branch_point_from
from rodatlas.continuation.curve.multiple import TOGETHER, MultiplePoint, SingularPlace, search_places
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.segment import AT_START, FOLD_NOISE, Located, Segment, changes
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.random_fields import smooth_vectors
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import SpecialPoint, Status
from rodatlas.continuation.singular.augmented import Augmented
from rodatlas.continuation.singular.smallest import smallest_singular

ALIGNED = 0.9  # cosine between the tangent of the branch and the ray that belongs to it, at least
SAME = 1e-8  # arclength within which a place at the end of a segment is the special point of the segment before


@dataclass(frozen=True)
class Verdict:
    """What a segment turns out to hold.

    Attributes
    ----------
    events : every singular place as one branch point, and everything else that was located.
    known : whether there is nothing else on the segment that is singular.
    shorten : whether a shorter segment would tell more: several modes become singular on it, what was found does not
        add up, or it ends too close to a multiple branch point.
    """

    events: list[Located]
    known: bool = False
    shorten: bool = False


def told_apart(
    segment: Segment, events: list[Located], options: TraceOptions, last: SpecialPoint | None = None,
    is_long: bool = False, keep_off: bool = False,
) -> Verdict:  # fmt: skip
    """Tell apart the branch points of a segment; where it holds no more than a simple one, nothing is done.

    Test functions are good at telling one branch point on a short segment. So a long one that may hold several is to be
    shortened; the search by the whole block of modes is for those that lie together.

    Parameters
    ----------
    events : what the test functions reported, see :func:`rodatlas.continuation.curve.events.locate_events`.
    last : the last branch point of the branch, which is not reported again.
    is_long : whether the segment can be made much shorter.
    keep_off : whether it can still be made to end somewhere else.
    """
    if "branch point" not in options.locate or not _is_suspicious(segment, events, last):
        return Verdict(events)
    if is_long:
        return Verdict(events, shorten=True)
    search = search_places(segment, options, keep_off)
    if not search.places:
        known = search.complete and not any(e.special.kind == "branch point" for e in events)
        return Verdict(events, known, not known)
    old = [p for p in search.places if last and _is_same(last, p.arclength, options)]
    places = [p for p in search.places if p not in old]
    several = [p for p in places if p.point]
    simple = _simple(segment, events, [p for p in places if not p.point], options)
    if simple is not None and not (old or several):
        simple = _counted(segment, simple)
    if simple is None:
        return Verdict(events, shorten=True)
    others = [e for e in events if e.special.kind != "branch point" and not _belongs(e, [*old, *several], segment)]
    found = [_event(segment, p.point) for p in several if p.point]
    return Verdict(sorted(_turned(segment, found, [*others, *simple]), key=lambda e: e.fraction), True)


def multiple_at_start(segment: Segment, options: TraceOptions) -> Located | None:
    """The multiple branch point at which a segment begins, None when it is none or a simple one."""
    places = [p.point for p in search_places(segment, options).places if abs(p.arclength - segment.start) < AT_START]
    return next((_event(segment, point) for point in places if point), None)


def _is_same(last: SpecialPoint, arclength: float, options: TraceOptions) -> bool:
    """Whether a singular place is the last branch point, which lies where two segments meet."""
    slack = SAME if last.multiplicity == 1 else max(SAME, 10 * options.mesh.tolerance)
    return abs(arclength - last.arclength) < slack


def _is_at_end(segment: Segment, event: Located) -> bool:
    off = event.special.arclength - segment.start
    return min(abs(off), abs(off - segment.step)) < SAME


def _counted(segment: Segment, simple: list[Located]) -> list[Located] | None:
    """Simple branch points as many as the determinant says; None when they do not add up.

    One right at an end may belong to the next segment; a mode that touches zero is no branch point.
    """
    odd = changes(segment.left.branch_test[0], segment.right.branch_test[0])
    for counted in (simple, [e for e in simple if not _is_at_end(segment, e)]):
        if len(counted) % 2 == odd:
            return counted
    return None


def _is_suspicious(segment: Segment, events: list[Located], last: SpecialPoint | None) -> bool:
    """Whether there may be several branch points on a segment, or a multiple one, or one that belongs to another."""
    points = [e for e in events if e.special.kind == "branch point"]
    if len(points) < segment.expected:
        return True
    if any(_is_at_end(segment, e) or (last and abs(e.special.arclength - last.arclength) < SAME) for e in points):
        return True
    if not points:
        return segment.may_be_singular_twice
    if any(e.gap or e.special.status is Status.BRACKETED or e.found is None for e in points):
        return True
    # a second mode may vanish on the segment too when it is as weak as the first one is at the ends
    reach = 1e-3 + max(segment.reach, np.nansum([segment.left.weakness, segment.right.weakness]))
    return any(e.found is not None and second_weakness(segment.colloc, e.found) < reach for e in points)


def second_weakness(colloc: Collocation, found: Augmented) -> float:
    """Singular value of the second-weakest mode at a simple branch point, zero at a multiple one.

    It is the smallest one of the matrix bordered with what spans the kernel.
    """
    assert found.column is not None
    rows = [colloc.row(scaled(v, 1.0 / colloc.norm(v))) for v in found.vectors]
    fac = colloc.factor(colloc.linearize(found.state), rows, [found.column])
    guess: Columns | None
    (guess,) = smooth_vectors(colloc, np.random.default_rng(29), 1, 2, len(colloc.free) + 1)
    value = 0.0
    for _ in range(2):
        guess, value = smallest_singular(colloc, fac, guess)
    return value


def _simple(
    segment: Segment, events: list[Located], places: Sequence[SingularPlace], options: TraceOptions
) -> list[Located] | None:
    """The simple branch points at these places; None when Newton does not find each of them."""
    known = [e for e in events if e.special.status is Status.CONVERGED and e.found is not None]
    found: list[Located] = []
    for place in places:
        gaps = [abs(place.arclength - p.arclength) for p in places if p is not place]
        near = min(1e-5, *(g / 3 for g in gaps)) if gaps else 1e-5
        event = next((e for e in known if abs(e.special.arclength - place.arclength) < near), None)
        event = event or branch_point_from(segment, place.fraction, place.state, options)
        if event is None or abs(event.special.arclength - place.arclength) > near:
            return None
        found.append(event)
    return found


def _belongs(event: Located, places: Sequence[SingularPlace], segment: Segment) -> bool:
    """Whether a fold is what the test functions made of a multiple branch point."""
    if not event.is_singular:
        return False
    if event.special.status is Status.CONVERGED:
        return any(abs(event.special.arclength - p.arclength) < TOGETHER for p in places)
    low, high = event.special.bracket
    slack = 1e-2 * segment.step
    return any(low - slack <= p.arclength <= high + slack for p in places)


def _turned(segment: Segment, several: list[Located], others: list[Located]) -> list[Located]:
    """All events, multiple points with what they do to the parameter: the changes of its direction have to add up."""
    odd = changes(*segment.fold_tests, FOLD_NOISE) != sum(e.turns for e in others) % 2
    if len(several) == 1:
        (event,) = several
        several = [replace(event, special=replace(event.special, turns=bool(odd)))]
    return several + others


def _event(segment: Segment, point: MultiplePoint) -> Located:
    """The special point at a multiple branch point."""
    colloc, fraction = point.colloc, float(np.clip(point.fraction, 0.0, 1.0))
    a, b = (frame.branch_test[0] * frame.weakness for frame in (segment.left, segment.right))
    tangent = segment.colloc.interpolate(segment.direction(fraction), colloc)
    rays, nearby, missing = list(point.directions), list(point.nearby), point.unverified
    for i, sign in enumerate((1.0, -1.0)):  # the branch itself is among the rays, unless it could not be confirmed
        if len(rays) <= i or sign * colloc.inner(rays[i], tangent) < ALIGNED:
            rays.insert(i, scaled(tangent, sign))
            nearby.insert(i, add(point.state, (0.01 * sign, tangent)))
            missing += 1
    flat = abs(rays[0].scalars[0]) < 1e-3 * max(np.abs(segment.fold_tests)) + 1e-9
    special = SpecialPoint(
        "branch point", colloc.solution(point.state, point.error), segment.start + fraction * segment.step,
        Status.CONVERGED, (segment.start, segment.start + segment.step), (a, b), residual=point.residual,
        directions=tuple(rays), free=tuple(colloc.bvp.parameter_names[i] for i in colloc.free), scale=colloc.scale,
        turns=bool(flat), multiplicity=point.multiplicity, continuum=point.continuum, nearby=tuple(nearby),
        unverified=missing,
    )  # fmt: skip
    return Located(special, fraction, 0)
