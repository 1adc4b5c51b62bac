"""Compiled core of multiple shooting under large forces: elimination of the poses without growth of rounding errors.

The corrections z_k of the poses between K segments and the common unknowns c = (dn, dm0) obey::

    z_(k+1) = G_k z_k + H_k c + d_k,   z_0 = z_K = 0

Condensing, that is marching these from z_0 on, multiplies rounding errors by exp(sqrt|n/a|). Here each z_k is
eliminated from the six rows that are left of the segments before it and the six of its own segment, by Gauss's method
with row pivoting, which picks rows that fix growing parts from the right and decaying ones from the left.
Source of the idea: U. M. Ascher, R. M. M. Mattheij and R. D. Russell (1995), Numerical Solution of Boundary Value
Problems for Ordinary Differential Equations, section 7.2. Imported on first use, because it imports Numba.
"""

from __future__ import annotations

from numba import njit

WIDTH = 19  # columns z_k (6), z_(k+1) (6), c (6), right-hand side


@njit(cache=True)
def _eliminate(window):
    """Gauss on the first six columns of `window` (12, WIDTH); False when they are dependent."""
    for i in range(6):
        pivot = i
        for r in range(i + 1, 12):
            if abs(window[r, i]) > abs(window[pivot, i]):
                pivot = r
        if not abs(window[pivot, i]) > 1e-300:
            return False
        if pivot != i:
            for c in range(i, WIDTH):
                window[i, c], window[pivot, c] = window[pivot, c], window[i, c]
        for r in range(i + 1, 12):
            factor = window[r, i] / window[i, i]
            if factor != 0.0:
                for c in range(i + 1, WIDTH):
                    window[r, c] -= factor * window[i, c]
    return True


@njit(cache=True)
def compact(own, forced, gaps, window, kept, matrix, d):
    """Eliminate the poses and set up the equations of c.

    Parameters
    ----------
    own (K, 6, 6), forced (K, 6, 6), gaps (K, 6): G_k, H_k and d_k.
    window (12, WIDTH): work space. kept (K, 6, WIDTH): filled with the rows for :func:`expand`.
    matrix (6, 6), d (6,): filled with the equations `matrix c = d`.

    Returns
    -------
    False when the poses cannot be eliminated.
    """
    segments = own.shape[0]
    window[:] = 0.0
    for i in range(6):  # z_1 = H_0 c + d_0, in the columns of z_(k+1)
        window[6 + i, 6 + i] = 1.0
        window[6 + i, 12:18] = -forced[0, i]
        window[6 + i, 18] = gaps[0, i]
    for k in range(1, segments):
        for i in range(6):
            window[i, :6], window[i, 6:12], window[i, 12:] = window[6 + i, 6:12], 0.0, window[6 + i, 12:]
            window[6 + i, :6], window[6 + i, 6:12], window[6 + i, 12:18] = own[k, i], 0.0, forced[k, i]
            window[6 + i, 6 + i], window[6 + i, 18] = -1.0, -gaps[k, i]
        if not _eliminate(window):
            return False
        kept[k] = window[:6]
    matrix[:] = window[6:, 12:18]
    d[:] = window[6:, 18]
    return True


@njit(cache=True)
def expand(kept, d, moves):
    """The corrections z_k of the poses, `moves` (K + 1, 6), from c = `d` (6,) and the rows of :func:`compact`."""
    segments = kept.shape[0]
    moves[0], moves[segments] = 0.0, 0.0
    for k in range(segments - 1, 0, -1):
        for i in range(5, -1, -1):
            total = kept[k, i, 18]
            for c in range(6):
                total -= kept[k, i, 6 + c] * moves[k + 1, c] + kept[k, i, 12 + c] * d[c]
            for c in range(i + 1, 6):
                total -= kept[k, i, c] * moves[k, c]
            moves[k, i] = total / kept[k, i, i]
