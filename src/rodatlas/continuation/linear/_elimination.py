"""Numba kernels: block elimination of a linearised collocation system (see `linear.py` for the matrix).

All sizes are run-time values, so that one compilation, cached on disk, serves every problem, mesh and number of
collocation points. Notation: N intervals, m stages, n unknowns, k scalars, q conditions at the ends, r dense rows.
They stay in one file because a Numba cache does not notice changes of functions that live in another one.
"""

from typing import Any

import numpy as np
from numba import njit

_OPTIONS: Any = {"cache": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}


@njit(**_OPTIONS)
def _factor_rows(a, n_rows, n_pivot_rows, n_pivots, pivots):
    """Row elimination in place of the first `n_pivots` columns of a (rows, cols), pivoting among `n_pivot_rows`.

    Multipliers stay below the diagonal. Returns (sign, log|det|) of the eliminated block, sign 0 when singular.
    """
    cols = a.shape[1]
    sign, log_det = 1.0, 0.0
    for p in range(n_pivots):
        best, at = -1.0, p
        for i in range(p, n_pivot_rows):
            v = abs(a[i, p])
            if v > best:
                best, at = v, i
        pivots[p] = at
        if not best > 0.0:
            return 0.0, -np.inf
        if at != p:
            sign = -sign
            for j in range(cols):
                t = a[p, j]
                a[p, j] = a[at, j]
                a[at, j] = t
        if a[p, p] < 0.0:
            sign = -sign
        log_det += np.log(best)
        inverse = 1.0 / a[p, p]
        for i in range(p + 1, n_rows):
            f = a[i, p] * inverse
            a[i, p] = f
            if f != 0.0:
                for j in range(p + 1, cols):
                    a[i, j] -= f * a[p, j]
    return sign, log_det


@njit(**_OPTIONS)
def _lu_solve(a, pivots, size, x):
    """Overwrite x by A^-1 x with the factors of `_factor_rows`; the stored multipliers are in final row order."""
    for p in range(size):
        t = x[pivots[p]]
        x[pivots[p]] = x[p]
        x[p] = t
    for p in range(size):
        t = x[p]
        for i in range(p + 1, size):
            x[i] -= a[i, p] * t
    for p in range(size - 1, -1, -1):
        t = x[p]
        for i in range(p + 1, size):
            t -= a[p, i] * x[i]
        x[p] = t / a[p, p]


@njit(**_OPTIONS)
def _lu_solve_transposed(a, pivots, size, x):
    """Overwrite x by A^-T x with the factors of `_factor_rows`."""
    for p in range(size):
        t = x[p] / a[p, p]
        x[p] = t
        for i in range(p + 1, size):
            x[i] -= a[p, i] * t
    for p in range(size - 1, -1, -1):
        t = x[p]
        for i in range(p + 1, size):
            t -= a[i, p] * x[i]
        x[p] = t
    for p in range(size - 1, -1, -1):
        t = x[pivots[p]]
        x[pivots[p]] = x[p]
        x[p] = t


@njit(**_OPTIONS)
def condense(sens, c_left, c_stage, dense, dense_scal, transfer, rows_u, rows_s):
    """Mesh-level system: u_{j+1} = transfer_j [u_j, scalars], dense rows rows_u (N+1, r, n) and rows_s (r, k)."""
    n_int = sens.shape[0]
    m = c_stage.shape[0]
    n = sens.shape[1] // m
    width = sens.shape[2]
    r = dense.shape[0]
    rows_u[:] = 0.0
    rows_s[:] = dense_scal
    for j in range(n_int):
        t = transfer[j]
        t[:] = 0.0
        for a in range(n):
            t[a, a] = c_left
        for i in range(m):
            ci = c_stage[i]
            for a in range(n):
                src = sens[j, i * n + a]
                for b in range(width):
                    t[a, b] += ci * src[b]
                for q in range(r):
                    f = dense[q, j, i, a]
                    if f != 0.0:
                        for b in range(n):
                            rows_u[j, q, b] += f * src[b]
                        for b in range(n, width):
                            rows_s[q, b - n] += f * src[b]


@njit(**_OPTIONS)
def factor_mesh(transfer, b_left, b_right, b_scal, rows_u, rows_s, merged, merge_piv, final, final_piv):
    """Sequential pivoted elimination of u_1 .. u_{N-1}; the rest is factored densely.

    merged (N-1, 2n+r, 3n+k) holds the eliminated pairs, columns [u_j | u_0 | u_{j+1} | scalars];
    final (2n+k, 2n+k) rows [chain | ends | dense], columns [u_0 | u_N | scalars].
    Returns (sign, log|det|).
    """
    n_int = transfer.shape[0]
    n = b_left.shape[1]
    k = b_scal.shape[1]
    q = b_left.shape[0]
    r = rows_s.shape[0]
    sign, log_det = 1.0, 0.0
    front = np.zeros((n, 2 * n + k))
    dense = np.zeros((r, 2 * n + k))
    for a in range(n):
        for b in range(n):
            front[a, b] = -transfer[0, a, b]
        front[a, n + a] = 1.0
        for t in range(k):
            front[a, 2 * n + t] = -transfer[0, a, n + t]
    for e in range(r):
        for b in range(n):
            dense[e, b] = rows_u[0, e, b]
        for t in range(k):
            dense[e, 2 * n + t] = rows_s[e, t]
    for j in range(1, n_int):
        w = merged[j - 1]
        w[:] = 0.0
        for a in range(n):
            for b in range(n):
                w[a, b] = front[a, n + b]
                w[a, n + b] = front[a, b]
                w[n + a, b] = -transfer[j, a, b]
            w[n + a, 2 * n + a] = 1.0
            for t in range(k):
                w[a, 3 * n + t] = front[a, 2 * n + t]
                w[n + a, 3 * n + t] = -transfer[j, a, n + t]
        for e in range(r):
            for b in range(n):
                w[2 * n + e, b] = rows_u[j, e, b] + dense[e, n + b]
                w[2 * n + e, n + b] = dense[e, b]
            for t in range(k):
                w[2 * n + e, 3 * n + t] = dense[e, 2 * n + t]
        sg, ld = _factor_rows(w, 2 * n + r, 2 * n, n, merge_piv[j - 1])
        sign *= sg
        log_det += ld
        if sg == 0.0:
            return 0.0, -np.inf
        for a in range(n):
            for b in range(2 * n + k):
                front[a, b] = w[n + a, n + b]
        for e in range(r):
            for b in range(2 * n + k):
                dense[e, b] = w[2 * n + e, n + b]
    final[:] = 0.0
    final[:n] = front
    for e in range(q):
        for b in range(n):
            final[n + e, b] = b_left[e, b]
            final[n + e, n + b] = b_right[e, b]
        for t in range(k):
            final[n + e, 2 * n + t] = b_scal[e, t]
    for e in range(r):
        for b in range(2 * n + k):
            final[n + q + e, b] = dense[e, b]
        for b in range(n):
            final[n + q + e, n + b] += rows_u[n_int, e, b]
    size = 2 * n + k
    sg, ld = _factor_rows(final, size, size, size, final_piv)
    return sign * sg, log_det + ld


@njit(**_OPTIONS)
def _downward(low, w, r, pivots, x, dense):
    """One merged pair of intervals: from x (2n) the row `low` (n) of the eliminated point; the rest is x[n:]."""
    n = low.shape[0]
    for p in range(n):
        at = pivots[p]
        t = x[at]
        x[at] = x[p]
        x[p] = t
    # the stored multipliers are in final row order, so the permutation goes first, as in LAPACK
    for i in range(1, 2 * n):
        t = x[i]
        for p in range(min(i, n)):
            t -= w[i, p] * x[p]
        x[i] = t
    for e in range(r):
        t = dense[e]
        for p in range(n):
            t -= w[2 * n + e, p] * x[p]
        dense[e] = t
    for a in range(n):
        low[a] = x[a]


@njit(**_OPTIONS)
def solve_mesh(stage, chain, ends, dense, c_stage, weights, sens, merged, merge_piv, final, final_piv, u, scalars):
    """Solve the mesh-level system for u (N+1, n) and scalars (k,), and put both into the stages.

    stage (N, m*n) enters as A^-1 r and leaves as the solution; weights (r, N, m*n) of the dense rows.
    """
    n_int, n, k, q, r = chain.shape[0], chain.shape[1], scalars.shape[0], ends.shape[0], dense.shape[0]
    m = c_stage.shape[0]
    rest = dense.copy()
    for e in range(r):
        for j in range(n_int):
            t = 0.0
            for i in range(m * n):
                t += weights[e, j, i] * stage[j, i]
            rest[e] -= t
    low = np.empty((n_int, n))
    x = np.empty(2 * n)
    for j in range(n_int):
        for a in range(n):
            x[a] = x[n + a]
            x[n + a] = chain[j, a]
        for i in range(m):
            for a in range(n):
                x[n + a] += c_stage[i] * stage[j, i * n + a]
        if j > 0:
            _downward(low[j - 1], merged[j - 1], r, merge_piv[j - 1], x, rest)
    y = np.empty(2 * n + k)
    y[:n] = x[n:]
    y[n : n + q] = ends
    y[n + q :] = rest
    _lu_solve(final, final_piv, 2 * n + k, y)
    u[0] = y[:n]
    u[n_int] = y[n : 2 * n]
    scalars[:] = y[2 * n :]
    for j in range(n_int - 1, 0, -1):
        w = merged[j - 1]
        for a in range(n - 1, -1, -1):
            t = low[j - 1, a]
            for b in range(a + 1, n):
                t -= w[a, b] * u[j, b]
            for b in range(n):
                t -= w[a, n + b] * u[0, b] + w[a, 2 * n + b] * u[j + 1, b]
            for b in range(k):
                t -= w[a, 3 * n + b] * scalars[b]
            u[j, a] = t / w[a, a]
    for j in range(n_int):
        for i in range(m * n):
            t = stage[j, i]
            for b in range(n):
                t += sens[j, i, b] * u[j, b]
            for b in range(k):
                t += sens[j, i, n + b] * scalars[b]
            stage[j, i] = t


@njit(**_OPTIONS)
def _upward(low, w, r, pivots, x, dense):
    """The transpose of `_downward`: x (2n) enters as [., multipliers of the rest] and leaves as those of both rows."""
    n = low.shape[0]
    for p in range(n):
        x[p] = low[p]
    for e in range(r):
        for p in range(n):
            x[p] -= w[2 * n + e, p] * dense[e]
    for i in range(2 * n - 1, 0, -1):
        t = x[i]
        for p in range(min(i, n)):
            x[p] -= w[i, p] * t
    for p in range(n - 1, -1, -1):
        at = pivots[p]
        t = x[at]
        x[at] = x[p]
        x[p] = t


@njit(**_OPTIONS)
def _loaded(stage, mesh, scal, sens):
    """Loads on mesh values (N+1, n) and scalars (k,), with those that the stages (N, m*n) hand on to them."""
    n, k = mesh.shape[1], scal.shape[0]
    c, s = mesh.copy(), scal.copy()
    for j in range(stage.shape[0]):
        for i in range(stage.shape[1]):
            f = stage[j, i]
            if f != 0.0:
                for b in range(n):
                    c[j, b] += f * sens[j, i, b]
                for b in range(k):
                    s[b] += f * sens[j, i, n + b]
    return c, s


@njit(**_OPTIONS)
def solve_mesh_transposed(
    stage, mesh, scal, c_stage, weights, sens, merged, merge_piv, final, final_piv, chain, ends, dense
):
    """Solve the transposed mesh-level system for the multipliers chain (N, n), ends (q,), dense (r,).

    stage (N, m*n) enters as the load on the stages and leaves as what is left for them, of which A^-T is to be taken.
    """
    n_int, n, k, q, r = chain.shape[0], chain.shape[1], scal.shape[0], ends.shape[0], dense.shape[0]
    m = c_stage.shape[0]
    c, s = _loaded(stage, mesh, scal, sens)
    low = np.empty((n_int, n))
    for j in range(1, n_int):
        w, x = merged[j - 1], low[j - 1]
        x[:] = c[j]
        for b in range(n):
            x[b] /= w[b, b]
            t = x[b]
            for a in range(b + 1, n):
                x[a] -= w[b, a] * t
            for a in range(n):
                c[0, a] -= w[b, n + a] * t
                c[j + 1, a] -= w[b, 2 * n + a] * t
            for a in range(k):
                s[a] -= w[b, 3 * n + a] * t
    y = np.empty(2 * n + k)
    y[:n] = c[0]
    y[n : 2 * n] = c[n_int]
    y[2 * n :] = s
    _lu_solve_transposed(final, final_piv, 2 * n + k, y)
    ends[:] = y[n : n + q]
    dense[:] = y[n + q :]
    x = np.empty(2 * n)
    x[:n] = y[:n]
    for j in range(n_int - 1, -1, -1):
        x[n:] = x[:n]
        if j > 0:
            _upward(low[j - 1], merged[j - 1], r, merge_piv[j - 1], x, dense)
        chain[j] = x[n:]
        for i in range(m):
            for a in range(n):
                stage[j, i * n + a] += c_stage[i] * x[n + a]
    for e in range(r):
        for j in range(n_int):
            for i in range(m * n):
                stage[j, i] -= weights[e, j, i] * dense[e]
