"""How much a band is twisted, and whether it is wound up."""

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
