"""The backend for many unknowns: the same elimination as in Numba, interval by interval, in blocks by LAPACK.

Blocks of hundreds of rows do not fit a processor's nearest memory; LAPACK cuts them so that they do. What it costs to
be called once per interval is little beside that. Notation as in `matrix.py`: N intervals, m stages, n unknowns, k
scalars, q rows at the ends, r dense rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs, dtrtrs
from scipy.sparse import csr_matrix

from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns


class SingularBlock(Exception):
    """A pivot is zero, or not a number."""


@dataclass(frozen=True)
class _Lu:
    """Factors of a matrix of at least as many rows as columns: P A = L U."""

    lu: np.ndarray
    exchanged: np.ndarray

    @classmethod
    def of(cls, a: np.ndarray) -> _Lu:
        lu, exchanged, info = dgetrf(a, overwrite_a=1)
        if info or not np.isfinite(lu).all():
            raise SingularBlock
        return cls(lu, exchanged)

    @property
    def determinant(self) -> tuple[float, float]:
        """(sign, log|det|) of the eliminated square."""
        diagonal = np.diagonal(self.lu)
        odd = (np.count_nonzero(self.exchanged != np.arange(len(self.exchanged))) + np.count_nonzero(diagonal < 0)) % 2
        return (-1.0 if odd else 1.0), float(np.log(np.abs(diagonal)).sum())

    def solve(self, b: np.ndarray, transposed: bool = False) -> np.ndarray:
        return np.asarray(dgetrs(self.lu, self.exchanged, b, trans=int(transposed))[0]).reshape(b.shape)

    @property
    def order(self) -> np.ndarray:
        """Rows of A in the order of those of L."""
        order = list(range(len(self.lu)))
        for i, at in enumerate(self.exchanged.tolist()):
            order[i], order[at] = order[at], order[i]
        return np.array(order)


class LapackFactorization:
    """Factors of one matrix; see :class:`rodatlas.continuation.linear.matrix.Factorization`."""

    def __init__(self, matrix: BorderedMatrix):
        self._matrix = matrix
        self.sign, self.log_det = 0.0, -np.inf
        try:
            with np.errstate(all="ignore"):  # of NaN and overflow, which end below with sign 0
                self._stages = _Stages(matrix)
                self._sens = self._stages.solve(matrix.stage_loads())
                self._mesh = _Mesh(matrix, self._sens)
        except SingularBlock:
            return
        log_det = self._stages.log_det + self._mesh.log_det
        if np.isfinite(log_det):
            self.sign, self.log_det = self._stages.sign * self._mesh.sign, log_det

    def solve(self, rhs: Blocks) -> Columns:
        a = self._matrix
        n_int, _, n, k = a.sizes
        stage = self._stages.solve(rhs.stage[..., None])[..., 0] if rhs.stage.any() else np.zeros_like(rhs.stage)
        chain = rhs.chain + np.einsum("i,jia->ja", a.scheme.c_stage, stage)
        dense = rhs.dense - a.dense.reshape(len(rhs.dense), stage.size) @ stage.ravel()
        mesh, scalars = self._mesh.solve(chain, rhs.ends, dense)
        moved = np.concatenate([mesh[:-1], np.broadcast_to(scalars, (n_int, k))], axis=1)
        stage += np.matmul(self._sens.reshape(n_int, -1, n + k), moved[:, :, None]).reshape(stage.shape)
        return Columns(stage, mesh, scalars)

    def solve_transposed(self, rhs: Columns) -> Blocks:
        a = self._matrix
        n_int, _, n, k = a.sizes
        pulled = np.matmul(rhs.stage.reshape(n_int, 1, -1), self._sens.reshape(n_int, -1, n + k))[:, 0]
        mesh = rhs.mesh.copy()
        mesh[:-1] += pulled[:, :n]
        chain, ends, dense = self._mesh.solve_transposed(mesh, rhs.scalars + pulled[:, n:].sum(axis=0))
        stage = rhs.stage + a.scheme.c_stage[:, None] * chain[:, None, :] - np.tensordot(dense, a.dense, axes=1)
        return Blocks(self._stages.solve_transposed(stage), chain, ends, dense)


class _Stages:
    """Stage equations, one strongly connected component of the unknowns after the other.

    For component c of interval j: A dU_c = r_c + U dU, where U (m size, m n) couples it to earlier components. Sign and
    log|det| are relative to the stages of u' = 0.
    """

    def __init__(self, a: BorderedMatrix):
        self._matrix = a
        n_int, m, _, _ = a.sizes
        sp = a.sparsity
        jac = a.step[:, None, None] * a.jac.reshape(n_int, m, -1)
        self.sign, self.log_det = 1.0, 0.0
        self._lu: list[list[_Lu]] = []  # by component (empty where it does not depend on itself) and interval
        self._feed: list[list[csr_matrix]] = []
        for c, members in enumerate(sp.components):
            size = len(members)
            own, up = (part[:, ptr[c] : ptr[c + 1]] for part, ptr in ((sp.own, sp.own_ptr), (sp.up, sp.up_ptr)))
            self._lu.append([self._factored(jac[j], own, size) for j in range(n_int)] if own.size else [])
            self._feed.append(self._coupling(jac, up, size) if up.size else [])

    def _factored(self, jac: np.ndarray, own: np.ndarray, size: int) -> _Lu:
        scheme, m = self._matrix.scheme, len(jac)
        block = np.zeros((m, size, m, size))  # columns first, as LAPACK wants them
        diagonal = np.arange(size)
        block[:, diagonal, :, diagonal] = scheme.d.T
        for i in range(m):
            block[i, own[2], i, own[1]] -= jac[i, own[0]]
        lu = _Lu.of(block.reshape(m * size, m * size).T)
        sign, log_det = lu.determinant
        self.sign *= sign * scheme.d_sign**size
        self.log_det += log_det - size * scheme.d_log
        return lu

    def _coupling(self, jac: np.ndarray, up: np.ndarray, size: int) -> list[csr_matrix]:
        n_int, m, n, _ = self._matrix.sizes
        stage = np.arange(m)[:, None]
        rows, columns = (stage * size + up[1]).ravel(), (stage * n + up[2]).ravel()
        return [csr_matrix((jac[j][:, up[0]].ravel(), (rows, columns)), shape=(m * size, m * n)) for j in range(n_int)]

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """A^-1 rhs (N, m, n, columns)."""
        n_int, m, n, columns = rhs.shape
        x = np.zeros_like(rhs)
        for members, lu, feed in zip(self._matrix.sparsity.components, self._lu, self._feed, strict=True):
            for j in range(n_int):
                r = rhs[j][:, members].reshape(-1, columns)
                if feed:
                    r = r + feed[j] @ x[j].reshape(m * n, columns)
                found = lu[j].solve(r) if lu else np.tensordot(self._matrix.scheme.d_inv, r, axes=1)
                x[j][:, members] = found.reshape(m, len(members), columns)
        return x

    def solve_transposed(self, rhs: np.ndarray) -> np.ndarray:
        """A^-T rhs (N, m, n): components in reverse order."""
        n_int, m, n = rhs.shape
        rest, w = rhs.copy(), np.empty_like(rhs)
        parts = zip(self._matrix.sparsity.components, self._lu, self._feed, strict=True)
        for members, lu, feed in reversed(list(parts)):
            for j in range(n_int):
                r = rest[j][:, members].ravel()
                found = lu[j].solve(r, transposed=True) if lu else self._matrix.scheme.d_inv.T @ r
                w[j][:, members] = found.reshape(m, -1)
                if feed:
                    rest[j] += (feed[j].T @ found).reshape(m, n)
        return w


@dataclass(frozen=True)
class _Merged:
    """A mesh point between two intervals, eliminated: P [front; chain] = [L1; L2] [U | right].

    `right` (n, 2n+k) has columns [u_0 | u_{j+1} | scalars]; `dense` (r, n) are the multipliers of the dense rows.
    """

    order: np.ndarray
    square: np.ndarray
    below: np.ndarray
    right: np.ndarray
    dense: np.ndarray

    def lower(self, b: np.ndarray, transposed: bool = False) -> np.ndarray:
        return np.asarray(dtrtrs(self.square, b, lower=1, unitdiag=1, trans=int(transposed))[0]).reshape(b.shape)

    def upper(self, b: np.ndarray, transposed: bool = False) -> np.ndarray:
        return np.asarray(dtrtrs(self.square, b, trans=int(transposed))[0]).reshape(b.shape)


class _Mesh:
    """Sequential pivoted elimination of u_1 .. u_{N-1}; what is left, [u_0 | u_N | scalars], is factored densely."""

    def __init__(self, a: BorderedMatrix, sens: np.ndarray):
        n_int, _, n, k = a.sizes
        q = len(a.b_left)
        self._sizes = (n_int, n, k, q)
        self._merged: list[_Merged] = []
        transfer = np.einsum("i,jiab->jab", a.scheme.c_stage, sens)
        transfer[:, :, :n] += a.scheme.c_left * np.eye(n)
        rows = np.einsum("rjia,jiab->jrb", a.dense, sens, optimize=True)
        front, dense = self._first(a, transfer[0], rows)
        self.sign, self.log_det = 1.0, 0.0
        for j in range(1, n_int):
            front, dense = self._merge(front, dense, transfer[j], rows[j])
        final = np.zeros((2 * n + k, 2 * n + k), order="F")
        final[:n] = front
        final[n : n + q] = np.hstack([a.b_left, a.b_right, a.b_scal])
        final[n + q :] = dense
        self._final = _Lu.of(final)
        self._count(self._final)

    def _first(self, a: BorderedMatrix, transfer: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the first interval, and the dense ones, with columns [u_0 | u_1 | scalars]."""
        n = a.sizes[2]
        front = np.hstack([-transfer[:, :n], np.eye(n), -transfer[:, n:]])
        scalars = a.dense_scal + rows[:, :, n:].sum(axis=0)
        return front, np.hstack([rows[0, :, :n], np.zeros((len(scalars), n)), scalars])

    def _merge(
        self, front: np.ndarray, dense: np.ndarray, transfer: np.ndarray, rows: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Eliminate the right end of `front`: the same rows with the next mesh point in its place."""
        n = len(front)
        panel = np.asfortranarray(np.vstack([front[:, n : 2 * n], -transfer[:, :n]]))
        lu = _Lu.of(panel)
        self._count(lu)
        rest = np.zeros((2 * n, front.shape[1]))
        rest[:n, :n], rest[:n, 2 * n :] = front[:, :n], front[:, 2 * n :]
        rest[n:, n : 2 * n], rest[n:, 2 * n :] = np.eye(n), -transfer[:, n:]
        rest = rest[lu.order]
        square = np.asfortranarray(lu.lu[:n])
        right = np.asarray(dtrtrs(square, rest[:n], lower=1, unitdiag=1)[0])
        pivoted = rows[:, :n] + dense[:, n : 2 * n]
        factors = np.asarray(dtrtrs(square, pivoted.T, trans=1)[0]).T if len(dense) else pivoted
        merged = _Merged(lu.order, square, np.ascontiguousarray(lu.lu[n:]), right, factors)
        self._merged.append(merged)
        kept = np.hstack([dense[:, :n], np.zeros((len(dense), n)), dense[:, 2 * n :]])
        return rest[n:] - merged.below @ right, kept - factors @ right

    def _count(self, lu: _Lu) -> None:
        sign, log_det = lu.determinant
        self.sign, self.log_det = self.sign * sign, self.log_det + log_det

    def solve(self, chain: np.ndarray, ends: np.ndarray, dense: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mesh values (N+1, n) and scalars (k,)."""
        n_int, n, _, _ = self._sizes
        front, low = chain[0], []
        for right, merged in zip(chain[1:], self._merged, strict=True):
            both = np.concatenate([front, right])[merged.order]
            low.append(merged.lower(both[:n]))
            front = both[n:] - merged.below @ low[-1]
            dense = dense - merged.dense @ low[-1]
        y = self._final.solve(np.concatenate([front, ends, dense]))
        u = np.empty((n_int + 1, n))
        u[0], u[n_int], scalars = y[:n], y[n : 2 * n], y[2 * n :]
        for j in range(n_int - 1, 0, -1):
            merged = self._merged[j - 1]
            u[j] = merged.upper(low[j - 1] - merged.right @ np.concatenate([u[0], u[j + 1], scalars]))
        return u, scalars

    def solve_transposed(self, mesh: np.ndarray, scalars: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Multipliers of the chain (N, n), of the ends (q,) and of the dense rows (r,)."""
        n_int, n, _, q = self._sizes
        c, s, low = mesh.copy(), scalars, []
        for j, merged in enumerate(self._merged, start=1):
            low.append(merged.upper(c[j], transposed=True))
            pulled = low[-1] @ merged.right
            c[0] -= pulled[:n]
            c[j + 1] -= pulled[n : 2 * n]
            s = s - pulled[2 * n :]
        y = self._final.solve(np.concatenate([c[0], c[n_int], s]), transposed=True)
        front, ends, dense = y[:n], y[n : n + q], y[n + q :]
        chain = np.empty((n_int, n))
        for j in range(n_int - 1, 0, -1):
            merged, both = self._merged[j - 1], np.empty(2 * n)
            top = merged.lower(low[j - 1] - front @ merged.below - dense @ merged.dense, transposed=True)
            both[merged.order] = np.concatenate([top, front])
            front, chain[j] = both[:n], both[n:]
        chain[0] = front
        return chain, ends, dense
