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

from rodatlas.continuation.linear.gauss import GaussScheme
from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns

GROWTH = 1e3  # of the largest entry when unknowns are eliminated beforehand, up to which few digits are lost


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


class _Component:
    r"""Stage equations of one component, factored on all intervals.

    Of unknowns e that do not depend on one another, as the values in a system of second order, the stages are known
    from those of the rest k, and only these are factored:

    .. math:: \begin{pmatrix} D & -G \\ -H & B \end{pmatrix}, \qquad
              (B - H D^{-1} G)\, U_k = r_k + H D^{-1} r_e, \qquad U_e = D^{-1} (r_e + G U_k)

    with G and H block diagonal in the stages. Where that would lose digits nothing is eliminated beforehand.

    Parameters
    ----------
    scheme : GaussScheme
    jac : (N, m, nnz) of all nonzeros, times the intervals' lengths
    own : (3, .) number, row and column of those inside the component
    size : unknowns; eliminated : local numbers of those called e above
    """

    def __init__(self, scheme: GaussScheme, jac: np.ndarray, own: np.ndarray, size: int, eliminated: np.ndarray):
        self._scheme = scheme
        full = np.zeros((*jac.shape[:2], size, size))
        full[:, :, own[1], own[2]] = jac[:, :, own[0]]
        for some in (eliminated, eliminated[:0]):
            self._e, self._k = some, np.setdiff1d(np.arange(size), some)
            rows = full[:, :, self._k]
            self._h, self._g = rows[..., self._e], full[:, :, self._e][..., self._k]
            most = self._h.shape[-1] and np.abs(self._h).max() * np.abs(self._g).max() * np.abs(scheme.d_inv).max()
            if not most > GROWTH * max(np.abs(full).max(), np.abs(scheme.d).max()):
                break
        own_rows = rows[..., self._k]
        self._lu = [_Lu.of(self._block(*parts)) for parts in zip(self._h, self._g, own_rows, strict=True)]
        sign, log_det, at = 1.0, 0.0, len(self._k)
        for lu in self._lu:
            one, size_of_one = lu.determinant
            sign, log_det = sign * one * scheme.d_sign**at, log_det + size_of_one - at * scheme.d_log
        self.sign, self.log_det = sign, log_det

    def _block(self, h: np.ndarray, g: np.ndarray, own: np.ndarray) -> np.ndarray:
        """B - H D^-1 G on one interval, columns first."""
        scheme, (m, at) = self._scheme, own.shape[:2]
        block = np.empty((m, at, m, at)) if h.shape[2] else np.zeros((m, at, m, at))
        for i in range(m) if h.shape[2] else ():
            for l in range(m):
                np.matmul(g[l].T, h[i].T, out=block[l, :, i])
                block[l, :, i] *= -scheme.d_inv[i, l]
        block[np.arange(m), :, np.arange(m)] -= own.transpose(0, 2, 1)
        block[:, np.arange(at), :, np.arange(at)] += scheme.d.T
        return block.reshape(m * at, m * at).T

    def solve(self, b: np.ndarray, transposed: bool = False) -> np.ndarray:
        """Solution (N, m, size, columns) for a right-hand side of that shape."""
        d_inv, h, g = self._scheme.d_inv, self._h, self._g
        if transposed:
            d_inv, h, g = d_inv.T, g.swapaxes(2, 3), h.swapaxes(2, 3)
        x = np.empty_like(b)
        of_e = b[:, :, self._e]
        found = b[:, :, self._k] + np.matmul(h, _in_stages(d_inv, of_e))
        for lu, one in zip(self._lu, found, strict=True):
            one[:] = lu.solve(one.reshape(-1, b.shape[3]), transposed).reshape(one.shape)
        x[:, :, self._k] = found
        x[:, :, self._e] = _in_stages(d_inv, of_e + np.matmul(g, found))
        return x


def _in_stages(d: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A matrix (m, m) applied to stages (N, m, ., .)."""
    n_int, m, size, columns = x.shape
    return np.asarray(np.matmul(d, x.reshape(n_int, m, size * columns)).reshape(x.shape))


class _Stages:
    """Stage equations, one strongly connected component of the unknowns after the other.

    For component c: A dU_c = r_c + U dU, where U (N m size, N m n) couples it to earlier components. Sign and log|det|
    are relative to the stages of u' = 0.
    """

    def __init__(self, a: BorderedMatrix):
        self._matrix = a
        n_int, m, _, _ = a.sizes
        sp = a.sparsity
        jac = a.step[:, None, None] * a.jac.reshape(n_int, m, -1)
        self._parts: list[_Component | None] = []  # None where it does not depend on itself
        self._feed: list[csr_matrix | None] = []
        for c, size in enumerate(sp.counts.tolist()):
            own, up = (part[:, ptr[c] : ptr[c + 1]] for part, ptr in ((sp.own, sp.own_ptr), (sp.up, sp.up_ptr)))
            self._parts.append(_Component(a.scheme, jac, own, size, sp.independent[c]) if own.size else None)
            self._feed.append(self._coupling(jac, up, size) if up.size else None)
        self.sign = float(np.prod([part.sign for part in self._parts if part]))
        self.log_det = sum(part.log_det for part in self._parts if part)

    def _coupling(self, jac: np.ndarray, up: np.ndarray, size: int) -> csr_matrix:
        n_int, m, n, _ = self._matrix.sizes
        stage = np.arange(n_int * m)[:, None]
        rows, columns = (stage * size + up[1]).ravel(), (stage * n + up[2]).ravel()
        return csr_matrix((jac[:, :, up[0]].ravel(), (rows, columns)), shape=(n_int * m * size, n_int * m * n))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """A^-1 rhs (N, m, n, columns)."""
        x, d_inv = np.zeros_like(rhs), self._matrix.scheme.d_inv
        for members, part, feed in zip(self._matrix.sparsity.components, self._parts, self._feed, strict=True):
            r = rhs[:, :, members]
            if feed is not None:
                r += (feed @ x.reshape(-1, x.shape[3])).reshape(r.shape)
            x[:, :, members] = part.solve(r) if part else _in_stages(d_inv, r)
        return x

    def solve_transposed(self, rhs: np.ndarray) -> np.ndarray:
        """A^-T rhs (N, m, n): components in reverse order."""
        rest, w, d_inv = rhs[..., None].copy(), np.empty_like(rhs), self._matrix.scheme.d_inv
        parts = zip(self._matrix.sparsity.components, self._parts, self._feed, strict=True)
        for members, part, feed in reversed(list(parts)):
            r = rest[:, :, members]
            found = part.solve(r, transposed=True) if part else _in_stages(d_inv.T, r)
            w[:, :, members] = found[..., 0]
            if feed is not None:
                rest += (feed.T @ found.ravel()).reshape(rest.shape)
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
