"""How near a bordered matrix is to singular: its smallest singular value in norms of functions."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, scaled
from rodatlas.continuation.discrete.random_fields import smooth_vectors
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization


def smallest_singular(
    colloc: Collocation, fac: Factorization, guess: Columns | None, scalars: int | None = None, passes: int = 1
) -> tuple[Columns | None, float]:
    r"""Smallest singular value of the bordered matrix, and its right vector, by inverse iteration.

    Norms are those of functions on both sides (residuals of the equations per unit length), so the value does not
    depend on the mesh. One pass of iteration from the vector of a neighbouring point is enough to follow it. The matrix
    has as many scalar unknowns as the problem has free parameters, or `scalars` of them.
    """
    if fac.sign == 0.0:
        return guess, 0.0
    x = guess
    if x is None:
        (x,) = smooth_vectors(colloc, np.random.default_rng(11), 1, 2, scalars or len(colloc.free))
        x, passes = scaled(x, 1.0 / colloc.norm(x)), 3
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    value = float("nan")
    for _ in range(passes):
        row = colloc.row(x)
        assert row.stage is not None
        left = fac.solve_transposed(Columns(row.stage, np.zeros_like(x.mesh), row.scalars))
        y = fac.solve(Blocks(per_length * left.stage, np.zeros_like(left.chain), left.ends, left.dense))
        overlap, size = row.dot(y), colloc.norm(y)
        if not (overlap > 0 and np.isfinite(size)):
            return guess, 0.0
        value, x = float(1.0 / np.sqrt(overlap)), scaled(y, 1.0 / size)
    return x, value
