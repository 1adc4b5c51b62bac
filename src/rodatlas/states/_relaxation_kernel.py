"""Compiled core of `rodatlas.states.starts`: bands of constant strain in each of J pieces, relaxed toward a minimum.

With strain u = (k1, tau), energy `u . W u / 2`, W = h diag(a, 1), closure error g (rotation and displacement of the
free end against its clamp) and its derivative G, each iteration takes::

    u <- (1 - alpha) u + W^-1 G^T (alpha lambda - nu),   (G W^-1 G^T) lambda = G u,   (G W^-1 G^T) nu = g

the projected gradient in the metric of the energy and the shortest correction of the closure. The multipliers
lambda become the end moment and the force. Fixed points are equilibria of the pieces; only minima attract.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rodatlas.rods._shooting_kernel import rotation_between, solve_six, turn_pose

# The gradient step alpha must stay below 2 over the largest eigenvalue of the energy's second variation, which grows
# with the force: it is lowered when the gradient grows. Corrections of the closure and steps of strain are bounded.
STEP, LONGEST_STEP, LARGEST_CLOSURE, LARGEST_CHANGE = 0.3, 0.6, 0.5, 4.0


@njit(cache=True)
def _shape(strain, start, poses, middles):
    """Poses (J + 1, 7) between pieces, and (d1, d3, X) in the middle of each, (J, 9), for strain (J, 2)."""
    count = strain.shape[0]
    h = 1.0 / count
    poses[0] = start
    q = start[:4].copy()
    for j in range(count):
        for half in range(2):
            q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
            a1, a2, a3 = 2 * (q0 * q0 + q1 * q1) - 1, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)
            t1, t2, t3 = 2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0 * q0 + q3 * q3) - 1
            if half == 1:
                middles[j, 0], middles[j, 1], middles[j, 2] = a1, a2, a3
                middles[j, 3], middles[j, 4], middles[j, 5] = t1, t2, t3
                for i in range(3):
                    poses[j + 1, 4 + i] = poses[j, 4 + i] + h * middles[j, 3 + i]
                    middles[j, 6 + i] = poses[j, 4 + i] + 0.5 * h * middles[j, 3 + i]
            k, t = 0.5 * h * strain[j, 0], 0.5 * h * strain[j, 1]
            turn_pose(q, k * a1 + t * t1, k * a2 + t * t2, k * a3 + t * t3)
        poses[j + 1, :4] = q


@njit(cache=True)
def _levers(middles, tip, levers):
    """Rows of G^T / h: (d, d x (X(1) - X)) for d1 and d3 of each piece, (J, 2, 6)."""
    for j in range(middles.shape[0]):
        r1, r2, r3 = tip[0] - middles[j, 6], tip[1] - middles[j, 7], tip[2] - middles[j, 8]
        for i in range(2):
            d1, d2, d3 = middles[j, 3 * i], middles[j, 3 * i + 1], middles[j, 3 * i + 2]
            levers[j, i, 0], levers[j, i, 1], levers[j, i, 2] = d1, d2, d3
            levers[j, i, 3] = d2 * r3 - d3 * r2
            levers[j, i, 4] = d3 * r1 - d1 * r3
            levers[j, i, 5] = d1 * r2 - d2 * r1


@njit(cache=True)
def _multipliers(strain, levers, softness, matrix, closure, force):
    """Overwrite `closure` (6,) by nu and `force` (6,) by lambda; False when G is rank deficient."""
    count = strain.shape[0]
    matrix[:] = 0.0
    force[:] = 0.0
    for j in range(count):
        for i in range(2):
            compliance = softness if i == 0 else 1.0
            for r in range(6):
                force[r] += levers[j, i, r] * strain[j, i] / count
                for c in range(6):
                    matrix[r, c] += compliance * levers[j, i, r] * levers[j, i, c] / count
    again = matrix.copy()
    return solve_six(matrix, closure) and solve_six(again, force)


@njit(cache=True)
def _relax(strain, start, target, softness, most, tolerance, poses, middles, levers):
    """Relax one band in place; returns (end moment, force), their moment referred to the tip, and the gradient."""
    matrix, closure, force, gap = np.empty((6, 6)), np.empty(6), np.zeros(6), np.empty(3)
    count = strain.shape[0]
    alpha, before, gradient = STEP, np.inf, np.inf
    for _ in range(most):
        _shape(strain, start, poses, middles)
        rotation_between(poses[count, :4], target[:4], gap)
        closure[:3] = gap
        closure[3:] = poses[count, 4:] - target[4:]
        size = np.sqrt(np.sum(closure**2))
        closure *= min(1.0, LARGEST_CLOSURE / max(size, 1e-300))
        _levers(middles, poses[count, 4:], levers)
        if not _multipliers(strain, levers, softness, matrix, closure, force):
            break
        total, change = 0.0, 0.0
        for j in range(count):
            for i in range(2):
                compliance = softness if i == 0 else 1.0
                pull, fix = 0.0, 0.0
                for r in range(6):
                    pull += compliance * levers[j, i, r] * force[r]
                    fix += compliance * levers[j, i, r] * closure[r]
                total += (strain[j, i] - pull) ** 2 / count
                change += (alpha * (strain[j, i] - pull) + fix) ** 2 / count
        gradient = np.sqrt(total)
        if size < tolerance and gradient < tolerance:
            break
        alpha = 0.5 * alpha if gradient > 1.2 * before and size < 0.1 else min(1.05 * alpha, LONGEST_STEP)
        before = gradient
        cut = min(1.0, LARGEST_CHANGE / max(np.sqrt(change), 1e-300))
        for j in range(count):
            for i in range(2):
                compliance = softness if i == 0 else 1.0
                aim = 0.0
                for r in range(6):
                    aim += compliance * levers[j, i, r] * (alpha * force[r] - closure[r])
                strain[j, i] += cut * (aim - alpha * strain[j, i])
    return force, gradient


@njit(cache=True, nogil=True)
def relax_batch(strains, start, targets, softness, iterations, tolerance, poses, constants):
    """Relax bands (B, J, 2) in place, each for its own number of `iterations` (B,) at most.

    Parameters: clamp poses `start` (7,) and `targets` (B, 7). Filled: `poses` (B, K + 1, 7) at equidistant places, J a
    multiple of K, first and last those of the clamps; and `constants` (B, 6) = (n, m(0)) in space.
    Returns the norm of the projected gradient (B,).
    """
    count, pieces = strains.shape[0], strains.shape[1]
    every = pieces // (poses.shape[1] - 1)
    inner, middles, levers = np.empty((pieces + 1, 7)), np.empty((pieces, 9)), np.empty((pieces, 2, 6))
    gradients = np.empty(count)
    for b in range(count):
        force, gradients[b] = _relax(strains[b], start, targets[b], softness, iterations[b], tolerance, inner, middles,
                                     levers)  # fmt: skip
        poses[b] = inner[::every]
        poses[b, -1] = targets[b]
        r1, r2, r3 = inner[pieces, 4] - start[4], inner[pieces, 5] - start[5], inner[pieces, 6] - start[6]
        n1, n2, n3 = force[3], force[4], force[5]
        constants[b, 0], constants[b, 1], constants[b, 2] = n1, n2, n3
        constants[b, 3] = force[0] + r2 * n3 - r3 * n2
        constants[b, 4] = force[1] + r3 * n1 - r1 * n3
        constants[b, 5] = force[2] + r1 * n2 - r2 * n1
    return gradients
