"""A run that starts at a multiple branch point: its kernel when no branch is known, and the ray to leave along."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import MeshControl
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.augmented import left_column, unit
from rodatlas.continuation.singular.kernel import Kernel, combined, combined_left, left_vectors, orthonormal, resolved
from rodatlas.continuation.singular.kernel import solved as solve_bordered
from rodatlas.continuation.singular.rays import Rays

LARGEST = 6  # multiplicity that is looked for
SINGULAR = 1e-6  # singular values of G that vanish, in units of the largest


def ray_at(
    colloc: Collocation, x: Columns, along: Columns, control: MeshControl
) -> tuple[Collocation, Columns, Columns] | None:
    """Discretization, state and unit tangent at a multiple branch point close to x; None when there is none.

    Of all branches through it that one is chosen whose tangent is nearest to `along` (either way).
    """
    kernel = _kernel_at(colloc, x)
    found = resolved(kernel, control)[0] if kernel is not None else None
    if found is None or not found.converged or found.residual > 1e-9 + control.tolerance:
        return None
    kernel = found.kernel
    ahead = along if kernel.colloc is colloc else colloc.interpolate(along, kernel.colloc)
    rays = Rays.of(kernel).directions
    if not rays:
        return None
    kernel.colloc.within = colloc.within
    return kernel.colloc, kernel.state, max(rays, key=lambda ray: kernel.colloc.inner(ray, ahead))


def _kernel_at(colloc: Collocation, x: Columns) -> Kernel | None:
    """The kernel of F' at x, when its dimension is three or more, from one solve with random borders.

    With more rows C and columns B than the kernel needs the bordered matrix is regular with probability one. Of its
    solutions, F' V = -B G, those combinations of V for which G vanishes make the kernel; the left one likewise.
    """
    rng, n = np.random.default_rng(29), len(colloc.scale.unknowns)
    waves = np.stack([np.cos(j * np.pi * colloc.gauss) for j in range(LARGEST + 1)])
    vectors, columns = [], []
    for _ in range(LARGEST + 1):
        stage = np.einsum("wji,wa->jia", waves, rng.normal(size=(LARGEST + 1, n)))
        vectors.append(Columns(stage, np.zeros_like(x.mesh), rng.normal(size=len(colloc.free))))
    for _ in range(LARGEST):
        stage = np.einsum("wji,wa->jia", waves, rng.normal(size=(LARGEST + 1, n))) * colloc.step[:, None, None]
        ends, dense = rng.normal(size=colloc.bvp.n_boundary), rng.normal(size=colloc.bvp.n_integral)
        columns.append(unit(Blocks(stage, np.zeros((len(colloc.step), n)), ends, dense)))
    at = solve_bordered(colloc, x, [colloc.row(v) for v in orthonormal(colloc, vectors)], columns)
    if at is None or not np.isfinite(at.g).all():
        return None
    u, sizes, vt = np.linalg.svd(at.g)
    count = int((sizes < SINGULAR * max(1.0, sizes[0])).sum())
    if not 2 <= count < LARGEST:
        return None
    lefts = left_vectors(colloc, at.fac, x, LARGEST)
    found = orthonormal(colloc, [combined(at.vectors, vt[-1 - i]) for i in range(count + 1)])
    left = tuple(left_column(colloc, combined_left(lefts, u[:, -1 - i])) for i in range(count))
    return Kernel(colloc, x, tuple(found), left)
