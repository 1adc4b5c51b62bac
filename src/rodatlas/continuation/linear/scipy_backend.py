"""The portable backend: stages eliminated with stacked NumPy algebra, the mesh-level system factored by SuperLU.

With the stages gone, u_{j+1} = T_j u_j + T^s_j dsigma, and the rest of the matrix in `linear.py` becomes::

                 u_0   u_1   u_2  sigma
    chain  0  [ -T_0    I          -T^s ]
    chain  1  [       -T_1    I    -T^s ]
    ends      [   x           x      x  ]
    dense     [   x     x     x      x  ]

It is factored as a whole, border included, so folds are ordinary points.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns


class ScipyFactorization:
    """Factors of one matrix; see :class:`rodatlas.continuation.linear.matrix.Factorization`."""

    def __init__(self, matrix: BorderedMatrix):
        self._matrix = a = matrix
        self.sign, self.log_det = 0.0, -np.inf
        n_int, _, n, _ = a.sizes
        try:
            with np.errstate(all="ignore"):  # of NaN and overflow, which end below with sign 0
                self._stages = _Stages(a)
                self._sens = self._stages.solve(a.stage_loads())
                self._lu = splu(_mesh_matrix(a, self._sens), permc_spec="NATURAL")
        except (np.linalg.LinAlgError, RuntimeError):  # their words for an exactly singular matrix
            return
        diagonal = self._lu.U.diagonal()
        log_det = self._stages.log_det + float(np.log(np.abs(diagonal)).sum())
        sign = self._stages.sign * np.prod(np.sign(diagonal)) * _parity(self._lu.perm_r) * _parity(self._lu.perm_c)
        # columns here are [u_0 .. u_N | scalars]; the Numba backend counts [u_1 .. u_{N-1}, u_0, u_N | scalars]
        sign *= (-1.0) ** (n * n * (n_int - 1))
        if np.isfinite(log_det):
            self.sign, self.log_det = float(sign), float(log_det)

    def solve(self, rhs: Blocks) -> Columns:
        a = self._matrix
        n_int, _, n, k = a.sizes
        stage = self._stages.solve(rhs.stage[..., None])[..., 0]
        chain = rhs.chain + np.einsum("i,jia->ja", a.scheme.c_stage, stage)
        dense = rhs.dense - a.dense.reshape(len(rhs.dense), stage.size) @ stage.ravel()
        x = self._lu.solve(np.concatenate([chain.ravel(), rhs.ends, dense]))
        mesh, scalars = x[: (n_int + 1) * n].reshape(n_int + 1, n), x[len(x) - k :]
        moved = np.concatenate([mesh[:-1], np.broadcast_to(scalars, (n_int, k))], axis=1)
        stage += np.matmul(self._sens.reshape(n_int, -1, n + k), moved[:, :, None]).reshape(stage.shape)
        return Columns(stage, mesh, scalars)

    def solve_transposed(self, rhs: Columns) -> Blocks:
        a = self._matrix
        n_int, _, n, _ = a.sizes
        q = len(a.b_left)
        pulled = np.einsum("jrt,jr->jt", self._sens.reshape(n_int, -1, self._sens.shape[3]),
                           rhs.stage.reshape(n_int, -1))  # fmt: skip
        mesh = rhs.mesh.copy()
        mesh[:-1] += pulled[:, :n]
        y = self._lu.solve(np.concatenate([mesh.ravel(), rhs.scalars + pulled[:, n:].sum(axis=0)]), trans="T")
        chain, ends, dense = y[: n_int * n].reshape(n_int, n), y[n_int * n : n_int * n + q], y[n_int * n + q :]
        stage = rhs.stage + a.scheme.c_stage[:, None] * chain[:, None, :] - np.tensordot(dense, a.dense, axes=1)
        return Blocks(self._stages.solve_transposed(stage), chain, ends, dense)


class _Stages:
    """Stage equations of all intervals, one strongly connected component of the unknowns after the other.

    For component c: A_c dU_c = r_c + U_c dU, with A_c (N, m*size, m*size) and U_c (N, m, size, n) for the coupling to
    earlier components. Sign and log|det| are relative to the stages of u' = 0.
    """

    def __init__(self, a: BorderedMatrix):
        self._matrix = a
        n_int, m, n, _ = a.sizes
        sp = a.sparsity
        jac = a.step[:, None, None] * a.jac.reshape(n_int, m, -1)
        self.sign, self.log_det = 1.0, 0.0
        self._inverse, self._coupling = [], []
        for c, members in enumerate(sp.components):
            size = len(members)
            own, up = (part[:, ptr[c] : ptr[c + 1]] for part, ptr in ((sp.own, sp.own_ptr), (sp.up, sp.up_ptr)))
            if own.size:
                block = np.tile(np.kron(a.scheme.d, np.eye(size)), (n_int, 1, 1))
                for i in range(m):
                    block[:, i * size + own[1], i * size + own[2]] -= jac[:, i, own[0]]
                sign, log_det = np.linalg.slogdet(block)
                self.sign *= float(np.prod(sign) * a.scheme.d_sign ** (n_int * size))
                self.log_det += float(log_det.sum() - n_int * size * a.scheme.d_log)
                self._inverse.append(np.linalg.inv(block))
            else:
                self._inverse.append(np.kron(a.scheme.d_inv, np.eye(size))[None])
            coupling = np.zeros((n_int, m, size, n))
            coupling[:, :, up[1], up[2]] = jac[:, :, up[0]]
            self._coupling.append(coupling if up.size else None)

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """A^-1 rhs (N, m, n, columns)."""
        n_int, m, _, columns = rhs.shape
        x = np.zeros_like(rhs)
        for members, inverse, coupling in self._parts():
            r = rhs[:, :, members]
            if coupling is not None:
                r = r + np.matmul(coupling, x)
            x[:, :, members] = np.matmul(inverse, r.reshape(n_int, -1, columns)).reshape(n_int, m, -1, columns)
        return x

    def solve_transposed(self, rhs: np.ndarray) -> np.ndarray:
        n_int, m, _ = rhs.shape
        rest, w = rhs.copy(), np.zeros_like(rhs)
        for members, inverse, coupling in reversed(list(self._parts())):
            r = rest[:, :, members].reshape(n_int, -1, 1)
            found = np.matmul(inverse.transpose(0, 2, 1), r).reshape(n_int, m, -1)
            w[:, :, members] = found
            if coupling is not None:
                rest += np.matmul(coupling.transpose(0, 1, 3, 2), found[..., None])[..., 0]
        return w

    def _parts(self) -> Iterator[tuple[list[int], np.ndarray, np.ndarray | None]]:
        return zip(self._matrix.sparsity.components, self._inverse, self._coupling, strict=True)


def _mesh_matrix(a: BorderedMatrix, sens: np.ndarray) -> csc_matrix:
    """The mesh-level matrix drawn at the top."""
    n_int, _, n, k = a.sizes
    r = len(a.dense)
    transfer = np.einsum("i,jiab->jab", a.scheme.c_stage, sens)
    transfer[:, :, :n] += a.scheme.c_left * np.eye(n)
    rows = np.einsum("rjia,jiab->rjb", a.dense, sens) if r else np.zeros((0, n_int, n + k))
    values = np.concatenate([
        -transfer[:, :, :n].ravel(), np.ones(n_int * n), -transfer[:, :, n:].ravel(), a.b_left.ravel(),
        a.b_right.ravel(), a.b_scal.ravel(), rows[:, :, :n].ravel(),
        (a.dense_scal + rows[:, :, n:].sum(axis=1)).ravel(),
    ])  # fmt: skip
    order, indices, pointer = _mesh_pattern(n_int, n, k, len(a.b_left), r)
    size = (n_int + 1) * n + k
    return csc_matrix((values[order], indices, pointer), shape=(size, size))


@lru_cache(maxsize=64)
def _mesh_pattern(n_int: int, n: int, k: int, q: int, r: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Order of the values of :func:`_mesh_matrix` in compressed columns, their rows, and the column pointer."""
    mesh = np.arange((n_int + 1) * n).reshape(n_int + 1, n)
    scal = mesh.size + np.arange(k)
    chain = np.arange(n_int * n).reshape(n_int, n)
    ends, dense = chain.size + np.arange(q), chain.size + q + np.arange(r)
    pairs = [
        (chain[:, :, None], mesh[:-1, None, :]), (chain, mesh[1:]), (chain[:, :, None], scal),
        (ends[:, None], mesh[0]), (ends[:, None], mesh[-1]), (ends[:, None], scal),
        (dense[:, None, None], mesh[:-1]), (dense[:, None], scal),
    ]  # fmt: skip
    both = [np.broadcast_arrays(row, column) for row, column in pairs]
    rows, columns = (np.concatenate([pair[i].ravel() for pair in both]) for i in (0, 1))
    order = np.lexsort((rows, columns))
    pointer = np.searchsorted(columns[order], np.arange((n_int + 1) * n + k + 1))
    return order, rows[order].astype(np.int32), pointer.astype(np.int32)


def _parity(permutation: np.ndarray) -> float:
    """Sign of a permutation, from its number of cycles."""
    seen = [False] * len(permutation)
    cycles = 0
    following = permutation.tolist()
    for start in range(len(following)):
        if not seen[start]:
            cycles += 1
            at = start
            while not seen[at]:
                seen[at] = True
                at = following[at]
    return -1.0 if (len(following) - cycles) % 2 else 1.0
