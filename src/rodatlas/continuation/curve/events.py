"""Events between two neighbouring points of a branch: detection by test functions, location by Newton."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.curve.extrema import locate_extrema, may_be_extreme_twice
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.segment import (
    FOLD_NOISE,
    Located,
    Segment,
    attempts,
    begins,
    bisected,
    changes,
    dips,
    passes_twice,
)
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.newton import fixed, newton
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import NormalForm, SpecialPoint, Status
from rodatlas.continuation.singular.augmented import Augmented, branch_directions, solve_branch_point, solve_fold
from rodatlas.continuation.singular.extremum import slope_along
from rodatlas.continuation.singular.normal_form import branch_point_form
from rodatlas.continuation.singular.refine import refined
from rodatlas.continuation.singular.smallest import smallest_singular

UNCHANGED = 1e-10  # relative change of an observable, or distance from a value, that is round-off
UPRIGHT = 1e-3  # tangent component of the parameter at a branch point, in units of that a step away, that is none
GRAZING = 0.1  # share of its values at the ends to which an observable comes near the value that is sought


def locate_events(segment: Segment, options: TraceOptions) -> list[Located]:
    """All events that the test functions report on a segment, in order along it."""
    found: list[Located] = []
    turned = changes(*segment.fold_tests, FOLD_NOISE)
    branch_point = fold = None
    if "branch point" in options.locate and changes(segment.left.branch_test[0], segment.right.branch_test[0]):
        branch_point = _locate_branch_point(segment, options)
    if "fold" in options.locate and turned and not (branch_point and branch_point.turns):
        fold = locate_fold(segment, options)
    bracketed = branch_point is not None and branch_point.special.status is Status.BRACKETED
    if fold and branch_point and bracketed and abs(fold.fraction - branch_point.fraction) < 0.05:
        # its tangents are unknown, but one place means one pitchfork
        branch_point, fold = replace(branch_point, special=replace(branch_point.special, turns=True)), None
    found += [event for event in (branch_point, fold) if event]
    found += _locate_zeros(segment, options)
    found += locate_extrema(segment, options, branch_point)
    return sorted(found, key=lambda item: item.fraction)


def events_off(segment: Segment, options: TraceOptions) -> list[Located]:
    """The same on the first step from a branch point, where the determinant that tells of others vanishes.

    A fold at the branch point itself is that of a pitchfork, seen from its side branch.
    """
    found = [*_locate_zeros(segment, options), *locate_extrema(segment, options, None)]
    a, b = segment.fold_tests
    if "fold" in options.locate and changes(a, b, FOLD_NOISE) and abs(a) > UPRIGHT * abs(b):
        found.append(locate_fold(segment, options))
    return sorted(found, key=lambda item: item.fraction)


def _locate_zeros(segment: Segment, options: TraceOptions) -> list[Located]:
    found = []
    for name, value in options.sought:
        ends, noise = _values(segment, name, value), UNCHANGED * max(1.0, abs(value))
        if changes(*ends) or begins(segment, *ends, noise):
            found.append(_locate_zero(segment, name, value, options))
    return found


def turns_at(special: SpecialPoint) -> bool:
    """Whether the continuation parameter turns at a branch point along the branch walked: a pitchfork's side branch."""
    return special.kind == "branch point" and special.turns


def explains(segment: Segment, events: list[Located], change: int) -> bool:
    """Whether the folds and branch points of a segment explain a change of the index.

    Where one of them is multiple the parity follows from the determinant of the problem at fixed parameters.
    """
    most, left, right = sum(e.capacity for e in events), segment.left.branch_test[0], segment.right.branch_test[0]
    odd = most % 2 == 1
    if any(e.special.multiplicity > 1 for e in events):
        if left * right == 0.0:
            return abs(change) <= most
        odd = changes(left, right) != changes(*segment.fold_tests, FOLD_NOISE)
    return abs(change) <= most and change % 2 == odd


def unresolved(
    segment: Segment, events: list[Located], options: TraceOptions, tried: float, told_apart: bool = False
) -> bool:
    """Whether a shorter step should tell more.

    It should when several folds or branch points crowd on the segment, when it jumps a gap between two curves, when
    the turns of the parameter do not add up, when two folds, branch points, extrema or zeros may hide on it, when an
    event lies beyond a bound, and (down to an eighth of the step tried first) when one was not located. With
    `told_apart` all places where the segment is singular are known, and only the rest is asked.
    """
    crowd = [e for e in events if e.is_singular and not (told_apart and e.special.kind == "branch point")]
    if len(crowd) > 1 or any(e.gap for e in events):
        return True
    both = "fold" in options.locate and "branch point" in options.locate
    if both and sum(e.turns for e in events) % 2 != changes(*segment.fold_tests, FOLD_NOISE):
        return True
    if any(e.special.status is Status.BRACKETED for e in events) and segment.step > tried / 8:
        return True
    if "fold" in options.locate and may_turn_twice(segment):
        return True
    if any(may_be_extreme_twice(segment, name) for name in options.extrema):
        return True
    near = GRAZING if segment.step > tried / 8 else 0.0
    if any(may_pass_twice(segment, name, value, near) for name, value in options.sought):
        return True
    if any(_may_leave_and_return(segment, name, pair, near) for name, pair in options.bounds.items()):
        return True
    if "branch point" in options.locate and not told_apart and segment.may_be_singular_twice:
        return True
    return any(_outside(e.special, segment, options) for e in events)


def may_turn_twice(segment: Segment) -> bool:
    """Whether two folds may hide on a segment at whose ends the parameter changes in the same direction.

    It is suspicious when the slope of the parameter dips on the segment (see :func:`dips`).
    """
    return dips(*segment.fold_tests, (segment.right.parameter - segment.left.parameter) / segment.step, FOLD_NOISE)


def may_pass_twice(segment: Segment, name: str, value: float, share: float = 0.0) -> bool:
    """Whether an observable may take a value twice on a segment at whose ends it is on the same side of it."""
    ends = (segment.left, segment.right)
    slopes = [slope_along(segment.colloc, name, frame.x, frame.tangent) for frame in ends]
    return passes_twice(_values(segment, name, value), (slopes[0], slopes[1]), segment.step, share)


def _may_leave_and_return(segment: Segment, name: str, bounds: tuple[float, float], share: float) -> bool:
    """Whether an observable may lie beyond a bound between two points at which it does not."""
    if name not in segment.colloc.bvp.observables:
        return False
    off = [min(map(abs, _values(segment, name, bound))) for bound in bounds]
    scale = max(1.0, *map(abs, bounds))  # a step that ends at a bound comes as near to it as it should
    return any(
        may_pass_twice(segment, name, bound, share) for bound, d in zip(bounds, off, strict=True) if d > 1e-9 * scale
    )


def _outside(special: SpecialPoint, segment: Segment, options: TraceOptions) -> bool:
    for name, (low, high) in options.bounds.items():
        bvp, before = segment.colloc.bvp, segment.colloc.observable_row(name, segment.left.x)[0]
        low, value, high = (bvp.coordinate(name, v) for v in (low, special.solution[name], high))
        slack = 1e-8 * max(1.0, abs(before))
        if low <= before <= high and not low - slack <= value <= high + slack:
            return True
    return False


def locate_fold(segment: Segment, options: TraceOptions) -> Located:
    """The fold near the zero of the parameter's slope between both ends."""
    a, b = segment.fold_tests

    def attempt(x: Columns, t: Columns) -> Augmented:
        return solve_fold(segment.colloc, x, t)

    found, tangent, bracket, spent = attempts(segment, options, attempt, lambda frame: frame.fold_test, a / (a - b))
    return _record(segment, options, "fold", found, tangent, (a, b), bracket, spent)


def _locate_branch_point(segment: Segment, options: TraceOptions) -> Located:
    a, b = (frame.branch_test[0] * frame.weakness for frame in (segment.left, segment.right))

    def attempt(x: Columns, t: Columns) -> Augmented:
        return solve_branch_point(segment.colloc, x, t)

    guess = float(np.clip(a / (a - b), 0.05, 0.95)) if np.isfinite(a - b) and a != b else 0.5
    found, tangent, bracket, spent = attempts(segment, options, attempt, lambda frame: frame.branch_test[0], guess)
    event = _record(segment, options, "branch point", found, tangent, (a, b), bracket, spent)
    if event.special.status is Status.CONVERGED or event.gap:
        return event
    return replace(event, is_round_off=_is_regular(segment, found.state, tangent))


def _is_regular(segment: Segment, x: Columns, tangent: Columns) -> bool:
    """Whether the smallest singular value at the end of a bisection is about that at the ends of the segment."""
    colloc = segment.colloc
    fac = colloc.factor(colloc.linearize(x), [colloc.row(tangent)])
    weakness = smallest_singular(colloc, fac, None)[1]
    return weakness > 0.1 * min(abs(segment.left.weakness), abs(segment.right.weakness))


def branch_point_from(segment: Segment, fraction: float, x: Columns, options: TraceOptions) -> Located | None:
    """The simple branch point that Newton finds from a state at a fraction of the segment; None when it fails."""
    a, b = (frame.branch_test[0] * frame.weakness for frame in (segment.left, segment.right))
    tangent = segment.direction(fraction)
    found = solve_branch_point(segment.colloc, x, tangent)
    if not (found.converged and segment.holds(found.state)):
        return None
    event = _record(segment, options, "branch point", found, tangent, (a, b), (0.0, 1.0), found.iterations)
    return None if event.gap else event


def _values(segment: Segment, name: str, value: float) -> tuple[float, float]:
    """A parameter or observable less `value` at both ends."""
    at = segment.colloc.bvp.coordinate(name, value)
    left, right = (segment.colloc.observable_row(name, f.x)[0] - at for f in (segment.left, segment.right))
    return left, right


def _locate_zero(segment: Segment, name: str, value: float, options: TraceOptions) -> Located:
    colloc = segment.colloc
    a, b = _values(segment, name, value)
    guess = a / (a - b)
    held = fixed(name, value)(colloc)
    result = newton(colloc, segment.interpolate(guess), [held], options.newton)
    converged = result.converged and segment.holds(result.state)
    if not converged and segment.left.branch_test[0] == 0.0:  # the first step from a branch point is never made shorter
        at = colloc.bvp.coordinate(name, value)
        x = bisected(segment, options, lambda frame: colloc.observable_row(name, frame.x)[0] - at)[1]
        result = newton(colloc, x, [held], options.newton)
        converged = result.converged and segment.holds(result.state)
    state = result.state if converged else segment.interpolate(guess)
    if not converged and segment.is_first and abs(a) < UNCHANGED * max(1.0, abs(value)):  # it only touches the value
        converged, state = True, segment.left.x
    found = Augmented(converged, state, (), np.full((1, 1), np.nan), result.estimate, len(result.corrections))
    tangent = segment.direction(guess)
    return _record(segment, options, f"zero of {name}", found, tangent, (a, b), (0.0, 1.0), found.iterations)


def _record(
    segment: Segment, options: TraceOptions, kind: str, found: Augmented, tangent: Columns,
    tests: tuple[float, float], bracket: tuple[float, float], spent: int,
) -> Located:  # fmt: skip
    """The special point, a fold or branch point on a mesh that resolves its kernel too."""
    colloc, error = segment.colloc, segment.right.error
    fraction = float(np.clip(segment.position(found.state)[0], 0.0, 1.0))
    directions: tuple[Columns, ...] = ()
    turns = kind == "fold"
    at_first = found if found.converged and kind == "branch point" else None
    if found.converged and found.vectors and not options.mesh.is_fixed_size:
        before = found.iterations
        colloc, found, error = refined(colloc, found, tangent, options.mesh)
        spent += found.iterations - before
        tangent = segment.colloc.interpolate(tangent, colloc)
    gap = kind == "branch point" and found.converged and abs(found.unfolding) > 1e-9 + 10 * options.mesh.tolerance
    if gap:
        found = replace(found, converged=False)
    if kind == "branch point":
        directions = branch_directions(colloc, found, tangent) if found.converged else (tangent,)
        turns = found.converged and abs(directions[0].scalars[0]) < 1e-3 * max(np.abs(segment.fold_tests)) + 1e-9
    form, bend = _normal_form(colloc, kind, found, directions)
    special = SpecialPoint(
        kind, colloc.solution(found.state, error), segment.start + fraction * segment.step,
        Status.CONVERGED if found.converged else Status.BRACKETED,
        (segment.start + bracket[0] * segment.step, segment.start + bracket[1] * segment.step), tests,
        residual=found.residual, curvature=float(found.form[0, 0]) if kind == "fold" else float("nan"),
        directions=directions, free=tuple(colloc.bvp.parameter_names[i] for i in colloc.free), scale=colloc.scale,
        turns=turns, normal_form=form, bend=bend,
    )  # fmt: skip
    return Located(special, fraction, spent, gap, at_first)


def _normal_form(
    colloc: Collocation, kind: str, found: Augmented, directions: tuple[Columns, ...]
) -> tuple[NormalForm | None, Columns | None]:
    if not found.converged or kind not in ("fold", "branch point"):
        return None, None
    if kind == "branch point":
        return branch_point_form(colloc, found, directions)
    unit = float(colloc.scale.parameters[colloc.free[0]])
    return NormalForm("fold", 0.0, unit * float(found.form[0, 0])), None
