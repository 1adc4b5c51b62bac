"""A point of a locus on its discretisation: correction, adaptation of the mesh, and the first one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.collocation import Collocation, Scale, add, predicted, scaled
from rodatlas.continuation.linear import Blocks, Columns
from rodatlas.continuation.locus_start import kernel_border
from rodatlas.continuation.locus_system import Border, Local, local_problem
from rodatlas.continuation.mesh import equidistribute, halved, monitor, relative_change
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import SpecialPoint


@dataclass(frozen=True)
class LocusFrame:
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
        return predicted(self.x, self.tangent, step, self.previous, self.previous_step)

    def reversed(self) -> LocusFrame:
        return replace(self, tangent=scaled(self.tangent, -1.0), previous=None, tests=dict(self.tests))


def correct(
    kind: str, here: LocusFrame, guess: Columns, normal: Columns, options: TraceOptions, exact: bool = False
) -> tuple[LocusFrame, list[float]] | None:
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
            done = LocusFrame(colloc, x, tangent, local.border, local.tests, error=here.error)
            return replace(done, iterations=len(corrections)), corrections
    return None


def adapted(kind: str, frame: LocusFrame, options: TraceOptions) -> LocusFrame:
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


def error_of(kind: str, frame: LocusFrame) -> float:
    """Largest error at mesh points and in the parameters: one Newton step on the mesh of halved intervals."""
    fine = on_mesh(frame, halved(frame.colloc.mesh))
    local = local_problem(kind, fine.colloc, fine.x, fine.border, 0.0)
    step = local.step(fine.colloc, fine.tangent, 0.0) if local else None
    if step is None:
        return float("nan")
    dx = step[0]
    return relative_change(frame.colloc, frame.x, Columns(dx.stage, dx.mesh[::2], dx.scalars))


def on_mesh(frame: LocusFrame, mesh: np.ndarray) -> LocusFrame:
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


def _carried_column(frame: LocusFrame, new: Collocation) -> Blocks:
    """The column on another mesh: its value per unit length, piecewise constant, at the new Gauss points."""
    old, column = frame.colloc, frame.border.column
    density = column.stage.mean(axis=1)
    place = np.clip(np.searchsorted(old.mesh, (new.mesh[1:] + new.mesh[:-1]) / 2) - 1, 0, len(old.step) - 1)
    stage = np.repeat(density[place][:, None, :], new.scheme.points, axis=1)
    return Blocks(stage, np.zeros((len(new.step), stage.shape[2])), column.ends, column.dense)


def first_frame(bvp: BVP, start: SpecialPoint, free: list[int], options: TraceOptions) -> LocusFrame | None:
    """Frame at the start, its kernel from inverse iteration, looking to larger values of the second parameter."""
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
    frame = LocusFrame(colloc, x, tangent, border, local.tests)
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
