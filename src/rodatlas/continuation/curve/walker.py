"""The steps along a branch: what is passed on the way, and whether the bookkeeping adds up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from rodatlas.continuation.curve.bounds import Crossing
from rodatlas.continuation.curve.chord import reached
from rodatlas.continuation.curve.closing import passes
from rodatlas.continuation.curve.events import (
    explains,
    locate_events,
    unresolved,
)
from rodatlas.continuation.curve.events_at_start import Beginning, singular_start
from rodatlas.continuation.curve.march import Corrected, March, Step, Trial
from rodatlas.continuation.curve.modes import adapted, measured_at, with_resolved_mode
from rodatlas.continuation.curve.multiple_events import told_apart
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame
from rodatlas.continuation.curve.segment import AT_START, EDGE, Located, Segment
from rodatlas.continuation.curve.settle import across, settled
from rodatlas.continuation.discrete.mesh import ACCEPTED, monitor
from rodatlas.continuation.discrete.newton import fixed, newton, plane
from rodatlas.continuation.discrete.vectors import add, arc_length, arc_over_sine
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import EndReason, Point, SpecialPoint
from rodatlas.continuation.results.verification import NEARLY_SINGULAR, ROUND_OFF, UNRESOLVED_MODE, Discrepancy
from rodatlas.continuation.symmetric.isotropy import with_symmetry

FORGETS = 0.8  # of the usual step, with every step taken
VAGUE = 0.15  # relative error of the distance at which a branch point is seen, at most


class Walker(March[Frame, Segment, Point, SpecialPoint]):
    """Follows a branch from a frame; iterate over it, then read `end`, `failure`, `doubts` and `unseen` (points and
    intervals that the mesh did not resolve) and `newton_iterations`. `last` is the point reached.

    Parameters
    ----------
    frame : Frame
        start, see :func:`rodatlas.continuation.curve.point.first_frame`.
    options : TraceOptions
    arclength : float
        of the start.
    looks_back : whether branch points seen behind have to be among those located; one that is not may also be the
        shape of the curve, which only a walk with much shorter steps can tell.
    """

    on_bound = 1e-12

    def __init__(self, frame: Frame, options: TraceOptions, arclength: float = 0.0, looks_back: bool = True):
        super().__init__(frame, options, _density, arclength)
        self._looks_back = looks_back
        self.newton_iterations = 0
        self.unfolding = 0.0  # largest unfolding parameter of phase conditions
        self._first = self._point(frame, arclength, 0, 0.0)
        self.last = self._first
        self._usual = 0.0  # steps that were tried of late: near a multiple point they get shorter and shorter
        self._folds = 0
        self._early: set[str] = set()
        self._passed: SpecialPoint | None = None
        self.unseen: list[Discrepancy] = []
        self._window = [self._first]  # points since the mesh was looked at
        self._singular: list[SpecialPoint] = []  # branch points passed
        self._seen: list[tuple[float, list[Discrepancy]]] = []  # places that were seen behind, and where they would be

    def first_point(self) -> Point:
        """The start itself as a point."""
        return self._first

    def __iter__(self) -> Iterator[Step[Point, SpecialPoint]]:
        yield from super().__iter__()
        self._measure_end()

    # -- one step -------------------------------------------------------------------------------------------------

    def _corrected(self, step: float) -> Corrected[Frame] | None:
        here, settings = self.frame, self.options.newton
        guess = here.predict(step)
        result = newton(here.colloc, guess, [plane(here.colloc, here.tangent, guess)], settings, settings.chord)
        self.newton_iterations += len(result.corrections)
        if not result.converged or result.factorization is None:
            self.failure = result.code
            return None
        self.failure = None  # what follows is refused by step control
        return Corrected(result.corrections, partial(reached, here, result, step))

    def _arc(self, frame: Frame, cosine: float) -> Segment:
        here = self.frame
        # the length of a circular arc with the same projection on the tangent
        length = here.colloc.inner(here.tangent, add(frame.x, (-1.0, here.x))) * arc_over_sine(cosine)
        return Segment(here, replace(frame, previous_step=length), length, self.last.arclength)

    def _landed(self, arc: Segment, crossing: Crossing) -> Segment | None:
        here, colloc, (fraction, name, bound) = arc.left, arc.colloc, crossing
        result = newton(colloc, arc.interpolate(fraction), [fixed(name, bound)(colloc)], self.options.newton)
        self.newton_iterations += len(result.corrections)
        if not result.converged:
            self.failure = result.code
        if not result.converged or not arc.holds(result.state):
            return None
        fac = colloc.factor(colloc.linearize(result.state), [colloc.row(here.tangent)])
        if fac.sign == 0.0:
            return None
        landed = here.reached(result.state, fac, arc.step)
        chord = colloc.norm(add(result.state, (-1.0, here.x)))
        length = max(arc_length(chord, colloc.inner(landed.tangent, here.tangent)), 1e-14)
        return replace(arc, right=replace(landed, previous_step=length), step=length)

    def _taken(self, trial: Trial[Segment], tried: float, longest: float) -> Step[Point, SpecialPoint] | None:
        segment, step = trial.arc, trial.step
        events = locate_events(segment, self.options)
        self.newton_iterations += sum(e.iterations for e in events)
        finest = 64 * self.options.step.minimum
        self._usual = max(self._usual, longest)
        is_long = step > max(finest, self._usual / 8)
        keep_off = step > max(finest, self._usual / 100) and not trial.at_bound
        verdict = told_apart(segment, events, self.options, self._passed, is_long, keep_off)
        events, known = verdict.events, verdict.known
        point = self._point(segment.right, segment.start + segment.step, trial.iterations, segment.step)
        first = singular_start(segment, self.options, events) if self._count == 0 else Beginning()
        discrepancy = None if first.events else self._unexplained(segment, point, events)  # there an index is round-off
        doubtful = (
            verdict.shorten or discrepancy or first.doubtful or unresolved(segment, events, self.options, tried, known)
        )
        if doubtful and step > finest:
            return None
        if doubtful and discrepancy is None and not known and self._nearly_singular(segment, events):
            discrepancy = self._record(point, (), NEARLY_SINGULAR)
        if any(e.is_round_off for e in events):
            events = [e for e in events if not e.is_round_off]
            discrepancy = self._record(point, tuple(e.special.kind for e in events if e.flips), ROUND_OFF)
        self._usual *= FORGETS
        taken = self._accept(segment, point, first.events, events, discrepancy, trial.at_bound)
        self.last = taken.point
        self._window.append(taken.point)
        return taken

    # -- bookkeeping ----------------------------------------------------------------------------------------------

    def _unexplained(self, segment: Segment, point: Point, events: list[Located]) -> Discrepancy | None:
        """Each fold or simple branch point changes the index by one (none where the parameter turns at it): compare.

        A branch point of multiplicity d changes it by d at most.
        """
        last = self.last
        if last.index is None or point.index is None:
            return None
        if explains(segment, [e for e in events if not e.is_round_off], point.index - last.index):
            return None
        return self._record(point, tuple(e.special.kind for e in events if e.flips))

    def _nearly_singular(self, segment: Segment, events: list[Located]) -> bool:
        """Whether the shortest step still seems to pass an even number of branch points, and none was located."""
        watched = "branch point" in self.options.locate
        return watched and segment.may_be_singular_twice and not any(e.special.kind == "branch point" for e in events)

    def _record(self, point: Point, kinds: tuple[str, ...], reason: str = "") -> Discrepancy:
        return self._between(self.last, point, kinds, reason)

    def _between(self, one: Point, two: Point, kinds: tuple[str, ...], reason: str) -> Discrepancy:
        name = one.solution.parameter_names[int(self.frame.colloc.free[0])]
        return Discrepancy(
            (one.arclength, two.arclength), (one.index, two.index), kinds, (one.solution[name], two.solution[name]),
            reason,
        )  # fmt: skip

    def _accept(
        self, segment: Segment, point: Point, first: tuple[Located, ...], events: list[Located],
        discrepancy: Discrepancy | None, at_bound: bool,
    ) -> Step[Point, SpecialPoint]:  # fmt: skip
        closing = None if at_bound else self._closing(segment)
        if closing is not None:  # what lies beyond the start was found when the walk began
            events = [e for e in events if e.fraction <= closing and not self._is_first(e, closing)]
        events = [*first, *events]
        if self._count == 0:
            self._early = {e.special.kind for e in events if e.fraction < 1e-6}
        bvp, before = segment.colloc.bvp, [None] * len(first) + [self.last.index] * (len(events) - len(first))
        special = [
            with_symmetry(bvp, replace(e.special, index=(i, point.index))) for i, e in zip(before, events, strict=True)
        ]
        passed = any(item.kind == "branch point" for item in special)
        weakness = abs(segment.right.weakness_before) * (-1.0 if passed else 1.0)
        self.frame = replace(segment.right, weakness_before=weakness)
        for i, item in enumerate(special):
            self._folds += item.kind == "fold" and i >= len(first)  # a run does not end where it starts
            if item.kind == "branch point":
                self._passed = item
                self._singular.append(item)
            near = self._count == 0 and not item.is_singular and item.arclength - segment.start < AT_START
            starts = near or i < len(first)
            if self.options.stop_at is not None and not starts and self.options.stop_at(item, point):
                self.end = EndReason.BRANCH_POINT if item.kind == "branch point" else EndReason.STOPPED
            elif self.options.max_folds is not None and self._folds > self.options.max_folds:
                self.end = EndReason.FOLD_LIMIT
            if self.end is not None:  # what lies beyond is not part of the branch
                met = replace(item, index=(self.last.index, None))
                return Step(self._stop_on(item), (*special[:i], met))
        if at_bound:
            self.end = EndReason.RANGE
        elif closing is not None:
            self.end = EndReason.CLOSED
            length = closing * segment.step
            point = replace(self._first, arclength=segment.start + length, iterations=point.iterations, step=length)
        return Step(point, tuple(special), discrepancy)

    def _is_first(self, event: Located, closing: float) -> bool:
        """Whether an event on the segment that closes the branch is one that was found right at its start."""
        return event.special.kind in self._early and closing - event.fraction < 1e-6

    def _stop_on(self, special: SpecialPoint) -> Point:
        """The special point as last point of the branch."""
        return replace(
            self.last, solution=special.solution, arclength=special.arclength, fold_test=0.0, branch_test=0.0,
            iterations=0, step=special.arclength - self.last.arclength,
        )  # fmt: skip

    def _closing(self, segment: Segment) -> float | None:
        """Fraction of the segment at which it passes the start again, in the same direction; else None."""
        start, here = self.start, segment.left
        if self._count < 3 or np.abs(start.x.mesh[[0, -1]] - here.x.mesh[[0, -1]]).max() > 20 * segment.step:
            return None

        def corrected(guess: Columns, normal: Columns) -> Columns | None:
            met = newton(segment.colloc, guess, [plane(segment.colloc, normal, guess)], self.options.newton)
            self.newton_iterations += len(met.corrections)
            return met.state if met.converged else None

        return passes(segment, start, corrected, self.options.mesh.tolerance)

    def _point(self, frame: Frame, arclength: float, iterations: int, step: float) -> Point:
        solution = frame.colloc.solution(frame.x, frame.error)
        self.unfolding = max(self.unfolding, frame.colloc.unfolding(frame.x))
        index = self.options.index(solution) if self.options.index is not None else None
        return Point(
            solution, arclength, frame.tangent.scalars.copy(), frame.fold_test, frame.branch_test[0], index, iterations,
            step, abs(frame.weakness),
        )  # fmt: skip

    def _adapt(self) -> None:
        """Let the mesh follow; where the error is more than a step may correct, or than is accepted, settle it here."""
        control, here = self.options.mesh, self.frame
        found = adapted(here, self.options, first=self._window[0] is self._first)
        self.newton_iterations += found.spent
        self._look_back(found.frame.expected)
        self._measured(found.error, found.resolved)
        self.frame = found.frame
        step_error = 0.1 * self.options.step.max_correction * self._step  # with more no step would be accepted
        if self.frame.error > min(step_error, ACCEPTED * control.tolerance):
            better = settled(here, self.options, (across,))
            self.newton_iterations += better.spent
            sign, log_det = better.frame.branch_test
            self.frame = replace(better.frame, branch_test=(here.branch_test[0] or sign, log_det))
            if here.with_mode or not found.resolved:
                self.frame, spent = with_resolved_mode(self.frame, self.options)
                self.newton_iterations += spent
            if better.missed in (EndReason.MESH_LIMIT, EndReason.UNREFINED):
                self.end = better.missed
        now = self.frame
        self._watch.moved(now.colloc, now.error, _density(now))

    def _look_back(self, expected: tuple[float, ...]) -> None:
        """Doubt the points of the last window where a branch point was seen behind them that was not located.

        Places at a distance are known to first order only. One that is no branch point, but the shape of the curve, is
        seen elsewhere at the next look; those close to the end of the window may lie ahead.
        """
        here = self.last.arclength
        for place, window in self._seen:
            if any(abs(here + d - place) < VAGUE * (here - place) for d in expected):
                self.unseen += window
        self._seen = []
        window = [self._between(a, b, (), UNRESOLVED_MODE) for a, b in pairwise(self._window)]
        known = [x for x in self._singular for _ in range(x.multiplicity)]
        back = here - self._window[0].arclength
        for distance in sorted(-d for d in expected if d < 0) if self._looks_back else ():
            if not EDGE * self.last.step < distance < (1 - VAGUE) * back:
                continue
            match = min(known, key=lambda x: abs(here - distance - x.arclength), default=None)
            if match is not None and _is_seen_at(match, distance, here - match.arclength):
                known.remove(match)
            else:
                self._seen.append((here - distance, window))

    def _measure_end(self) -> None:
        """Look at the last point too, for the mesh has followed since the last adaptation only so far."""
        for _, window in self._seen:  # no other look can clear these
            self.unseen += window
        if self._watch.is_behind(self.last.arclength):
            error, resolved = measured_at(self.frame, self.options)
            self.newton_iterations += 2
            self._measured(error, resolved)

    def _measured(self, error: float, resolved: bool) -> None:
        """Keep in mind where points or test functions may be wrong: since they were looked at last."""
        self._watch.measured(error, self.last.arclength)
        if not resolved and "branch point" in self.options.locate:
            self.unseen += [self._between(a, b, (), UNRESOLVED_MODE) for a, b in pairwise(self._window)]
        self._window = [self.last]


def _density(frame: Frame) -> np.ndarray:
    return monitor(frame.colloc, frame.x)


def _is_seen_at(point: SpecialPoint, distance: float, true: float) -> bool:
    """Whether a branch point may be what is seen at a distance; a mode that only touches zero is seen at half of it."""
    nearest = 0.5 if point.turns or point.multiplicity > 1 else 1.0
    return (nearest - VAGUE) * true < distance < (1 + VAGUE) * true
