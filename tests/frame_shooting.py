"""Equilibria of the band between any two clamps by single shooting on the moment equations in space.

Nothing is shared with the package: frames are matrices turned by SciPy, strains follow from the moment in space, and
the six unknowns are the constant force n and the moment m(0). With lengths by L, moments by GJ/L and forces by GJ/L^2

    m(s) = m(0) - (X(s) - X(0)) x n,   d_i' = omega x d_i,   omega = (m . d1 / a) d1 + (m . d3) d3,   X' = d3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation


def clamp(angle, twist=0.0):
    """Rows d1, d2, d3 of a clamp: tangent at an angle to x toward y, width along -z, turned about the tangent."""
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    width = Rotation.from_rotvec(twist * tangent).apply([0.0, 0.0, -1.0])
    return np.array([width, np.cross(tangent, width), tangent])


@dataclass(frozen=True)
class Poses:
    """Frames (3, 3) and places (3,) of both clamps."""

    left: np.ndarray
    start: np.ndarray
    right: np.ndarray
    end: np.ndarray

    @classmethod
    def of(cls, left, right, compression, shear=0.0, offset=0.0, twist=0.0):
        """Clamp angles and twist in degrees."""
        return cls(
            clamp(np.radians(left)), np.array([0.0, 0.0, -shear]), clamp(-np.radians(right), np.radians(twist)),
            np.array([1.0 - compression, offset, 0.0]),
        )  # fmt: skip

    def moved(self, rotation, shift):
        """Both clamps turned about the origin and displaced as one."""
        turn = rotation.apply
        return Poses(turn(self.left), turn(self.start) + shift, turn(self.right), turn(self.end) + shift)


@dataclass(frozen=True)
class Shot:
    """An equilibrium: force and moment (3,) at s = 0 in space, energy, height, and by how much it misses the clamp."""

    force: np.ndarray
    moment: np.ndarray
    energy: float
    height: float
    gap: float


def shoot(poses, force, moment, bending=0.625):
    """The equilibrium near a force and a moment (3,) at the left clamp."""

    def rate(_, y, n, m0):
        d, x = y[:9].reshape(3, 3), y[9:12]
        m = m0 - np.cross(x - poses.start, n)
        k1, tau = m @ d[0] / bending, m @ d[2]
        omega = k1 * d[0] + tau * d[2]
        return np.concatenate([np.cross(omega, d).ravel(), d[2], [(bending * k1**2 + tau**2) / 2, x[1]]])

    def run(unknowns):
        y = np.concatenate([poses.left.ravel(), poses.start, np.zeros(2)])
        loads = (unknowns[:3], unknowns[3:])
        return solve_ivp(rate, (0.0, 1.0), y, "DOP853", args=loads, rtol=1e-10, atol=1e-11).y[:, -1]

    def miss(unknowns):
        y = run(unknowns)
        return np.concatenate([y[9:12] - poses.end, np.cross(y[:9].reshape(3, 3), poses.right).sum(axis=0) / 2])

    found = fsolve(miss, np.concatenate([force, moment]), xtol=1e-10, epsfcn=1e-10)
    y = run(found)
    gap = max(np.abs(y[:9].reshape(3, 3) - poses.right).max(), np.abs(y[9:12] - poses.end).max())
    return Shot(found[:3], found[3:], y[12], y[13], gap)
