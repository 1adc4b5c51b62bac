"""The mesh along a branch: it follows the state, and the mode nearest to a branch point where the state is no guide.

A straight column is exact on any mesh, and yet the load at which its twentieth mode buckles is not: on ten intervals it
lies elsewhere, and test functions evaluated there report the wrong point or none. So determinant and smallest singular
value are compared with those on halved intervals; where they differ the mesh follows the mode too, from there on. Where
the state asks for no mesh at all, the modes of the next branch points are computed on the halved intervals, and the
mesh has to hold them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, with_tests
from rodatlas.continuation.curve.settle import across, corrected
from rodatlas.continuation.discrete.mesh import (
    ErrorEstimate,
    Halves,
    MeshControl,
    equidistribute,
    halves_of,
    monitor,
    wanted_intervals,
)
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.singular.crossings import next_crossings
from rodatlas.continuation.singular.smallest import smallest_singular

ALIKE = 0.1  # relative difference of the smallest singular values on a mesh and on its halves
AIM = 0.01  # the same, that a mesh which follows the mode is made for
NEAR = 1e-6  # arclength from a branch point below which values are alike: they are round-off on it
IDLE = 1e-2  # share of the tolerance; where the error is less, the mesh is coarser than the state alone asks for
AHEAD = 4.0  # times the steps to the next look, over which branch points are looked for
LOST = 0.05  # share of a mode that a mesh may lose; the place of the branch point is off by about the square of that
PASSES = 5  # of inverse iteration, where one finds a difference: the mode of a neighboring point may be another one
ROUNDS = 6  # doublings of the mesh


@dataclass(frozen=True)
class Adapted:
    """A frame on its new mesh, Newton iterations spent, the error estimated before, and if the mode was resolved."""

    frame: Frame
    spent: int
    error: float
    resolved: bool


def adapted(frame: Frame, options: TraceOptions, first: bool = False) -> Adapted:
    """Move the mesh, and change its size, to follow the solution.

    The state is interpolated: the next step corrects that, whose error is far below that of a predictor.

    Parameters
    ----------
    first : of a branch, where the weakest mode is not yet known well from the points before.
    """
    control, colloc = options.mesh, frame.colloc
    if control.is_fixed_size:
        mesh = equidistribute(colloc.mesh, monitor(colloc, frame.x), len(colloc.step))
        return Adapted(_moved(frame, mesh, frame.error), 0, frame.error, True)
    halves = halves_of(colloc, frame.x, frame.tangent)
    estimate, off, (frame, held) = (
        halves.estimate,
        _mode_error(frame, halves, first),
        _with_next(frame, halves, options),
    )
    if off > ALIKE or not held:
        found, spent = with_resolved_mode(frame, options)
        return Adapted(found, spent + 2, estimate.error, False)
    intervals = wanted_intervals(control, len(colloc.step), estimate)
    if frame.with_mode:
        intervals = max(intervals, _for_mode(frame, off, control))
    carried = estimate.error * max(1.0, len(colloc.step) / intervals) ** (2 * colloc.scheme.points)
    mesh = equidistribute(colloc.mesh, _density(frame, frame.with_mode), intervals)
    return Adapted(_moved(frame, mesh, carried), 2, estimate.error, True)


def measured_at(frame: Frame, options: TraceOptions) -> tuple[float, bool]:
    """The error of a state, and whether its mesh resolves the modes."""
    halves = halves_of(frame.colloc, frame.x, frame.tangent)
    return halves.estimate.error, _mode_error(frame, halves) <= ALIKE and _with_next(frame, halves, options)[1]


def with_resolved_mode(frame: Frame, options: TraceOptions) -> tuple[Frame, int]:
    """The frame, corrected across its tangent, on a mesh that resolves its mode, as far as the limits allow."""
    control, spent = options.mesh, 0
    frame = replace(frame, with_mode=True)
    for _ in range(0 if control.is_fixed_size else ROUNDS):
        halves = halves_of(frame.colloc, frame.x, frame.tangent)
        spent += 2
        off, (frame, held) = _mode_error(frame, halves, True), _with_next(frame, halves, options)
        intervals = min(2 * len(frame.colloc.step), control.intervals[1])
        if (off <= AIM and held) or intervals <= len(frame.colloc.step):
            break
        mesh = equidistribute(frame.colloc.mesh, _density(frame, True), intervals)
        found, more = corrected(_moved(frame, mesh, halves.estimate.error), options.newton, (across,))
        spent += more
        if found is None:
            break
        frame = with_tests(replace(found, weakness_before=float("nan")), PASSES)
    return frame, spent


def _moved(frame: Frame, mesh: np.ndarray, error: float) -> Frame:
    within = frame.colloc.within
    return replace(frame.on_mesh(mesh if within is None else within.mesh(mesh)), error=error)


def _density(frame: Frame, with_mode: bool) -> np.ndarray:
    """Where points are wanted: for the state, and for the mode."""
    density = monitor(frame.colloc, frame.x)
    for mode in _followed(frame) if with_mode else ():
        wanted = monitor(frame.colloc, mode)
        density = np.maximum(density / (density @ frame.colloc.step), wanted / (wanted @ frame.colloc.step))
    return density


def _followed(frame: Frame) -> tuple[Columns, ...]:
    return frame.ahead or (() if frame.weakest is None else (frame.weakest,))


def _with_next(frame: Frame, halves: Halves, options: TraceOptions) -> tuple[Frame, bool]:
    """The frame with the modes of the next branch points, and whether its mesh holds them.

    Nothing is done where the state itself determines the mesh, which holds modes of the same scale then.
    """
    control, fine = options.mesh, halves.colloc
    if control.is_fixed_size or "branch point" not in options.locate:
        return frame, True
    if not halves.estimate.error < IDLE * control.tolerance:
        return frame, True
    there, back = frame.colloc.carrier(fine), fine.carrier(frame.colloc)
    start = there(frame.ahead[0]) if frame.ahead else None
    found = next_crossings(fine, halves.factorization, there(frame.x), there(frame.tangent), start)
    if found is None:
        return frame, True
    reach = AHEAD * control.every * max(frame.previous_step, options.step.initial)
    near = [(place, mode) for place, mode in zip(found.places, found.modes, strict=True) if abs(place) < reach]
    held = all(fine.norm(add(mode, (-1.0, there(back(mode))))) < LOST for _, mode in near[:3])
    return replace(frame, ahead=tuple(back(m) for _, m in near[:3]), expected=tuple(d for d, _ in near)), held


def _for_mode(frame: Frame, off: float, control: MeshControl) -> int:
    """Intervals that make the smallest singular value as good as it is to be; its error is of order 2m."""
    count = len(frame.colloc.step)
    return wanted_intervals(replace(control, tolerance=AIM), count, ErrorEstimate(max(off, 1e-16), 0.0))


def _mode_error(frame: Frame, halves: Halves, thorough: bool = False) -> float:
    """Relative difference of the smallest singular values on the mesh and its halves; infinite where signs differ."""
    if halves.factorization.sign == 0.0 or frame.weakest is None or frame.branch_test[0] == 0.0:
        return 0.0
    on_halves = frame.colloc.interpolate(frame.weakest, halves.colloc)
    off = float("inf") if thorough else _difference(frame, halves, on_halves, abs(frame.weakness), 1)
    if off <= ALIKE:
        return off
    again = with_tests(frame, PASSES)
    on_halves = frame.colloc.interpolate(again.weakest, halves.colloc) if again.weakest else on_halves
    return _difference(again, halves, on_halves, abs(again.weakness), PASSES)


def _difference(frame: Frame, halves: Halves, mode: Columns, weakness: float, passes: int) -> float:
    fine = smallest_singular(halves.colloc, halves.factorization, mode, passes=passes)[1]
    largest = max(fine, weakness)
    steepness = frame.steepness if np.isfinite(frame.steepness) else 1.0
    if not np.isfinite(largest) or largest < NEAR * min(1.0, steepness):
        return 0.0
    if frame.branch_test[0] * halves.factorization.sign < 0:
        return float("inf")
    return abs(fine - weakness) / largest
