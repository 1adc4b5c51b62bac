"""The matrix of a problem bordered with kernel vectors and one artificial column, and what its solves tell."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Row, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization
from rodatlas.continuation.singular.smallest import smallest_singular

UPRIGHT = 1e-6  # kernel vectors at a branch point whose lambda components are below this are told apart by continuity


@dataclass(frozen=True)
class Border:
    """Kernel vectors (one at a fold, two at a branch point) that make the rows, and the artificial column."""

    vectors: tuple[Columns, ...]
    column: Blocks


@dataclass(frozen=True)
class Tests:
    """What is watched along a locus.

    values : test functions by name; determinant : sign and log|det| of the bordered matrix, whose zero means one more
    vector in the kernel; weakness : its smallest singular value with that sign; weakest : the right vector to it;
    shares : on a locus of folds, psi.F_lambda and psi.F_mu (up to a factor).
    """

    values: dict[str, float] = field(default_factory=dict)
    determinant: tuple[float, float] = (1.0, 0.0)
    shares: tuple[float, float] = (1.0, 1.0)
    weakness: float = 1.0
    weakest: Columns | None = field(default=None, repr=False)


class Bordered:
    """The factored matrix with the columns of some scalars, rows from kernel vectors, and one artificial column."""

    def __init__(self, colloc: Collocation, lin: Linearization, border: Border, scalars: list[int]):
        self.colloc, self.scalars = colloc, np.array(scalars, dtype=np.int64)
        rows = [colloc.row(v) for v in border.vectors]
        self.rows = [Row(r.scalars[self.scalars], r.stage) for r in rows]
        self.fac: Factorization = colloc.factor(lin.with_scalars(scalars), self.rows, [border.column])

    def solve(self, residual: Blocks | None, values: list[float], mu: dict[int, float]) -> tuple[Columns, float]:
        """Minus the residual (None: zero) and values on the rows -> vector with the other scalars set, share of b."""
        y = self.fac.solve(self.colloc.right_hand_side(residual, self.rows, values))
        scalars = np.zeros(len(self.colloc.free))
        scalars[self.scalars] = y.scalars[:-1]
        for index, value in mu.items():
            scalars[index] = value
        return Columns(y.stage, y.mesh, scalars), float(y.scalars[-1])

    def tests(self, values: dict[str, float], near: Columns | None, shares: tuple[float, float] = (1.0, 1.0)) -> Tests:
        """Test functions, with those of the matrix itself added."""
        weakest, value = smallest_singular(self.colloc, self.fac, near, len(self.scalars) + 1)
        return Tests(values, (self.fac.sign, self.fac.log_det), shares, self.fac.sign * value, weakest)

    def left(self, x: Columns) -> Blocks:
        one = np.zeros(len(self.scalars) + 1)
        one[-1] = 1.0
        return self.fac.solve_transposed(Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), one))


def overlap(w: Blocks, r: Blocks) -> float:
    """Sum of the products of a left vector and a residual, over the problem's own rows."""
    ends, dense = w.ends[: len(r.ends)], w.dense[: len(r.dense)]
    return float(np.vdot(w.stage, r.stage) + np.vdot(w.chain, r.chain) + ends @ r.ends + dense @ r.dense)


def norm_of(w: Blocks) -> float:
    """Euclidean length of a left vector."""
    return float(np.sqrt(overlap(w, w)))


def unit_vector(colloc: Collocation, v: Columns) -> Columns:
    """A tangent, kept in the symmetric subspace if there is one, as a unit vector."""
    v = colloc.kept_symmetric(v)
    return scaled(v, 1.0 / colloc.norm(v))
