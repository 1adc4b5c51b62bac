"""The portable backend: the same bordered matrix, assembled as a whole and factored by SuperLU."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

from rodatlas.continuation.linear import Blocks, BorderedMatrix, Columns


class ScipyFactorization:
    """Factors of one matrix; see :class:`rodatlas.continuation.linear.Factorization`."""

    def __init__(self, matrix: BorderedMatrix):
        self._matrix = matrix
        assembled = assemble(matrix)
        self.sign, self.log_det = 0.0, -np.inf
        try:
            self._lu = splu(assembled)
        except RuntimeError:  # SuperLU's word for an exactly singular matrix
            return
        diagonal = self._lu.U.diagonal()
        n_int, _, n, _ = matrix.sizes
        permuted = _parity(self._lu.perm_r) * _parity(self._lu.perm_c)
        self.log_det = float(np.log(np.abs(diagonal)).sum() - n_int * n * matrix.scheme.d_log)
        self.sign = float(np.prod(np.sign(diagonal)) * permuted * matrix.scheme.d_sign ** (n_int * n))
        # columns here are [u_0 .. u_N | scalars]; the Numba backend counts [u_1 .. u_{N-1}, u_0, u_N | scalars]
        self.sign *= (-1.0) ** (n * n * (n_int - 1))
        if not np.isfinite(self.log_det):
            self.sign, self.log_det = 0.0, -np.inf

    def solve(self, rhs: Blocks) -> Columns:
        n_int, m, n, k = self._matrix.sizes
        flat = np.concatenate([rhs.stage.ravel(), rhs.chain.ravel(), rhs.ends, rhs.dense])
        x = self._lu.solve(flat)
        stages = n_int * m * n
        return Columns(
            x[:stages].reshape(n_int, m, n), x[stages : stages + (n_int + 1) * n].reshape(n_int + 1, n), x[len(x) - k :]
        )

    def solve_transposed(self, rhs: Columns) -> Blocks:
        n_int, m, n, _ = self._matrix.sizes
        q = self._matrix.b_left.shape[0]
        x = self._lu.solve(np.concatenate([rhs.stage.ravel(), rhs.mesh.ravel(), rhs.scalars]), trans="T")
        stages, chain = n_int * m * n, n_int * n
        rest = x[stages + chain :]
        return Blocks(
            x[:stages].reshape(n_int, m, n), x[stages : stages + chain].reshape(n_int, n), rest[:q], rest[q:]
        )


def assemble(a: BorderedMatrix) -> csc_matrix:
    """The whole matrix of `linear.py` in sparse form, rows and columns in the order printed there."""
    n_int, m, n, k = a.sizes
    q, r = a.b_left.shape[0], a.dense.shape[0]
    stage = np.arange(n_int * m * n).reshape(n_int, m, n)
    mesh = stage.size + np.arange((n_int + 1) * n).reshape(n_int + 1, n)
    scal = stage.size + mesh.size + np.arange(k)
    chain = stage.size + np.arange(n_int * n).reshape(n_int, n)
    ends = stage.size + chain.size + np.arange(q)
    dense = stage.size + chain.size + q + np.arange(r)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def add(rows: np.ndarray, cols: np.ndarray, values: np.ndarray) -> None:
        parts.append(tuple(x.ravel() for x in np.broadcast_arrays(rows, cols, values)))  # type: ignore[arg-type]

    add(stage[:, :, None, :], stage[:, None, :, :], a.scheme.d[None, :, :, None])
    add(stage, mesh[:-1, None, :], a.scheme.d0[None, :, None])
    sp = a.sparsity
    jac = -a.step[:, None, None] * a.jac.reshape(n_int, m, -1)
    add(stage[:, :, sp.rows], stage[:, :, sp.cols], jac)
    add(stage[..., None], scal, a.stage_scal.reshape(n_int, m, n, k))
    add(chain, mesh[1:], np.array(1.0))
    add(chain, mesh[:-1], np.array(-a.scheme.c_left))
    add(chain[:, None, :], stage, -a.scheme.c_stage[None, :, None])
    add(ends[:, None], mesh[0], a.b_left)
    add(ends[:, None], mesh[-1], a.b_right)
    add(ends[:, None], scal, a.b_scal)
    add(dense[:, None], stage.ravel(), a.dense.reshape(r, stage.size))
    add(dense[:, None], scal, a.dense_scal)
    rows, cols, values = (np.concatenate(x) for x in zip(*parts, strict=True))
    size = stage.size + mesh.size + k
    return coo_matrix((values, (rows, cols)), shape=(size, size)).tocsc()


def _parity(permutation: np.ndarray) -> float:
    """Sign of a permutation, from its number of cycles."""
    seen = np.zeros(len(permutation), dtype=bool)
    cycles = 0
    for start in range(len(permutation)):
        if not seen[start]:
            cycles += 1
            at = start
            while not seen[at]:
                seen[at] = True
                at = permutation[at]
    return -1.0 if (len(permutation) - cycles) % 2 else 1.0
