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
def solve_mesh(rhs_chain, rhs_ends, rhs_dense, merged, merge_piv, final, final_piv, u, scalars):
    """Solve the mesh-level system for u (N+1, n) and scalars (k,); the right-hand sides are overwritten."""
    n_int = rhs_chain.shape[0]
    n = rhs_chain.shape[1]
    q = rhs_ends.shape[0]
    r = rhs_dense.shape[0]
    k = scalars.shape[0]
    size = 2 * n + k
    low = np.empty((n_int, n))
    x = np.empty(2 * n + r)
    for a in range(n):
        x[n + a] = rhs_chain[0, a]
    for j in range(1, n_int):
        w = merged[j - 1]
        for a in range(n):
            x[a] = x[n + a]
        for a in range(n):
            x[n + a] = rhs_chain[j, a]
        for p in range(n):
            at = merge_piv[j - 1, p]
            t = x[at]
            x[at] = x[p]
            x[p] = t
        # the stored multipliers are in final row order, so the permutation goes first, as in LAPACK
        for p in range(n):
            t = x[p]
            for i in range(p + 1, 2 * n):
                x[i] -= w[i, p] * t
            for e in range(r):
                rhs_dense[e] -= w[2 * n + e, p] * t
        for a in range(n):
            low[j - 1, a] = x[a]
    y = np.empty(size)
    for a in range(n):
        y[a] = x[n + a]
    for e in range(q):
        y[n + e] = rhs_ends[e]
    for e in range(r):
        y[n + q + e] = rhs_dense[e]
    _lu_solve(final, final_piv, size, y)
    for a in range(n):
        u[0, a] = y[a]
        u[n_int, a] = y[n + a]
    for t in range(k):
        scalars[t] = y[2 * n + t]
    for j in range(n_int - 1, 0, -1):
        w = merged[j - 1]
        for a in range(n - 1, -1, -1):
            t = low[j - 1, a]
            for b in range(a + 1, n):
                t -= w[a, b] * u[j, b]
            for b in range(n):
                t -= w[a, n + b] * u[0, b]
                t -= w[a, 2 * n + b] * u[j + 1, b]
            for b in range(k):
                t -= w[a, 3 * n + b] * scalars[b]
            u[j, a] = t / w[a, a]


@njit(**_OPTIONS)
def solve_mesh_transposed(c_u, c_scal, merged, merge_piv, final, final_piv, chain, ends, dense):
    """Solve the transposed mesh-level system for the multipliers chain (N, n), ends (q,), dense (r,)."""
    n_int = chain.shape[0]
    n = chain.shape[1]
    q = ends.shape[0]
    r = dense.shape[0]
    k = c_scal.shape[0]
    size = 2 * n + k
    low = np.zeros((n_int, n))
    c = c_u.copy()
    s = c_scal.copy()
    for j in range(1, n_int):
        w = merged[j - 1]
        for a in range(n):
            t = c[j, a]
            for b in range(a):
                t -= w[b, a] * low[j - 1, b]
            low[j - 1, a] = t / w[a, a]
        for a in range(n):
            t = low[j - 1, a]
            for b in range(n):
                c[0, b] -= w[a, n + b] * t
                c[j + 1, b] -= w[a, 2 * n + b] * t
            for b in range(k):
                s[b] -= w[a, 3 * n + b] * t
    y = np.empty(size)
    for a in range(n):
        y[a] = c[0, a]
        y[n + a] = c[n_int, a]
    for t in range(k):
        y[2 * n + t] = s[t]
    _lu_solve_transposed(final, final_piv, size, y)
    x = np.empty(2 * n + r)
    for a in range(n):
        x[n + a] = y[a]
    for e in range(q):
        ends[e] = y[n + e]
    for e in range(r):
        dense[e] = y[n + q + e]
    for j in range(n_int - 1, 0, -1):
        w = merged[j - 1]
        for a in range(n):
            x[a] = low[j - 1, a]
        for p in range(n - 1, -1, -1):
            t = x[p]
            for i in range(p + 1, 2 * n):
                t -= w[i, p] * x[i]
            for e in range(r):
                t -= w[2 * n + e, p] * dense[e]
            x[p] = t
        for p in range(n - 1, -1, -1):
            at = merge_piv[j - 1, p]
            t = x[at]
            x[at] = x[p]
            x[p] = t
        for a in range(n):
            chain[j, a] = x[n + a]
        for a in range(n):
            x[n + a] = x[a]
    for a in range(n):
        chain[0, a] = x[n + a]
