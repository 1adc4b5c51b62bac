"""Special points on a mesh that resolves not only the solution but also its kernel.

The mesh of a branch follows the solution. A straight column is exact on any mesh, and yet the load at which it buckles
depends on how well the mesh resolves the buckling mode. So the augmented system, which holds both, gets an error
estimate of its own, and a finer mesh where that asks for one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.augmented import Augmented, solve_branch_point, solve_fold
from rodatlas.continuation.collocation import Collocation, scaled
from rodatlas.continuation.linear import Blocks, Columns
from rodatlas.continuation.mesh import MeshControl, halved, relative_change


def refined(
    colloc: Collocation, found: Augmented, tangent: Columns, control: MeshControl
) -> tuple[Collocation, Augmented, float]:
    """Halve the mesh until a converged fold or branch point is known to the tolerance.

    Returns the discretisation, the point on it, and the estimated error at mesh points and in the parameters: what
    one Newton step on the halved mesh still corrects.
    """
    while True:
        fine = Collocation(
            colloc.bvp, halved(colloc.mesh), colloc.scheme.points, colloc.base, list(colloc.free), colloc.scale,
            colloc.backend,
        )  # fmt: skip
        tangent = colloc.interpolate(tangent, fine)
        step = _solve(fine, colloc.interpolate(found.state, fine), tangent, found, colloc, 1)
        found = replace(found, iterations=found.iterations + 2 * step.iterations)
        if step.correction is None:
            return colloc, found, float("nan")
        dx = step.correction
        k = len(colloc.free)
        error = relative_change(colloc, found.state, Columns(dx.stage, dx.mesh[::2], dx.scalars[:k]))
        if error <= control.tolerance or len(fine.step) > control.intervals[1]:
            return colloc, found, error
        better = _solve(fine, step.state, tangent, found, colloc, 8)
        if not better.converged:
            return colloc, found, error
        colloc, found = fine, replace(better, iterations=found.iterations + 2 * better.iterations)


def _solve(
    fine: Collocation, x: Columns, tangent: Columns, found: Augmented, coarse: Collocation, iterations: int
) -> Augmented:
    """Newton on the halved mesh, with the kernel vectors of the coarse one for rows."""
    if found.column is None:
        return solve_fold(fine, x, tangent, max_iterations=iterations)
    vectors = [coarse.interpolate(v, fine) for v in found.vectors]
    rows = [fine.row(scaled(v, 1.0 / fine.norm(v))) for v in vectors]
    # any column with a share along the left kernel vector will do: the old one's mean over each interval
    old = found.column
    mean = np.repeat(old.stage.mean(axis=1), 2, axis=0)[:, None, :]
    stage = np.repeat(mean, fine.scheme.points, axis=1)
    column = Blocks(stage, np.zeros((len(fine.step), stage.shape[2])), old.ends, old.dense)
    return solve_branch_point(fine, x, tangent, max_iterations=iterations, border=(rows, column))
