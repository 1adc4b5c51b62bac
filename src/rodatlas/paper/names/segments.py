"""Names of stable states, decided by symmetry, family and shape; never by a table of coordinates.

A stable segment is a stretch of a branch on which every state is stable. The rules, in order:

* reversal-broken and strongly twisted (:func:`rodatlas.rods.symmetry.is_twisted`): `TU+-` above the clamp plane,
  `TW+-` below it;
* reversal-symmetric, containing dD = 0: `other` where the band is curled up there
  (:func:`rodatlas.paper.names.curled.is_curled`), `U` where the height is positive, `W` where it is negative;
* a segment that starts as U and goes on without a bifurcation through a dimple is cut at these changes of shape into
  U, w and uUui (the paper's U-w and U-w-uUui); the cuts are ends of kind 'smooth';
* `other`, none of the named ones, where halfway along the segment k1 has fewer than two inflections or the band is
  wound up (:func:`rodatlas.states.winding.is_wound`);
* other reversal-broken ones: `US+-` above the clamp plane, `WS+-` below it, `S+-` at height zero (only at psi0 = 0);
* other symmetric segments, by the middle at their high-shear end. Where it is bent as in U (k1(1/2) > 0) and k1 has
  four inflections halfway: `uUu` above the clamp plane, `wi` below; with fewer `other`. Where it is bent the other way:
  `uUui` on the branch of W, elsewhere `w` if that dimple has deepened with shear (k1(1/2) fell) and `uUui` if it was
  pulled flat.

The members of a pair are told apart by :func:`rodatlas.rods.symmetry.pair_member`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_each
from rodatlas.model import Part
from rodatlas.paper.names.curled import is_curled
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import is_twisted
from rodatlas.states.winding import is_wound

NAMES = ("U", "US+-", "uUu", "w", "wi", "W", "WS+-", "uUui", "S+-", "TU+-", "TW+-")
OTHER = "other"
"""A stable state that is none of the named ones: some exist at other compressions than 1/2, or at steep angles."""
ZERO_HEIGHT = 1e-6


def middle_curvature(solution: Solution) -> float:
    """k1 at s = 1/2 [1/L]."""
    return float(RodState(solution).at(0.5).k1[0])


def name_parts(solutions: Sequence[Solution], symmetric: bool, inverted: bool = False) -> list[Part]:
    """The named parts of a stable segment, in order of increasing shear.

    Parameters
    ----------
    solutions : the segment's solutions, in order along the branch, shear increasing.
    symmetric : whether they are reversal-symmetric.
    inverted : whether their branch is that of W.
    """
    check_each("solutions", solutions, Solution, "a sequence of Solutions")
    last = len(solutions) - 1
    halfway = solutions[last // 2]
    height = np.array([s.observables["height"] for s in solutions])
    shear = np.array([s.parameter("dD") for s in solutions])
    bend = np.array([middle_curvature(s) for s in solutions])
    if not symmetric and is_twisted(halfway):
        return [Part("TU+-" if halfway["height"] > 0 else "TW+-", 0, last)]
    if symmetric and shear[0] <= 0.0 <= shear[-1]:
        if is_curled(solutions[int(np.argmin(np.abs(shear)))]):
            return [Part(OTHER, 0, last)]
        if np.interp(0.0, shear, height) < 0:
            return [Part("W", 0, last)]
        return _dimpled(np.where(shear < 0.0, np.abs(bend), bend), last)
    if not symmetric and np.abs(height).max() < ZERO_HEIGHT:
        return [Part("S+-", 0, last)]
    inflections = RodState(halfway).inflections["k1"]
    if inflections < 2 or is_wound(halfway, "+"):
        return [Part(OTHER, 0, last)]
    if not symmetric:
        return [Part("US+-" if halfway["height"] > 0 else "WS+-", 0, last)]
    if bend[-1] > 0:
        with_dimples = "uUu" if halfway["height"] > 0 else "wi"
        return [Part(with_dimples if inflections >= 4 else OTHER, 0, last)]
    return [Part("w" if bend[-1] < bend[0] and not inverted else "uUui", 0, last)]


def _dimpled(bend: np.ndarray, last: int) -> list[Part]:
    """Cut a segment that starts as U where the middle bends over, and where the dimple is deepest.

    Only dD >= 0 counts: at negative shear the shapes are mirror images of those at positive shear.
    """
    below = np.flatnonzero(bend < 0)
    if len(below) == 0:
        return [Part("U", 0, last)]
    over = int(below[0])
    deepest = over + int(np.argmin(bend[over:]))
    parts = [Part("U", 0, over)]
    if deepest < last - 1:
        return [*parts, Part("w", over, deepest), Part("uUui", deepest, last)]
    return [*parts, Part("w", over, last)]
