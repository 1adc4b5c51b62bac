"""SciPy's `solve_bvp` on the U state of the perfectly anisotropic rod, at fixed shears.

Prints one JSON object. `solve_bvp` follows no branch and detects no bifurcation; what is measured is the CPU time of
one solution, each started from the solution at the shear before it, with analytic Jacobians.
"""

import json
import math
import time

import numpy as np
import scipy
from scipy.integrate import solve_bvp

A = 0.625
PSI0 = math.radians(15.0)
SHEARS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.79)
TOLERANCE = 1e-7
INTERVALS = 50


def rod(s, u):
    """Right-hand sides of the perfectly anisotropic rod.

    Parameters
    ----------
    s : ndarray, shape (m,)
        Arclength.
    u : ndarray, shape (13, m)
        Force N1..N3 [GJ/L^2], moment M1..M3 [GJ/L] (body frame), unit quaternion, position [L].

    Returns
    -------
    ndarray, shape (13, m)
    """
    n1, n2, n3, m1, m2, tau, q0, q1, q2, q3 = u[:10]
    k = m1 / A
    return np.stack([
        n2 * tau, -n1 * tau + n3 * k, -n2 * k,
        m2 * tau + n2, -m1 * tau + tau * k - n1, -m2 * k,
        (-q1 * k - q3 * tau) / 2, (q0 * k + q2 * tau) / 2, (q3 * k - q1 * tau) / 2, (-q2 * k + q0 * tau) / 2,
        2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0**2 + q3**2) - 1,
    ])  # fmt: skip


def rod_jacobian(s, u):
    """Derivatives of `rod` with respect to the state, shape (13, 13, m)."""
    n1, n2, n3, m1, m2, tau, q0, q1, q2, q3 = u[:10]
    k, b = m1 / A, 1 / A
    jac = np.zeros((13, 13, u.shape[1]))
    entries = {
        (0, 1): tau, (0, 5): n2, (1, 0): -tau, (1, 2): k, (1, 3): b * n3, (1, 5): -n1, (2, 1): -k, (2, 3): -b * n2,
        (3, 1): 1, (3, 4): tau, (3, 5): m2, (4, 0): -1, (4, 3): b * tau - tau, (4, 5): k - m1,
        (5, 3): -b * m2, (5, 4): -k,
        (6, 3): -b * q1 / 2, (6, 5): -q3 / 2, (6, 7): -k / 2, (6, 9): -tau / 2,
        (7, 3): b * q0 / 2, (7, 5): q2 / 2, (7, 6): k / 2, (7, 8): tau / 2,
        (8, 3): b * q3 / 2, (8, 5): -q1 / 2, (8, 7): -tau / 2, (8, 9): k / 2,
        (9, 3): -b * q2 / 2, (9, 5): q0 / 2, (9, 6): tau / 2, (9, 8): -k / 2,
        (10, 6): 2 * q2, (10, 7): 2 * q3, (10, 8): 2 * q0, (10, 9): 2 * q1,
        (11, 6): -2 * q1, (11, 7): -2 * q0, (11, 8): 2 * q3, (11, 9): 2 * q2,
        (12, 6): 4 * q0, (12, 9): 4 * q3,
    }  # fmt: skip
    for (i, j), value in entries.items():
        jac[i, j] = value
    return jac


def clamps(psi0, compression, shear):
    """Return the 13 end conditions and their constant Jacobians as two functions for `solve_bvp`.

    ``q(0)``, ``X(0)`` and ``X(1)`` are given, and ``vec(conj(p) q(1)) = 0`` for the target ``p = (c, s, c, -s)``.
    """
    c, s = math.cos(psi0 / 2) / math.sqrt(2), math.sin(psi0 / 2) / math.sqrt(2)
    start = np.array([c, -s, c, s, 0, 0, -shear])
    finish = np.array([1 - compression, 0, 0])
    left, right = np.zeros((13, 13)), np.zeros((13, 13))
    left[:7, 6:] = np.eye(7)
    right[7:10, 10:] = np.eye(3)
    right[10:, 6:10] = [[-s, c, -s, -c], [-c, s, c, s], [s, c, -s, c]]

    def residual(u0, u1):
        r = left @ u0 + right @ u1
        r[:7] -= start
        r[7:10] -= finish
        return r

    return residual, lambda u0, u1: (left, right)


def solve(x, u, psi0, compression, shear):
    """Solve at one setting from the guess ``u`` on the mesh ``x``; raise RuntimeError where it fails."""
    residual, jacobian = clamps(psi0, compression, shear)
    solution = solve_bvp(rod, residual, x, u, fun_jac=rod_jacobian, bc_jac=jacobian, tol=TOLERANCE, max_nodes=20000)
    if not solution.success:
        raise RuntimeError(f"solve_bvp at psi0={psi0:.4f}, dL={compression}, dD={shear}: {solution.message}")
    return solution


def start_state(x):
    """The U state at psi0 = 15 deg, dL = 1/2, dD = 0 on the mesh ``x``, reached from the circle (psi0 = pi, dL = 1)."""
    p, r = np.pi * x, np.sqrt(0.5)
    u = np.zeros((13, x.size))
    u[3] = 2 * np.pi * A
    u[6:10] = r * np.stack([np.sin(p), -np.cos(p), np.sin(p), np.cos(p)])
    u[10:12] = np.stack([-np.sin(2 * p), 1 - np.cos(2 * p)]) / (2 * np.pi)
    path = [(math.pi, d) for d in np.linspace(0.98, 0.5, 25)]
    path += [(psi, 0.5) for psi in np.linspace(math.pi, PSI0, 16)[1:]]
    for psi0, compression in path:
        u = solve(x, u, psi0, compression, 0.0).sol(x)
    return u


def run() -> dict:
    """Solve at each of `SHEARS` and return the JSON object of the benchmark, one entry of ``solutions`` per shear."""
    x = np.linspace(0, 1, INTERVALS + 1)
    u = start_state(x)
    solutions = []
    for shear in SHEARS:
        began = time.process_time()
        solution = solve(x, u, PSI0, 0.5, shear)
        seconds = time.process_time() - began
        u = solution.sol(x)
        force = np.sum(solution.y[:3] ** 2, axis=0)
        solutions.append({
            "shear": shear,
            "cpu_seconds": seconds,
            "nodes": int(solution.x.size),
            "iterations": int(solution.niter),
            "height": float(np.trapezoid(solution.sol(np.linspace(0, 1, 2001))[11], dx=1 / 2000)),
            "force_drift": float(np.ptp(force) / force.mean()),
        })  # fmt: skip
    return {
        "name": "SciPy solve_bvp",
        "version": scipy.__version__,
        "cpu_seconds": sum(one["cpu_seconds"] for one in solutions),
        "points": len(solutions),
        "solutions": solutions,
    }


if __name__ == "__main__":
    print(json.dumps(run()))
