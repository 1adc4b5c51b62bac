"""Compiled core of `rodatlas.states.starts`: bands of constant strain in each of J pieces, brought to a minimum.

Of the perfectly anisotropic rod only: k2 = 0, and the compliance of (k1, k2, tau) is diag(softness, 0, 1). The softness
1/a comes from :func:`rodatlas.rods.law.softness_of_band`, which refuses other laws.

The energy `sum h u . W u / 2` of the strains u = (k1, tau), W = diag(a, 1), h = 1/J, is lowered with the right end held
at its clamp by Newton steps on the Lagrangian. A change of strain turns the cross-sections by phi and shifts them by xi
(both in space), phi' = B du with B = (d1, d3) and xi' = phi x d3, and changes the Lagrangian to second order by::

    (1/2) int  du . W du - (B du) . (m x phi) + (n . d3) phi . phi - (n . phi)(d3 . phi) + sigma phi . phi  ds

with the present multipliers: force n and moment m = m(1) + (X(1) - X) x n. The closure of the end enters as a penalty
RHO with the multipliers as an offset, so that they converge and the penalty leaves no error. The quadratic problem is
solved by a Riccati recursion from right to left. sigma (Levenberg's) grows until every 2 x 2 block of the recursion is
positive: then the step leads downhill, so minima attract and saddles repel. It shrinks after every full step; at a
strict minimum it vanishes, and the convergence is that of Newton's method whatever the force. While the end is far from
its clamp the multipliers say little, and the quadratic form takes them as zero.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rodatlas.rods._shooting_kernel import rotation_between, turn_pose

RHO = 1e4  # of the closure [GJ/L, GJ/L^3]; the stiffness of a band against its end is of order 10 to 1000
# Bounds of one step, of which a part is taken otherwise: turn of a cross-section [rad], and change of strain (root mean
# square) [1/L]. One step closes no more than LARGEST_CLOSURE of the gap of the end. Smaller bounds lose fewer bands but
# lead most of them to the few states of least energy.
LARGEST_TURN, LARGEST_CHANGE, LARGEST_CLOSURE = 0.6, 5.0, 0.3
FAR = 0.3  # gap of the end from which multipliers are left out of the quadratic form
FIRST_SHIFT, LEAST_SHIFT, SHRINK, GROW, MOST_SHIFT = 100.0, 1e-2, 0.25, 4.0, 1e8  # sigma [GJ/L^2]
LEAST_BLOCK = 0.02  # of the recursion, against that of a band without load


@njit(cache=True)
def shape_of(strain, start, poses, middles):
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
def _cross(u, v, out):
    out[0] = u[1] * v[2] - u[2] * v[1]
    out[1] = u[2] * v[0] - u[0] * v[2]
    out[2] = u[0] * v[1] - u[1] * v[0]


@njit(cache=True)
def _piece(middle, tip, force, shift, h, moment, stage, mixed, inputs):
    """Quadratic form of one piece: `moment` (3,), `stage` (3, 3) of phi, `mixed` (2, 3), and `inputs` b (2, 6)."""
    d3, n = middle[3:6], force[3:]
    for i in range(3):
        inputs[0, i], inputs[1, i] = h * middle[i], h * d3[i]
    for k in range(2):
        _cross(inputs[k, :3], d3, inputs[k, 3:])
        for i in range(3):
            inputs[k, 3 + i] *= 0.5 * h
    arm = tip - middle[6:]
    _cross(arm, n, moment)
    for i in range(3):
        moment[i] += force[i]
    tension = n[0] * d3[0] + n[1] * d3[1] + n[2] * d3[2]
    for i in range(3):
        for k in range(3):
            stage[i, k] = -0.5 * h * (n[i] * d3[k] + n[k] * d3[i])
        stage[i, i] += h * (tension + shift)
    for k in range(2):
        b0, b1, b2 = inputs[k, 0], inputs[k, 1], inputs[k, 2]
        mixed[k, 0] = -0.5 * (b1 * moment[2] - b2 * moment[1])
        mixed[k, 1] = -0.5 * (b2 * moment[0] - b0 * moment[2])
        mixed[k, 2] = -0.5 * (b0 * moment[1] - b1 * moment[0])
        for i in range(3):
            mixed[k, i] += 0.5 * (b0 * stage[0, i] + b1 * stage[1, i] + b2 * stage[2, i])


@njit(cache=True)
def _ahead(P, p, d3, h):
    """P (6, 6) and p (6,) of the cost that lies ahead, carried from the right end of a piece to its left."""
    # xi at the right end is xi - h d3 x phi at the left: columns first, then rows
    for i in range(6):
        x, y, z = P[i, 3], P[i, 4], P[i, 5]
        P[i, 0] += h * (d3[1] * z - d3[2] * y)
        P[i, 1] += h * (d3[2] * x - d3[0] * z)
        P[i, 2] += h * (d3[0] * y - d3[1] * x)
    for i in range(6):
        x, y, z = P[3, i], P[4, i], P[5, i]
        P[0, i] += h * (d3[1] * z - d3[2] * y)
        P[1, i] += h * (d3[2] * x - d3[0] * z)
        P[2, i] += h * (d3[0] * y - d3[1] * x)
    x, y, z = p[3], p[4], p[5]
    p[0] += h * (d3[1] * z - d3[2] * y)
    p[1] += h * (d3[2] * x - d3[0] * z)
    p[2] += h * (d3[0] * y - d3[1] * x)


@njit(cache=True)
def _block(inputs, stage, Pb, softness, h):
    """The symmetric 2 x 2 block of the recursion, (q11, q12, q22, determinant)."""
    q11, q12, q22 = h / softness, 0.0, h
    for c in range(6):
        q11 += Pb[0, c] * inputs[0, c]
        q12 += Pb[0, c] * inputs[1, c]
        q22 += Pb[1, c] * inputs[1, c]
    for i in range(3):
        for c in range(3):
            q11 += 0.25 * inputs[0, i] * stage[i, c] * inputs[0, c]
            q12 += 0.25 * inputs[0, i] * stage[i, c] * inputs[1, c]
            q22 += 0.25 * inputs[1, i] * stage[i, c] * inputs[1, c]
    return q11, q12, q22, q11 * q22 - q12 * q12


@njit(cache=True)
def _sides(P, p, inputs, mixed, d3, h, Pb, side, own):
    """Fill `Pb` (2, 6) = b P and `side` (2, 6) = b P A + mixed; subtract b . p from `own` (2,)."""
    for k in range(2):
        for i in range(6):
            total = 0.0
            for c in range(6):
                total += inputs[k, c] * P[c, i]
            Pb[k, i] = total
            own[k] -= inputs[k, i] * p[i]
        x, y, z = Pb[k, 3], Pb[k, 4], Pb[k, 5]
        side[k, 0] = Pb[k, 0] + h * (d3[1] * z - d3[2] * y) + mixed[k, 0]
        side[k, 1] = Pb[k, 1] + h * (d3[2] * x - d3[0] * z) + mixed[k, 1]
        side[k, 2] = Pb[k, 2] + h * (d3[0] * y - d3[1] * x) + mixed[k, 2]
        side[k, 3], side[k, 4], side[k, 5] = x, y, z


@njit(cache=True)
def _backward(strain, middles, tip, force, known, closure, softness, shift, feedback):
    """Fill `feedback` (J, 2, 7): the change of strain is -(feedback[:, :6] . (phi, xi) + feedback[:, 6]).

    `known` (6,) are the multipliers in the quadratic form, `force` (6,) those of the closure. Returns False when a
    block is not positive.
    """
    count = strain.shape[0]
    h = 1.0 / count
    P, p = RHO * np.eye(6), force - RHO * closure
    moment, stage, mixed, inputs = np.empty(3), np.empty((3, 3)), np.empty((2, 3)), np.empty((2, 6))
    Pb, side, own = np.empty((2, 6)), np.empty((2, 6)), np.empty(2)
    least = LEAST_BLOCK * h
    for j in range(count - 1, -1, -1):
        d3 = middles[j, 3:6]
        _piece(middles[j], tip, known, shift, h, moment, stage, mixed, inputs)
        own[0], own[1] = h * strain[j, 0] / softness, h * strain[j, 1]
        _sides(P, p, inputs, mixed, d3, h, Pb, side, own)
        q11, q12, q22, det = _block(inputs, stage, Pb, softness, h)
        if not (q11 > least and q22 > least and det > least * h):
            return False
        for c in range(6):
            feedback[j, 0, c] = (q22 * side[0, c] - q12 * side[1, c]) / det
            feedback[j, 1, c] = (q11 * side[1, c] - q12 * side[0, c]) / det
        feedback[j, 0, 6] = (q22 * own[0] - q12 * own[1]) / det
        feedback[j, 1, 6] = (q11 * own[1] - q12 * own[0]) / det
        _ahead(P, p, d3, h)
        for i in range(6):
            for c in range(6):
                P[i, c] -= side[0, i] * feedback[j, 0, c] + side[1, i] * feedback[j, 1, c]
            p[i] += side[0, i] * feedback[j, 0, 6] + side[1, i] * feedback[j, 1, 6]
        for i in range(3):
            for c in range(3):
                P[i, c] += stage[i, c]
    return True


@njit(cache=True)
def _forward(middles, feedback, h, change, tilt):
    """Fill `change` (J, 2) of strain and `tilt` (6,) = (phi, xi) at the right end; returns the largest turn."""
    tilt[:] = 0.0
    largest = 0.0
    for j in range(change.shape[0]):
        for k in range(2):
            total = feedback[j, k, 6]
            for c in range(6):
                total += feedback[j, k, c] * tilt[c]
            change[j, k] = -total
        x, y, z = middles[j, 3], middles[j, 4], middles[j, 5]
        g0 = h * (middles[j, 0] * change[j, 0] + x * change[j, 1])
        g1 = h * (middles[j, 1] * change[j, 0] + y * change[j, 1])
        g2 = h * (middles[j, 2] * change[j, 0] + z * change[j, 1])
        f0, f1, f2 = tilt[0] + 0.5 * g0, tilt[1] + 0.5 * g1, tilt[2] + 0.5 * g2
        tilt[3] += h * (f1 * z - f2 * y)
        tilt[4] += h * (f2 * x - f0 * z)
        tilt[5] += h * (f0 * y - f1 * x)
        tilt[0] += g0
        tilt[1] += g1
        tilt[2] += g2
        largest = max(largest, abs(tilt[0]), abs(tilt[1]), abs(tilt[2]))
    return largest


@njit(cache=True)
def _gradient(strain, middles, tip, force, softness):
    """Norm of u - W^-1 (d1 . m, d3 . m), which vanishes in equilibrium."""
    total = 0.0
    moment = np.empty(3)
    for j in range(strain.shape[0]):
        _cross(tip - middles[j, 6:], force[3:], moment)
        k, t = 0.0, 0.0
        for i in range(3):
            k += middles[j, i] * (moment[i] + force[i])
            t += middles[j, 3 + i] * (moment[i] + force[i])
        total += (strain[j, 0] - softness * k) ** 2 + (strain[j, 1] - t) ** 2
    return np.sqrt(total / strain.shape[0])


@njit(cache=True)
def _relax(strain, start, target, softness, most, tolerance, poses, middles, feedback, change, force):
    """Relax one band in place; fills `force` (6,), end moment referred to the tip and force. Returns the gradient."""
    closure, gap, tilt, nothing = np.empty(6), np.empty(3), np.empty(6), np.zeros(6)
    count = strain.shape[0]
    force[:] = 0.0
    shift, gradient = FIRST_SHIFT, np.inf
    for _ in range(most):
        shape_of(strain, start, poses, middles)
        tip = poses[count, 4:]
        rotation_between(poses[count, :4], target[:4], gap)
        closure[:3] = gap
        closure[3:] = tip - target[4:]
        size = np.sqrt(np.sum(closure**2))
        gradient = _gradient(strain, middles, tip, force, softness)
        if size < tolerance and gradient < tolerance * (1.0 + np.sqrt(np.sum(force**2))):
            break
        closure *= min(1.0, LARGEST_CLOSURE / max(size, 1e-300))
        known = force if size < FAR else nothing
        while not _backward(strain, middles, tip, force, known, closure, softness, shift, feedback):
            shift = max(GROW * shift, LEAST_SHIFT)
            if not shift < MOST_SHIFT:
                return np.inf
        turn = _forward(middles, feedback, 1.0 / count, change, tilt)
        bend = np.sqrt(np.sum(change**2) / count)
        length = min(1.0, LARGEST_TURN / max(turn, 1e-300), LARGEST_CHANGE / max(bend, 1e-300))
        if not length > 0.0:
            return np.inf
        strain += length * change
        force -= length * RHO * (tilt + closure)
        if length == 1.0:
            shift = SHRINK * shift if shift > LEAST_SHIFT else 0.0
        elif length < 0.5:
            shift = max(2.0 * shift, LEAST_SHIFT)
    return gradient


@njit(cache=True)
def fill_constants(arm, load, constants):
    """`constants` (6,) = (n, m(0)) from `load` (6,), moment at the right end and force, and `arm` (3,) to that end."""
    n1, n2, n3 = load[3], load[4], load[5]
    constants[0], constants[1], constants[2] = n1, n2, n3
    constants[3] = load[0] + arm[1] * n3 - arm[2] * n2
    constants[4] = load[1] + arm[2] * n1 - arm[0] * n3
    constants[5] = load[2] + arm[0] * n2 - arm[1] * n1


@njit(cache=True, nogil=True)
def relax_batch(strains, start, target, softness, iterations, tolerance, poses, constants):
    """Relax bands (B, J, 2) in place, each for its own number of `iterations` (B,) at most.

    Parameters: clamp poses `start` and `target` (7,). Filled: `poses` (B, K + 1, 7) at equidistant places, J a
    multiple of K, first and last those of the clamps; and `constants` (B, 6) = (n, m(0)) in space.
    Returns (B,) how far the strains are from equilibrium, a norm; infinite where the descent failed.
    """
    count, pieces = strains.shape[0], strains.shape[1]
    every = pieces // (poses.shape[1] - 1)
    inner, middles, feedback = np.empty((pieces + 1, 7)), np.empty((pieces, 9)), np.empty((pieces, 2, 7))
    change, force = np.empty((pieces, 2)), np.empty(6)
    gradients = np.empty(count)
    for b in range(count):
        gradients[b] = _relax(strains[b], start, target, softness, iterations[b], tolerance, inner, middles,
                              feedback, change, force)  # fmt: skip
        poses[b] = inner[::every]
        poses[b, -1] = target
        fill_constants(inner[pieces, 4:] - start[4:], force, constants[b])
    return gradients
