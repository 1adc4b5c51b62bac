r"""Where along a curve the next branch points lie, seen from one of its points.

A branch point ahead at arclength tau is a vector phi, across the tangent t, with

.. math:: F'\varphi + \tau F''[t, \varphi] = 0, \qquad \varphi = -\tau A \varphi, \quad A = F'^{-1} F''[t, \cdot],

to first order; exactly where the state stays the same and the parameter enters linearly, as for a straight column. So
the eigenvalues of A of largest size belong to the nearest ones, ahead (tau > 0) and behind, whatever units and norms
are; pairs of complex ones come near no branch point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.directional import mixed_derivative
from rodatlas.continuation.discrete.random_fields import displacement
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization

REAL = 1e-3  # relative imaginary part up to which an eigenvalue is real


@dataclass(frozen=True)
class Crossings:
    """Signed distances of the next branch points along the curve, the nearest first, and their modes, of unit norm."""

    places: tuple[float, ...]
    modes: tuple[Columns, ...]

    @property
    def nearest(self) -> float:
        return self.places[0] if self.places else float("inf")


def next_crossings(
    colloc: Collocation, fac: Factorization, x: Columns, tangent: Columns, start: Columns | None = None, size: int = 12
) -> Crossings | None:
    """The branch points nearest to a state, by Arnoldi's method; None where F' is singular.

    Parameters
    ----------
    fac : of F' bordered with (about) the tangent.
    start : a mode to begin with, for a state near by; something smooth is added.
    size : dimension of the Krylov space; about a third of it are found well.
    """
    if fac.sign == 0.0:
        return None
    basis, h = [_first(colloc, start)], np.zeros((size + 1, size))
    for j in range(size):
        b = mixed_derivative(colloc, x, tangent, basis[j])
        if not np.isfinite(b.stage).all():
            return None
        y = fac.solve(Blocks(b.stage, b.chain, b.ends, np.append(b.dense, 0.0)))
        before = colloc.norm(y)
        if not np.isfinite(before):
            return None
        for _ in range(2):
            share = [colloc.inner(v, y) for v in basis]
            h[: j + 1, j] += share
            y = add(y, *((-s, v) for s, v in zip(share, basis, strict=True)))
        h[j + 1, j] = colloc.norm(y)
        if h[j + 1, j] <= 1e-12 * before or before == 0.0:
            size = j + 1
            break
        basis.append(scaled(y, 1.0 / h[j + 1, j]))
    values, factors = np.linalg.eig(h[:size, :size])
    real = [i for i in np.argsort(-np.abs(values)) if abs(values[i].imag) <= REAL * abs(values[i]) > 0.0]
    modes = []
    for i in real:
        v = factors[:, i].real
        mode = add(scaled(basis[0], float(v[0])), *zip(v[1:].tolist(), basis[1:size], strict=True))
        modes.append(scaled(mode, 1.0 / colloc.norm(mode)))
    return Crossings(tuple(float(-1.0 / values[i].real) for i in real), tuple(modes))


def _first(colloc: Collocation, start: Columns | None) -> Columns:
    """A smooth vector, with the mode that is known."""
    v = displacement(colloc, np.random.default_rng(19), len(colloc.free), 4)
    v = scaled(v, 1.0 / colloc.norm(v))
    if start is not None:
        v = add(scaled(start, 1.0 / colloc.norm(start)), (0.3, v))
    return scaled(v, 1.0 / colloc.norm(v))
