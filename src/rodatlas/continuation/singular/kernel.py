r"""The kernel at a multiple branch point: the bordered system that defines it, and Gauss-Newton for its place.

With F' of n rows and n + 1 columns, d + 1 rows C and d columns B, the solution of

.. math:: \begin{pmatrix} F' & B \\ C & 0 \end{pmatrix} \begin{pmatrix} V \\ G \end{pmatrix} =
          \begin{pmatrix} 0 \\ I_{d+1} \end{pmatrix}

has a d x (d + 1) block G that vanishes as a whole exactly where the kernel of F' has dimension d + 1: a branch point of
multiplicity d. Where only det G vanishes along a branch, the branch point is simple. (Govaerts 2000, chapter 3 and 4.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.mesh import MeshControl, halved, relative_change
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.bordered import BorderedSystem, left_column, loaded
from rodatlas.continuation.singular.smallest import orthonormal


@dataclass(frozen=True, eq=False)
class Kernel:
    """State x at which F' is singular d times, with what borders it.

    vectors : d + 1 orthonormal vectors that span the kernel, the first one near the tangent of the branch walked;
    columns : d left vectors, the columns B.
    """

    colloc: Collocation
    state: Columns
    vectors: tuple[Columns, ...]
    columns: tuple[Blocks, ...]

    @property
    def rows(self) -> list[Row]:
        return [self.colloc.row(v) for v in self.vectors]

    def moved(self, a: np.ndarray) -> Columns:
        """x + sum of a_j v_j."""
        return add(self.state, *zip(a.tolist(), self.vectors, strict=True))

    def coordinates(self, x: Columns) -> np.ndarray:
        """Kernel coordinates a (d + 1,) of a state."""
        dx = add(x, (-1.0, self.state))
        return np.array([self.colloc.inner(v, dx) for v in self.vectors])


def combined(vectors: Sequence[Columns], factors: np.ndarray) -> Columns:
    return add(scaled(vectors[0], float(factors[0])), *zip(factors[1:].tolist(), vectors[1:], strict=True))


@dataclass(frozen=True)
class _Polished:
    """Outcome of Gauss-Newton for G = 0: the kernel, whether it converged, the distance to G = 0, last correction."""

    kernel: Kernel
    converged: bool
    residual: float
    correction: Columns | None


def _polished(kernel: Kernel, tolerance: float = 1e-9, max_iterations: int = 10) -> _Polished:
    r"""Gauss-Newton for F(x) + B beta = 0, G(x) = 0.

    Newton's corrections of the first equation leave d + 1 coordinates of the kernel free; they are chosen so that the
    linearised d (d + 1) entries of G vanish in the sense of least squares. The derivative of an entry is
    :math:`\delta G_{ij} = -w_i\cdot F''[v_j, \delta x]`.
    """
    colloc, x, rows, columns = kernel.colloc, kernel.state, kernel.rows, kernel.columns
    d = len(columns)
    beta, before, residual, dx = np.zeros(d), np.inf, np.inf, None
    vectors: list[Columns] = []
    lefts, converged = list[Blocks](), False
    for _ in range(max_iterations):
        lin = colloc.linearize(x)
        b = BorderedSystem(colloc, lin, rows, columns)
        if b.is_singular:
            break
        (vectors, g), lefts = b.kernel(), b.left_vectors()
        bare, shares = b.solved(loaded(lin.residual, beta, columns), [0.0] * len(rows))
        gradients = [scaled(colloc.second(x, v, w), -1.0) for w in lefts for v in vectors]
        slopes = np.array([[p.dot(v) for v in vectors] for p in gradients])
        values = g.reshape(-1) + [p.dot(bare) for p in gradients]
        if not (np.isfinite(slopes).all() and np.isfinite(values).all()):
            break
        alpha = np.linalg.lstsq(slopes, -values, rcond=1e-8)[0]
        dx = add(bare, *zip(alpha.tolist(), vectors, strict=True))
        x, beta = add(x, (1.0, dx)), beta + shares + g @ alpha
        steepness = float(np.linalg.svd(slopes, compute_uv=False)[-1])
        missed = float(np.linalg.norm(values + slopes @ alpha) + np.linalg.norm(beta))
        size, residual = colloc.norm(dx), missed / max(steepness, 1e-8)
        converged = size < tolerance or (size < 1e3 * tolerance and size > 0.5 * before)
        if converged or size > 1.0:
            break
        before = size
    if not converged:
        return _Polished(replace(kernel, state=x), False, residual, dx)
    left = tuple(left_column(colloc, w) for w in lefts)
    return _Polished(Kernel(colloc, x, tuple(orthonormal(colloc, vectors)), left), True, residual, dx)


def resolved(kernel: Kernel, control: MeshControl) -> tuple[_Polished, float]:
    """The polished point on a mesh halved until it is known to the tolerance, and the estimated error.

    As in :func:`rodatlas.continuation.singular.refine.refined`; the mesh of the branch need not resolve the modes, and
    its error separates modes that belong together.
    """
    found, error = _polished(kernel), float("nan")
    while not control.is_fixed_size and 2 * (len(kernel.colloc.step)) <= control.intervals[1]:
        fine = _polished(_halved(found.kernel))
        if not fine.converged:
            break
        old, new = found.kernel, fine.kernel
        dx = add(new.state, (-1.0, old.colloc.interpolate(old.state, new.colloc)))
        change = relative_change(old.colloc, old.state, Columns(dx.stage, dx.mesh[::2], dx.scalars))
        error = change if found.converged else float("nan")
        settled = found.residual <= control.tolerance or fine.residual > 0.5 * found.residual
        if found.converged and error <= control.tolerance and settled:
            break
        found, kernel = fine, new
    return found, error


def _halved(kernel: Kernel) -> Kernel:
    """The kernel on a mesh of halved intervals; columns are carried as their means over each interval."""
    old = kernel.colloc
    fine = old.on(halved(old.mesh))
    carry = old.carrier(fine)

    def column(b: Blocks) -> Blocks:
        mean = np.repeat(b.stage.mean(axis=1), 2, axis=0)[:, None, :]
        return Blocks(
            np.repeat(mean, fine.scheme.points, axis=1), np.zeros((len(fine.step), mean.shape[2])), b.ends, b.dense
        )  # fmt: skip

    vectors = orthonormal(fine, [carry(v) for v in kernel.vectors])
    return Kernel(fine, carry(kernel.state), tuple(vectors), tuple(column(b) for b in kernel.columns))
