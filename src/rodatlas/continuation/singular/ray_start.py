"""A run that starts at a multiple branch point: its kernel when no branch is known, and the ray to leave along."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import MeshControl
from rodatlas.continuation.discrete.random_fields import smooth_load, smooth_vectors
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.singular.bordered import BorderedSystem, combined_left, left_column, unit
from rodatlas.continuation.singular.kernel import Kernel, combined, resolved
from rodatlas.continuation.singular.rays import Rays
from rodatlas.continuation.singular.smallest import orthonormal

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
    rng, waves = np.random.default_rng(29), LARGEST + 1
    vectors = smooth_vectors(colloc, rng, LARGEST + 1, waves, len(colloc.free))
    columns = [unit(smooth_load(colloc, rng, waves)) for _ in range(LARGEST)]
    rows = [colloc.row(v) for v in orthonormal(colloc, vectors)]
    b = BorderedSystem(colloc, colloc.linearize(x), rows, columns)
    if b.is_singular:
        return None
    vectors, g = b.kernel()
    if not np.isfinite(g).all():
        return None
    u, sizes, vt = np.linalg.svd(g)
    count = int((sizes < SINGULAR * max(1.0, sizes[0])).sum())
    if not 2 <= count < LARGEST:
        return None
    lefts = b.left_vectors()
    found = orthonormal(colloc, [combined(vectors, vt[-1 - i]) for i in range(count + 1)])
    left = tuple(left_column(colloc, combined_left(lefts, u[:, -1 - i])) for i in range(count))
    return Kernel(colloc, x, tuple(found), left)
