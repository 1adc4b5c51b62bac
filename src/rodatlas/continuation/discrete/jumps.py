"""Jumps of the right-hand side inside an interval, which the Gauss points may not see.

The quadrature of a jump depends on the Gauss points at its two sides only. Where they carry the same weight on the
interval and on its halves, as they do when it lies in the middle or close to an end, the correction on halved intervals
vanishes, and tells nothing. So the polynomial's slope is compared with the right-hand side just inside both ends of an
interval, too. A jump makes a residual that stands out from that of both neighbors.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.linear.gauss import gauss_scheme, lagrange_basis
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.evaluator import evaluator

STANDS_OUT = 100.0  # times the residuals of both neighbors
INSIDE = 1e-5  # of an interval, from its ends: a jump on a mesh point is none, and 1/s at s = 0 is to be defined
JUMP_SHARE = 0.1  # of an interval: how far Gauss points may misplace a jump on which they seem to agree
NOISE = 1e-11  # residual per length that is round-off


def jump_error(residual: np.ndarray, step: np.ndarray) -> float:
    """Error that jumps make, from the largest residual on each interval (N,), per length; zero where there are none."""
    if len(step) < 3:
        return 0.0
    residual = np.where(np.isfinite(residual), residual, 0.0)  # where the right-hand side is not defined
    padded = np.concatenate([[0.0], residual, [0.0]])
    alone = residual > STANDS_OUT * np.maximum(padded[:-2], padded[2:]) + NOISE
    return float(JUMP_SHARE * (residual * step)[alone].max(initial=0.0))


def _at_ends(colloc: Collocation, x: Columns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, unknowns and parameters just inside the ends."""
    s = colloc.mesh[:-1, None] + colloc.step[:, None] * np.array([INSIDE, 1 - INSIDE])
    return s, values_at_ends(colloc, x) * colloc.scale.unknowns, colloc.parameters(x)


@lru_cache(maxsize=16)
def _bases(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Just inside the ends, the polynomials of a value (2, m+1) and of its slope (2, m)."""
    scheme, ends = gauss_scheme(points), np.array([INSIDE, 1 - INSIDE])
    return scheme.basis(ends), lagrange_basis(scheme.nodes, ends)


def values_at_ends(colloc: Collocation, v: Columns) -> np.ndarray:
    """A piecewise polynomial (N, 2, n) just inside the ends."""
    basis = _bases(colloc.scheme.points)[0]
    return basis[:, :1] * v.mesh[:-1, None, :] + np.matmul(basis[:, 1:], v.stage)


def slopes_at_ends(colloc: Collocation, v: Columns) -> np.ndarray:
    """Slopes (N, 2, n) of a piecewise polynomial just inside the ends, scaled."""
    scheme = colloc.scheme
    change = np.matmul(scheme.d, v.stage) + scheme.d0[:, None] * v.mesh[:-1, None, :]
    return np.matmul(_bases(scheme.points)[1], change) / colloc.step[:, None, None]


def residual_of(colloc: Collocation, x: Columns) -> np.ndarray:
    """Largest residual (N,) of a state just inside the ends of each interval, relative to the size of the unknowns."""
    su = colloc.scale.unknowns
    size = np.maximum(1.0, np.abs(x.mesh).max(axis=0) * su) / su
    values = colloc.kept("values at ends", lambda: evaluator(colloc.bvp.traced.values, 2 * len(colloc.step)))
    with np.errstate(all="ignore"):
        (f,) = values(*_at_ends(colloc, x))
    return _on_pieces(colloc, (slopes_at_ends(colloc, x) - f.reshape(len(colloc.step), 2, -1) / su) / size)


def residual_along(colloc: Collocation, x: Columns, v: Columns) -> np.ndarray:
    """The same of a vector v in the linearised equations at x, relative to its norm."""
    su, sparsity = colloc.scale.unknowns, colloc.bvp.sparsity
    field = colloc.kept("ends of intervals", lambda: evaluator(colloc.bvp.traced.field, 2 * len(colloc.step)))
    with np.errstate(all="ignore"):
        _, jac, f_p = (part.reshape(len(colloc.step), 2, -1) for part in field(*_at_ends(colloc, x)))
    f_p = f_p.reshape(len(colloc.step), 2, -1, len(su))
    ends = values_at_ends(colloc, v)
    vp = v.scalars[: len(colloc.free)] * colloc.scale.parameters[colloc.free]
    slope = np.zeros((*f_p.shape[:2], len(su)))
    for i, at in colloc.moving:
        slope += f_p[:, :, at] * vp[i] / su
    for i, (row, col) in enumerate(zip(sparsity.rows, sparsity.cols, strict=True)):
        slope[..., row] += jac[..., i] * su[col] / su[row] * ends[..., col]
    return _on_pieces(colloc, slopes_at_ends(colloc, v) - slope) / colloc.norm(v)


def _on_pieces(colloc: Collocation, residual: np.ndarray) -> np.ndarray:
    """Largest residual (N,) on each interval; at inner points, where collocation is exact, it is round-off."""
    return np.where(colloc.bvp.layout.is_inner[colloc.part], 0.0, np.abs(residual).max(axis=(1, 2)))
