"""Loci of folds and branch points in two parameters, with the special points on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.collocation import Collocation, Scale, add, free_indices, scaled
from rodatlas.continuation.linear import Blocks, Columns
from rodatlas.continuation.locus_system import KINDS, Border, Local, local_problem
from rodatlas.continuation.mesh import equidistribute, halved, monitor, relative_change
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import EndReason, SpecialPoint, Status
from rodatlas.continuation.solution import Solution

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class LocusPoint:
    """One point of a locus: the solution there, arclength, and the tangent (k+1,) of the free parameters, scaled."""

    solution: Solution
    arclength: float
    tangent: np.ndarray
    tests: dict[str, float]
    iterations: int = 0


@dataclass(frozen=True, eq=False)
class LocusEvent:
    """A special point of a locus.

    Attributes
    ----------
    kind : 'cusp' (two folds meet), 'criticality' (a pitchfork changes between super- and subcritical; a locus of folds
        ends there), or 'extremum' (the locus turns back in `parameter`: two points meet and vanish, or, on a locus of
        folds that is no cusp, two branches touch).
    parameter : name of the parameter that is extreme, or ''.
    status : CONVERGED when the test function was brought to zero, else BRACKETED.
    bracket : arclengths between which it lies; test : value of the test function at the solution.
    """

    kind: str
    parameter: str
    solution: Solution
    arclength: float
    status: Status
    bracket: tuple[float, float]
    test: float

    def __repr__(self) -> str:
        of = f" in {self.parameter}" if self.parameter else ""
        return f"LocusEvent({self.kind}{of}, {self.status.value}, {self.solution!r})"


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of folds or branch points in the plane of two parameters, in order of arclength.

    kind : 'fold' or 'branch point'; free : names of the free parameters, the two of the plane first.
    """

    kind: str
    free: tuple[str, ...]
    points: tuple[LocusPoint, ...]
    events: tuple[LocusEvent, ...]
    ends: tuple[EndReason, EndReason]

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        spans = ", ".join(f"{n} in [{self.column(n).min():.6g}, {self.column(n).max():.6g}]" for n in self.free[:2])
        return f"Locus({self.kind}: {len(self)} points, {spans}, {len(self.events)} events)"

    @property
    def closed(self) -> bool:
        return EndReason.CLOSED in self.ends

    def column(self, name: str) -> np.ndarray:
        """A parameter or observable at all points."""
        return np.array([p.solution[name] for p in self.points])

    def to_frame(self) -> pd.DataFrame:
        """One row per point: arclength, parameters, observables, error."""
        import pandas as pd

        rows = []
        for p in self.points:
            row = {"arclength": p.arclength, **dict(zip(p.solution.parameter_names, p.solution.parameters, strict=True))}
            rows.append(row | dict(p.solution.observables) | {"error": p.solution.error})
        return pd.DataFrame(rows)


@dataclass(frozen=True)
class _Frame:
    """A point of the locus on its discretisation."""

    colloc: Collocation
    x: Columns
    tangent: Columns
    border: Border
    tests: dict[str, float]
    previous: Columns | None = None
    previous_step: float = 1.0
    error: float = float("nan")
    iterations: int = 0

    def predict(self, step: float) -> Columns:
        if self.previous is None:
            return add(self.x, (step, self.tangent))
        bend = step * step / (2 * self.previous_step)
        return add(self.x, (step + bend, self.tangent), (-bend, self.previous))

    def reversed(self) -> _Frame:
        return replace(self, tangent=scaled(self.tangent, -1.0), previous=None, tests=dict(self.tests))


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
    from rodatlas.continuation.trace import NotConverged

    if start.kind not in KINDS:
        raise ValueError(f"start: expected a fold or a branch point, got a {start.kind}")
    names = list(dict.fromkeys(free))
    if len(names) != bvp.n_free + 1:
        raise ValueError(f"free: expected {bvp.n_free + 1} parameter names for a locus, got {list(free)}")
    options = options or TraceOptions()
    index = [bvp.parameter_index(name) for name in names]
    free_indices(bvp, [names[0], *names[2:]])
    frame = _first(bvp, start, index, options)
    if frame is None:
        from rodatlas.continuation.newton import NewtonCode

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
        events = [
            replace(e, arclength=-e.arclength, bracket=(-e.bracket[1], -e.bracket[0])) for e in reversed(backward.events)
        ] + events
        first = backward.end or EndReason.STOPPED
    return Locus(start.kind, tuple(names), tuple(points), tuple(events), (first, forward.end or EndReason.STOPPED))


class _Walk:
    """Pseudo-arclength continuation of a locus in one direction."""

    def __init__(self, kind: str, frame: _Frame, options: TraceOptions, names: tuple[str, ...]):
        self.kind, self.start, self.frame, self.options, self.names = kind, frame, frame, options, names
        self.arclength = 0.0
        self.end: EndReason | None = None
        self.points = [self._point(frame)]
        self.events: list[LocusEvent] = []

    def run(self) -> None:
        control, step = self.options.step, self.options.step.initial
        while self.end is None:
            tried = self._attempt(step)
            if tried is None:
                step *= 0.5
                if step < control.minimum:
                    self.end = EndReason.MIN_STEP
                continue
            frame, first = tried
            bound = self._crossed(frame)
            if bound is not None:
                landed = self._land(step, *bound)
                if landed is None:
                    step *= 0.5
                    if step < control.minimum:
                        self.end = EndReason.MIN_STEP
                    continue
                frame, taken = landed
                self.end = EndReason.RANGE
            else:
                taken = step
            self._locate(frame, taken)
            self._accept(frame, taken)
            step = control.next_step(step, first, frame.iterations)

    def _attempt(self, step: float) -> tuple[_Frame, float] | None:
        """Correct a step; None when a smaller one is needed."""
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

    def _accept(self, frame: _Frame, step: float) -> None:
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

    def _point(self, frame: _Frame) -> LocusPoint:
        solution = frame.colloc.solution(frame.x, frame.error)
        return LocusPoint(solution, self.arclength, frame.tangent.scalars.copy(), frame.tests, frame.iterations)

    # -- bounds and closing ---------------------------------------------------------------------------------------

    def _crossed(self, frame: _Frame) -> tuple[str, float] | None:
        for name, (low, high) in self.options.bounds.items():
            before, value = (f.colloc.observable_row(name, f.x)[0] for f in (self.frame, frame))
            for bound, outward in ((low, -1.0), (high, 1.0)):
                if outward * (value - bound) > 1e-12 * max(1.0, abs(bound)) and outward * (value - before) > 0:
                    return name, bound
        return None

    def _land(self, step: float, name: str, bound: float) -> tuple[_Frame, float] | None:
        """The point exactly at a bound, by root finding along the step."""

        def value(frame: _Frame) -> float:
            return frame.colloc.observable_row(name, frame.x)[0] - bound

        return self._root(step, value)

    def _closes(self, frame: _Frame, step: float) -> bool:
        if len(self.points) < 4 or np.abs(self.start.x.scalars - frame.x.scalars).max() > 2 * step:
            return False
        x0 = self.start.colloc.interpolate(self.start.x, frame.colloc)
        t0 = self.start.colloc.interpolate(self.start.tangent, frame.colloc)
        ahead = frame.colloc.inner(add(frame.x, (-1.0, x0)), t0)
        off = frame.colloc.norm(add(frame.x, (-1.0, x0), (-ahead, t0)))
        return 0.0 <= ahead <= step and off < 0.1 * step and frame.colloc.inner(frame.tangent, t0) > 0.9

    # -- events ---------------------------------------------------------------------------------------------------

    def _locate(self, frame: _Frame, step: float) -> None:
        """Locate what changes sign on the step."""
        tests: list[tuple[str, str, Callable[[_Frame], float]]] = []
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
        self, kind: str, parameter: str, test: Callable[[_Frame], float], frame: _Frame, step: float
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

    def _root(self, step: float, test: Callable[[_Frame], float]) -> tuple[_Frame, float] | None:
        """Point of the step at which a function of frames vanishes (Brent's method on corrected points)."""
        from scipy.optimize import brentq

        last: dict[str, _Frame] = {}

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


def correct(
    kind: str, here: _Frame, guess: Columns, normal: Columns, options: TraceOptions, exact: bool = False
) -> tuple[_Frame, list[float]] | None:
    """Newton for a point of the locus on the plane <normal, x - guess> = 0; None when it fails.

    Tangent and test functions belong to the iterate before the last, or with `exact` to the last one.
    """
    colloc, border, x, beta = here.colloc, here.border, guess, 0.0
    offset = colloc.inner(normal, guess)
    corrections: list[float] = []
    for _ in range(options.newton.max_iterations):
        local = local_problem(kind, colloc, x, border, beta)
        step = local.step(colloc, normal, offset - colloc.inner(normal, x)) if local else None
        if local is None or step is None:
            return None
        dx, dbeta = step
        size = colloc.norm(dx)
        if not np.isfinite(size) or (corrections and size > 2 * corrections[-1] and size > 1e-6) or size > 10.0:
            return None
        x, beta = add(x, (1.0, dx)), beta + dbeta
        corrections.append(size)
        before = corrections[-2] if len(corrections) > 1 else 0.0
        if max(size * (size / before) ** 2 if before else size**1.5, size**2) < options.newton.tolerance:
            local = (local_problem(kind, colloc, x, border, beta) or local) if exact else local
            tangent = local.tangent(colloc, normal)
            if tangent is None:
                return None
            frame = _Frame(colloc, x, tangent, local.border, local.tests, error=here.error, iterations=len(corrections))
            return frame, corrections
    return None


def adapted(kind: str, frame: _Frame, options: TraceOptions) -> _Frame:
    """Move the mesh to follow the solution and its kernel, and change its size with the estimated error."""
    control, colloc = options.mesh, frame.colloc
    intervals, error = len(colloc.step), frame.error
    if not control.is_fixed_size:
        error = error_of(kind, frame)
        ratio = (max(error, 1e-16) / (0.3 * control.tolerance)) ** (1.0 / (2 * colloc.scheme.points))
        if np.isfinite(error) and not 0.85 < ratio < 1.0:
            intervals = int(np.clip(round(intervals * np.clip(ratio, 0.7, 1.5)), *control.intervals))
    density = monitor(colloc, frame.x)
    for v in frame.border.vectors:
        density = np.maximum(density, monitor(colloc, v))
    moved = on_mesh(frame, equidistribute(colloc.mesh, density, intervals))
    found = correct(kind, moved, moved.x, moved.tangent, options)
    if found is None:
        return replace(frame, error=error)
    new = found[0]
    return replace(new, previous=moved.previous, previous_step=frame.previous_step, error=error)


def error_of(kind: str, frame: _Frame) -> float:
    """Largest error at mesh points and in the parameters: one Newton step on the mesh of halved intervals."""
    fine = on_mesh(frame, halved(frame.colloc.mesh))
    local = local_problem(kind, fine.colloc, fine.x, fine.border, 0.0)
    step = local.step(fine.colloc, fine.tangent, 0.0) if local else None
    if step is None:
        return float("nan")
    dx = step[0]
    return relative_change(frame.colloc, frame.x, Columns(dx.stage, dx.mesh[::2], dx.scalars))


def on_mesh(frame: _Frame, mesh: np.ndarray) -> _Frame:
    """The frame interpolated on another mesh, with borders that fit there."""
    old = frame.colloc
    new = Collocation(old.bvp, mesh, old.scheme.points, old.base, list(old.free), old.scale, old.backend)
    carry = old.carrier(new)
    previous = carry(frame.previous) if frame.previous is not None else None
    vectors = tuple(carry(v) for v in frame.border.vectors)
    border = Border(vectors, _carried_column(frame, new))
    return replace(
        frame, colloc=new, x=carry(frame.x), tangent=carry(frame.tangent), border=border, previous=previous
    )


def _carried_column(frame: _Frame, new: Collocation) -> Blocks:
    """The column on another mesh: its value per unit length, piecewise constant, at the new Gauss points."""
    old, column = frame.colloc, frame.border.column
    density = column.stage.mean(axis=1)
    place = np.clip(np.searchsorted(old.mesh, (new.mesh[1:] + new.mesh[:-1]) / 2) - 1, 0, len(old.step) - 1)
    stage = np.repeat(density[place][:, None, :], new.scheme.points, axis=1)
    return Blocks(stage, np.zeros((len(new.step), stage.shape[2])), column.ends, column.dense)


def _first(bvp: BVP, start: SpecialPoint, free: list[int], options: TraceOptions) -> _Frame | None:
    """Frame at the start, its kernel from inverse iteration, looking to larger values of the second parameter."""
    from rodatlas.continuation.locus_start import kernel_border

    solution = start.solution
    scale = start.scale or Scale.of(bvp, solution)
    colloc = Collocation(bvp, solution.mesh, solution.points, solution.parameters, free, scale, options.backend)
    x = colloc.state(solution)
    border = kernel_border(start.kind, colloc, x)
    if border is None:
        return None
    local: Local | None = None
    for _ in range(3):  # the borders settle
        local = local_problem(start.kind, colloc, x, border, 0.0)
        if local is None:
            return None
        border = local.border
    assert local is not None
    tangent = local.null_vector(colloc)
    tangent = scaled(tangent, 1.0 if tangent.scalars[1] >= 0 else -1.0)
    frame = _Frame(colloc, x, tangent, border, local.tests)
    found = correct(start.kind, frame, x, tangent, options)
    if found is None:
        return None
    frame = found[0]
    for _ in range(4):
        before = len(frame.colloc.step)
        frame = adapted(start.kind, frame, options)
        if len(frame.colloc.step) == before:
            break
    return frame


def _flipped(p: LocusPoint) -> LocusPoint:
    return replace(p, arclength=-p.arclength, tangent=-p.tangent)
