"""A point that was reached with the factors of a state nearby: its tangent and test functions all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.curve.point import Frame
from rodatlas.continuation.discrete.newton import NewtonResult
from rodatlas.continuation.discrete.vectors import add, scaled

TRUSTED = 0.2  # largest relative change of the matrix along its weakest direction, up to which its sign is known


def reached(here: Frame, found: NewtonResult, step: float) -> Frame:
    r"""The frame at a corrected state, from the last factors that Newton made.

    They belong to a matrix :math:`M_0` when the state was corrected by chords, and :math:`M` is the one there. One
    correction :math:`t - M_0^{-1}(M t - r)` makes the tangent as good as the square of the difference, and
    :math:`M_0^{-1} M v = v + e` for the weakest direction v tells how the smallest singular value and the determinant
    have changed. Where e is not small the matrix is factored.
    """
    colloc, fac = here.colloc, found.factorization
    assert fac is not None
    rough = here.reached(found.state, fac, step)
    if not found.chord:
        return rough
    lin, rows = colloc.linearize(found.state), [colloc.row(here.tangent)]
    matrix, t, v = colloc.bordered(lin, rows), rough.tangent, rough.weakest
    if v is not None and rough.weakness > 0.0:
        off = add(fac.solve(matrix.times(v)), (-1.0, v))
        if colloc.norm(off) < TRUSTED:
            t = add(t, (1.0, t), (-1.0, colloc.kept_symmetric(fac.solve(matrix.times(t)))))  # as M_0 t = r
            change = 1.0 + colloc.inner(v, off)
            return replace(
                rough, tangent=scaled(t, 1.0 / colloc.norm(t)), weakness=change * rough.weakness,
                branch_test=(fac.sign, fac.log_det + float(np.log(change))),
            )  # fmt: skip
    return here.reached(found.state, colloc.factor(lin, rows), step)
