"""Kernel vectors at a fold or branch point, from one solve of a matrix with random borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.random_fields import smooth_load, smooth_vectors
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.locus.system import scalars_of
from rodatlas.continuation.singular.bordered import Border, BorderedSystem, left_column, unit
from rodatlas.continuation.singular.smallest import orthonormal


def kernel_border(kind: str, colloc: Collocation, x: Columns) -> Border | None:
    """Borders for the first linear problem of a locus.

    The bordered matrix with random rows and column is regular with probability one, and its solutions span the
    kernel: no iteration is needed.
    """
    scalars = scalars_of(kind, len(colloc.free))
    count = 1 if kind == "fold" else 2
    rng = np.random.default_rng(17)
    rows = []
    for v in smooth_vectors(colloc, rng, count, 3, len(scalars)):
        full = np.zeros(len(colloc.free))
        full[scalars] = v.scalars
        rows.append(colloc.row(replace(v, scalars=full)))
    b = BorderedSystem(colloc, colloc.linearize(x), rows, [unit(smooth_load(colloc, rng, 3))], scalars)
    if b.is_singular:
        return None
    return Border(tuple(orthonormal(colloc, b.kernel()[0])), left_column(colloc, b.left_vector(-1)))
