r"""Loci on which an observable keeps its value: F(X) = 0, G(X) = G_0 in two parameters, an ordinary bordered system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Row
from rodatlas.continuation.discrete.random_fields import smooth_vectors
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.bordered import Border, Tests, unit_vector


@dataclass(frozen=True)
class ValueLocal:
    """The linear problem at one state: rows of the equations, of the observable, and of the arclength.

    gap : G - G_0 at the state; row : gradient of G. It serves where :class:`Local` does for folds.
    """

    lin: Linearization
    gap: float
    row: Row
    border: Border

    def step(self, colloc: Collocation, normal: Columns, value: float) -> tuple[Columns, float] | None:
        """Correction with <normal, dX> = value (and no artificial unknown)."""
        dx = self._solve(colloc, normal, self.lin.residual, [-self.gap, value])
        return None if dx is None else (colloc.kept_symmetric(dx), 0.0)

    def tangent(self, colloc: Collocation, along: Columns) -> Columns | None:
        """Unit tangent of the locus with <tangent, along> > 0."""
        t = self._solve(colloc, along, None, [0.0, 1.0])
        return None if t is None else unit_vector(colloc, t)

    def null_vector(self, colloc: Collocation) -> Columns:
        """Unit tangent of the locus, of either sense."""
        (along,) = smooth_vectors(colloc, np.random.default_rng(13), 1, 1, len(colloc.free))
        t = self.tangent(colloc, along)
        return along if t is None else t

    def measure(self, near: Columns | None) -> Tests:
        """Nothing but the turns of the locus is watched."""
        return Tests()

    def _solve(
        self, colloc: Collocation, normal: Columns, residual: Blocks | None, values: list[float]
    ) -> Columns | None:
        rows = [self.row, colloc.row(normal)]
        fac = colloc.factor(self.lin, rows)
        return None if fac.sign == 0.0 else fac.solve(colloc.right_hand_side(residual, rows, values))


def value_problem(name: str, value: float, colloc: Collocation, x: Columns) -> ValueLocal | None:
    """The linear problem at a state; None when something is not finite."""
    lin = colloc.linearize(x)
    current, row = colloc.observable_row(name, x)
    if not (lin.is_finite and np.isfinite(current)):
        return None
    empty = Blocks(*(np.zeros_like(part) for part in vars(lin.residual).values()))
    return ValueLocal(lin, current - colloc.bvp.coordinate(name, value), row, Border((), empty))
