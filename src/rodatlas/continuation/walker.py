"""Pseudo-arclength continuation as an iterator over the points of one branch, in one direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.collocation import Scale, add
from rodatlas.continuation.events import Located, Segment, locate_events, turns_at
from rodatlas.continuation.frame import Frame, adapted, with_tests
from rodatlas.continuation.newton import NewtonCode, fixed, newton, plane
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.results import Discrepancy, EndReason, Point, SpecialPoint


@dataclass(frozen=True)
class Step:
    """What one step of a walker yields: the special points passed, then the point reached."""

    point: Point
    special: tuple[SpecialPoint, ...] = ()
    discrepancy: Discrepancy | None = None


class Walker:
    """Follows a branch from a frame; iterate over it, then read `end` and `newton_iterations`.

    Parameters
    ----------
    frame : Frame
        start, see :func:`rodatlas.continuation.frame.first_frame`.
    options : TraceOptions
    """

    def __init__(self, frame: Frame, options: TraceOptions):
        self.options = options
        self.start = frame
        self.frame = frame
        self.end: EndReason | None = None
        self.failure: NewtonCode | None = None
        self.newton_iterations = 0
        self.arclength = 0.0
        self._step = options.step.initial
        self._folds = 0
        self._count = 0

    @property
    def scale(self) -> Scale:
        return self.start.colloc.scale

    def first_point(self) -> Point:
        """The start itself as a point."""
        return self._point(self.start, 0.0, 0, 0.0)

    def __iter__(self) -> Iterator[Step]:
        last = self.first_point()
        while self.end is None:
            step = self._advance(last)
            if step is None:
                return
            last = step.point
            if self.options.on_point is not None:
                self.options.on_point(last)
            yield step
            self._count += 1
            if self.end is None and self._count >= self.options.max_points:
                self.end = EndReason.POINT_LIMIT
            if self.end is None and self._count % self.options.mesh.every == 0:
                self._adapt()

    # -- one step -------------------------------------------------------------------------------------------------

    def _advance(self, last: Point) -> Step | None:
        """Take a step that Newton, the tangent and the bookkeeping accept; None when there is none."""
        control = self.options.step
        step = self._step
        while True:
            if step < control.minimum:
                self.end = EndReason.MIN_STEP
                return None
            tried = self._correct(step)
            if tried is None:
                step *= 0.5
                continue
            frame, length, iterations, first, outside = tried
            segment = Segment(self.frame, frame, length, self.arclength)
            events = locate_events(segment, self.options)
            self.newton_iterations += sum(e.iterations for e in events)
            point = self._point(frame, self.arclength + length, iterations, length)
            discrepancy = self._unexplained(last, point, events)
            crowded = sum(not e.special.kind.startswith("zero") for e in events) > 1
            if (discrepancy or crowded) and step > 64 * control.minimum and step > 1e-3 * control.maximum:
                step *= 0.5
                continue
            self._step = control.next_step(length if not outside else step, first, iterations)
            return self._accept(segment, last, point, events, discrepancy, outside)

    def _correct(self, step: float) -> tuple[Frame, float, int, float, bool] | None:
        """Predict and correct; (frame, step, iterations, first correction, at a bound) or None to try a smaller step."""
        control, here = self.options.step, self.frame
        guess = here.predict(step)
        result = newton(here.colloc, guess, [plane(here.colloc, here.tangent, guess)], self.options.newton)
        self.newton_iterations += len(result.corrections)
        if not result.converged or result.factorization is None:
            self.failure = result.code
            return None
        if sum(result.corrections) > control.max_correction * step:
            return None
        frame = here.reached(result.state, result.factorization, step)
        if here.colloc.inner(frame.tangent, here.tangent) < control.min_cosine:
            return None
        first = result.corrections[0]
        crossed = self._crossed_bound(frame)
        if crossed is not None:
            landed = self._land(frame, step, *crossed)
            return None if landed is None else (*landed, len(result.corrections), first, True)
        return frame, step, len(result.corrections), first, False

    def _crossed_bound(self, frame: Frame) -> tuple[str, float] | None:
        for name, (low, high) in self.options.bounds.items():
            value = frame.colloc.observable_row(name, frame.x)[0]
            before = frame.colloc.observable_row(name, self.frame.x)[0]
            tiny = 1e-12 * max(1.0, abs(high - low))
            if value > high + tiny and value > before:
                return name, high
            if value < low - tiny and value < before:
                return name, low
        return None

    def _land(self, frame: Frame, step: float, name: str, bound: float) -> tuple[Frame, float] | None:
        """Solve for the point exactly at a bound."""
        colloc = frame.colloc
        a, b = (colloc.observable_row(name, f.x)[0] for f in (self.frame, frame))
        segment = Segment(self.frame, frame, step, 0.0)
        fraction = float(np.clip((bound - a) / (b - a), 0.0, 1.0))
        result = newton(colloc, segment.interpolate(fraction), [fixed(name, bound)(colloc)], self.options.newton)
        self.newton_iterations += len(result.corrections)
        if not result.converged or not segment.holds(result.state):
            return None
        at = replace(self.frame, x=result.state)
        normal = self.frame.tangent
        final = newton(colloc, at.x, [plane(colloc, normal, at.x)], self.options.newton)
        if not final.converged or final.factorization is None:
            return None
        length = colloc.norm(add(result.state, (-1.0, self.frame.x)))
        return self.frame.reached(result.state, final.factorization, max(length, 1e-14)), max(length, 1e-14)

    # -- bookkeeping ----------------------------------------------------------------------------------------------

    def _unexplained(self, last: Point, point: Point, events: list[Located]) -> Discrepancy | None:
        """Each fold or branch point changes the index by one: compare.

        A pitchfork met along its side branch counts twice, because the branch also turns there.
        """
        if last.index is None or point.index is None:
            return None
        kinds = tuple(e.special.kind for e in events if not e.special.kind.startswith("zero"))
        change = abs(point.index - last.index)
        expected = len(kinds) + sum(turns_at(e.special) for e in events)
        if change <= expected and (change - expected) % 2 == 0:
            return None
        name = point.solution.parameter_names[int(self.frame.colloc.free[0])]
        return Discrepancy(
            (last.arclength, point.arclength), (last.index, point.index), kinds,
            (last.solution[name], point.solution[name]),
        )  # fmt: skip

    def _accept(
        self, segment: Segment, last: Point, point: Point, events: list[Located], discrepancy: Discrepancy | None,
        outside: bool,
    ) -> Step:  # fmt: skip
        special = [replace(e.special, index=(last.index, point.index)) for e in events]
        self.frame = segment.right
        self.arclength = point.arclength
        for i, item in enumerate(special):
            self._folds += item.kind == "fold"
            if self.options.stop_at is not None and self.options.stop_at(item, point):
                self.end = EndReason.BRANCH_POINT
            elif self.options.max_folds is not None and self._folds > self.options.max_folds:
                self.end = EndReason.FOLD_LIMIT
            if self.end is not None:
                return Step(self._stop_on(item, last), tuple(special[: i + 1]))
        if outside:
            self.end = EndReason.RANGE
        elif self._closes(segment):
            self.end = EndReason.CLOSED
            start = self.first_point()
            point = replace(start, arclength=point.arclength)
        return Step(point, tuple(special), discrepancy)

    def _stop_on(self, special: SpecialPoint, last: Point) -> Point:
        """The special point as last point of the branch."""
        return replace(last, solution=special.solution, arclength=special.arclength, fold_test=0.0, branch_test=0.0)

    def _closes(self, segment: Segment) -> bool:
        """Whether the start lies on the segment just walked, passed in the same direction."""
        start, here = self.start, segment.left
        if self._count < 3 or np.abs(start.x.scalars - here.x.scalars).max() > 2 * segment.step:
            return False
        ends = np.abs(start.x.mesh[[0, -1]] - here.x.mesh[[0, -1]]).max()
        if ends > 20 * segment.step:
            return False
        x0 = start.colloc.interpolate(start.x, segment.colloc)
        t0 = start.colloc.interpolate(start.tangent, segment.colloc)
        fraction, off = segment.position(x0)
        return 0.0 < fraction <= 1.0 and off < 0.05 and segment.colloc.inner(t0, segment.direction(fraction)) > 0.95

    def _point(self, frame: Frame, arclength: float, iterations: int, step: float) -> Point:
        solution = frame.colloc.solution(frame.x, frame.error)
        index = self.options.index(solution) if self.options.index is not None else None
        return Point(
            solution, arclength, frame.tangent.scalars.copy(), frame.fold_test, frame.branch_test[0], index, iterations,
            step,
        )  # fmt: skip

    def _adapt(self) -> None:
        self.frame, spent = adapted(self.frame, self.options)
        self.newton_iterations += spent
        control = self.options.mesh
        at_limit = len(self.frame.colloc.step) >= control.intervals[1] and not control.is_fixed_size
        if at_limit and self.frame.error > 10 * control.tolerance:
            self.end = EndReason.MESH_LIMIT


def settled(frame: Frame, options: TraceOptions, passes: int = 6) -> Frame:
    """Adapt the mesh at one point until its size and error have settled; the continuation parameter is held."""
    name = frame.colloc.bvp.parameter_names[frame.colloc.free[0]]
    value = float(frame.colloc.parameters(frame.x)[frame.colloc.free[0]])
    for _ in range(passes):
        before = len(frame.colloc.step)
        frame, _ = adapted(frame, options)
        if options.mesh.is_fixed_size or (
            len(frame.colloc.step) == before and frame.error <= options.mesh.tolerance
        ):
            break
    held = newton(frame.colloc, frame.x, [fixed(name, value)(frame.colloc)], options.newton)
    return with_tests(replace(frame, x=held.state) if held.converged else frame)
