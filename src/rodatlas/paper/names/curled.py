"""How much a band is bent round, and whether it is curled up."""

from __future__ import annotations

import math

from rodatlas.continuation import Solution
from rodatlas.rods.state import RodState


def turning(solution: Solution) -> float:
    """int k1 ds [rad]."""
    return solution.mean(RodState(solution).at_gauss_points().k1)


def is_curled(solution: Solution) -> bool:
    """Whether a band without shear and twist is bent round more often than its clamps ask for.

    A planar band of class + turns its tangent by minus both clamp angles, and any number of double turns: int k1 ds =
    2 psi0 + turn_left + turn_right + 4 pi n.
    U, W and the third mode have n = 0. With n = -1 a band lies in two curls, one at each clamp, and crosses itself; at
    dL = 1/2 it is stable near psi0 = 90 degrees. The bound lies half-way.
    """
    given = 2.0 * solution["psi0"] + solution["turn_left"] + solution["turn_right"]
    return abs(turning(solution) - given) > 2.0 * math.pi
