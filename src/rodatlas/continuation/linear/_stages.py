"""Numba kernels: elimination of the stages inside every interval, eight intervals at a time.

Intervals do not know of one another here, so LANES of them are eliminated in lockstep: each number becomes a row of
LANES numbers, one for each interval, which a processor handles at once however small the blocks are. Rows of the last
group that have no interval of their own repeat the last one.

Symbols: N intervals in G groups, m stages, n unknowns, k scalars; component c of the unknowns has `size` members and
`rows` = m size stage equations. Arrays in lanes are (.., LANES):

    lu (G, ., LANES)       eliminated rows [LU | sensitivities] of the components, offsets lu_ptr, each (rows, width)
    pivots (G, ., LANES)   rows exchanged, offsets piv_ptr
    feed (G, m n_up, LANES)  -h f_u of the nonzeros towards earlier components

All sizes are run-time values, so that one compilation, cached on disk, serves every problem. The kernels stay in one
file because a Numba cache does not notice changes of functions that live in another one.
"""

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 8

_OPTIONS: Any = {"cache": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}


def _subtract(typingctx, x, i, count, f, q, y, p):
    """x[i + c] -= f[q] * y[p + c] for all c < count, of arrays (., LANES).

    In vectors, because the compiler unrolls a loop over LANES before it comes to think of them.
    """

    def codegen(context, builder, signature, arguments):
        vector = ir.VectorType(ir.DoubleType(), LANES)

        def row(array, number):
            made = context.make_array(signature.args[array])(context, builder, arguments[array])
            return builder.gep(builder.bitcast(made.data, vector.as_pointer()), [arguments[number]])

        target, factor, source = row(0, 1), builder.load(row(3, 4), align=8), row(5, 6)
        count = arguments[2]
        with cgutils.for_range(builder, count, intp=count.type) as loop:
            at, other = (builder.gep(start, [loop.index]) for start in (target, source))
            product = builder.fmul(factor, builder.load(other, align=8), flags=("contract",))
            difference = builder.fsub(builder.load(at, align=8), product, flags=("contract",))
            builder.store(difference, at, align=8)
        return context.get_dummy_value()

    return types.void(x, i, count, f, q, y, p), codegen


subtract: Any = intrinsic(_subtract)


@njit(**_OPTIONS)
def _exchange(w, row, at, width, alike):
    """Exchange the row that begins at `row` with row at[l], lane by lane, or (the same in all lanes) as a whole."""
    if alike:
        other = at[0] * width
        if other != row:
            for j in range(width):
                for l in range(LANES):
                    t = w[row + j, l]
                    w[row + j, l] = w[other + j, l]
                    w[other + j, l] = t
        return
    for l in range(LANES):
        other = at[l] * width
        if other != row:
            for j in range(width):
                t = w[row + j, l]
                w[row + j, l] = w[other + j, l]
                w[other + j, l] = t


@njit(**_OPTIONS)
def _factor(w, rows, width, pivots, first, lanes):
    """Row elimination in place of w (rows * width, LANES), whose first `rows` columns become LU factors.

    Multipliers stay below the diagonal; `pivots` is filled from `first`. Returns (sign, log|det|) of the first `lanes`
    blocks together, sign 0 when one of them is singular.
    """
    sign, log_det = 1.0, 0.0
    best = np.empty(LANES)
    at = np.empty(LANES, dtype=np.int64)
    inverse = np.empty(LANES)
    for p in range(rows):
        for l in range(LANES):
            best[l], at[l] = -1.0, p
        for i in range(p, rows):
            for l in range(LANES):
                v = abs(w[i * width + p, l])
                if v > best[l]:
                    best[l], at[l] = v, i
        alike = True
        for l in range(LANES):
            if not best[l] > 0.0:
                return 0.0, -np.inf
            pivots[first + p, l] = at[l]
            alike = alike and at[l] == at[0]
        _exchange(w, p * width, at, width, alike)
        for l in range(LANES):
            inverse[l] = 1.0 / w[p * width + p, l]
        for l in range(lanes):
            log_det += np.log(best[l])
            if (inverse[l] < 0.0) != (at[l] != p):
                sign = -sign
        for i in range(p + 1, rows):
            f = i * width + p
            coupled = False
            for l in range(LANES):
                w[f, l] *= inverse[l]
                coupled = coupled or w[f, l] != 0.0
            if coupled:
                subtract(w, f + 1, width - p - 1, w, f, w, p * width + p + 1)
    return sign, log_det


@njit(**_OPTIONS)
def _back(w, rows, width):
    """Solve U X = B in place, where each row of w is [U | B]."""
    inverse = np.empty(LANES)
    for i in range(rows - 1, -1, -1):
        right = i * width + rows
        for j in range(i + 1, rows):
            coupled = False
            for l in range(LANES):
                coupled = coupled or w[i * width + j, l] != 0.0
            if coupled:
                subtract(w, right, width - rows, w, i * width + j, w, j * width + rows)
        for l in range(LANES):
            inverse[l] = 1.0 / w[i * width + i, l]
        for j in range(right, right + width - rows):
            for l in range(LANES):
                w[j, l] *= inverse[l]


@njit(**_OPTIONS)
def _solve(w, pivots, first, rows, x):
    """Overwrite x (rows, LANES) by A^-1 x; the stored multipliers are in final row order, so exchanges go first."""
    width = w.shape[0] // rows
    for p in range(rows):
        for l in range(LANES):
            at = pivots[first + p, l]
            if at != p:
                t = x[at, l]
                x[at, l] = x[p, l]
                x[p, l] = t
    for i in range(1, rows):
        for p in range(i):
            subtract(x, i, 1, w, i * width + p, x, p)
    for i in range(rows - 1, -1, -1):
        for p in range(i + 1, rows):
            subtract(x, i, 1, w, i * width + p, x, p)
        for l in range(LANES):
            x[i, l] /= w[i * width + i, l]


@njit(**_OPTIONS)
def _solve_transposed(w, pivots, first, rows, x):
    """Overwrite x (rows, LANES) by A^-T x."""
    width = w.shape[0] // rows
    for p in range(rows):
        for l in range(LANES):
            x[p, l] /= w[p * width + p, l]
        for i in range(p + 1, rows):
            subtract(x, i, 1, w, p * width + i, x, p)
    for p in range(rows - 1, 0, -1):
        for i in range(p):
            subtract(x, i, 1, w, p * width + i, x, p)
    for p in range(rows - 1, -1, -1):
        for l in range(LANES):
            at = pivots[first + p, l]
            if at != p:
                t = x[at, l]
                x[at, l] = x[p, l]
                x[p, l] = t


@njit(**_OPTIONS)
def _multiply(d, x, y):
    """y (m, LANES) = d x."""
    m = d.shape[0]
    for i in range(m):
        for l in range(LANES):
            y[i, l] = 0.0
        for j in range(m):
            f = d[i, j]
            for l in range(LANES):
                y[i, l] += f * x[j, l]


@njit(**_OPTIONS)
def _assemble(w, lead, width, c, j, jac, h, scal, d, d0, member_ptr, members, own_ptr, own, reach_ptr, reach):
    """Rows [A | d0 | scalars] of component c on the intervals j (LANES,), without what earlier components feed."""
    m = d.shape[0]
    size = member_ptr[c + 1] - member_ptr[c]
    nr = reach_ptr[c + 1] - reach_ptr[c]
    k = scal.shape[2]
    for a in range(size):
        ga = members[member_ptr[c] + a]
        column = lead
        while reach[reach_ptr[c] + column - lead] != ga:
            column += 1
        for i in range(m):
            row = (i * size + a) * width
            for l in range(LANES):
                w[row + column, l] = -d0[i]
            if lead > 0:
                for s in range(m):
                    for l in range(LANES):
                        w[row + s * size + a, l] = d[i, s]
            for t in range(k):
                for l in range(LANES):
                    w[row + lead + nr + t, l] = -scal[j[l] * m + i, ga, t]
    for e in range(own_ptr[c], own_ptr[c + 1]):
        for i in range(m):
            row = (i * size + own[1, e]) * width + i * size + own[2, e]
            for l in range(LANES):
                w[row, l] -= h[j[l]] * jac[j[l] * m + i, own[0, e]]


@njit(**_OPTIONS)
def factor_stages(
    jac, h, scal, d, d0, d_inv, member_ptr, members, coupled, own_ptr, own, up_ptr, up, reach_ptr, reach,
    lu_ptr, lu, piv_ptr, pivots, feed, sens,
):  # fmt: skip
    """Eliminate the stages of every interval: dU = sens [du_left, dscalars] + A^-1 r, component by component.

    jac (N*m, nnz), scal (N*m, n, k) derivatives of the stage equations, sens (N, m*n, n+k) is overwritten.
    Returns (sign, log|det|) of all stage matrices.
    """
    n_int, m, n, k = h.shape[0], d.shape[0], scal.shape[1], scal.shape[2]
    nc, n_up, total = member_ptr.shape[0] - 1, up.shape[1], n + k
    sign, log_det = 1.0, 0.0
    s = np.empty((m * n * total, LANES))  # sens of a group
    j = np.empty(LANES, dtype=np.int64)
    for g in range(lu.shape[0]):
        lanes = min(LANES, n_int - g * LANES)
        for l in range(LANES):
            j[l] = min(g * LANES + l, n_int - 1)
        for i in range(m):
            for e in range(n_up):
                for l in range(LANES):
                    feed[g, i * n_up + e, l] = -h[j[l]] * jac[j[l] * m + i, up[0, e]]
        s[:] = 0.0
        for c in range(nc):
            size = member_ptr[c + 1] - member_ptr[c]
            nr = reach_ptr[c + 1] - reach_ptr[c]
            rows = m * size
            lead = rows if coupled[c] else 0
            width = lead + nr + k
            w = lu[g, lu_ptr[c] : lu_ptr[c + 1]]
            w[:] = 0.0
            _assemble(w, lead, width, c, j, jac, h, scal, d, d0, member_ptr, members, own_ptr, own, reach_ptr, reach)
            for e in range(up_ptr[c], up_ptr[c + 1]):
                for i in range(m):
                    row, source = (i * size + up[1, e]) * width + lead, (i * n + up[2, e]) * total
                    for b in range(nr):
                        subtract(w, row + b, 1, feed[g], i * n_up + e, s, source + reach[reach_ptr[c] + b])
                    subtract(w, row + nr, k, feed[g], i * n_up + e, s, source + n)
            if coupled[c]:
                sg, ld = _factor(w, rows, width, pivots[g], piv_ptr[c], lanes)
                sign *= sg
                log_det += ld
                if sg == 0.0:
                    return 0.0, -np.inf
                _back(w, rows, width)
            for i in range(m):
                for a in range(size):
                    to = (i * n + members[member_ptr[c] + a]) * total
                    for b in range(nr + k):
                        at = to + (reach[reach_ptr[c] + b] if b < nr else n + b - nr)
                        if coupled[c]:
                            for l in range(LANES):
                                s[at, l] = w[(i * size + a) * width + lead + b, l]
                        else:
                            for p in range(m):
                                for l in range(LANES):
                                    s[at, l] += d_inv[i, p] * w[p * width + b, l]
        for l in range(lanes):
            for i in range(m * n):
                for b in range(total):
                    sens[j[l], i, b] = s[i * total + b, l]
    return sign, log_det


@njit(**_OPTIONS)
def _gather(r, g, x):
    """x (m*n, LANES) from r (N, m*n)."""
    for l in range(LANES):
        j = min(g * LANES + l, r.shape[0] - 1)
        for i in range(r.shape[1]):
            x[i, l] = r[j, i]


@njit(**_OPTIONS)
def _scatter(x, g, r):
    """Back to r (N, m*n)."""
    for l in range(min(LANES, r.shape[0] - g * LANES)):
        for i in range(r.shape[1]):
            r[g * LANES + l, i] = x[i, l]


@njit(**_OPTIONS)
def solve_stages(rhs, d_inv, member_ptr, members, coupled, up_ptr, up, lu_ptr, lu, piv_ptr, pivots, feed):
    """Overwrite rhs (N, m*n) by A^-1 rhs with the stored factors."""
    m, n_up = d_inv.shape[0], up.shape[1]
    n = rhs.shape[1] // m
    r = np.empty((m * n, LANES))
    x = np.empty((m * n, LANES))
    y = np.empty((m, LANES))
    for g in range(lu.shape[0]):
        _gather(rhs, g, r)
        for c in range(member_ptr.shape[0] - 1):
            first, size = member_ptr[c], member_ptr[c + 1] - member_ptr[c]
            for e in range(up_ptr[c], up_ptr[c + 1]):
                for i in range(m):
                    subtract(r, i * n + members[first + up[1, e]], 1, feed[g], i * n_up + e, r, i * n + up[2, e])
            for i in range(m):
                for a in range(size):
                    x[i * size + a] = r[i * n + members[first + a]]
            if coupled[c]:
                _solve(lu[g, lu_ptr[c] : lu_ptr[c + 1]], pivots[g], piv_ptr[c], m * size, x)
            else:
                _multiply(d_inv, x, y)
                x[:m] = y
            for i in range(m):
                for a in range(size):
                    r[i * n + members[first + a]] = x[i * size + a]
        _scatter(r, g, rhs)


@njit(**_OPTIONS)
def solve_stages_transposed(rhs, d_inv, member_ptr, members, coupled, up_ptr, up, lu_ptr, lu, piv_ptr, pivots, feed):
    """Overwrite rhs (N, m*n) by A^-T rhs with the stored factors: components in reverse order."""
    m, n_up = d_inv.shape[0], up.shape[1]
    n = rhs.shape[1] // m
    r = np.empty((m * n, LANES))
    x = np.empty((m * n, LANES))
    y = np.empty((m, LANES))
    d_inv_transposed = np.ascontiguousarray(d_inv.T)
    for g in range(lu.shape[0]):
        _gather(rhs, g, r)
        for c in range(member_ptr.shape[0] - 2, -1, -1):
            first, size = member_ptr[c], member_ptr[c + 1] - member_ptr[c]
            for i in range(m):
                for a in range(size):
                    x[i * size + a] = r[i * n + members[first + a]]
            if coupled[c]:
                _solve_transposed(lu[g, lu_ptr[c] : lu_ptr[c + 1]], pivots[g], piv_ptr[c], m * size, x)
            else:
                _multiply(d_inv_transposed, x, y)
                x[:m] = y
            for i in range(m):
                for a in range(size):
                    r[i * n + members[first + a]] = x[i * size + a]
            for e in range(up_ptr[c], up_ptr[c + 1]):
                for i in range(m):
                    subtract(r, i * n + up[2, e], 1, feed[g], i * n_up + e, r, i * n + members[first + up[1, e]])
        _scatter(r, g, rhs)
