"""Events between two neighbouring points of a branch: detection by test functions, location by Newton."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.augmented import Augmented, branch_directions, solve_branch_point, solve_fold
from rodatlas.continuation.collocation import Collocation, add, scaled
from rodatlas.continuation.frame import Frame
from rodatlas.continuation.linear import Columns
from rodatlas.continuation.newton import fixed, newton, plane
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.results import SpecialPoint, Status


@dataclass(frozen=True)
class Located:
    """A special point and the state and direction at which it sits on the walker's discretisation."""

    special: SpecialPoint
    fraction: float
    iterations: int


@dataclass(frozen=True)
class Segment:
    """Two frames on one discretisation, `step` apart; `start` is the arclength of the first."""

    left: Frame
    right: Frame
    step: float
    start: float

    @property
    def colloc(self) -> Collocation:
        return self.right.colloc

    def interpolate(self, fraction: float) -> Columns:
        """Cubic Hermite interpolation of the curve."""
        t, h = fraction, self.step
        a, b = 1 - 3 * t**2 + 2 * t**3, 3 * t**2 - 2 * t**3
        c, d = h * (t - 2 * t**2 + t**3), h * (t**3 - t**2)
        x = scaled(self.left.x, a)
        return add(x, (b, self.right.x), (c, self.left.tangent), (d, self.right.tangent))

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
        return -0.05 <= fraction <= 1.05 and off < 0.1


def locate_events(segment: Segment, options: TraceOptions) -> list[Located]:
    """All events that the test functions report on a segment, in order along it."""
    found: list[Located] = []
    left, right = segment.left, segment.right
    branch_point = None
    if "branch point" in options.locate and left.branch_test[0] * right.branch_test[0] < 0:
        branch_point = _locate_branch_point(segment, options)
        found.append(branch_point)
    if "fold" in options.locate and left.fold_test * right.fold_test < 0:
        fold = _locate_fold(segment, options)
        if branch_point is None or not _same_point(fold, branch_point):
            found.append(fold)
    found += [_locate_zero(segment, name, value, options) for name, value in options.zeros.items()
              if _changes(segment, name, value)]  # fmt: skip
    return sorted(found, key=lambda item: item.fraction)


def turns_at(special: SpecialPoint) -> bool:
    """Whether the continuation parameter turns at a branch point along the branch walked: a pitchfork's side branch."""
    return bool(special.directions) and abs(special.directions[0].scalars[0]) < 1e-3


def _same_point(fold: Located, branch_point: Located) -> bool:
    """A pitchfork met along its side branch is a branch point at which the parameter turns: not a fold."""
    if not branch_point.special.directions:
        return abs(fold.fraction - branch_point.fraction) < 0.05
    return turns_at(branch_point.special) or (
        fold.special.status is Status.BRACKETED and abs(fold.fraction - branch_point.fraction) < 0.05
    )


def _locate_fold(segment: Segment, options: TraceOptions) -> Located:
    a, b = segment.left.fold_test, segment.right.fold_test
    guess = a / (a - b)
    found = solve_fold(segment.colloc, segment.interpolate(guess), segment.direction(guess))
    spent, bracket = found.iterations, (0.0, 1.0)
    if not (found.converged and segment.holds(found.state)):
        bracket, x, t, more = _bisect(segment, options, lambda frame: frame.fold_test)
        found = solve_fold(segment.colloc, x, t)
        spent += more + found.iterations
        if not (found.converged and segment.holds(found.state)):
            found = replace(found, converged=False, state=x)
    return _record(segment, "fold", found, (a, b), bracket, spent, ())


def _locate_branch_point(segment: Segment, options: TraceOptions) -> Located:
    (sa, la), (sb, lb) = segment.left.branch_test, segment.right.branch_test
    top = max(la, lb)
    a, b = sa * np.exp(la - top), sb * np.exp(lb - top)
    guess = float(np.clip(a / (a - b), 0.05, 0.95))
    tangent = segment.direction(guess)
    found = solve_branch_point(segment.colloc, segment.interpolate(guess), tangent)
    spent, bracket = found.iterations, (0.0, 1.0)
    if not (found.converged and segment.holds(found.state)):
        bracket, x, tangent, more = _bisect(segment, options, lambda frame: frame.branch_test[0])
        found = solve_branch_point(segment.colloc, x, tangent)
        spent += more + found.iterations
        if not (found.converged and segment.holds(found.state)):
            found = replace(found, converged=False, state=x)
    directions: tuple[Columns, ...] = (tangent,)
    if found.converged:
        directions = branch_directions(segment.colloc, found, tangent)
    return _record(segment, "branch point", found, (float(a), float(b)), bracket, spent, directions)


def _record(
    segment: Segment, kind: str, found: Augmented, tests: tuple[float, float], bracket: tuple[float, float], spent: int,
    directions: tuple[Columns, ...],
) -> Located:  # fmt: skip
    fraction, _ = segment.position(found.state)
    fraction = float(np.clip(fraction, 0.0, 1.0))
    at = tuple(segment.start + f * segment.step for f in bracket)
    special = SpecialPoint(
        kind, segment.colloc.solution(found.state, segment.right.error), segment.start + fraction * segment.step,
        Status.CONVERGED if found.converged else Status.BRACKETED, (at[0], at[1]), tests, residual=found.residual,
        curvature=float(found.form[0, 0]) if kind == "fold" else float("nan"), directions=directions,
        free=tuple(segment.colloc.bvp.parameter_names[i] for i in segment.colloc.free), scale=segment.colloc.scale,
    )  # fmt: skip
    return Located(special, fraction, spent)


def _bisect(segment: Segment, options: TraceOptions, test, cuts: int = 14):  # type: ignore[no-untyped-def]
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


def _changes(segment: Segment, name: str, value: float) -> bool:
    a, b = (segment.colloc.observable_row(name, f.x)[0] - value for f in (segment.left, segment.right))
    return a * b < 0 or (b == 0.0 and a != 0.0)


def _locate_zero(segment: Segment, name: str, value: float, options: TraceOptions) -> Located:
    colloc = segment.colloc
    a, b = (colloc.observable_row(name, f.x)[0] - value for f in (segment.left, segment.right))
    guess = a / (a - b)
    result = newton(colloc, segment.interpolate(guess), [fixed(name, value)(colloc)], options.newton)
    converged = result.converged and segment.holds(result.state)
    state = result.state if converged else segment.interpolate(guess)
    found = Augmented(converged, state, (), np.full((1, 1), np.nan), result.estimate, len(result.corrections))
    return _record(segment, f"zero of {name}", found, (a, b), (0.0, 1.0), found.iterations, ())
