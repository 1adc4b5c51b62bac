"""Kernel vectors at a fold or branch point, from one solve of a matrix with random borders."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row, add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.locus.system import scalars_of
from rodatlas.continuation.singular.augmented import left_column, unit
from rodatlas.continuation.singular.bordered import Border


def kernel_border(kind: str, colloc: Collocation, x: Columns) -> Border | None:
    """Borders for the first linear problem of a locus.

    The bordered matrix with random rows and column is regular with probability one, and its solutions span the
    kernel: no iteration is needed.
    """
    scalars = scalars_of(kind, len(colloc.free))
    count = 1 if kind == "fold" else 2
    rng = np.random.default_rng(17)
    lin = colloc.linearize(x)
    n = x.stage.shape[2]
    weights = rng.normal(size=(count, 3, n))
    waves = np.stack([np.ones_like(colloc.gauss), np.cos(np.pi * colloc.gauss), np.cos(2 * np.pi * colloc.gauss)])
    rows = []
    for w in weights:
        stage = np.einsum("wji,wa->jia", waves, w)
        vector = Columns(stage, np.zeros_like(x.mesh), rng.normal(size=len(scalars)))
        row = colloc.row(vector)
        rows.append(Row(row.scalars, row.stage))
    stage = np.einsum("wji,wa->jia", waves, rng.normal(size=(3, n))) * colloc.step[:, None, None]
    ends, dense = rng.normal(size=colloc.bvp.n_boundary), rng.normal(size=colloc.bvp.n_integral)
    column = unit(Blocks(stage, np.zeros((len(colloc.step), n)), ends, dense))
    fac = colloc.factor(lin.with_scalars(scalars), rows, [column])
    if fac.sign == 0.0:
        return None
    vectors: list[Columns] = []
    for i in range(count):
        y = fac.solve(colloc.right_hand_side(None, rows, [float(i == j) for j in range(count)]))
        full = np.zeros(len(colloc.free))
        full[scalars] = y.scalars[:-1]
        v = Columns(y.stage, y.mesh, full)
        for other in vectors:
            v = add(v, (-colloc.inner(v, other), other))
        vectors.append(scaled(v, 1.0 / colloc.norm(v)))
    one = np.zeros(len(scalars) + 1)
    one[-1] = 1.0
    psi = fac.solve_transposed(Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), one))
    return Border(tuple(vectors), left_column(colloc, psi))
