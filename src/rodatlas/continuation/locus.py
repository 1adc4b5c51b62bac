"""Loci of folds and branch points in two parameters, with the special points on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rodatlas.continuation.collocation import add, free_indices
from rodatlas.continuation.locus_frame import LocusFrame, adapted, correct, first_frame
from rodatlas.continuation.locus_results import Locus, LocusEvent, LocusPoint
from rodatlas.continuation.locus_system import KINDS
from rodatlas.continuation.newton import NewtonCode
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import EndReason, SpecialPoint, Status
from rodatlas.continuation.trace import NotConverged


def follow_locus(
    bvp: BVP, start: SpecialPoint, free: Sequence[str], options: TraceOptions | None = None, *, both: bool = True
) -> Locus:
    """Follow a fold or branch point in two parameters.

    Parameters
    ----------
    start : a located fold or branch point.
    free : bvp.n_free + 1 names: the parameter in which it was found, the second one, then any inner ones.
    options : bounds, steps and mesh as for branches; `locate` and `index` are not used.
    both : follow both directions.

    Raises
    ------
    ValueError
        when the point is of another kind, or the names do not fit the problem.
    NotConverged
        when Newton does not converge from the start.
    """
    if start.kind not in KINDS:
        raise ValueError(f"start: expected a fold or a branch point, got a {start.kind}")
    names = list(dict.fromkeys(free))
    if len(names) != bvp.n_free + 1:
        raise ValueError(f"free: expected {bvp.n_free + 1} parameter names for a locus, got {list(free)}")
    options = options or TraceOptions()
    index = [bvp.parameter_index(name) for name in names]
    free_indices(bvp, [names[0], *names[2:]])
    frame = first_frame(bvp, start, index, options)
    if frame is None:
        raise NotConverged(NewtonCode.SLOW, f"start of the locus at {start!r}")
    forward = _Walk(start.kind, frame, options, tuple(names))
    forward.run()
    points, events, first = forward.points, forward.events, EndReason.START
    if both and forward.end is EndReason.CLOSED:
        first = EndReason.CLOSED
    elif both:
        backward = _Walk(start.kind, frame.reversed(), options, tuple(names))
        backward.run()
        points = [_flipped(p) for p in reversed(backward.points[1:])] + points
        events = [_flipped_event(e) for e in reversed(backward.events)] + events
        first = backward.end or EndReason.STOPPED
    return Locus(start.kind, tuple(names), tuple(points), tuple(events), (first, forward.end or EndReason.STOPPED))


class _Walk:
    """Pseudo-arclength continuation of a locus in one direction."""

    def __init__(self, kind: str, frame: LocusFrame, options: TraceOptions, names: tuple[str, ...]):
        self.kind, self.start, self.frame, self.options, self.names = kind, frame, frame, options, names
        self.arclength = 0.0
        self.end: EndReason | None = None
        self.points = [self._point(frame)]
        self.events: list[LocusEvent] = []

    def run(self) -> None:
        """Walk until there is a reason to end."""
        control, step = self.options.step, self.options.step.initial
        while self.end is None:
            tried = self._attempt(step)
            bound = self._crossed(tried[0]) if tried is not None else None
            landed = self._land(step, *bound) if bound is not None else None
            if tried is None or (bound is not None and landed is None):
                step *= 0.5
                self.end = EndReason.MIN_STEP if step < control.minimum else None
                continue
            frame, taken = landed or (tried[0], step)
            self.end = EndReason.RANGE if landed else None
            self._locate(frame, taken)
            self._accept(frame, taken)
            step = control.next_step(step, tried[1], frame.iterations)

    def _attempt(self, step: float) -> tuple[LocusFrame, float] | None:
        """Correct a step: the frame and the first correction; None when a smaller step is needed."""
        control, here = self.options.step, self.frame
        guess = here.predict(step)
        found = correct(self.kind, here, guess, here.tangent, self.options)
        if found is None:
            return None
        frame, corrections = found
        if sum(corrections) > control.max_correction * step:
            return None
        if here.colloc.inner(frame.tangent, here.tangent) < control.min_cosine:
            return None
        return replace(frame, previous=here.tangent, previous_step=step), corrections[0]

    def _accept(self, frame: LocusFrame, step: float) -> None:
        closing = self._closes(frame, step)
        self.frame = frame
        self.arclength += step
        self.points.append(self._point(frame))
        if self.end is None and closing:
            self.end = EndReason.CLOSED
        if self.end is None and len(self.points) > self.options.max_points:
            self.end = EndReason.POINT_LIMIT
        if self.end is None and (len(self.points) - 1) % self.options.mesh.every == 0:
            self.frame = adapted(self.kind, self.frame, self.options)

    def _point(self, frame: LocusFrame) -> LocusPoint:
        solution = frame.colloc.solution(frame.x, frame.error)
        return LocusPoint(solution, self.arclength, frame.tangent.scalars.copy(), frame.tests, frame.iterations)

    # -- bounds and closing ---------------------------------------------------------------------------------------

    def _crossed(self, frame: LocusFrame) -> tuple[str, float] | None:
        for name, (low, high) in self.options.bounds.items():
            before, value = (f.colloc.observable_row(name, f.x)[0] for f in (self.frame, frame))
            for bound, outward in ((low, -1.0), (high, 1.0)):
                if outward * (value - bound) > 1e-12 * max(1.0, abs(bound)) and outward * (value - before) > 0:
                    return name, bound
        return None

    def _land(self, step: float, name: str, bound: float) -> tuple[LocusFrame, float] | None:
        """The point exactly at a bound, by root finding along the step."""

        def value(frame: LocusFrame) -> float:
            return frame.colloc.observable_row(name, frame.x)[0] - bound

        return self._root(step, value)

    def _closes(self, frame: LocusFrame, step: float) -> bool:
        if len(self.points) < 4 or np.abs(self.start.x.scalars - frame.x.scalars).max() > 2 * step:
            return False
        x0 = self.start.colloc.interpolate(self.start.x, frame.colloc)
        t0 = self.start.colloc.interpolate(self.start.tangent, frame.colloc)
        ahead = frame.colloc.inner(add(frame.x, (-1.0, x0)), t0)
        off = frame.colloc.norm(add(frame.x, (-1.0, x0), (-ahead, t0)))
        return 0.0 <= ahead <= step and off < 0.1 * step and frame.colloc.inner(frame.tangent, t0) > 0.9

    # -- events ---------------------------------------------------------------------------------------------------

    def _locate(self, frame: LocusFrame, step: float) -> None:
        """Locate what changes sign on the step."""
        tests: list[tuple[str, str, Callable[[LocusFrame], float]]] = []
        own = {"fold": "cusp", "branch point": "criticality"}[self.kind]
        tests.append((own, "", lambda f: f.tests[own]))
        for i, name in enumerate(self.names[:2]):
            tests.append(("extremum", name, lambda f, i=i: float(f.tangent.scalars[i])))  # type: ignore[misc]
        cusp = False
        for kind, parameter, test in tests:
            if not test(self.frame) * test(frame) < 0:
                continue
            if cusp and kind == "extremum" and abs(self.events[-1].arclength - self.arclength) <= step:
                before, after = (np.array(f.tangent.scalars[:2]) for f in (self.frame, frame))
                if float(before @ after) < 0:  # both parameters turn at a cusp
                    continue
            cusp = cusp or kind == "cusp"
            self.events.append(self._event(kind, parameter, test, frame, step))

    def _event(
        self, kind: str, parameter: str, test: Callable[[LocusFrame], float], frame: LocusFrame, step: float
    ) -> LocusEvent:
        found = self._root(step, test)
        status = Status.CONVERGED
        if found is None:
            found, status = (frame, step), Status.BRACKETED
        at, distance = found
        bracket = (self.arclength, self.arclength + step)
        if status is Status.CONVERGED:
            bracket = (self.arclength + distance, self.arclength + distance)
        solution = at.colloc.solution(at.x, frame.error)
        return LocusEvent(kind, parameter, solution, self.arclength + distance, status, bracket, test(at))

    def _root(self, step: float, test: Callable[[LocusFrame], float]) -> tuple[LocusFrame, float] | None:
        """Point of the step at which a function of frames vanishes (Brent's method on corrected points)."""
        from scipy.optimize import brentq

        last: dict[str, LocusFrame] = {}

        class Lost(Exception):
            pass

        def value(distance: float) -> float:
            if distance == 0.0:
                last["frame"] = self.frame
                return test(self.frame)
            guess = self.frame.predict(distance)
            found = correct(self.kind, self.frame, guess, self.frame.tangent, self.options, exact=True)
            if found is None:
                raise Lost
            last["frame"] = replace(found[0], previous=self.frame.tangent, previous_step=distance)
            return test(last["frame"])

        try:
            distance = float(brentq(value, 0.0, step, xtol=1e-11 * max(1.0, step), rtol=1e-14, maxiter=60))
            value(distance)
        except (Lost, ValueError):
            return None
        return last["frame"], distance


def _flipped(p: LocusPoint) -> LocusPoint:
    return replace(p, arclength=-p.arclength, tangent=-p.tangent)


def _flipped_event(e: LocusEvent) -> LocusEvent:
    return replace(e, arclength=-e.arclength, bracket=(-e.bracket[1], -e.bracket[0]))
