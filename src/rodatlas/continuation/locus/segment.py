"""One step of a locus, and points on it: corrected at a fraction of the step, or where a function vanishes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.closing import passes
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.vectors import add, arc_length, hermite, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.locus.point import LocusFrame, Sought, correct

NOTHING = 1e-5  # share of the values near by; what is smaller belongs to another curve, on which Newton has fallen
CLOSE = 0.001  # arclength; points nearer to a singular one are worse than interpolation between those further away
LOCATED = 1e-8  # arclength to which a special point is known
Test = Callable[[LocusFrame], float]


@dataclass(frozen=True)
class Stretch:
    """One step of a locus: frames at both ends, on one discretization, `step` apart; `start` is the arclength."""

    sought: Sought
    left: LocusFrame
    right: LocusFrame
    step: float
    start: float
    options: TraceOptions

    def corrected(self, fraction: float, near: tuple[float, LocusFrame] | None = None) -> LocusFrame | None:
        """The point of the locus at a fraction of the step, from cubic Hermite interpolation.

        With a corrected point `near`by, its deviation from the interpolation improves the guess.
        """
        if fraction in (0.0, 1.0):
            return self.right if fraction else self.left
        guess, normal = self.interpolate(fraction), self.direction(fraction)
        if near is not None:
            guess = add(guess, (1.0, near[1].x), (-1.0, self.interpolate(near[0])))
        found = correct(self.sought, self.right, guess, normal, self.options, exact=True)
        if found is None or self.right.colloc.norm(add(found[0].x, (-1.0, guess))) > 0.1 * self.step:
            return None
        return found[0].after(self.left, fraction * self.step)

    def interpolate(self, fraction: float) -> Columns:
        """Cubic Hermite interpolation of the locus."""
        one, two = self.left, self.right
        return hermite((one.x, two.x), (one.tangent, two.tangent), self.step, fraction)

    def direction(self, fraction: float) -> Columns:
        """Unit tangent, interpolated."""
        t = add(scaled(self.left.tangent, 1 - fraction), (fraction, self.right.tangent))
        return scaled(t, 1.0 / self.right.colloc.norm(t))

    def root(self, test: Test, within: float = LOCATED) -> tuple[LocusFrame, float] | None:
        """Frame and fraction at which a function of frames vanishes: the secant method, kept inside the bracket.

        It ends when the next correction would be smaller than `within`, in arclength.
        """
        a, b = (0.0, self.left, test(self.left)), (1.0, self.right, test(self.right))
        if a[2] * b[2] >= 0:
            return next(((p[1], p[0]) for p in (a, b) if p[2] == 0.0), None)
        known = [a, b]
        fraction = a[2] / (a[2] - b[2])
        for _ in range(60):
            frame = self.corrected(fraction, min(known, key=lambda p: abs(p[0] - fraction))[:2])
            if frame is None:
                return None
            here = (fraction, frame, test(frame))
            known.append(here)
            a, b = (here, b) if here[2] * a[2] > 0 else (a, here)
            slope = (here[2] - known[-2][2]) / (fraction - known[-2][0])
            ahead = fraction - here[2] / slope if slope else np.inf
            if not a[0] < ahead < b[0]:
                ahead = (a[0] + b[0]) / 2
            if abs(ahead - fraction) * self.step < within or here[2] == 0.0:
                return frame, fraction
            fraction = float(ahead)
        return None

    def passes(self, other: LocusFrame) -> float | None:
        """Fraction of the step at which it passes another frame, in the same direction; else None."""

        def corrected(guess: Columns, normal: Columns) -> Columns | None:
            found = correct(self.sought, self.right, guess, normal, self.options)
            return None if found is None else found[0].x

        return passes(self, other, corrected, self.options.mesh.tolerance)

    def position(self, x: Columns) -> float:
        """Fraction of the step at which a state lies, from its projection on the chord."""
        chord, colloc = add(self.right.x, (-1.0, self.left.x)), self.right.colloc
        return colloc.inner(chord, add(x, (-1.0, self.left.x))) / colloc.inner(chord, chord)

    def singular_root(self, test: Test) -> SingularRoot:
        """The same where the equations of the locus are singular, so that Newton fails close to the root.

        Points on both sides close in on it; then interpolation between them gives it.
        """
        known = [(0.0, self.left, test(self.left)), (1.0, self.right, test(self.right))]
        low, high = known
        for place, frame, value in known:
            if value == 0.0:
                return SingularRoot(frame, place, 0.0, (place, place))
        while (high[0] - low[0]) * self.step > CLOSE:
            a, b = low[0], high[0]
            width = 0.1 * (b - a)
            middle = float(np.clip(a - low[2] * (b - a) / (high[2] - low[2]), a + 1.5 * width, b - 1.5 * width))
            frames = [(place, self.corrected(place)) for place in (middle - width, middle + width)]
            found = [(place, f, test(f)) for place, f in frames if f is not None]
            if len(found) < 2 or min(abs(v) for _, _, v in found) < NOTHING * max(abs(low[2]), abs(high[2])):
                break
            known = sorted([*known, *found], key=lambda p: p[0])
            at = next(i for i in range(len(known) - 1) if known[i][0] >= a and known[i][2] * known[i + 1][2] < 0)
            low, high = known[at], known[at + 1]
        at = known.index(low)
        near = [(p, v) for p, _, v in known[max(at - 1, 0) : at + 3]]
        fraction, other = (_root_of_polynomial(points, low[0], high[0]) for points in (near, [low[::2], high[::2]]))
        if len(near) > 2:
            other = _root_of_polynomial(near[1:] if near[0][0] < low[0] else near[:-1], low[0], high[0])
        colloc = self.right.colloc
        chord, cosine = colloc.norm(add(high[1].x, (-1.0, low[1].x))), colloc.inner(low[1].tangent, high[1].tangent)
        between = replace(self, left=low[1], right=high[1], step=arc_length(chord, cosine))
        share = (fraction - low[0]) / (high[0] - low[0])
        x, tangent = between.interpolate(share), between.direction(share)
        error = abs(fraction - other) * self.step
        return SingularRoot(replace(low[1], x=x, tangent=tangent), fraction, error, (low[0], high[0]))


@dataclass(frozen=True)
class SingularRoot:
    """A root between corrected points: the frame interpolated there, its fraction of the step, and the error of that.

    error : in arclength, from one point less; bracket : fractions of the nearest points on both sides.
    """

    frame: LocusFrame
    fraction: float
    error: float
    bracket: tuple[float, float]


def _root_of_polynomial(points: list[tuple[float, float]], a: float, b: float) -> float:
    """Root between a and b of the polynomial through some points, whose values at a and b differ in sign.

    (The barycentric form of SciPy shuffles the points at random: results would not repeat to the last digit.)
    """
    from scipy.interpolate import KroghInterpolator
    from scipy.optimize import brentq

    polynomial = KroghInterpolator(*np.array(points).T)
    return float(brentq(lambda t: float(polynomial(t)), a, b, xtol=1e-14))
