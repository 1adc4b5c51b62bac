"""Stability of a computed rod state: the Morse index of its solution."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.conjugate_points import IndexResult, index_nodes, morse_index
from rodatlas.rods.perfectly_anisotropic import check_rod


def index_of(solution: Solution, per_interval: int = 2, most: int = 32) -> IndexResult:
    """Morse index by conjugate points of a solution of the perfectly anisotropic rod.

    Parameters
    ----------
    solution : of :func:`rodatlas.rods.perfectly_anisotropic.rod_problem`.
    per_interval : steps of the Jacobi equation on each mesh interval to begin with; large forces need more.
    most : the number is doubled, up to this one, while the count cannot be made.

    Returns
    -------
    the index (0: stable) with its margin and what speaks against it, if anything.
    """
    check_rod(solution)
    result = _count(solution, per_interval)
    while result.index < 0 and per_interval < most:
        per_interval *= 2
        result = _count(solution, per_interval)
    return result


def _count(solution: Solution, per_interval: int) -> IndexResult:
    s = index_nodes(solution.mesh, per_interval)
    n1, n2, n3, m2, k1, tau = solution(s)[:, :6].T
    zero = np.zeros_like(k1)
    a = solution.parameter("a")
    return morse_index(
        s,
        np.column_stack([n1, n2, n3]),
        np.column_stack([a * k1, m2, tau]),
        np.column_stack([k1, zero, tau]),
        np.diag([1.0 / a, 0.0, 1.0]),
    )


def morse_index_of(solution: Solution) -> int | None:
    """The index alone, as a branch walker wants it; None where it could not be counted."""
    index = index_of(solution).index
    return index if index >= 0 else None
