"""Directors and unit quaternions of a framed curve; written for numbers and for CasADi symbols alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rodatlas.continuation import Solution


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


def ribbon(solution: Solution, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Center line (n, 3) and directors (3, n, 3) of a solution with unknowns q0..q3, x, y, z at some s (n,)."""
    fields, columns = solution(s), {name: i for i, name in enumerate(solution.unknowns)}
    q = fields[:, [columns[f"q{i}"] for i in range(4)]]
    center = fields[:, [columns[name] for name in "xyz"]]
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


def clamp_residual(q: Sequence[Any], target: Sequence[Any]) -> list[Any]:
    """vec(conj(target) q) = 0: three conditions for one orientation, regular at every angle (q and -q both satisfy)."""
    t0, t1, t2, t3 = target
    q0, q1, q2, q3 = q
    return [
        t0 * q1 - t1 * q0 - t2 * q3 + t3 * q2,
        t0 * q2 + t1 * q3 - t2 * q0 - t3 * q1,
        t0 * q3 - t1 * q2 + t2 * q1 - t3 * q0,
    ]
