r"""Normal forms: the reduced equation on the kernel, whose coefficients say what a bifurcation looks like."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.collocation import Collocation
from rodatlas.continuation.linear import Columns
from rodatlas.continuation.locus_system import Border, Bordered


def fold_quadratic(
    colloc: Collocation, x: Columns, border: Border, along: int, across: int
) -> tuple[np.ndarray, float]:
    r"""Reduced equation of a fold in two parameters where its locus is extreme in one of them.

    With p the scalar `along` and q the scalar `across`, the kernel of :math:`(F_x, F_p)` is spanned by
    :math:`v_1 = (\varphi, 0)` and :math:`v_2` with :math:`F_x v_2 = -F_p`; solutions are

    .. math:: (\psi\cdot F_q)\,\delta q + \tfrac12 \sum_{ij} a_i a_j\,\psi\cdot F''[v_i, v_j] = 0.

    Returns the form (2, 2) and :math:`\psi\cdot F_q`.
    """
    lin = colloc.linearize(x)
    b = Bordered(colloc, lin, border, list(range(2, len(colloc.free))))
    psi = b.left(x)
    phi, _ = b.solve(None, [1.0], {})
    beside, _ = b.solve(lin.column(along), [0.0], {along: 1.0})
    _, share = b.solve(lin.column(across), [0.0], {across: 1.0})
    vectors = (phi, beside)
    form = np.array([[colloc.second(x, v, psi).dot(w) for w in vectors] for v in vectors])
    return (form + form.T) / 2, -share
