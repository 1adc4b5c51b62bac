r"""Linear algebra of collocation: one bordered almost-block-diagonal matrix, factored once, solved many times.

Unknowns: stages dU (N, m, n), mesh values du (N+1, n), scalars dsigma (k,). Rows::

    stages  j   D dU_j - h_j f_u dU_j + d0 du_j + S dsigma               = r_stage   (N, m, n)
    chain   j   du_{j+1} - c_left du_j - c_stage . dU_j                  = r_chain   (N, n)
    ends        B_left du_0 + B_right du_N + B_scal dsigma               = r_ends    (q,)
    dense       sum_j W_j . dU_j + W_scal dsigma                         = r_dense   (r,)

                 dU_0   dU_1   u_0 u_1 u_2  sigma
    stages 0  [   x             x             x   ]
    stages 1  [          x          x         x   ]
    chain  0  [   x             x   I             ]
    chain  1  [          x          x   I         ]
    ends      [                 x       x     x   ]
    dense     [   x      x                    x   ]

with q + r = n + k. The bordered matrix is factored as a whole, never the matrix at fixed parameters, so folds
are ordinary points.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from rodatlas.continuation.linear.gauss import GaussScheme
from rodatlas.continuation.linear.sparsity import Sparsity

LARGE = (
    144  # stage equations of one component from which on blocks of LAPACK pay: 36 unknowns that depend on each other
)


@dataclass(frozen=True)
class BorderedMatrix:
    """Blocks of the matrix above, in scaled variables.

    jac : (N*m, nnz) nonzeros of f_u at the Gauss points; stage_scal : (N*m, n, k); step : (N,) interval lengths;
    b_left, b_right : (q, n); b_scal : (q, k); dense : (r, N, m, n); dense_scal : (r, k).
    """

    scheme: GaussScheme
    sparsity: Sparsity
    step: np.ndarray
    jac: np.ndarray
    stage_scal: np.ndarray
    b_left: np.ndarray
    b_right: np.ndarray
    b_scal: np.ndarray
    dense: np.ndarray
    dense_scal: np.ndarray

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """(N, m, n, k)."""
        return len(self.step), self.scheme.points, self.sparsity.size, self.stage_scal.shape[2]

    def stage_loads(self) -> np.ndarray:
        """(N, m, n, n+k) what the left mesh value and the scalars do to the stage equations, as right-hand sides."""
        n_int, m, n, k = self.sizes
        loads = np.empty((n_int, m, n, n + k))
        loads[..., :n] = -self.scheme.d0[:, None, None] * np.eye(n)
        loads[..., n:] = -self.stage_scal.reshape(n_int, m, n, k)
        return loads

    def times(self, x: Columns) -> Blocks:
        """The matrix applied to a vector."""
        n_int, m, n, _ = self.sizes
        stage = np.matmul(self.scheme.d, x.stage) + self.scheme.d0[:, None] * x.mesh[:-1, None, :]
        by_entry = self.jac * x.stage.reshape(n_int * m, n)[:, self.sparsity.cols]
        stage -= self.step[:, None, None] * (by_entry @ self.sparsity.row_sums).reshape(n_int, m, n)
        stage += (self.stage_scal @ x.scalars).reshape(n_int, m, n)
        chain = x.mesh[1:] - self.scheme.c_left * x.mesh[:-1] - np.einsum("i,jia->ja", self.scheme.c_stage, x.stage)
        ends = self.b_left @ x.mesh[0] + self.b_right @ x.mesh[-1] + self.b_scal @ x.scalars
        dense = self.dense.reshape(len(self.dense), n_int * m * n) @ x.stage.ravel() + self.dense_scal @ x.scalars
        return Blocks(stage, chain, ends, dense)


@dataclass(frozen=True)
class Blocks:
    """A right-hand side, or a left vector: one array per kind of row."""

    stage: np.ndarray
    chain: np.ndarray
    ends: np.ndarray
    dense: np.ndarray


@dataclass(frozen=True)
class Columns:
    """A solution, or a linear functional: one array per kind of unknown."""

    stage: np.ndarray
    mesh: np.ndarray
    scalars: np.ndarray

    def dot(self, other: Columns) -> float:
        return float(
            np.vdot(self.stage, other.stage) + np.vdot(self.mesh, other.mesh) + np.vdot(self.scalars, other.scalars)
        )


class Factorization(Protocol):
    """What a backend returns: sign and log|det| of the whole matrix (0, -inf when singular), and both solves."""

    sign: float
    log_det: float

    def solve(self, rhs: Blocks) -> Columns: ...

    def solve_transposed(self, rhs: Columns) -> Blocks: ...


def backend_name() -> str:
    """'numba' or 'scipy': the environment variable RODATLAS_BACKEND, else numba where it is installed."""
    chosen = os.environ.get("RODATLAS_BACKEND", "")
    if chosen not in ("", "numba", "scipy"):
        raise ValueError(f"RODATLAS_BACKEND: expected 'numba' or 'scipy', got '{chosen}'")
    if chosen:
        return chosen
    return "numba" if _has_numba() else "scipy"


@cache
def _has_numba() -> bool:
    return find_spec("numba") is not None


def factor(matrix: BorderedMatrix, backend: str | None = None) -> Factorization:
    """Factor the matrix with the chosen backend, or the one for large blocks; all agree to round-off."""
    if backend == "lapack" or matrix.scheme.points * matrix.sparsity.largest >= LARGE:
        from rodatlas.continuation.linear.lapack_backend import LapackFactorization

        return LapackFactorization(matrix)
    if (backend or backend_name()) == "numba":
        from rodatlas.continuation.linear.numba_backend import NumbaFactorization

        return NumbaFactorization(matrix)
    from rodatlas.continuation.linear.scipy_backend import ScipyFactorization

    return ScipyFactorization(matrix)
