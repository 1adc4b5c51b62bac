"""A state on a mesh that meets the tolerance: the mesh moves where Newton can follow, and is halved where it cannot.

A move to better places may carry the state further than Newton converges from: where a layer is missed altogether,
what is interpolated on the places of the layer is no guess. The halved mesh keeps all old points, so the state stays
close, and the next move starts from a better one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from rodatlas.continuation.curve.damped import damped_newton
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, with_tests
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import (
    ErrorEstimate,
    MeshControl,
    equidistribute,
    error_estimate,
    halved,
    monitor,
)
from rodatlas.continuation.discrete.mesh import wanted_intervals as wanted
from rodatlas.continuation.discrete.newton import Condition, NewtonOptions, NewtonResult, fixed, newton, plane
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.results.branch import EndReason

PASSES = 24  # meshes at one state: 6 doublings lead from the fewest intervals to the most, then the places settle
STALLED = 0.7  # of the smallest error so far: a mesh that may not grow and brings no less is no progress
PATIENCE = 3  # meshes without progress: places that were found from a state that oscillates need several moves


class Meshed(Protocol):
    """What is settled: the dataclass of a point with a discretization, a state and an error."""

    @property
    def colloc(self) -> Collocation: ...

    @property
    def error(self) -> float: ...


F = TypeVar("F", bound=Meshed)


class Settling(Protocol[F]):
    """How the points of one kind of curve are measured and corrected on another mesh."""

    def measured(self, frame: F) -> ErrorEstimate:
        """Its error, from the mesh of halved intervals."""

    def density(self, frame: F) -> np.ndarray:
        """Where its mesh wants points (N,)."""

    def corrected(self, frame: F, mesh: np.ndarray, finer: bool) -> tuple[F | None, int]:
        """The frame at the same point on another mesh, None where Newton fails; and iterations spent.

        `finer` says that the mesh holds all old points.
        """


Hold = Callable[[Frame], Condition]
"""The condition that singles out a point of the branch, on the mesh of a frame."""


@dataclass(frozen=True)
class Settled(Generic[F]):
    """A frame with its estimated error, the Newton iterations spent, and why the tolerance is missed (else None)."""

    frame: F
    spent: int
    missed: EndReason | None


def across(frame: Frame) -> Condition:
    """The state stays in the plane through it across the tangent: regular at folds, but the parameter may change."""
    return plane(frame.colloc, frame.tangent, frame.x)


def at_value(name: str, value: float) -> Hold:
    """A free parameter or observable keeps a value."""
    return lambda frame: fixed(name, value)(frame.colloc)


def at_own_parameter(frame: Frame) -> Hold:
    """The continuation parameter keeps its value."""
    index = int(frame.colloc.free[0])
    bvp = frame.colloc.bvp
    return at_value(bvp.parameter_names[index], float(bvp.values(frame.colloc.parameters(frame.x))[index]))


def settled(frame: Frame, options: TraceOptions, holds: Sequence[Hold], anywhere: bool = False) -> Settled[Frame]:
    """Adapt the mesh at one point of a branch until its size and error have settled.

    Parameters
    ----------
    holds : tried in turn on each mesh: the first one under which Newton converges corrects the state.
    anywhere : accept a state further away, or beyond a fold, and fall back to a damped iteration.
    """
    found = settle(frame, options.mesh, _OnBranch(options.newton, tuple(holds), anywhere))
    return replace(found, frame=with_tests(found.frame))


@dataclass(frozen=True)
class _OnBranch:
    """Points of a branch, see :func:`settled`."""

    newton: NewtonOptions
    holds: tuple[Hold, ...]
    anywhere: bool

    def measured(self, frame: Frame) -> ErrorEstimate:
        return error_estimate(frame.colloc, frame.x, frame.tangent)

    def density(self, frame: Frame) -> np.ndarray:
        return monitor(frame.colloc, frame.x)

    def corrected(self, frame: Frame, mesh: np.ndarray, finer: bool) -> tuple[Frame | None, int]:
        moved = frame.on_mesh(mesh)
        return corrected(moved, self.newton, self.holds, self.anywhere, damped=self.anywhere and finer)


def settle(frame: F, control: MeshControl, curve: Settling[F]) -> Settled[F]:
    """Adapt the mesh at one point of a curve until its size and error have settled."""
    best, spent, stalls = frame, 0, 0
    estimate, least = ErrorEstimate(float("nan"), float("nan")), np.inf
    for _ in range(PASSES):
        before = len(frame.colloc.step)
        if not control.is_fixed_size:
            estimate, spent = curve.measured(frame), spent + 2
            frame = _with_error(frame, estimate.error)
        if not estimate.error >= least:
            best = frame
        intervals = wanted(control, before, estimate)
        if intervals <= before and estimate.error > max(control.tolerance, STALLED * least):
            stalls += 1
            if stalls > PATIENCE or estimate.is_round_off:
                break
        least = min(least, estimate.error)
        if estimate.jumps and estimate.error <= control.tolerance:
            break  # elsewhere the jump would lie otherwise in its interval
        found, more = _on_better_mesh(frame, intervals, control, curve)
        spent += more
        if found is None:
            break
        frame = found
        if control.is_fixed_size or (estimate.error <= control.tolerance and intervals == before):
            best = frame  # points that are enough, at better places
            break
    return Settled(best, spent, _missed(best, estimate, control))


def _with_error(frame: F, error: float) -> F:
    return replace(frame, error=error)  # type: ignore[type-var]


def _missed(frame: Meshed, estimate: ErrorEstimate, control: MeshControl) -> EndReason | None:
    """Why the error of a settled frame exceeds what is accepted; None where it does not."""
    if control.accepts(frame.error):
        return None
    if estimate.is_round_off:
        return EndReason.ROUND_OFF
    return EndReason.MESH_LIMIT if 2 * len(frame.colloc.step) > control.intervals[1] else EndReason.UNREFINED


def _on_better_mesh(frame: F, intervals: int, control: MeshControl, curve: Settling[F]) -> tuple[F | None, int]:
    """The state corrected on a mesh of better places or, where that fails and more are needed, on a finer one."""
    colloc, spent, density = frame.colloc, 0, curve.density(frame)
    meshes = [equidistribute(colloc.mesh, density, intervals)]
    if not (control.is_fixed_size or frame.error <= control.tolerance):
        meshes += [refined_within(colloc.mesh, density, control.intervals[1])]
    for i, mesh in enumerate(meshes):
        if len(mesh) - 1 > control.intervals[1] or (i > 0 and len(mesh) == len(colloc.mesh)):
            continue
        found, more = curve.corrected(frame, mesh if colloc.within is None else colloc.within.mesh(mesh), i > 0)
        spent += more
        if found is not None:
            shrunk = max(1.0, len(colloc.step) / len(found.colloc.step)) ** (2 * colloc.scheme.points)
            return _with_error(found, frame.error * shrunk), spent
    return None, spent


def refined_within(mesh: np.ndarray, density: np.ndarray, most: int) -> np.ndarray:
    """All intervals halved or, where that makes too many, those in which the mesh wants most points."""
    room = most - (len(mesh) - 1)
    if room >= len(mesh) - 1:
        return halved(mesh)
    worst = np.argsort(-density * np.diff(mesh), kind="stable")[: max(0, room)]
    return np.sort(np.concatenate([mesh, (mesh[worst] + mesh[worst + 1]) / 2]))


def corrected(
    moved: Frame, options: NewtonOptions, holds: Sequence[Hold], anywhere: bool = False, damped: bool = False
) -> tuple[Frame | None, int]:
    """Newton on a new mesh; what turns the tangent round, as a correction across a fold does, is refused."""
    spent = 0
    for solver in (newton, damped_newton) if damped else (newton,):
        for hold in holds:
            condition = hold(moved)
            result: NewtonResult = solver(moved.colloc, moved.x, [condition], options)
            spent += len(result.corrections)
            if result.converged and result.factorization is not None:
                row = condition(result.state)[1]
                v = result.factorization.solve(moved.colloc.right_hand_side(None, [row], [1.0]))
                v = moved.colloc.kept_symmetric(v)
                size = moved.colloc.norm(v)
                if not (np.isfinite(size) and size > 0):
                    continue
                tangent = scaled(v, float(np.copysign(1.0, moved.colloc.inner(v, moved.tangent))) / size)
                if anywhere or tangent.scalars[0] * moved.fold_test >= 0:
                    return replace(moved, x=result.state, tangent=tangent), spent
    return None, spent
