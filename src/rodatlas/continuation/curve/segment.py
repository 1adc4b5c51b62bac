"""A piece of a branch between two neighboring points, what may lie on it, and how a place on it is solved for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, with_tests
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.newton import newton, plane
from rodatlas.continuation.discrete.vectors import add, hermite, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import SpecialPoint
from rodatlas.continuation.singular.augmented import Augmented

PLACES = 65  # on a step, at which a cubic is looked at
FOLD_NOISE = 1e-9  # tangent component of the parameter below which it is round-off: the branch is vertical
STEEP = 4.0  # change of a singular value per arclength that is hardly ever exceeded, where none is known yet
LEEWAY = 2.0  # by which a mode may be steeper than those that were seen
PASSES, SLOW = 5, 5.0  # of inverse iteration, and how much too large a second singular value may be after one
AT_START = 1e-6  # arclength within which a special point is one of the very start of a walk
EDGE = 0.02  # share of a segment at its ends where an expected branch point may lie on the next one


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
    def is_singular(self) -> bool:
        """Whether the problem is singular there at a fixed continuation parameter."""
        return self.special.is_singular

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
    def is_first(self) -> bool:
        """Whether a walk starts with it: what lies right at its left end is on no other segment."""
        return self.left.previous is None

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

    @cached_property
    def may_be_singular_twice(self) -> bool:
        """Whether two branch points may hide on the segment, at whose ends the determinant has the same sign.

        It is suspicious when both smallest singular values at either end may reach zero on the segment (two modes that
        become singular in turn), when the smallest one, extrapolated along a line from the point before and the left
        end, does so, or when the parabola through these two and the right end has a minimum there at less than half of
        the values at the ends (one mode that does so twice). At the start of a branch, where no point lies before, a
        value is suspicious that is small for the length of the step.
        """
        before, left, right = self.left.weakness_before, self.left.weakness, self.right.weakness
        if self.left.branch_test[0] * self.right.branch_test[0] <= 0 or not np.isfinite([left, right]).all():
            return False
        h0, h1 = self.left.previous_step, self.step
        if not np.isfinite(before):
            return min(left, right) < STEEP * h1
        if left + right < self.reach and self._both_are_weak():
            return True
        slope_before, slope = (left - before) / h0, (right - left) / h1
        if left + slope_before * h1 <= 0.0:
            return True
        bend = (slope - slope_before) / (h0 + h1)
        start = slope - bend * h1
        if bend <= 0.0 or not 0.0 < -start / (2 * bend) < h1:
            return False
        return bool(left - start**2 / (4 * bend) < 0.5 * min(left, right))

    def _both_are_weak(self) -> bool:
        """Whether the second-smallest singular value, too, may reach zero on the segment from either end.

        Inverse iteration comes from above, and slowly where modes are alike, so a value of some size is looked at
        again.
        """
        for frame in (self.left, self.right):
            value = frame.second_weakness
            if self.reach <= value < SLOW * self.reach:
                value = with_tests(frame, PASSES).second_weakness
            if not value < self.reach:
                return False
        return True

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


def begins(segment: Segment, a: float, b: float, noise: float) -> bool:
    """Whether a walk starts where a test function, a and b at the ends of its first segment, vanishes."""
    return segment.is_first and abs(b) > noise and abs(a) * segment.step <= AT_START * abs(b - a)


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


def passes_twice(ends: tuple[float, float], slopes: tuple[float, float], step: float, share: float = 0.0) -> bool:
    """Whether a function with these values and slopes at the ends of a step seems to pass zero twice between them.

    It does when the cubic with these ends passes zero, or falls below a `share` of the values at both ends.
    """
    if ends[0] * ends[1] <= 0:
        return False
    sign = np.sign(ends[0])
    a, b, c, d = sign * ends[0], sign * ends[1], sign * step * slopes[0], sign * step * slopes[1]
    t = np.linspace(0.0, 1.0, PLACES)
    cubic = a + t * (c + t * (3 * (b - a) - 2 * c - d + t * (2 * (a - b) + c + d)))
    return bool(cubic.min() < share * min(a, b))


def attempts(
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
        bracket, x, tangent, more = bisected(segment, options, test)
        found = attempt(x, tangent)
        spent += more + found.iterations
        if not (found.converged and segment.holds(found.state)):
            found = replace(found, converged=False, state=x)
    return found, tangent, bracket, spent


def bisected(
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
