"""Special points on a mesh that resolves not only the solution but also its kernel.

The mesh of a branch follows the solution. A straight column is exact on any mesh, and yet the load at which it buckles
depends on how well the mesh resolves the buckling mode. So the augmented system, which holds both, gets an error
estimate of its own, and a finer mesh where that asks for one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodatlas.continuation.augmented import Augmented, solve_branch_point, solve_fold
from rodatlas.continuation.collocation import Collocation, Row, scaled
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
        carry = colloc.carrier(fine)
        tangent, border = carry(tangent), _border(fine, found, carry)
        step = _solve(fine, carry(found.state), tangent, border, 1)
        found = replace(found, iterations=found.iterations + 2 * step.iterations)
        if step.correction is None:
            return colloc, found, float("nan")
        dx = step.correction
        k = len(colloc.free)
        error = relative_change(colloc, found.state, Columns(dx.stage, dx.mesh[::2], dx.scalars[:k]))
        if error <= control.tolerance or len(fine.step) > control.intervals[1]:
            return colloc, found, error
        better = _solve(fine, step.state, tangent, border, 8)
        if not better.converged:
            return colloc, found, error
        colloc, found = fine, replace(better, iterations=found.iterations + 2 * better.iterations)


Border = tuple[list[Row], Blocks]


def _border(fine: Collocation, found: Augmented, carry: Callable[[Columns], Columns]) -> Border | None:
    """Rows and column for a branch point on the halved mesh, from those of the coarse one; None at a fold."""
    old = found.column
    if old is None:
        return None
    vectors = [carry(v) for v in found.vectors]
    rows = [fine.row(scaled(v, 1.0 / fine.norm(v))) for v in vectors]
    # any column with a share along the left kernel vector will do: the old one's mean over each interval
    mean = np.repeat(old.stage.mean(axis=1), 2, axis=0)[:, None, :]
    stage = np.repeat(mean, fine.scheme.points, axis=1)
    return rows, Blocks(stage, np.zeros((len(fine.step), stage.shape[2])), old.ends, old.dense)


def _solve(fine: Collocation, x: Columns, tangent: Columns, border: Border | None, iterations: int) -> Augmented:
    if border is None:
        return solve_fold(fine, x, tangent, max_iterations=iterations)
    return solve_branch_point(fine, x, tangent, max_iterations=iterations, border=border)
