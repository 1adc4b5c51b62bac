"""Exact places of smooth changes of shape, at which a stable segment is cut into named states."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rodatlas.continuation import Solution
from rodatlas.model import Part
from rodatlas.model.places import solved_at
from rodatlas.paper.names.segments import middle_curvature
from rodatlas.rods.perfectly_anisotropic import rod_problem

SHEAR_TOLERANCE = 1e-9  # of the zero of k1(1/2)
LEAST_TOLERANCE = 1e-6  # of its minimum, which a value of k1 to 1e-12 does not determine better


def cut_segment(solutions: Sequence[Solution], named: Sequence[Part], tolerance: float) -> list[list[Solution]]:
    """Solutions of each named part of a segment, neighbors sharing the solution at the cut.

    U becomes w where k1(1/2) = 0; w becomes uUui where k1(1/2) is least. Both are solved for between the computed
    points.

    Parameters
    ----------
    solutions : of the whole segment, in order of increasing shear.
    named : its parts, from :func:`rodatlas.paper.names.segments.name_parts`.
    """
    cuts = []
    for one, two in pairwise(named):
        find, beyond = (_least, 1) if one.name == "w" else (_zero, 0)
        low, high = solutions[max(two.first - 1, 0)], solutions[min(two.first + beyond, len(solutions) - 1)]
        cuts.append(find(low, high, solutions[two.first], tolerance))
    edges = [-float("inf"), *[c["dD"] for c in cuts], float("inf")]
    parts = []
    for k, (low_edge, high_edge) in enumerate(pairwise(edges)):
        inside = [s for s in solutions if low_edge < s["dD"] < high_edge]
        parts.append([*cuts[max(k - 1, 0) : k], *inside, *cuts[k : k + 1]])
    return parts


def _zero(low: Solution, high: Solution, near: Solution, tolerance: float) -> Solution:
    """The state between two others at which k1(1/2) = 0; the computed one next to it where none can be solved for."""
    from scipy.optimize import brentq

    bend = _Bend((low, high), tolerance)
    if bend(low["dD"]) * bend(high["dD"]) >= 0:
        return near
    brentq(bend, low["dD"], high["dD"], xtol=SHEAR_TOLERANCE)
    return bend.last


def _least(low: Solution, high: Solution, near: Solution, tolerance: float) -> Solution:
    """The state between two others at which k1(1/2) is least."""
    from scipy.optimize import minimize_scalar

    bend = _Bend((low, near, high), tolerance)
    found = minimize_scalar(bend, bounds=(low["dD"], high["dD"]), method="bounded", options={"xatol": LEAST_TOLERANCE})
    bend(float(found.x))
    return bend.last


class _Bend:
    """k1(1/2) as a function of the shear, solved from the nearest of some known states; keeps the last solution."""

    def __init__(self, known: Sequence[Solution], tolerance: float):
        self.last = known[0]
        self._known, self._tolerance = known, tolerance

    def __call__(self, shear: float) -> float:
        nearest = min(self._known, key=lambda s: abs(s["dD"] - shear))
        exact = nearest["dD"] == shear
        found = nearest if exact else solved_at(rod_problem(), nearest, "dD", shear, self._tolerance)
        self.last = found or self.last
        return middle_curvature(self.last)
