"""Stability of a computed rod state: the Morse index of its solution."""

from __future__ import annotations

from rodatlas.continuation import Solution
from rodatlas.rods.conjugate_points import IndexResult, index_nodes, morse_index
from rodatlas.rods.formulation import Formulation
from rodatlas.rods.state import RodState


def index_of(
    solution: Solution, per_interval: int = 2, most: int = 32, formulation: Formulation | None = None
) -> IndexResult:
    """Morse index by conjugate points of a rod with both ends held.

    Parameters
    ----------
    solution : of a rod problem, see :class:`rodatlas.rods.RodState`.
    per_interval : steps of the Jacobi equation on each mesh interval to begin with; large forces need more.
    most : the number is doubled, up to this one, while the count cannot be made.
    formulation : as for :class:`rodatlas.rods.RodState`.

    Returns
    -------
    the index (0: stable) with its margin and what speaks against it, if anything.
    """
    state = RodState(solution, formulation)
    result = _count(state, per_interval)
    while result.index < 0 and per_interval < most:
        per_interval *= 2
        result = _count(state, per_interval)
    return result


def _count(rod: RodState, per_interval: int) -> IndexResult:
    rod = rod.at(index_nodes(rod.solution.mesh, per_interval))
    return morse_index(rod.s, rod.force_body, rod.moment_body, rod.strain, rod.compliance)


def morse_index_of(solution: Solution) -> int | None:
    """The index alone, as a branch walker wants it; None where it could not be counted."""
    index = index_of(solution).index
    return index if index >= 0 else None
