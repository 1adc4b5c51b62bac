"""Compiled core of `rodatlas.states.descent`: a band of constant strain in each of J pieces, in steepest descent.

Of the perfectly anisotropic rod only: k2 = 0, and the compliance of (k1, k2, tau) is diag(softness, 0, 1). The softness
1/a comes from :func:`rodatlas.rods.law.softness_of_band`, which refuses other laws.

With strain u = (k1, tau), energy `u . W u / 2`, W = h diag(a, 1), closure error g (rotation and displacement of the
free end against its clamp) and its derivative G, each iteration takes::

    u <- (1 - alpha) u + W^-1 G^T (alpha lambda - nu),   (G W^-1 G^T) lambda = G u,   (G W^-1 G^T) nu = g

the projected gradient in the metric of the energy and the shortest correction of the closure. The multipliers
lambda become the end moment and the force. Fixed points are equilibria of the pieces; only minima attract.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rodatlas.rods._shooting_kernel import rotation_between, solve_six
from rodatlas.states._relaxation_kernel import fill_constants, shape_of

# The gradient step alpha must stay below 2 over the largest eigenvalue of the energy's second variation, which grows
# with the force: it is lowered when the gradient grows. Corrections of the closure and steps of strain are bounded.
STEP, LONGEST_STEP, LARGEST_CLOSURE, LARGEST_CHANGE = 0.3, 0.6, 0.5, 4.0


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
        shape_of(strain, start, poses, middles)
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
def descend_band(strain, start, target, softness, most, tolerance, poses, constants):
    """Relax a band (J, 2) in place, in `most` iterations at most.

    Parameters: clamp poses `start` and `target` (7,). Filled: `poses` (K + 1, 7) at equidistant places, J a multiple of
    K, first and last those of the clamps; and `constants` (6,) = (n, m(0)) in space.
    Returns the norm of the projected gradient.
    """
    pieces = strain.shape[0]
    every = pieces // (poses.shape[0] - 1)
    inner, middles, levers = np.empty((pieces + 1, 7)), np.empty((pieces, 9)), np.empty((pieces, 2, 6))
    force, gradient = _relax(strain, start, target, softness, most, tolerance, inner, middles, levers)
    poses[:] = inner[::every]
    poses[-1] = target
    fill_constants(inner[pieces, 4:] - start[4:], force, constants)
    return gradient
