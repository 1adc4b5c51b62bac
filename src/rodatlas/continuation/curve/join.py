"""The two halves of a branch, walked from one start: what they find, kept through errors and joined."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from numbers import Integral
from typing import Any

import numpy as np

from rodatlas.continuation.curve.events import UNCHANGED
from rodatlas.continuation.curve.march import Step
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame
from rodatlas.continuation.curve.resolve import doubted
from rodatlas.continuation.curve.segment import AT_START
from rodatlas.continuation.curve.walker import Walker
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import Branch, EndReason, Point, SpecialPoint, Status
from rodatlas.continuation.results.verification import ROUND_OFF, Discrepancy, Verification

COINCIDE = 1e-8  # arclength between simple branch points, below which there is one


class Guard:
    """Keeps the first exception of a user's functions, so that the step in which it comes is finished and kept."""

    def __init__(self) -> None:
        self.error: BaseException | None = None

    def options(self, options: TraceOptions) -> TraceOptions:
        """The same with guarded functions; `on_point` is left to whoever collects the points."""
        index = self._guarded(_integer(options.index), None)
        stop_at = self._guarded(options.stop_at, True)
        return replace(options, index=index, stop_at=stop_at, on_point=None)

    def _guarded(self, function: Callable[..., Any] | None, otherwise: Any) -> Callable[..., Any] | None:
        if function is None:
            return None

        def guarded(*arguments: Any) -> Any:
            if self.error is None:
                try:
                    return function(*arguments)
                except BaseException as error:
                    self.error = error
            return otherwise

        return guarded

    def check(self) -> None:
        """Raise what was kept."""
        if self.error is not None:
            raise self.error


def _integer(index: Callable[[Solution], Any] | None) -> Callable[[Solution], int | None] | None:
    """The caller's index function, its result checked."""
    if index is None:
        return None

    def checked(solution: Solution) -> int | None:
        value = index(solution)
        if value is not None and not isinstance(value, Integral):
            raise ValueError(f"index: expected an integer or None, got {value!r}")
        return None if value is None else int(value)

    return checked


class Half:
    """The steps of one walker, and why they end."""

    def __init__(self, walker: Walker, guard: Guard, on_point: Callable[[Point], None] | None):
        self.walker, self.steps = walker, list[Step[Point, SpecialPoint]]()
        self._guard, self._on_point = guard, on_point
        self.end = EndReason.INTERRUPTED

    def walk(self) -> None:
        """Take all steps; whatever happens, those that were finished stay."""
        guard = self._guard
        guard.check()
        for step in self.walker:
            self.steps.append(step)
            guard.check()
            if self._on_point is not None:
                self._on_point(step.point)
        guard.check()
        self.end = self.walker.end or EndReason.STOPPED
        while self.failure is NewtonCode.NOT_FINITE and self.steps and not self._last_is_finite():
            self.steps.pop()  # its last correction left the domain of the right-hand side

    def _last_is_finite(self) -> bool:
        solution, colloc = self.steps[-1].point.solution, self.walker.frame.colloc
        there = Collocation.at(colloc.bvp, solution, list(colloc.free), colloc.scale, colloc.backend)
        return is_finite(there, there.state(solution))

    @property
    def failure(self) -> NewtonCode | None:
        """Why Newton failed last, where that is the end."""
        return self.walker.failure if self.end is EndReason.MIN_STEP else None


def joined(frame: Frame, options: TraceOptions, forward: Half, backward: Half | None, start: EndReason) -> Branch:
    """The branch from its two halves; `start` is the first end's reason when there is one half only."""
    bvp = frame.colloc.bvp
    names = tuple(bvp.parameter_names[i] for i in frame.colloc.free)
    points, special, discrepancies = _collect(forward)
    points = [forward.walker.first_point(), *points]
    first, failure, spent = start, None, forward.walker.newton_iterations
    if backward is not None:
        more, also, doubts = _collect(backward)
        points = [flipped(p) for p in reversed(more)] + points
        also = [flipped_special(x) for x in reversed(also)]
        special = _each_once(also, special)
        discrepancies = [flipped_discrepancy(d) for d in reversed(doubts)] + discrepancies
        first, failure = backward.end, backward.failure
        spent += backward.walker.newton_iterations
    unfolding = max(half.walker.unfolding for half in (forward, backward) if half is not None)
    repeated = sum(s.repeated for half in (forward, backward) if half is not None for s in half.steps)
    return Branch(
        names, tuple(points), tuple(special), (first, forward.end), tuple(discrepancies), spent,
        (failure, forward.failure), {"problem": bvp.name, **options.settings()},
        replace(verified(points, special, discrepancies, repeated), unfolding=unfolding),
    )  # fmt: skip


def _each_once(backward: list[SpecialPoint], forward: list[SpecialPoint]) -> list[SpecialPoint]:
    """The special points of both halves; one at the start, which both report, with the index on both sides."""
    both = [next((y for y in forward if is_same(x, y)), x) for x in backward]
    joined = [replace(x, index=(x.index[0], y.index[1])) for x, y in zip(backward, both, strict=True)]
    return joined + [x for x in forward if not any(x is y for y in both)]


def verified(
    points: Sequence[Point], special: Sequence[SpecialPoint], discrepancies: Sequence[Discrepancy], repeated: int
) -> Verification:
    """The record of what was checked."""
    known = [p.index is not None for p in points]
    events = [x.status for x in special if not x.is_zero]
    weakness = [p.weakness for p in points if np.isfinite(p.weakness)]
    return Verification(
        len(points) - 1, sum(a and b for a, b in pairwise(known)), repeated,
        converged=sum(s is Status.CONVERGED for s in events), bracketed=sum(s is Status.BRACKETED for s in events),
        least_singular=float(min(weakness, default=np.nan)),
        untrusted=tuple(d.bracket for d in discrepancies if d.reason == ROUND_OFF),
    )  # fmt: skip


def _collect(half: Half) -> tuple[list[Point], list[SpecialPoint], list[Discrepancy]]:
    steps = half.steps
    points, special = doubted(
        [s.point for s in steps], [x for s in steps for x in s.special], half.walker.doubts
    )  # fmt: skip
    found = [s.discrepancy for s in steps if s.discrepancy]
    unseen = [d for d in half.walker.unseen if all(d.bracket != other.bracket for other in found)]
    return points, special, sorted([*found, *unseen], key=lambda d: d.bracket)


def is_same(one: SpecialPoint, two: SpecialPoint) -> bool:
    """Whether two walks from one place report one special point there.

    Both see what an observable does there, a multiple branch point, and a simple one or a fold right at the start.
    Simple branch points that do not coincide are two, and so are folds that bend to different sides.
    """
    distance = abs(one.arclength - two.arclength)
    if one.kind != two.kind or distance > AT_START:
        return False
    if one.kind == "fold":
        return one.curvature * two.curvature > 0
    if one.is_singular:
        return one.multiplicity == two.multiplicity and (one.multiplicity > 1 or distance < COINCIDE)
    values = one.solution[one.name], two.solution[two.name]
    return bool(np.isclose(*values, rtol=UNCHANGED, atol=UNCHANGED))


def flipped(p: Point) -> Point:
    """A point of the backward half, seen along the forward direction."""
    return replace(p, arclength=-p.arclength, tangent=-p.tangent, fold_test=-p.fold_test, branch_test=-p.branch_test)


def flipped_special(x: SpecialPoint) -> SpecialPoint:
    sign = 1.0 if x.is_zero else -1.0
    if x.multiplicity > 1:  # rays: forward and backward change places
        directions, nearby = ((*v[:2][::-1], *v[2:]) for v in (x.directions, x.nearby))
    else:
        directions, nearby = (*(scaled(d, -1.0) for d in x.directions[:1]), *x.directions[1:]), x.nearby
    return replace(
        x, arclength=-x.arclength, bracket=(-x.bracket[1], -x.bracket[0]), tests=(sign * x.tests[1], sign * x.tests[0]),
        index=(x.index[1], x.index[0]), directions=directions, nearby=nearby,
    )  # fmt: skip


def flipped_discrepancy(d: Discrepancy) -> Discrepancy:
    return Discrepancy((-d.bracket[1], -d.bracket[0]), d.index[::-1], d.events[::-1], d.parameter[::-1], d.reason)


def is_finite(colloc: Collocation, x: Columns) -> bool:
    """Whether the equations can be evaluated at x."""
    with np.errstate(all="ignore"):
        return colloc.linearize(x).is_finite
