"""Exact places of smooth changes of shape, at which a stable segment is cut into named states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from rodatlas.atlas.follow import state_at_shear
from rodatlas.atlas.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.states.names import middle_curvature

SHEAR_TOLERANCE = 1e-9


def cut_segment(
    solutions: Sequence[Solution], names: Sequence[tuple[str, int, int]], settings: SliceSettings
) -> list[list[Solution]]:
    """Solutions of each named part of a segment, neighbours sharing the solution at the cut.

    U becomes w where k1(1/2) = 0; w becomes uUui where k1(1/2) is least. Both are solved for between the computed
    points.
    """
    cuts = []
    for (name, _, _), (_, at, _) in pairwise(names):
        low, high = solutions[max(at - 1, 0)], solutions[min(at + (name == "w"), len(solutions) - 1)]
        find = _least if name == "w" else _zero
        cuts.append(find(low, high, solutions[at], settings))
    edges = [-float("inf"), *[c["dD"] for c in cuts], float("inf")]
    parts = []
    for k in range(len(names)):
        inside = [s for s in solutions if edges[k] < s["dD"] < edges[k + 1]]
        parts.append([*cuts[k - 1 : k], *inside, *cuts[k : k + 1]] if k else [*inside, *cuts[:1]])
    return parts


def _zero(low: Solution, high: Solution, near: Solution, settings: SliceSettings) -> Solution:
    from scipy.optimize import brentq

    bend = _Bend(near, settings)
    brentq(bend, low["dD"], high["dD"], xtol=SHEAR_TOLERANCE)
    return bend.last


def _least(low: Solution, high: Solution, near: Solution, settings: SliceSettings) -> Solution:
    from scipy.optimize import minimize_scalar

    bend = _Bend(near, settings)
    found = minimize_scalar(bend, bounds=(low["dD"], high["dD"]), method="bounded", options={"xatol": 1e-6})
    bend(float(found.x))
    return bend.last


class _Bend:
    """k1(1/2) as a function of the shear near a solution; keeps the last solution."""

    def __init__(self, near: Solution, settings: SliceSettings):
        self.last = near
        self._solve: Callable[[float], Solution | None] = lambda shear: state_at_shear(near, shear, settings)

    def __call__(self, shear: float) -> float:
        self.last = self._solve(shear) or self.last
        return middle_curvature(self.last)
