"""Names of stable states at one setting."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rodatlas.continuation import EndReason, MeshControl, NotConverged, Solution, TraceOptions, solve, trace
from rodatlas.paper.names.curled import is_curled
from rodatlas.paper.names.segments import ZERO_HEIGHT, middle_curvature
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.stability import morse_index_of
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import is_twisted
from rodatlas.states.winding import is_wound

SHEAR_STEP = 1e-4  # of the difference quotient that tells w from uUui


def names_of(states: Sequence[tuple[Solution, str, int, str]]) -> list[str | None]:
    """Names of all states at one setting, given as (solution, class, index, '+', '-' or '' when symmetric).

    Only stable ones of class + that are not wound up have names; the rules are those of
    :mod:`rodatlas.paper.names.segments`, with what one setting shows in the place of a branch:

    * reversal-broken and strongly twisted: TU+- or TW+- by height; other broken ones with two inflections of k1 or more
      US+-, WS+- or S+- by height;
    * symmetric with k1(1/2) > 0: U with two inflections of k1; with four uUu, or wi below the clamp plane;
    * symmetric with k1(1/2) < 0: W with two inflections below the clamp plane; otherwise w where k1(1/2) falls as the
      shear grows, and uUui where it rises;
    * symmetric with fewer inflections, or bent round more often than its clamps ask for: followed to dD = 0. U between
      steep clamps has none, and is told by the state at rest; what is curled up there, turns back or loses its
      stability on the way has no name;
    * what looks like U or W is followed to dD = 0 where US or w is there too, or another such state: if it turns back
      or loses its stability on the way, U is w, and W is w or uUui as above.
    """
    names = [_name(*state) for state in states]
    if "US+" not in names and "w" not in names and max(names.count("U"), names.count("W")) < 2:
        return names
    for i, name in enumerate(names):
        if name in ("U", "W") and at_rest(states[i][0]) is None:
            names[i] = "w" if name == "U" else _dimpled(states[i][0])
    return names


def _name(solution: Solution, cls: str, index: int, side: str) -> str | None:
    if cls != "+" or index != 0 or is_wound(solution, cls):
        return None
    rod = RodState(solution)
    inflections = rod.inflections["k1"]
    if side:
        if is_twisted(solution):
            return ("TU" if rod.height > 0 else "TW") + side
        if inflections < 2:
            return None  # of the families of wound-up states, where they have less than a turn
        return ("S" if abs(rod.height) < ZERO_HEIGHT else "US" if rod.height > 0 else "WS") + side
    if inflections < 2 or is_curled(solution):
        return _by_rest(solution)
    if middle_curvature(solution) > 0:
        if inflections >= 4:
            return "uUu" if rod.height > 0 else "wi"
        return "U" if rod.height > 0 else None
    if inflections == 2 and rod.height < 0:
        return "W"
    return _dimpled(solution)


def _by_rest(solution: Solution) -> str | None:
    """Name of a symmetric state by what it becomes without shear, where its shape does not tell."""
    rest = at_rest(solution)
    if rest is None or is_curled(rest):
        return None
    if rest["height"] < 0:
        return "W"
    return "U" if middle_curvature(solution) > 0 else _dimpled(solution)


def _dimpled(solution: Solution) -> str | None:
    slope = _slope_of_middle(solution)
    return None if slope is None else "w" if slope < 0 else "uUui"


def at_rest(solution: Solution) -> Solution | None:
    """What a state becomes while its shear is taken away; None where it turns back or loses its stability before."""
    shear = solution["dD"]
    if shear == 0.0:
        return solution
    options = TraceOptions(
        mesh=MeshControl(tolerance=1e-6), locate=("fold",), max_folds=0,
        bounds={"dD": (min(0.0, shear), max(0.0, shear))},
    )  # fmt: skip
    branch = trace(rod_problem(), solution, ("dD",), options, both=False, direction=-math.copysign(1.0, shear))
    stays = branch.ends[1] is EndReason.RANGE and all(morse_index_of(p.solution) == 0 for p in branch.points)
    return branch.points[-1].solution if stays else None


def _slope_of_middle(solution: Solution) -> float | None:
    """Derivative of k1(1/2) by |dD|; None where the neighbors cannot be solved for."""
    shear, bend = solution["dD"], []
    options = TraceOptions(mesh=MeshControl(tolerance=1e-8))
    for step in (-SHEAR_STEP, SHEAR_STEP):
        near = solution.with_parameters(dD=shear + math.copysign(1.0, shear) * step)
        try:
            bend.append(middle_curvature(solve(rod_problem(), near, ("dD",), options)))
        except NotConverged:
            return None
    return (bend[1] - bend[0]) / (2.0 * SHEAR_STEP)
