"""How near a bordered matrix is to singular: its smallest singular value in norms of functions."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization

RANDOM_WAVES = 8  # cosines in which another weak mode is sought


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
        x, passes = _smooth(colloc, np.random.default_rng(11), scalars or len(colloc.free)), 3
    value = float("nan")
    for _ in range(passes):
        y = _applied(colloc, fac, x)
        overlap, size = colloc.row(x).dot(y), colloc.norm(y)
        if not (overlap > 0 and np.isfinite(size)):
            return guess, 0.0
        value, x = float(1.0 / np.sqrt(overlap)), scaled(y, 1.0 / size)
    if colloc.bvp.generators and guess is not None:
        return _weaker(colloc, fac, x, value)
    return x, value


def _applied(colloc: Collocation, fac: Factorization, x: Columns) -> Columns:
    """The inverse of K* K, with norms of functions on both sides, applied to a vector."""
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    row = colloc.row(x)
    assert row.stage is not None
    left = fac.solve_transposed(Columns(row.stage, np.zeros_like(x.mesh), row.scalars))
    return fac.solve(Blocks(per_length * left.stage, np.zeros_like(left.chain), left.ends, left.dense))


def _smooth(colloc: Collocation, rng: np.random.Generator, scalars: int, waves: int = 2) -> Columns:
    """A smooth random unit vector."""
    n = len(colloc.scale.unknowns)
    cosines = np.cos(np.pi * colloc.gauss[..., None] * np.arange(waves))
    stage = cosines @ rng.normal(size=(waves, n))
    x = Columns(stage, np.zeros((len(colloc.mesh), n)), rng.normal(size=scalars))
    return scaled(x, 1.0 / colloc.norm(x))


def _weaker(colloc: Collocation, fac: Factorization, x: Columns, value: float) -> tuple[Columns, float]:
    """The weaker one of a known mode and what a random vector across it leads to.

    Under a continuous symmetry most modes come in pairs, whose zeros leave no change of sign, and modes of different
    symmetry do not mix: iteration from one of them never leads to another that has become weaker.
    """
    z = _smooth(colloc, np.random.default_rng(41), len(x.scalars), RANDOM_WAVES)
    for _ in range(2):
        z = add(z, (-colloc.inner(x, z), x))
        z = _applied(colloc, fac, z)
        z = scaled(z, 1.0 / colloc.norm(z))
    z = add(z, (-colloc.inner(x, z), x))
    size = colloc.norm(z)
    if not (np.isfinite(size) and size > 0):
        return x, value
    pair = (x, scaled(z, 1.0 / size))
    images = [_applied(colloc, fac, v) for v in pair]
    squares, factors = np.linalg.eigh([[colloc.row(v).dot(w) for w in images] for v in pair])
    if not (np.isfinite(squares).all() and squares[-1] * value**2 > 1.0):
        return x, value
    y = add(scaled(images[0], float(factors[0, -1])), (float(factors[1, -1]), images[1]))
    return scaled(y, 1.0 / colloc.norm(y)), float(1.0 / np.sqrt(squares[-1]))
