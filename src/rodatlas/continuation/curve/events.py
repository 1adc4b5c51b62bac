"""Events between two neighbouring points of a branch: detection by test functions, location by Newton."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, with_tests
from rodatlas.continuation.discrete.collocation import Collocation, add, hermite, scaled
from rodatlas.continuation.discrete.newton import fixed, newton, plane
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import NormalForm, SpecialPoint, Status
from rodatlas.continuation.singular.augmented import Augmented, branch_directions, solve_branch_point, solve_fold
from rodatlas.continuation.singular.normal_form import branch_point_form
from rodatlas.continuation.singular.refine import refined
from rodatlas.continuation.singular.smallest import smallest_singular

FOLD_NOISE = 1e-9  # tangent component of the parameter below which it is round-off: the branch is vertical

STEEP = 4.0  # change of a singular value per arclength that is hardly ever exceeded, where none is known yet
PASSES, SLOW = 5, 5.0  # of inverse iteration, and how much too large a second singular value may be after one
EDGE = 0.02  # share of a segment at its ends where an expected branch point may lie on the next one
LEEWAY = 1.3  # by which a mode may be steeper than those that were seen


@dataclass(frozen=True)
class Located:
    """A special point and its place on a segment.

    Attributes
    ----------
    fraction : place on the segment, 0 to 1; iterations : Newton iterations spent.
    gap : the branch point exists only for a perturbed problem: here two curves pass each other at a small distance,
        and the step jumped from one to the other.
    found : a converged branch point on the mesh of the segment.
    is_round_off : the determinant changes sign where no singular value vanishes.
    """

    special: SpecialPoint
    fraction: float
    iterations: int
    gap: bool = False
    found: Augmented | None = None
    is_round_off: bool = False

    @property
    def is_zero(self) -> bool:
        return self.special.kind not in ("fold", "branch point")

    @property
    def turns(self) -> bool:
        """Whether the continuation parameter is extreme there."""
        return self.special.turns

    @property
    def flips(self) -> bool:
        """Whether eigenvalues of the problem at fixed parameters may change sign there, as an index counts them."""
        return self.capacity > 0

    @property
    def capacity(self) -> int:
        """How many eigenvalues change sign there at most; all of them do so except at a multiple branch point."""
        if self.special.multiplicity > 1:
            return self.special.multiplicity
        return int(self.special.kind == "fold" or (self.special.kind == "branch point" and not self.turns))


@dataclass(frozen=True)
class Segment:
    """Two frames on one discretisation, `step` apart along the curve; `start` is the arclength of the first."""

    left: Frame
    right: Frame
    step: float
    start: float

    @property
    def colloc(self) -> Collocation:
        return self.right.colloc

    @property
    def fold_tests(self) -> tuple[float, float]:
        return self.left.fold_test, self.right.fold_test

    @property
    def reach(self) -> float:
        """How much a singular value may change on the segment, by what was seen on it and before."""
        left, right = self.left.steepness, self.right.steepness
        return LEEWAY * self.step * (right if np.isfinite(left) else max(STEEP, float(np.nan_to_num(right))))

    @property
    def expected(self) -> int:
        """How many branch points were seen ahead on the segment, from before it, and not just at an end."""
        return sum(EDGE < d / self.step < 1 - EDGE for d in self.left.expected)

    def interpolate(self, fraction: float) -> Columns:
        """Cubic Hermite interpolation of the curve."""
        ends, tangents = (self.left.x, self.right.x), (self.left.tangent, self.right.tangent)
        return hermite(ends, tangents, self.step, fraction)

    def direction(self, fraction: float) -> Columns:
        t = add(scaled(self.left.tangent, 1 - fraction), (fraction, self.right.tangent))
        return scaled(t, 1.0 / self.colloc.norm(t))

    def position(self, x: Columns) -> tuple[float, float]:
        """Fraction of the segment nearest to x, and distance from the curve in units of the step."""
        chord = add(self.right.x, (-1.0, self.left.x))
        fraction = self.colloc.inner(chord, add(x, (-1.0, self.left.x))) / self.colloc.inner(chord, chord)
        clipped = float(np.clip(fraction, -0.2, 1.2))
        off = self.colloc.norm(add(x, (-1.0, self.interpolate(clipped))))
        return float(fraction), off / self.step

    def holds(self, x: Columns) -> bool:
        """Whether x lies on this piece of the curve (and not on another solution that Newton fell on)."""
        fraction, off = self.position(x)
        return -1e-3 <= fraction <= 1 + 1e-3 and off < 0.1


def changes(a: float, b: float, noise: float = 0.0) -> bool:
    """Whether a test function passes zero from a to b; a zero at the left end was counted on the segment before.

    Values of both ends below the noise mean nothing.
    """
    if max(abs(a), abs(b)) < noise:
        return False
    return a * b < 0 or (b == 0.0 and a != 0.0)


def locate_events(segment: Segment, options: TraceOptions) -> list[Located]:
    """All events that the test functions report on a segment, in order along it."""
    found: list[Located] = []
    turned = changes(*segment.fold_tests, FOLD_NOISE)
    branch_point = fold = None
    if "branch point" in options.locate and changes(segment.left.branch_test[0], segment.right.branch_test[0]):
        branch_point = _locate_branch_point(segment, options)
    if "fold" in options.locate and turned and not (branch_point and branch_point.turns):
        fold = _locate_fold(segment, options)
    bracketed = branch_point is not None and branch_point.special.status is Status.BRACKETED
    if fold and branch_point and bracketed and abs(fold.fraction - branch_point.fraction) < 0.05:
        # its tangents are unknown, but one place means one pitchfork
        branch_point, fold = replace(branch_point, special=replace(branch_point.special, turns=True)), None
    found += [event for event in (branch_point, fold) if event]
    found += [_locate_zero(segment, name, value, options) for name, value in options.zeros.items()
              if changes(*_values(segment, name, value))]  # fmt: skip
    return sorted(found, key=lambda item: item.fraction)


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
    the turns of the parameter do not add up, when two folds or two branch points may hide on it, when an event lies
    beyond a bound, and (down to an eighth of the step tried first) when one was not located. With `told_apart` all
    places where the segment is singular are known, and only the rest is asked.
    """
    crowd = [e for e in events if not e.is_zero and not (told_apart and e.special.kind == "branch point")]
    if len(crowd) > 1 or any(e.gap for e in events):
        return True
    both = "fold" in options.locate and "branch point" in options.locate
    if both and sum(e.turns for e in events) % 2 != changes(*segment.fold_tests, FOLD_NOISE):
        return True
    if any(e.special.status is Status.BRACKETED for e in events) and segment.step > tried / 8:
        return True
    if "fold" in options.locate and may_turn_twice(segment):
        return True
    if "branch point" in options.locate and not told_apart and may_be_singular_twice(segment):
        return True
    return any(_outside(e.special, segment, options) for e in events)


def may_turn_twice(segment: Segment) -> bool:
    """Whether two folds may hide on a segment at whose ends the parameter changes in the same direction.

    It is suspicious when the slope of the parameter dips on the segment (see :func:`dips`).
    """
    return dips(*segment.fold_tests, (segment.right.parameter - segment.left.parameter) / segment.step, FOLD_NOISE)


def dips(left: float, right: float, mean: float, noise: float = 0.0) -> bool:
    """Whether a slope that is `left` and `right` at the ends of a step and `mean` on average dips between them.

    It does when the parabola with these ends and this mean has an extremum there below half of the values at the ends.
    """
    if left * right <= 0 or max(abs(left), abs(right)) < noise:
        return False
    middle = 1.5 * mean - (left + right) / 4
    bend = 2 * (left + right - 2 * middle)  # slope(x) = left + start x + bend x^2 on 0 <= x <= 1
    start = right - left - bend
    if bend == 0.0 or not 0.0 < -start / (2 * bend) < 1.0:
        return False
    extremum = left - start**2 / (4 * bend)
    return bool(extremum / left < 0.5 * min(1.0, right / left))


def may_be_singular_twice(segment: Segment) -> bool:
    """Whether two branch points may hide on a segment at whose ends the determinant has the same sign.

    It is suspicious when both smallest singular values at either end may reach zero on the segment (two modes that
    become singular in turn), when the smallest one, extrapolated along a line from the point before and the left end,
    does so, or when the parabola through these two and the right end has a minimum there at less than half of the
    values at the ends (one mode that does so twice). At the start of a branch, where no point lies before, a value is
    suspicious that is small for the length of the step.
    """
    before, left, right = segment.left.weakness_before, segment.left.weakness, segment.right.weakness
    if segment.left.branch_test[0] * segment.right.branch_test[0] <= 0 or not np.isfinite([left, right]).all():
        return False
    h0, h1 = segment.left.previous_step, segment.step
    if not np.isfinite(before):
        return min(left, right) < STEEP * h1
    if left + right < segment.reach and _both_are_weak(segment):
        return True
    slope_before, slope = (left - before) / h0, (right - left) / h1
    if left + slope_before * h1 <= 0.0:
        return True
    bend = (slope - slope_before) / (h0 + h1)
    start = slope - bend * h1
    if bend <= 0.0 or not 0.0 < -start / (2 * bend) < h1:
        return False
    return bool(left - start**2 / (4 * bend) < 0.5 * min(left, right))


def _both_are_weak(segment: Segment) -> bool:
    """Whether the second-smallest singular value, too, may reach zero on the segment from either end.

    Inverse iteration comes from above, and slowly where modes are alike, so a value of some size is looked at again.
    """
    reach = segment.reach
    for frame in (segment.left, segment.right):
        value = frame.second_weakness
        if reach <= value < SLOW * reach:
            value = with_tests(frame, PASSES).second_weakness
        if not value < reach:
            return False
    return True


def _outside(special: SpecialPoint, segment: Segment, options: TraceOptions) -> bool:
    for name, (low, high) in options.bounds.items():
        bvp, before = segment.colloc.bvp, segment.colloc.observable_row(name, segment.left.x)[0]
        low, value, high = (bvp.coordinate(name, v) for v in (low, special.solution[name], high))
        slack = 1e-8 * max(1.0, abs(before))
        if low <= before <= high and not low - slack <= value <= high + slack:
            return True
    return False


def _locate_fold(segment: Segment, options: TraceOptions) -> Located:
    a, b = segment.fold_tests

    def attempt(x: Columns, t: Columns) -> Augmented:
        return solve_fold(segment.colloc, x, t)

    found, tangent, bracket, spent = _attempts(segment, options, attempt, lambda frame: frame.fold_test, a / (a - b))
    return _record(segment, options, "fold", found, tangent, (a, b), bracket, spent)


def _locate_branch_point(segment: Segment, options: TraceOptions) -> Located:
    a, b = (frame.branch_test[0] * frame.weakness for frame in (segment.left, segment.right))

    def attempt(x: Columns, t: Columns) -> Augmented:
        return solve_branch_point(segment.colloc, x, t)

    guess = float(np.clip(a / (a - b), 0.05, 0.95)) if np.isfinite(a - b) and a != b else 0.5
    found, tangent, bracket, spent = _attempts(segment, options, attempt, lambda frame: frame.branch_test[0], guess)
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


def _attempts(
    segment: Segment, options: TraceOptions, attempt: Callable[[Columns, Columns], Augmented],
    test: Callable[[Frame], float], guess: float,
) -> tuple[Augmented, Columns, tuple[float, float], int]:  # fmt: skip
    """Newton from the interpolated zero of the test function and, should that fail, from a bisected one.

    Returns what was found, the tangent there, the bracket (fractions) and the Newton iterations spent.
    """
    tangent, bracket = segment.direction(guess), (0.0, 1.0)
    found = attempt(segment.interpolate(guess), tangent)
    spent = found.iterations
    if not (found.converged and segment.holds(found.state)):
        bracket, x, tangent, more = _bisect(segment, options, test)
        found = attempt(x, tangent)
        spent += more + found.iterations
        if not (found.converged and segment.holds(found.state)):
            found = replace(found, converged=False, state=x)
    return found, tangent, bracket, spent


def _bisect(
    segment: Segment, options: TraceOptions, test: Callable[[Frame], float], cuts: int = 14
) -> tuple[tuple[float, float], Columns, Columns, int]:
    """Narrow the sign change of a test function by bisection on the curve itself."""
    lo, hi, spent = 0.0, 1.0, 0
    low_sign = np.sign(test(segment.left))
    x, t = segment.interpolate(0.5), segment.direction(0.5)
    for _ in range(cuts):
        mid = (lo + hi) / 2
        guess, normal = segment.interpolate(mid), segment.direction(mid)
        result = newton(segment.colloc, guess, [plane(segment.colloc, normal, guess)], options.newton)
        spent += len(result.corrections)
        if not result.converged or result.factorization is None:
            break
        frame = replace(segment.left, tangent=normal).reached(result.state, result.factorization, segment.step)
        x, t = result.state, frame.tangent
        if np.sign(test(frame)) == low_sign:
            lo = mid
        else:
            hi = mid
    return (lo, hi), x, t, spent


def _values(segment: Segment, name: str, value: float) -> tuple[float, float]:
    """A parameter or observable less `value` at both ends."""
    at = segment.colloc.bvp.coordinate(name, value)
    left, right = (segment.colloc.observable_row(name, f.x)[0] - at for f in (segment.left, segment.right))
    return left, right


def _locate_zero(segment: Segment, name: str, value: float, options: TraceOptions) -> Located:
    colloc = segment.colloc
    a, b = _values(segment, name, value)
    guess = a / (a - b)
    result = newton(colloc, segment.interpolate(guess), [fixed(name, value)(colloc)], options.newton)
    converged = result.converged and segment.holds(result.state)
    state = result.state if converged else segment.interpolate(guess)
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
