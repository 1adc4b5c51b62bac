"""Equilibria of a clamped rod by single shooting, for tests that need a few of them and nothing else.

Without body force the space force n is constant and the moment is `m(s) = m0 - (X(s) - X(0)) x n`, so the
unknowns are (n, m0). Lengths by L, moments by GJ/L, forces by GJ/L^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import DOP853, solve_ivp


def directors(q):
    """Rows d1, d2, d3 (..., 3, 3) of the unit quaternions `q` (..., 4)."""
    q0, q1, q2, q3 = np.moveaxis(q, -1, 0)
    rows = [
        [2 * (q0 * q0 + q1 * q1) - 1, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)],
        [2 * (q1 * q2 - q0 * q3), 2 * (q0 * q0 + q2 * q2) - 1, 2 * (q2 * q3 + q0 * q1)],
        [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0 * q0 + q3 * q3) - 1],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def spin(q, strain):
    """q' (..., 4) of the quaternions `q` with the strain (k1, k2, tau) (..., 3)."""
    q0, q1, q2, q3 = np.moveaxis(q, -1, 0)
    k1, k2, tau = np.moveaxis(strain, -1, 0)
    rate = [
        -q1 * k1 - q2 * k2 - q3 * tau,
        q0 * k1 - q3 * k2 + q2 * tau,
        q3 * k1 + q0 * k2 - q1 * tau,
        -q2 * k1 + q1 * k2 + q0 * tau,
    ]
    return 0.5 * np.stack(rate, axis=-1)


def crossed(v):
    """Matrices (..., 3, 3) whose product x @ crossed(v) is the cross product of x and `v` (..., 3).

    `np.cross` takes several times as long on few vectors, and the tests need some hundred thousand of them.
    """
    matrix = np.zeros((*np.shape(v), 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., j, i], matrix[..., k, i] = v[..., k], -v[..., j]
    return matrix


E3 = crossed(np.array([0.0, 0.0, 1.0]))


def clamp(angle):
    """Quaternion (4,) of a clamp parallel to the width direction whose tangent makes `angle` with the x axis."""
    c, s = np.cos(angle / 2) / np.sqrt(2), np.sin(angle / 2) / np.sqrt(2)
    return np.array([c, -s, c, s])


@dataclass(frozen=True)
class Equilibrium:
    """The equilibrium that leaves the pose (q0, 0) with the body force and moment given; `load` is -n', in space."""

    quaternion: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    compliance: np.ndarray
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def rate(self, s, y):
        """dy/ds of y = (q, X, N, M) (13,)."""
        q, force, moment = y[:4], y[7:10], y[10:13]
        strain = self.compliance @ moment
        frame, across = directors(q), crossed(strain)
        return np.concatenate(
            [spin(q, strain), frame[2], force @ across - frame @ self.load, moment @ across + force @ E3]
        )

    @cached_property
    def dense(self):
        start = np.concatenate([self.quaternion, np.zeros(3), self.force, self.moment])
        return solve_ivp(self.rate, (0.0, 1.0), start, "DOP853", rtol=1e-11, atol=1e-11, dense_output=True).sol

    def fields(self, s):
        """Samples (q, X, N, M, strain) at `s` (K,)."""
        y = self.dense(s).T
        return y[:, :4], y[:, 4:7], y[:, 7:10], y[:, 10:], y[:, 10:] @ self.compliance

    @cached_property
    def energy(self):
        """int M . C M / 2 ds by 40 panels of six Gauss points."""
        x, w = np.polynomial.legendre.leggauss(6)
        s = ((np.arange(40)[:, None] + 0.5 * (x + 1)) / 40).ravel()
        moment, strain = self.fields(s)[3:]
        return float(np.tile(w, 40) @ np.sum(moment * strain, axis=1) / 160)

    @cached_property
    def height(self):
        """int y ds by the same panels."""
        x, w = np.polynomial.legendre.leggauss(6)
        s = ((np.arange(40)[:, None] + 0.5 * (x + 1)) / 40).ravel()
        return float(np.tile(w, 40) @ self.fields(s)[1][:, 1] / 80)


def half_way(start, force, moment, bending, steps=25):
    """q(1/2) (B, 4) and X(1/2) (B, 3) from space force and moment (B, 3), in equal steps of eighth order."""

    def rate(y):
        frame = directors(y[:, :4])
        body = np.einsum("bij,bj->bi", frame, moment - np.cross(y[:, 4:], force))
        return np.concatenate([spin(y[:, :4], body * [1 / bending, 0.0, 1.0]), frame[:, 2]], axis=1)

    y, h = np.zeros((len(force), 7)), 0.5 / steps
    y[:, :4] = start
    stages = np.zeros((len(DOP853.B), *y.shape))
    for _ in range(steps):
        for i, row in enumerate(DOP853.A[: len(DOP853.B)]):
            stages[i] = rate(y + h * np.tensordot(row[:i], stages[:i], axes=1))
        y = y + h * np.tensordot(DOP853.B, stages, axes=1)
    return y[:, :4], y[:, 4:]


def symmetric_band(unknowns, angle, compression, shear, bending=0.625, iterations=20):
    """The R-symmetric equilibrium of the clamped band near `unknowns` = (n_x, n_z, c_x, c_z).

    c is the moment about the middle of the chord. A half turn about the y axis through that point maps the rod
    to itself reversed, so the y components of n and c vanish, the middle of the rod lies on the axis, and
    d1 and d3 are normal to it there: four conditions for four unknowns, regular where the symmetry breaks.
    Returns the solved unknowns (4,) and the `Equilibrium`.
    """
    start, chord = clamp(angle), np.array([1.0 - compression, 0.0, shear])

    def reactions(u):
        force, center = np.zeros((len(u), 3)), np.zeros((len(u), 3))
        force[:, ::2], center[:, ::2] = u[:, :2], u[:, 2:]
        return force, center + np.cross(chord / 2, force)

    def residual(u):
        q, x = half_way(start, *reactions(u), bending)
        frame = directors(q)
        return np.stack([x[:, 0] - chord[0] / 2, x[:, 2] - chord[2] / 2, frame[:, 0, 1], frame[:, 2, 1]], axis=1)

    u = np.array(unknowns, float)
    for _ in range(iterations):
        size = 1e-5 * np.maximum(1.0, np.abs(u))
        values = residual(u + np.concatenate([np.diag(size), -np.diag(size), np.zeros((1, 4))]))
        jacobian = (values[:4] - values[4:8]).T / (2 * size)
        change = np.linalg.solve(jacobian, -values[8])
        u = u + change
        if np.abs(change).max() < 1e-9 * np.abs(u).max():
            break
    else:
        raise RuntimeError(f"no convergence at angle {angle}, shear {shear}: last change {np.abs(change).max():.1e}")
    frame = directors(start)
    force, moment = reactions(u[None])
    return u, Equilibrium(start, frame @ force[0], frame @ moment[0], np.diag([1 / bending, 0.0, 1.0]))


def follow_shear(unknowns, angle, shears, compression=0.5, bending=0.625):
    """The R-symmetric equilibria at each of `shears` in turn, from `unknowns` near the first; secant predictions."""
    found, previous, last = [], None, None
    for shear in shears:
        guess = np.asarray(unknowns, float)
        if previous is not None and last is not None:
            guess = last[1] + (last[1] - previous[1]) * (shear - last[0]) / (last[0] - previous[0])
        elif last is not None:
            guess = last[1]
        solved, state = symmetric_band(guess, angle, compression, shear, bending)
        previous, last = last, (shear, solved)
        found.append(state)
    return found
