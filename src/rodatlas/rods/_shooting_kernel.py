"""Compiled core of `rodatlas.states.shooting`: condensed multiple shooting for the reduced clamped band.

Of the perfectly anisotropic rod only: k2 = 0, and the compliance of (k1, k2, tau) is diag(softness, 0, 1). The softness
1/a comes from :func:`rodatlas.rods.law.softness_of_band`, which refuses other laws.

The band is (q, X) with constant space force n and moment m(0), as in
:func:`rodatlas.rods.perfectly_anisotropic.reduced_problem`. A perturbation is a rotation phi and a displacement xi of
the cross-section, both in space components, and obeys, with r = X - X(0) and m = m(0) - r x n::

    phi' = d1 dk1 + d3 dtau                 xi' = phi x d3
    dk1  = (phi . (d1 x m) - xi . (n x d1) - dn . (d1 x r) + dm0 . d1) / a
    dtau =  phi . (d3 x m) - xi . (n x d3) - dn . (d3 x r) + dm0 . d3

Every segment starts from its own pose. With the poses free, a Newton step has six unknowns (dn, dm0) once those of
the poses are condensed: the columns that start a segment are those that ended the one before it (seven columns: six
for the unknowns, one for the defects), so each iteration integrates 9 + 6 x 7 numbers once over the rod.
Integration: Dormand and Prince's method of order 8 with equal steps (E. Hairer, S. P. Norsett and G. Wanner (1993),
Solving Ordinary Differential Equations I). Imported on first use, because it imports Numba.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.integrate import DOP853

from rodatlas.rods._compaction_kernel import WIDTH, compact, expand

STAGES = 12
TABLEAU = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
WEIGHTS = np.ascontiguousarray(DOP853.B[:STAGES])
STATE = 9  # q (4), X (3), int y ds, int (a k1^2 + tau^2)/2 ds
COLUMNS = 7
SIZE = STATE + 6 * COLUMNS
# One Newton step turns no pose by more than this (radians), and changes n and m(0) by at most a start value (in
# GJ/L^2 and GJ/L) and half their size: larger steps land on other solutions, or nowhere.
LARGEST_TURN, LARGEST_FORCE, LARGEST_MOMENT = 0.7, 60.0, 15.0


@njit(cache=True, fastmath=False)
def _rate(y, n, m0, x0, softness, out):
    """Derivative `out` (SIZE,) of state and columns `y` (SIZE,); softness = 1/a."""
    q0, q1, q2, q3 = y[0], y[1], y[2], y[3]
    a1, a2, a3 = 2 * (q0 * q0 + q1 * q1) - 1, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)
    t1, t2, t3 = 2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0 * q0 + q3 * q3) - 1
    r1, r2, r3 = y[4] - x0[0], y[5] - x0[1], y[6] - x0[2]
    n1, n2, n3 = n[0], n[1], n[2]
    m1, m2, m3 = m0[0] - r2 * n3 + r3 * n2, m0[1] - r3 * n1 + r1 * n3, m0[2] - r1 * n2 + r2 * n1
    k1 = (a1 * m1 + a2 * m2 + a3 * m3) * softness
    tau = t1 * m1 + t2 * m2 + t3 * m3
    out[0] = 0.5 * (-q1 * k1 - q3 * tau)
    out[1] = 0.5 * (q0 * k1 + q2 * tau)
    out[2] = 0.5 * (q3 * k1 - q1 * tau)
    out[3] = 0.5 * (-q2 * k1 + q0 * tau)
    out[4], out[5], out[6] = t1, t2, t3
    out[7] = y[5]
    out[8] = 0.5 * (k1 * k1 / softness + tau * tau)
    # d1 x m, n x d1, d1 x r, and the same for d3
    b1, b2, b3 = a2 * m3 - a3 * m2, a3 * m1 - a1 * m3, a1 * m2 - a2 * m1
    c1, c2, c3 = n2 * a3 - n3 * a2, n3 * a1 - n1 * a3, n1 * a2 - n2 * a1
    e1, e2, e3 = a2 * r3 - a3 * r2, a3 * r1 - a1 * r3, a1 * r2 - a2 * r1
    u1, u2, u3 = t2 * m3 - t3 * m2, t3 * m1 - t1 * m3, t1 * m2 - t2 * m1
    v1, v2, v3 = n2 * t3 - n3 * t2, n3 * t1 - n1 * t3, n1 * t2 - n2 * t1
    w1, w2, w3 = t2 * r3 - t3 * r2, t3 * r1 - t1 * r3, t1 * r2 - t2 * r1
    bend = (-e1, -e2, -e3, a1, a2, a3, 0.0)
    turn = (-w1, -w2, -w3, t1, t2, t3, 0.0)
    for c in range(COLUMNS):
        i = STATE + c
        p1, p2, p3 = y[i], y[i + COLUMNS], y[i + 2 * COLUMNS]
        x1, x2, x3 = y[i + 3 * COLUMNS], y[i + 4 * COLUMNS], y[i + 5 * COLUMNS]
        dk = (p1 * b1 + p2 * b2 + p3 * b3 - x1 * c1 - x2 * c2 - x3 * c3 + bend[c]) * softness
        dt = p1 * u1 + p2 * u2 + p3 * u3 - x1 * v1 - x2 * v2 - x3 * v3 + turn[c]
        out[i] = a1 * dk + t1 * dt
        out[i + COLUMNS] = a2 * dk + t2 * dt
        out[i + 2 * COLUMNS] = a3 * dk + t3 * dt
        out[i + 3 * COLUMNS] = p2 * t3 - p3 * t2
        out[i + 4 * COLUMNS] = p3 * t1 - p1 * t3
        out[i + 5 * COLUMNS] = p1 * t2 - p2 * t1


@njit(cache=True)
def _march(y, steps, h, n, m0, x0, softness, tableau, weights, rates, work):
    """Carry `y` (SIZE,) over equal steps of length h."""
    for _ in range(steps):
        for i in range(STAGES):
            work[:] = y
            for j in range(i):
                if tableau[i, j] != 0.0:
                    factor = h * tableau[i, j]
                    for k in range(SIZE):
                        work[k] += factor * rates[j, k]
            _rate(work, n, m0, x0, softness, rates[i])
        for j in range(STAGES):
            if weights[j] != 0.0:
                factor = h * weights[j]
                for k in range(SIZE):
                    y[k] += factor * rates[j, k]


@njit(cache=True)
def rotation_between(q, p, out):
    """Rotation vector `out` (3,), in space, that carries the quaternion p to q; of size up to 2 pi, as signs say."""
    r0 = q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3]
    out[0] = -q[0] * p[1] + q[1] * p[0] - q[2] * p[3] + q[3] * p[2]
    out[1] = -q[0] * p[2] + q[1] * p[3] + q[2] * p[0] - q[3] * p[1]
    out[2] = -q[0] * p[3] - q[1] * p[2] + q[2] * p[1] + q[3] * p[0]
    size = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    factor = 2.0 * np.arctan2(size, r0) / size if size > 1e-12 else 2.0
    for i in range(3):
        out[i] *= factor


@njit(cache=True)
def turn_pose(q, p1, p2, p3):
    """Turn the quaternion q (4,) by the rotation vector (p1, p2, p3) in space, and normalize it."""
    angle = np.sqrt(p1 * p1 + p2 * p2 + p3 * p3)
    s = np.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    c = np.cos(0.5 * angle)
    a0, a1, a2, a3 = q[0], q[1], q[2], q[3]
    p1, p2, p3 = s * p1, s * p2, s * p3
    q[0] = c * a0 - p1 * a1 - p2 * a2 - p3 * a3
    q[1] = c * a1 + p1 * a0 + p2 * a3 - p3 * a2
    q[2] = c * a2 - p1 * a3 + p2 * a0 + p3 * a1
    q[3] = c * a3 + p1 * a2 - p2 * a1 + p3 * a0
    size = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] /= size


@njit(cache=True)
def solve_six(matrix, rhs):
    """Overwrite `rhs` (6,) by `matrix^-1 rhs`, `matrix` (6, 6) destroyed; False when it is singular."""
    for i in range(6):
        pivot = i
        for r in range(i + 1, 6):
            if abs(matrix[r, i]) > abs(matrix[pivot, i]):
                pivot = r
        if not abs(matrix[pivot, i]) > 1e-300:
            return False
        if pivot != i:
            for c in range(i, 6):
                matrix[i, c], matrix[pivot, c] = matrix[pivot, c], matrix[i, c]
            rhs[i], rhs[pivot] = rhs[pivot], rhs[i]
        for r in range(i + 1, 6):
            factor = matrix[r, i] / matrix[i, i]
            for c in range(i + 1, 6):
                matrix[r, c] -= factor * matrix[i, c]
            rhs[r] -= factor * rhs[i]
    for i in range(5, -1, -1):
        for c in range(i + 1, 6):
            rhs[i] -= matrix[i, c] * rhs[c]
        rhs[i] /= matrix[i, i]
    return True


@njit(cache=True)
def _linearize(poses, n, m0, softness, steps, tableau, weights, rates, work, y, columns):
    """March all segments: fill `columns` (K, 6, 7) at their ends; returns the largest defect.

    `poses` (K + 1, 7) hold (q, X), the clamps first and last. Leaves height and energy in y[7], y[8].
    """
    segments = poses.shape[0] - 1
    h = 1.0 / (segments * steps)
    gap = np.empty(3)
    largest = 0.0
    y[:] = 0.0
    for k in range(segments):
        y[:7] = poses[k]
        _march(y, steps, h, n, m0, poses[0, 4:], softness, tableau, weights, rates, work)
        rotation_between(y[:4], poses[k + 1, :4], gap)
        for i in range(3):
            shift = y[4 + i] - poses[k + 1, 4 + i]
            y[STATE + i * COLUMNS + 6] += gap[i]
            y[STATE + (3 + i) * COLUMNS + 6] += shift
            largest = max(largest, abs(gap[i]), abs(shift))
        for i in range(6):
            for c in range(COLUMNS):
                columns[k, i, c] = y[STATE + i * COLUMNS + c]
    return largest if np.isfinite(y[:STATE].sum()) else np.inf


@njit(cache=True)
def _linearize_apart(poses, n, m0, softness, steps, tableau, weights, rates, work, y, own, forced, gaps):
    """March all segments apart: fill G_k, H_k and d_k of :mod:`rodatlas.rods._compaction_kernel`; as `_linearize`.

    Each segment is marched twice, with the columns of the common unknowns alone, and with a unit column added to each.
    """
    segments = poses.shape[0] - 1
    h = 1.0 / (segments * steps)
    largest, height, energy = 0.0, 0.0, 0.0
    for k in range(segments):
        for unit in range(2):
            y[:] = 0.0
            y[:7] = poses[k]
            if unit == 1:
                for i in range(6):
                    y[STATE + i * COLUMNS + i] = 1.0
            _march(y, steps, h, n, m0, poses[0, 4:], softness, tableau, weights, rates, work)
            for i in range(6):
                for c in range(6):
                    value = y[STATE + i * COLUMNS + c]
                    if unit == 0:
                        forced[k, i, c] = value
                    else:
                        own[k, i, c] = value - forced[k, i, c]
        height, energy = height + y[7], energy + y[8]
        rotation_between(y[:4], poses[k + 1, :4], gaps[k, :3])
        for i in range(3):
            gaps[k, 3 + i] = y[4 + i] - poses[k + 1, 4 + i]
            largest = max(largest, abs(gaps[k, i]), abs(gaps[k, 3 + i]))
    y[7], y[8] = height, energy
    return largest if np.isfinite(y[:STATE].sum()) else np.inf


@njit(cache=True)
def _condensed(columns, d, moves):
    """Corrections of the poses, `moves` (K + 1, 6), from `d` (6,) and the columns of :func:`_linearize`."""
    segments = columns.shape[0]
    moves[0], moves[segments] = 0.0, 0.0
    for k in range(segments - 1):
        for i in range(6):
            total = columns[k, i, 6]
            for c in range(6):
                total += columns[k, i, c] * d[c]
            moves[k + 1, i] = total


@njit(cache=True)
def _step_length(moves, d, n, m0):
    """Part of the Newton step d (6,) = (dn, dm0) that may be taken; see LARGEST_TURN."""
    turn = np.abs(moves[:, :3]).max()
    length = min(1.0, LARGEST_TURN / max(turn, 1e-300))
    force, moment = np.sqrt(np.sum(d[:3] ** 2)), np.sqrt(np.sum(d[3:] ** 2))
    length = min(length, (LARGEST_FORCE + 0.5 * np.sqrt(np.sum(n**2))) / max(force, 1e-300))
    return min(length, (LARGEST_MOMENT + 0.5 * np.sqrt(np.sum(m0**2))) / max(moment, 1e-300))


@njit(cache=True)
def _take(poses, n, m0, moves, d, length):
    """Apply a part of the Newton step to n, m0 and the inner poses."""
    for k in range(1, poses.shape[0] - 1):
        turn_pose(poses[k, :4], length * moves[k, 0], length * moves[k, 1], length * moves[k, 2])
        poses[k, 4:] += length * moves[k, 3:]
    n += length * d[:3]
    m0 += length * d[3:]


@njit(cache=True, nogil=True)
def solve_batch(
    poses, constants, softness, steps, tolerance, most, largest_force, apart, tableau, weights, observed
):  # fmt: skip
    """Newton's method on many problems, each in place.

    Parameters
    ----------
    poses (B, K + 1, 7), constants (B, 6): guesses, overwritten by solutions; constants are (n, m(0)) in space.
    steps: of the integration in each segment. tolerance: largest defect of a solution. most: Newton iterations.
    largest_force: an iteration whose force grows beyond it is given up.
    apart: eliminate the poses by compaction, at twice the cost; needed under forces beyond about 200.
    observed (B, 3): filled with height, energy and the last defect.

    Returns
    -------
    iterations (B,): of those that converged, 0 for the others.
    """
    count, segments = poses.shape[0], poses.shape[1] - 1
    iterations = np.zeros(count, np.int64)
    columns, own, forced = np.empty((segments, 6, COLUMNS)), np.empty((segments, 6, 6)), np.empty((segments, 6, 6))
    gaps, window, kept = np.empty((segments, 6)), np.empty((12, WIDTH)), np.empty((segments, 6, WIDTH))
    rates, work, y = np.empty((STAGES, SIZE)), np.empty(SIZE), np.empty(SIZE)
    matrix, d, moves = np.empty((6, 6)), np.empty(6), np.empty((segments + 1, 6))
    for b in range(count):
        n, m0 = constants[b, :3], constants[b, 3:]
        for iteration in range(most):
            if apart:
                defect = _linearize_apart(poses[b], n, m0, softness, steps, tableau, weights, rates, work, y, own,
                                          forced, gaps)  # fmt: skip
            else:
                defect = _linearize(poses[b], n, m0, softness, steps, tableau, weights, rates, work, y, columns)
            observed[b, 0], observed[b, 1], observed[b, 2] = y[7], y[8], defect
            if not defect < 1e6:
                break
            if apart:
                if not compact(own, forced, gaps, window, kept, matrix, d):
                    break
            else:
                matrix[:] = columns[segments - 1, :, :6]
                d[:] = -columns[segments - 1, :, 6]
            if not solve_six(matrix, d) or not np.isfinite(d.sum()):
                break
            if defect < tolerance:
                iterations[b] = iteration + 1
                break
            if apart:
                expand(kept, d, moves)
            else:
                _condensed(columns, d, moves)
            _take(poses[b], n, m0, moves, d, _step_length(moves, d, n, m0))
            if not np.sqrt(np.sum(n**2)) < largest_force:
                break
    return iterations


@njit(cache=True, nogil=True)
def march_batch(poses, constants, softness, every, steps, tableau, weights):
    """Fill poses (B, K + 1, 7) by marching with the constants (B, 6) from every `every`-th one, K a multiple of it."""
    segments = poses.shape[1] - 1
    h = 1.0 / (segments * steps)
    rates, work, y = np.empty((STAGES, SIZE)), np.empty(SIZE), np.empty(SIZE)
    for b in range(poses.shape[0]):
        for k in range(segments):
            if k % every == 0:
                y[:] = 0.0
                y[:7] = poses[b, k]
            if (k + 1) % every == 0:
                continue
            _march(y, steps, h, constants[b, :3], constants[b, 3:], poses[b, 0, 4:], softness, tableau, weights, rates,
                   work)  # fmt: skip
            y[STATE:] = 0.0
            poses[b, k + 1] = y[:7]
            poses[b, k + 1, :4] /= np.sqrt(np.sum(y[:4] ** 2))
