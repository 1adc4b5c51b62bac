"""How much a band is twisted and bent round, and whether it is wound up or curled up."""

from __future__ import annotations

import math

from rodatlas.continuation import Solution
from rodatlas.rods.state import RodState


def twist(solution: Solution) -> float:
    """int tau ds [rad]."""
    return solution.mean(RodState(solution).at_gauss_points().tau)


def is_wound(solution: Solution, cls: str) -> bool:
    """Whether a band has more turns of twist than its class needs.

    A full turn of the right clamp about the tangent changes the class: bands of class + need no turn, those of class -
    one, to the left or to the right. Two turns more, and the class is the same again. The bound lies half-way: a band
    is wound up with more than 1 turn, int tau ds / 2 pi, in class +, and more than 2 in class -. Where the clamps are
    twisted themselves, to one side, a band may have so much more to that side.
    """
    turn, given = twist(solution), solution["twist_right"] - solution["twist_left"]
    most = 2.0 * math.pi * (1.0 if cls == "+" else 2.0)
    return not min(given, 0.0) - most <= turn <= max(given, 0.0) + most


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
