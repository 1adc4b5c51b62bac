"""Compiled core of `rodatlas.rods.conjugate_points`; imported on first use, because it imports Numba.

A Lagrangian plane is held as a frame: 12 rows (p, eta, theta, xi), three each, whose six columns span the
plane. `(p, eta)` are the momenta conjugate to the rotation `theta` and the displacement `xi`; the symplectic
form is `omega(u, v) = q_u . p_v - p_u . q_v` with q = (theta, xi). The equations and the count are derived in
`rodatlas.rods.conjugate_points`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# Auxiliary planes q = tan(alpha) p. A plane has six angles to p = 0, and each of them lies within CLEARANCE
# (2.9 degrees) of one entry of this list at most: of seven entries one is always free.
ALPHAS = np.deg2rad(np.array([90.0, 76.0, 104.0, 62.0, 118.0, 48.0, 132.0]))
CLEARANCE = 0.05
# Sine of an angle that counts as zero throughout; a squared sine is known to about 1e-15.
ZERO_SINE = 1e-7
# One step must carry the plane q = 0 to angles in this sector, so that it meets no auxiliary plane on its way.
SECTOR = np.deg2rad(np.array([-3.0, 45.0]))


@njit(cache=True)
def _solve(matrix, rhs):
    """Overwrite `rhs` (n, k) by `matrix^-1 rhs` and `matrix` (n, n) by its factors; partial pivoting."""
    n = matrix.shape[0]
    k = rhs.shape[1]
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[pivot, i]):
                pivot = r
        if pivot != i:
            for c in range(i, n):
                matrix[i, c], matrix[pivot, c] = matrix[pivot, c], matrix[i, c]
            for c in range(k):
                rhs[i, c], rhs[pivot, c] = rhs[pivot, c], rhs[i, c]
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in range(i + 1, n):
                    matrix[r, c] -= factor * matrix[i, c]
                for c in range(k):
                    rhs[r, c] -= factor * rhs[i, c]
    for i in range(n - 1, -1, -1):
        for r in range(i + 1, n):
            factor = matrix[i, r]
            if factor != 0.0:
                for c in range(k):
                    rhs[i, c] -= factor * rhs[r, c]
        inverse = 1.0 / matrix[i, i]
        for c in range(k):
            rhs[i, c] *= inverse


@njit(cache=True)
def _stage_matrix(h, tableau, coefficients, matrix):
    """Fill `matrix` with `I - h A x F`: block (i, j) is `delta_ij I - h A_ij F_j`, F_j = coefficients[j]."""
    m, n = coefficients.shape[0], coefficients.shape[1]
    for i in range(m):
        for j in range(m):
            factor = h * tableau[i, j]
            for r in range(n):
                for c in range(n):
                    matrix[i * n + r, j * n + c] = -factor * coefficients[j, r, c]
    for r in range(m * n):
        matrix[r, r] += 1.0


@njit(cache=True)
def _gauss_step(h, tableau, weights, rotation, spin, frame, work):
    """Advance the columns of `frame` (12, k) by one step of the Gauss method, in place.

    Block triangular: eta' = spin eta, then (p, theta)' = rotation (p, theta) - (e3 x eta, 0), then
    xi' = spin xi - e3 x theta. The end value is `(1 - sum g) z + sum g_i Z_i` with g = b A^-1 = `weights`.
    """
    m, k = tableau.shape[0], frame.shape[1]
    small, large, matrix3, matrix6 = work
    keep = 1.0 - weights.sum()
    for i in range(m):
        small[3 * i : 3 * i + 3] = frame[3:6]
    _stage_matrix(h, tableau, spin, matrix3)
    _solve(matrix3, small)
    for i in range(m):
        large[6 * i : 6 * i + 3] = frame[0:3]
        large[6 * i + 3 : 6 * i + 6] = frame[6:9]
        for j in range(m):
            factor = h * tableau[i, j]
            for c in range(k):
                large[6 * i, c] += factor * small[3 * j + 1, c]
                large[6 * i + 1, c] -= factor * small[3 * j, c]
    for r in range(3):
        for c in range(k):
            value = keep * frame[3 + r, c]
            for i in range(m):
                value += weights[i] * small[3 * i + r, c]
            frame[3 + r, c] = value
    _stage_matrix(h, tableau, rotation, matrix6)
    _solve(matrix6, large)
    for i in range(m):
        small[3 * i : 3 * i + 3] = frame[9:12]
        for j in range(m):
            factor = h * tableau[i, j]
            for c in range(k):
                small[3 * i, c] += factor * large[6 * j + 4, c]
                small[3 * i + 1, c] -= factor * large[6 * j + 3, c]
    _stage_matrix(h, tableau, spin, matrix3)
    _solve(matrix3, small)
    for r in range(3):
        for c in range(k):
            momentum, angle, position = keep * frame[r, c], keep * frame[6 + r, c], keep * frame[9 + r, c]
            for i in range(m):
                momentum += weights[i] * large[6 * i + r, c]
                angle += weights[i] * large[6 * i + 3 + r, c]
                position += weights[i] * small[3 * i + r, c]
            frame[r, c], frame[6 + r, c], frame[9 + r, c] = momentum, angle, position


@njit(cache=True)
def _orthonormalize(frame, first):
    """Orthonormalize the six columns of `frame` from `first` on, in place (modified Gram-Schmidt, twice)."""
    for _ in range(2):
        for c in range(first, first + 6):
            for d in range(first, c):
                product = 0.0
                for r in range(12):
                    product += frame[r, d] * frame[r, c]
                for r in range(12):
                    frame[r, c] -= product * frame[r, d]
            norm = 0.0
            for r in range(12):
                norm += frame[r, c] * frame[r, c]
            norm = 1.0 / np.sqrt(norm)
            for r in range(12):
                frame[r, c] *= norm


@njit(cache=True)
def _angle_block(frame, first, angle, out):
    """`out = cos(angle) q - sin(angle) p` (6, 6): singular where the plane meets q = tan(angle) p."""
    cosine, sine = np.cos(angle), np.sin(angle)
    for r in range(6):
        for c in range(6):
            out[r, c] = cosine * frame[6 + r, first + c] - sine * frame[r, first + c]


@njit(cache=True)
def _gram(left, right, out):
    """`out` = symmetric part of `left^T right`, all (6, 6)."""
    for i in range(6):
        for j in range(6):
            value = 0.0
            for k in range(6):
                value += left[k, i] * right[k, j]
            out[i, j] = value
    for i in range(6):
        for j in range(i):
            out[i, j] = out[j, i] = 0.5 * (out[i, j] + out[j, i])


@njit(cache=True)
def negative_count(matrix, shift):
    """Number of eigenvalues of the symmetric `matrix` (n, n; overwritten) below `shift`.

    Householder reduction to a tridiagonal matrix, then its Sturm sequence; both are backward stable.
    """
    n = matrix.shape[0]
    vector = np.zeros(n)
    product = np.zeros(n)
    for k in range(n - 2):
        norm = 0.0
        for i in range(k + 1, n):
            norm += matrix[i, k] ** 2
        norm = np.sqrt(norm)
        if norm == 0.0:
            continue
        if matrix[k + 1, k] > 0.0:
            norm = -norm
        scale = norm * (norm - matrix[k + 1, k])
        for i in range(k + 1, n):
            vector[i] = matrix[i, k]
        vector[k + 1] -= norm
        overlap = 0.0
        for i in range(k + 1, n):
            product[i] = 0.0
            for j in range(k + 1, n):
                product[i] += matrix[i, j] * vector[j]
            product[i] /= scale
            overlap += product[i] * vector[i]
        overlap /= 2.0 * scale
        for i in range(k + 1, n):
            product[i] -= overlap * vector[i]
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                matrix[i, j] -= vector[i] * product[j] + product[i] * vector[j]
        matrix[k + 1, k] = norm
    count = 0
    pivot = 1.0
    for k in range(n):
        off = matrix[k, k - 1] if k > 0 else 0.0
        pivot = matrix[k, k] - shift - off * off / pivot
        if pivot == 0.0:
            pivot = 1e-300
        if pivot < 0.0:
            count += 1
    return count


@njit(cache=True)
def _free_angle(frame, first, block, gram):
    """The first of ALPHAS that no angle of the orthonormal plane comes within CLEARANCE of."""
    limit = np.sin(CLEARANCE) ** 2
    for alpha in ALPHAS:
        _angle_block(frame, first, alpha, block)
        _gram(block, block, gram)
        if negative_count(gram, limit) == 0:
            return alpha
    return np.nan


@njit(cache=True)
def _sector_defect(frame, first, low, high, gram):
    """How many of the six angles of the plane lie outside SECTOR."""
    _angle_block(frame, first, SECTOR[0], low)
    _angle_block(frame, first, SECTOR[1], high)
    _gram(low, high, gram)
    return 6 - negative_count(gram, 0.0)


@njit(cache=True)
def _omega(left, first, frame, start, out):
    """`out[i, j] = omega(left[:, first + i], frame[:, start + j])`, shape (6, 6)."""
    for i in range(6):
        for j in range(6):
            value = 0.0
            for r in range(6):
                value += left[6 + r, first + i] * frame[r, start + j] - left[r, first + i] * frame[6 + r, start + j]
            out[i, j] = value


@njit(cache=True)
def _between_image(frame, alpha, blocks):
    """Number of directions of the plane (columns 0-5) between the image plane (6-11) and q = tan(alpha) p.

    On the image plane V, the auxiliary plane U = (cos(alpha) I, sin(alpha) I) and the plane L itself, the form
    is `X(L)^T X(V)^-T omega(V, L)` with X the block of `_angle_block`; it is negative on those directions.
    """
    omega, own, image, gram = blocks
    _angle_block(frame, 6, alpha, own)
    for i in range(6):
        for j in range(6):
            image[i, j] = own[j, i]
    _omega(frame, 6, frame, 0, omega)
    _solve(image, omega)
    _angle_block(frame, 0, alpha, own)
    _gram(own, omega, gram)
    return negative_count(gram, 0.0)


@njit(cache=True)
def count_crossings(steps, tableau, weights, rotation, spin, tolerance):
    """Crossings of q = 0 in every step by the plane that starts there.

    Parameters: `steps` (n,), Gauss `tableau` (m, m) and `weights` (m,), `rotation` (n, m, 6, 6), `spin`
    (n, m, 3, 3), and `tolerance`: a crossing is counted at that angle below q = 0, so that the plane begins above.
    Returns the counts (n,), the orthonormal frame at the end (12, 6), the number of angles that stay zero,
    the number of steps that were too long, and the largest departure of a frame from a Lagrangian plane.
    """
    n, m = spin.shape[0], spin.shape[1]
    counts = np.zeros(n, np.int64)
    work = (np.zeros((3 * m, 12)), np.zeros((6 * m, 12)), np.zeros((3 * m, 3 * m)), np.zeros((6 * m, 6 * m)))
    blocks = (np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)))
    low, high, _, gram = blocks
    frame = np.zeros((12, 12))
    stuck, too_long, defect = 6, 0, 0.0
    for r in range(6):
        frame[r, r] = 1.0
    for step in range(n):
        frame[:, 6:] = 0.0
        for r in range(6):
            frame[r, 6 + r] = np.cos(tolerance)
            frame[6 + r, 6 + r] = -np.sin(tolerance)
        _gauss_step(steps[step], tableau, weights, rotation[step], spin[step], frame, work)
        _orthonormalize(frame, 0)
        _orthonormalize(frame, 6)
        _omega(frame, 0, frame, 0, gram)
        defect = max(defect, np.abs(gram).max())
        _angle_block(frame, 0, 0.0, low)
        _gram(low, low, gram)
        stuck = min(stuck, negative_count(gram, ZERO_SINE**2))
        alpha = _free_angle(frame, 0, low, gram)
        if not np.isfinite(alpha) or _sector_defect(frame, 6, low, high, gram) > 0:
            too_long += 1
        if np.isfinite(alpha):
            _angle_block(frame, 0, -tolerance, low)
            _angle_block(frame, 0, alpha, high)
            _gram(low, high, gram)
            counts[step] = negative_count(gram, 0.0) - _between_image(frame, alpha, blocks)
    return counts, frame[:, :6].copy(), stuck, too_long, defect
