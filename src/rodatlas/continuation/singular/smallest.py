"""How near a bordered matrix is to singular: its smallest singular values in norms of functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.random_fields import smooth_vectors
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization

SETTLED = 3e-3  # relative change of the values in one pass, below which no more of them are made
RANDOM_WAVES = 8  # cosines in which another weak mode is sought


def smallest_singular(
    colloc: Collocation, fac: Factorization, guess: Columns | None, scalars: int | None = None, passes: int = 1
) -> tuple[Columns | None, float]:
    r"""Smallest singular value of the bordered matrix, and its right vector, by inverse iteration.

    Norms are those of functions on both sides (residuals of the equations per unit length), so the value does not
    depend on the mesh. One pass of iteration from the vector of a neighbouring point is enough to follow it. The matrix
    has as many scalar unknowns as the problem has free parameters, or `scalars` of them.
    """
    found = smallest_singulars(colloc, fac, None if guess is None else (guess,), 1, scalars, passes)
    return (guess, 0.0) if found is None else (found[0][0], found[1][0])


def smallest_singulars(
    colloc: Collocation, fac: Factorization, guess: tuple[Columns, ...] | None, count: int = 2,
    scalars: int | None = None, passes: int = 1,
) -> tuple[tuple[Columns, ...], tuple[float, ...]] | None:  # fmt: skip
    r"""The `count` smallest singular values in ascending order, with their right vectors; None for a singular matrix.

    They are those of the problem's own equations, on vectors orthogonal to the ones that border the matrix (the rows of
    the border would add values of their own, of one, and hide larger ones). Block inverse iteration in the norms of
    :func:`smallest_singular`, with the values and vectors of

    .. math:: B_{ij} = \langle x_i, M^{-1} M^{-*} x_j \rangle, \qquad B c = \sigma^{-2} c.

    Where the problem declares continuous symmetries, the block has one vector more than is known from before, see
    :func:`_another`.
    """
    if fac.sign == 0.0:
        return None
    if guess is None:
        vectors = smooth_vectors(colloc, np.random.default_rng(11), count, 2, scalars or len(colloc.free))
        guess, passes = tuple(orthonormal(colloc, vectors)), 3
    elif colloc.bvp.generators:
        guess = (*guess, *_another(colloc, fac, guess))
    block, values = Block.of(colloc, guess), tuple[float, ...]()
    for _ in range(passes):
        images = Block.of(colloc, [_applied(colloc, fac, x) for x in block.columns])
        overlaps = block.overlaps(images)
        if not np.isfinite(overlaps).all() or not np.isfinite(images.vectors).all():
            return None
        inverse, turns = np.linalg.eigh((overlaps + overlaps.T) / 2)
        if not inverse[-1] > 0:
            return None
        before, values = values, tuple(float(1.0 / np.sqrt(max(v, 1e-300))) for v in inverse[::-1])
        block = images.combined(turns.T[::-1]).orthonormal()
        if all(abs(old - new) < SETTLED * new for old, new in zip(before, values, strict=False)) and before:
            break
    return tuple(block.columns)[:count], values[:count]


@dataclass(frozen=True)
class Block:
    """Some vectors of one discretisation as rows of one array: (count, size), with the weights (size,) of the inner
    product and the shapes of their parts."""

    vectors: np.ndarray
    weights: np.ndarray
    shapes: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, colloc: Collocation, vectors: Sequence[Columns]) -> Block:
        first = vectors[0]
        scalars = len(first.scalars)
        parts = [np.concatenate([v.stage.ravel(), v.mesh.ravel(), v.scalars]) for v in vectors]
        weights = colloc.kept(f"weights of vectors with {scalars} scalars", lambda: colloc.weights(scalars))
        return cls(np.array(parts), weights, (first.stage.shape, first.mesh.shape, first.scalars.shape))

    @property
    def columns(self) -> list[Columns]:
        """The vectors one by one."""
        stage, mesh, _ = self.shapes
        a = stage[0] * stage[1] * stage[2]
        b = a + mesh[0] * mesh[1]
        return [Columns(v[:a].reshape(stage), v[a:b].reshape(mesh), v[b:]) for v in self.vectors]

    def overlaps(self, other: Block) -> np.ndarray:
        """Inner products <x_i, y_j>."""
        return (self.weights * self.vectors) @ other.vectors.T

    def combined(self, factors: np.ndarray) -> Block:
        """The vectors sum_j factors[i, j] x_j."""
        return replace(self, vectors=factors @ self.vectors)

    def orthonormal(self, first: int = 0) -> Block:
        """Gram-Schmidt (twice) in the order given; the first ones are orthonormal already."""
        out = self.vectors.copy()
        for i in range(first, len(out)):
            for _ in range(2):
                if i:
                    out[i] -= (out[:i] @ (self.weights * out[i])) @ out[:i]
                out[i] /= np.sqrt(np.vdot(self.weights * out[i], out[i]))
        return replace(self, vectors=out)


def orthonormal(colloc: Collocation, vectors: Sequence[Columns], first: Sequence[Columns] = ()) -> list[Columns]:
    """Gram-Schmidt (twice) after the orthonormal vectors `first`, which are left out of the result."""
    return Block.of(colloc, [*first, *vectors]).orthonormal(len(first)).columns[len(first) :]


def _applied(colloc: Collocation, fac: Factorization, x: Columns) -> Columns:
    """The inverse of M* M, with norms of functions on both sides, applied to a vector."""
    row, own = colloc.row(x), colloc.bvp.n_integral
    assert row.stage is not None
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    left = fac.solve_transposed(Columns(row.stage, np.zeros_like(x.mesh), row.scalars))
    dense = np.append(left.dense[:own], np.zeros(len(left.dense) - own))
    return fac.solve(Blocks(per_length * left.stage, np.zeros_like(left.chain), left.ends, dense))


def _another(colloc: Collocation, fac: Factorization, known: Sequence[Columns]) -> list[Columns]:
    """A weak mode across known ones, from a random vector; none where round-off leaves nothing of it.

    Under a continuous symmetry most modes come in pairs, whose zeros leave no change of sign, and modes of different
    symmetry do not mix: iteration from known ones never leads to another that has become weaker.
    """
    (z,) = smooth_vectors(colloc, np.random.default_rng(41), 1, RANDOM_WAVES, len(known[0].scalars))
    with np.errstate(all="ignore"):
        for _ in range(2):
            (z,) = orthonormal(colloc, [z], known)
            z = _applied(colloc, fac, z)
        (z,) = orthonormal(colloc, [z], known)
    return [z] if np.isfinite(colloc.norm(z)) else []
