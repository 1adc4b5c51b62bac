"""Special points on a mesh that resolves not only the solution but also its kernel.

The mesh of a branch follows the solution. A straight column is exact on any mesh, and yet the load at which it buckles
depends on how well the mesh resolves the buckling mode. So the augmented system, which holds both, gets an error
estimate of its own, and a finer mesh where that asks for one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.jumps import jump_error, residual_along
from rodatlas.continuation.discrete.mesh import MeshControl, halved, relative_change
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.augmented import Augmented, solve_branch_point, solve_fold

MOST_CUTS = 60  # a jump is closed in on by halving: 1e-9 of an interval after 30
PAYS = 8.0  # halving all intervals lowers the error by 2^(2m); less than this is not the mesh's order


def refined(
    colloc: Collocation, found: Augmented, tangent: Columns, control: MeshControl
) -> tuple[Collocation, Augmented, float]:
    """Refine the mesh until a converged fold or branch point is known to the tolerance.

    All intervals are halved as long as that pays; where it does not, as with a coefficient that jumps inside an
    interval, those are cut in which the kernel satisfies its equations worst.

    Returns the discretisation, the point on it, and the estimated error at mesh points and in the parameters: what
    one Newton step on the finer mesh still corrects.
    """
    before, everywhere = np.inf, True
    for _ in range(MOST_CUTS):
        fine = colloc.on(halved(colloc.mesh) if everywhere else _cut_worst(colloc, found))
        carry = colloc.carrier(fine)
        ahead, border = carry(tangent), _border(colloc, fine, found, carry)
        step = _solve(fine, carry(found.state), ahead, border, 1)
        found = replace(found, iterations=found.iterations + 2 * step.iterations)
        if step.correction is None:
            return colloc, found, float("nan")
        dx = step.correction
        k, old = len(colloc.free), np.searchsorted(fine.mesh, colloc.mesh)
        error = relative_change(colloc, found.state, Columns(dx.stage, dx.mesh[old], dx.scalars[:k]))
        if error <= control.tolerance:
            error = max(error, _jump_error(colloc, found))
        if error <= control.tolerance:
            break
        if everywhere and (error > before / PAYS or len(fine.step) > control.intervals[1]):
            everywhere, before = False, np.inf
            continue
        if len(fine.step) > control.intervals[1]:
            break
        better = _solve(fine, step.state, ahead, border, 8)
        if not better.converged:
            break
        found = replace(better, iterations=found.iterations + 2 * better.iterations)
        colloc, tangent, before = fine, ahead, error
    return colloc, found, error


def _cut_worst(colloc: Collocation, found: Augmented) -> np.ndarray:
    """The mesh with those intervals halved in which the kernel vectors satisfy the linearised equations worst.

    The residual falls as h^m where all is smooth, and not at all in an interval with a jump.
    """
    worst = _residuals(colloc, found)
    cut = worst > 0.1 * worst.max()
    return np.sort(np.concatenate([colloc.mesh, ((colloc.mesh[1:] + colloc.mesh[:-1]) / 2)[cut]]))


def _residuals(colloc: Collocation, found: Augmented) -> np.ndarray:
    return np.max([residual_along(colloc, found.state, v) for v in found.vectors], axis=0)


def _jump_error(colloc: Collocation, found: Augmented) -> float:
    return jump_error(_residuals(colloc, found), colloc.step)


Border = tuple[list[Row], Blocks]


def _border(
    colloc: Collocation, fine: Collocation, found: Augmented, carry: Callable[[Columns], Columns]
) -> Border | None:
    """Rows and column for a branch point on the finer mesh, from those of the coarse one; None at a fold."""
    old = found.column
    if old is None:
        return None
    vectors = [carry(v) for v in found.vectors]
    rows = [fine.row(scaled(v, 1.0 / fine.norm(v))) for v in vectors]
    # any column with a share along the left kernel vector will do: the old one's mean over each interval
    parent = np.searchsorted(colloc.mesh, (fine.mesh[1:] + fine.mesh[:-1]) / 2) - 1
    stage = np.repeat(old.stage.mean(axis=1)[parent][:, None, :], fine.scheme.points, axis=1)
    return rows, Blocks(stage, np.zeros((len(fine.step), stage.shape[2])), old.ends, old.dense)


def _solve(fine: Collocation, x: Columns, tangent: Columns, border: Border | None, iterations: int) -> Augmented:
    if border is None:
        return solve_fold(fine, x, tangent, max_iterations=iterations)
    return solve_branch_point(fine, x, tangent, max_iterations=iterations, border=border)
