"""A point of a locus on its discretization: correction, error and adaptation of the mesh."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import (
    ErrorEstimate,
    equidistribute,
    halved,
    monitor,
    relative_change,
    wanted_intervals,
)
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.locus.start import kernel_border
from rodatlas.continuation.locus.system import KINDS, Local, local_problem
from rodatlas.continuation.locus.value import ValueLocal, value_problem
from rodatlas.continuation.results.branch import SpecialPoint
from rodatlas.continuation.singular.bordered import Border, Tests

AWAY = 0.01  # distance at which a branch that leaves a branch point is moved by symmetries that do not move the point
RATE_MARGIN = 20.0  # safety of the rate of convergence that one step tells the next
SHARP = 3e-8  # distance from the solution at which test functions are as good as exact


@dataclass(frozen=True)
class Sought:
    """What is followed: 'fold', 'branch point', or 'zero of NAME' with the value that NAME keeps.

    `pitchfork` says that the branch points have no quadratic term, as a reflection demands.
    """

    kind: str
    name: str = ""
    value: float = 0.0
    pitchfork: bool = False

    @classmethod
    def of(cls, start: SpecialPoint) -> Sought:
        """What a special point is a point of; ValueError for a kind that has no locus."""
        if start.kind in KINDS:
            return cls(start.kind)
        if not start.kind.startswith("zero of "):
            raise ValueError(f"start: expected a fold, a branch point, an extremum or a zero, got a {start.kind}")
        name = start.kind.removeprefix("zero of ")
        return cls(start.kind, name, start.solution[name])

    def local(self, colloc: Collocation, x: Columns, border: Border, beta: float) -> Local | ValueLocal | None:
        """The linear problem at a state."""
        if self.kind in KINDS:
            return local_problem(self.kind, colloc, x, border, beta)
        return value_problem(self.name, self.value, colloc, x)


@dataclass(frozen=True)
class LocusFrame:
    """A point of the locus on its discretization; `behind` is the one before, at a `distance`.

    `unfolding` is the artificial unknown of a branch point; `noise` the distance to the iterate at which tangent and
    test functions were evaluated; `rate` bounds error / correction^2 of Newton's method; `error` is the last estimate.
    """

    colloc: Collocation
    x: Columns
    tangent: Columns
    border: Border
    tests: Tests = field(default_factory=Tests)
    behind: LocusFrame | None = None
    distance: float = float("nan")
    rate: float = 1e3
    error: float = float("nan")
    iterations: int = 0
    unfolding: float = 0.0
    noise: float = 0.0

    def predict(self, step: float) -> Columns:
        """Where the curve is expected after a step: cubic Hermite extrapolation from here and the point before."""
        if self.behind is None:
            return add(self.x, (step, self.tangent))
        x, t, h = self.behind.x, self.behind.tangent, self.distance
        r = step / h
        # p(s) = x0 + s t0 + s^2 (3 A + B) + s^3 (2 A + B)/h, with A = (x - x0 + h t0)/h^2 and B = (t - t0)/h
        square, cube = r**2, r**3
        a, b = 3 * square + 2 * cube, h * (square + cube)
        return add(scaled(self.x, 1 - a), (a, x), (step + h * a - b, self.tangent), (b, t))

    def after(self, other: LocusFrame, distance: float) -> LocusFrame:
        """This frame with another one behind it."""
        return replace(self, behind=replace(other, behind=None), distance=distance)

    def reversed(self) -> LocusFrame:
        return replace(self, tangent=scaled(self.tangent, -1.0), behind=None)

    def value(self, name: str) -> float:
        """A free parameter or observable here, as it is measured along the locus."""
        return self.colloc.observable_row(name, self.x)[0]

    def beyond(self, name: str, value: float) -> float:
        """A free parameter or observable less a value."""
        return self.value(name) - self.colloc.bvp.coordinate(name, value)


def correct(
    sought: Sought, here: LocusFrame, guess: Columns, normal: Columns, options: TraceOptions, exact: bool = False
) -> tuple[LocusFrame, list[float]] | None:
    """Newton for a point of the locus on the plane <normal, x - guess> = 0; None when it fails.

    Tangent and test functions belong to the iterate before the last, or with `exact` to one that is no further than
    `SHARP` from the last.
    """
    colloc, border, beta = here.colloc, here.border, 0.0
    x = guess if colloc.within is None else colloc.within.state(guess)  # extrapolation makes round-off grow
    offset = colloc.inner(normal, guess)
    corrections: list[float] = []
    for _ in range(options.newton.max_iterations):
        local = sought.local(colloc, x, border, beta)
        step = local.step(colloc, normal, offset - colloc.inner(normal, x)) if local else None
        if local is None or step is None:
            return None
        dx, dbeta = step
        size = colloc.norm(dx)
        if not np.isfinite(size) or (corrections and size > 2 * corrections[-1] and size > 1e-6) or size > 10.0:
            return None
        x, beta = add(x, (1.0, dx)), beta + dbeta
        corrections.append(size)
        if _remaining(corrections, here.rate) < options.newton.tolerance:
            noise = size
            if exact and size > SHARP:
                local, noise = sought.local(colloc, x, border, beta) or local, 0.0
            tangent = local.tangent(colloc, normal)
            if tangent is None:
                return None
            tests = local.measure(here.tests.weakest)
            done = LocusFrame(colloc, x, tangent, local.border, tests, rate=here.rate, unfolding=beta)
            if len(corrections) > 1 and corrections[1] > 1e-13:
                done = replace(done, rate=float(np.clip(RATE_MARGIN * corrections[1] / corrections[0] ** 2, 10.0, 1e4)))
            return replace(done, error=here.error, iterations=len(corrections), noise=noise), corrections
    return None


def _remaining(corrections: list[float], rate: float) -> float:
    """Estimated error after a number of corrections, from their decrease or the rate known from the step before."""
    size = corrections[-1]
    if len(corrections) == 1:
        return rate * size**2
    return max(size * (size / corrections[-2]) ** 2, size**2)


def adapted(sought: Sought, frame: LocusFrame, options: TraceOptions) -> tuple[LocusFrame, ErrorEstimate]:
    """Move the mesh to follow the solution and its kernel, and change its size with the estimated error.

    Returns the frame interpolated there, for the next step corrects that, whose error is far below that of a predictor;
    and the estimate on the mesh before.
    """
    control, colloc = options.mesh, frame.colloc
    intervals, estimate = len(colloc.step), ErrorEstimate(frame.error, 0.0)
    error = frame.error
    if not control.is_fixed_size:
        estimate = error_of(sought, frame, control.tolerance)
        intervals = wanted_intervals(control, intervals, estimate)
        grown = max(1.0, intervals / len(colloc.step))
        error = estimate.error / (1.0 if estimate.is_round_off else grown ** (2 * colloc.scheme.points))
    mesh = equidistribute(colloc.mesh, density_of(frame), intervals)
    moved = on_mesh(frame, mesh if colloc.within is None else colloc.within.mesh(mesh))
    return replace(moved, error=error), estimate


def density_of(frame: LocusFrame) -> np.ndarray:
    """Where the solution or its kernel wants mesh points (N,)."""
    density = monitor(frame.colloc, frame.x)
    for v in frame.border.vectors:
        density = np.maximum(density, monitor(frame.colloc, v))
    return density


def error_of(sought: Sought, frame: LocusFrame, enough: float) -> ErrorEstimate:
    """Error at mesh points and in the parameters, from Newton steps on the mesh of halved intervals.

    The first one gives the error; where that is more than `enough`, a second one measures round-off.
    """
    fine = on_mesh(frame, halved(frame.colloc.mesh))
    y, beta = fine.x, 0.0
    sizes: list[float] = []
    for _ in range(2):
        local = sought.local(fine.colloc, y, fine.border, beta)
        step = local.step(fine.colloc, fine.tangent, 0.0) if local else None
        if step is None:
            return ErrorEstimate(float("nan"), float("nan"))
        dx, beta = step[0], beta + step[1]
        y = add(y, (1.0, dx))
        sizes.append(relative_change(frame.colloc, frame.x, Columns(dx.stage, dx.mesh[::2], dx.scalars)))
        if sizes[0] <= enough:
            return ErrorEstimate(sizes[0], 0.0)
    return ErrorEstimate(sizes[0], sizes[1])


def on_mesh(frame: LocusFrame, mesh: np.ndarray) -> LocusFrame:
    """The frame interpolated on another mesh, with borders that fit there."""
    old = frame.colloc
    new = old.on(mesh)
    carry = old.carrier(new)
    behind = frame.behind
    if behind is not None:
        behind = replace(behind, colloc=new, x=carry(behind.x), tangent=carry(behind.tangent))
    weakest = frame.tests.weakest
    tests = replace(frame.tests, weakest=weakest if weakest is None else carry(weakest))
    vectors = tuple(carry(v) for v in frame.border.vectors)
    border = Border(vectors, _carried_column(frame, new))
    x, tangent = carry(frame.x), carry(frame.tangent)
    new.hold(x, new.phase, tangent, add(x, (AWAY, vectors[-1])) if len(vectors) == 2 else None)
    return replace(frame, colloc=new, x=x, tangent=tangent, border=border, tests=tests, behind=behind)


def _carried_column(frame: LocusFrame, new: Collocation) -> Blocks:
    """The column on another mesh: its value per unit length, piecewise constant, at the new Gauss points."""
    old, column = frame.colloc, frame.border.column
    density = column.stage.mean(axis=1)
    place = np.clip(np.searchsorted(old.mesh, (new.mesh[1:] + new.mesh[:-1]) / 2) - 1, 0, len(old.step) - 1)
    stage = np.repeat(density[place][:, None, :], new.scheme.points, axis=1)
    return Blocks(stage, np.zeros((len(new.step), stage.shape[2])), column.ends, column.dense)


def frame_at(sought: Sought, colloc: Collocation, x: Columns, options: TraceOptions) -> LocusFrame | None:
    """Frame on the locus close to a state, with tangent of either sense; None when Newton does not converge."""
    empty = Blocks(*(np.zeros_like(r) for r in vars(colloc.linearize(x).residual).values()))
    border = kernel_border(sought.kind, colloc, x) if sought.kind in KINDS else Border((), empty)
    local: Local | ValueLocal | None = None
    for _ in range(3):  # the borders settle
        local = sought.local(colloc, x, border, 0.0) if border is not None else None
        if local is None:
            return None
        border = local.border
    assert local is not None
    assert border is not None
    tangent = local.null_vector(colloc)
    found = correct(sought, LocusFrame(colloc, x, tangent, border), x, tangent, options, exact=True)
    return None if found is None else found[0]
