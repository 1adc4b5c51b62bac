"""Directors, unit quaternions and balance of a framed curve; written for numbers and for CasADi symbols alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rodatlas.continuation import Solution

QUATERNION, POSITION = ("q0", "q1", "q2", "q3"), ("x", "y", "z")
POSE = (*QUATERNION, *POSITION)
"""What every rod problem calls the rotation and the place of a cross-section."""


def directors(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """d1 (width), d2 (normal), d3 (tangent), each (..., 3), of quaternions (..., 4)."""
    q0, q1, q2, q3 = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    return tuple(np.stack(d, axis=-1) for d in director_components(q0, q1, q2, q3))  # type: ignore[return-value]


def director_components(q0: Any, q1: Any, q2: Any, q3: Any) -> tuple[list[Any], list[Any], list[Any]]:
    """Components of the directors in space, for a unit quaternion."""
    d1 = [2 * (q0 * q0 + q1 * q1) - 1, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)]
    d2 = [2 * (q1 * q2 - q0 * q3), 2 * (q0 * q0 + q2 * q2) - 1, 2 * (q2 * q3 + q0 * q1)]
    d3 = [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0 * q0 + q3 * q3) - 1]
    return d1, d2, d3


def pose_of(columns: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Quaternion (..., 4) and position (..., 3) from columns (...) by name, those of any rod among them."""
    q, x = (np.stack([columns[name] for name in names], axis=-1) for names in (QUATERNION, POSITION))
    return q, x


def ribbon(solution: Solution, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Center line (n, 3) and directors (3, n, 3) of a solution with the unknowns `POSE` at some s (n,)."""
    q, center = pose_of(dict(zip(solution.unknowns, solution(s).T, strict=True)))
    return center, np.array(directors(q / np.linalg.norm(q, axis=1, keepdims=True)))


def quaternion_rate(q: Sequence[Any], k1: Any, k2: Any, tau: Any) -> list[Any]:
    """q' for the body strain (k1, k2, tau)."""
    q0, q1, q2, q3 = q
    return [
        (-q1 * k1 - q2 * k2 - q3 * tau) / 2,
        (q0 * k1 - q3 * k2 + q2 * tau) / 2,
        (q3 * k1 + q0 * k2 - q1 * tau) / 2,
        (-q2 * k1 + q1 * k2 + q0 * tau) / 2,
    ]


def in_space(q: Sequence[Any], body: Sequence[Any]) -> list[Any]:
    """Components in space of a vector given along the directors of a unit quaternion."""
    frame = director_components(*q)
    return [sum(along * d[i] for along, d in zip(body, frame, strict=True)) for i in range(3)]


def cross(u: Sequence[Any], v: Sequence[Any]) -> list[Any]:
    """u x v by components."""
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def balance(force: Sequence[Any], moment: Sequence[Any], strain: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    r"""Derivatives of force and moment along a rod without load, all of them body components.

    .. math:: N' = N \times \omega, \quad M' = M \times \omega + N \times e_3, \quad \omega = (\kappa_1, \kappa_2, \tau)
    """
    n1, n2, n3 = force
    m1, m2, m3 = moment
    k1, k2, tau = strain
    return (
        [n2 * tau - n3 * k2, -n1 * tau + n3 * k1, -n2 * k1 + n1 * k2],
        [m2 * tau + n2 - m3 * k2, -m1 * tau + m3 * k1 - n1, -m2 * k1 + m1 * k2],
    )


def clamp_residual(q: Sequence[Any], target: Sequence[Any]) -> list[Any]:
    """vec(conj(target) q) = 0: three conditions for one orientation, regular at every angle (q and -q both satisfy)."""
    t0, t1, t2, t3 = target
    q0, q1, q2, q3 = q
    return [
        t0 * q1 - t1 * q0 - t2 * q3 + t3 * q2,
        t0 * q2 + t1 * q3 - t2 * q0 - t3 * q1,
        t0 * q3 - t1 * q2 + t2 * q1 - t3 * q0,
    ]
