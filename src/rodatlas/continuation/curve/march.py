"""Pseudo-arclength continuation: the steps along a curve in one direction, the same for branches and for loci."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Generic, TypeVar

import numpy as np

from rodatlas.continuation.curve.bounds import Crossing, are_finite, crossed
from rodatlas.continuation.curve.closing import Arc, End
from rodatlas.continuation.curve.doubt import Doubt, ErrorWatch
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.results.branch import EndReason, Point, SpecialPoint
from rodatlas.continuation.results.locus import LocusEvent, LocusPoint
from rodatlas.continuation.results.verification import Discrepancy

F = TypeVar("F", bound=End)
A = TypeVar("A", bound=Arc)
P = TypeVar("P", Point, LocusPoint)
S = TypeVar("S", SpecialPoint, LocusEvent)


@dataclass(frozen=True)
class Step(Generic[P, S]):
    """What one step yields: the special points passed, then the point reached."""

    point: P
    special: tuple[S, ...] = ()
    discrepancy: Discrepancy | None = None
    repeated: bool = False


@dataclass(frozen=True)
class Corrected(Generic[F]):
    """What Newton's method found: sizes of its corrections, and how to make the frame of the state."""

    corrections: Sequence[float]
    frame: Callable[[], F]


@dataclass(frozen=True)
class Trial(Generic[A]):
    """A step that was corrected, what Newton's method needed for it, and whether it was cut to end on a bound."""

    arc: A
    step: float
    iterations: int
    first_correction: float
    at_bound: bool = False


class March(ABC, Generic[F, A, P, S]):
    """Follows a curve from a frame; iterate over it, then read `end`, and `failure` of Newton's method if that is why.

    Iteration may be broken off and taken up again. Branches and loci differ in five methods: how a step is corrected,
    the arc that it makes, how a bound is met exactly, what is passed on the way, and how the mesh follows.

    Parameters
    ----------
    density : where the mesh of a frame wants points (N,).
    arclength : of the start.
    """

    on_bound: ClassVar[float]  # distance from a bound, relative to it or to one, within which a point lies on it

    def __init__(self, frame: F, options: TraceOptions, density: Callable[[F], np.ndarray], arclength: float = 0.0):
        self.start, self.frame, self.options = frame, frame, options
        self.end: EndReason | None = None
        self.failure: NewtonCode | None = None
        self._step = options.step.initial
        self._count = 0
        self._density = density
        self._watch = ErrorWatch(options.mesh, frame.colloc, frame.error, density(frame), arclength)

    @abstractmethod
    def _corrected(self, step: float) -> Corrected[F] | None:
        """Newton from the predicted state; None when it fails."""

    @abstractmethod
    def _arc(self, frame: F, cosine: float) -> A | None:
        """The arc from the present frame, with the cosine of its turn; None where it leads to another curve."""

    @abstractmethod
    def _landed(self, arc: A, crossing: Crossing) -> A | None:
        """The arc up to the point exactly at a bound; None when Newton fails."""

    @abstractmethod
    def _taken(self, trial: Trial[A], tried: float, longest: float) -> Step[P, S] | None:
        """Search the arc for special points and go to its end; None when a shorter step should tell more.

        It may set `end`, with a step to a last point or without. `tried` is the step tried first, `longest` the first
        of those since that could be corrected.
        """

    @abstractmethod
    def _adapt(self) -> None:
        """Let the mesh follow, and keep the error in mind; it may set `end`."""

    @property
    def doubts(self) -> list[Doubt]:
        """Where points may miss the tolerance."""
        return self._watch.doubts

    def __iter__(self) -> Iterator[Step[P, S]]:
        while self.end is None:
            if self._watch.is_due(self.frame.colloc, self._density(self.frame)):
                self._adapt()
            taken = self._advance() if self.end is None else None
            if taken is None:
                return
            self._count += 1
            self._watch.stepped()
            if self.end is None and self._count >= self.options.max_points:
                self.end = EndReason.POINT_LIMIT
            if self.options.on_point is not None:
                self.options.on_point(taken.point)
            yield taken

    def _advance(self) -> Step[P, S] | None:
        """Take a step, halved until it is accepted; None, and `end` says why, when there is none."""
        control = self.options.step
        step = tried = self._step
        longest = 0.0
        while step >= control.minimum and self.end is None:
            trial = self._attempt(step)
            if trial is not None:
                longest = longest or step
                taken = self._taken(trial, tried, longest)
                if taken is not None:
                    self._step = control.next_step(step, trial.first_correction, taken.point.iterations)
                    return replace(taken, repeated=step < longest)
            step *= 0.5
        self.end = self.end or EndReason.MIN_STEP
        return None

    def _attempt(self, step: float) -> Trial[A] | None:
        """Correct a step, up to the first bound on it; None to try a smaller one or, when `end` is set, to stop."""
        control, here = self.options.step, self.frame
        found = self._corrected(step)
        if found is None or sum(found.corrections) > control.max_correction * step:
            return None
        frame = found.frame()
        cosine = here.colloc.inner(frame.tangent, here.tangent)
        arc = self._arc(frame, cosine) if cosine >= control.min_cosine else None
        if arc is None:
            return None
        if not are_finite(frame.colloc, (*self.options.bounds, *self.options.zeros, *self.options.extrema), frame.x):
            self.failure = NewtonCode.NOT_FINITE
            return None
        work = len(found.corrections), found.corrections[0]
        passed = self._crossed(frame)
        if not passed:
            return Trial(arc, step, *work)
        if passed[0][0] <= 0.0:  # the present point lies on a bound
            self.end = EndReason.RANGE
            return None
        for crossing in passed:
            landed = self._landed(arc, crossing)
            if landed is not None and not self._crossed(landed.right):
                return Trial(landed, step, *work, at_bound=True)
        return None

    def _crossed(self, frame: End) -> list[Crossing]:
        """Bounds between the present frame and another."""
        return crossed(frame.colloc, self.options.bounds, self.frame.x, frame.x, self.on_bound)
