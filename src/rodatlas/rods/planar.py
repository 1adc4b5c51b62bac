"""Planar states without shear: where every study of a clamped band begins.

The circle (psi0 = pi, dL = 1) is opened to the wanted compression and its clamps are turned; where the compression is
small, and the circle far, the arch between level clamps is known from linear theory. Lowering psi0 gives the
first-mode elastica U; past psi0 = 0 it is the inverted state W of the opposite angle, seen in the angle mirror; past
a fold (near -86 degrees for dL = 1/2) the same curve comes back as the branch of the third elastica mode.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rodatlas.continuation import (
    Branch,
    EndReason,
    MeshControl,
    NotConverged,
    Solution,
    StepControl,
    TraceOptions,
    solve,
    trace,
)
from rodatlas.rods.band import check_setting
from rodatlas.rods.formulation import Sections
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import FULL, rod_problem
from rodatlas.rods.shallow import SHALLOW, first_mode
from rodatlas.rods.symmetry import mirror_angle

PLANAR = ("U", "W", "third mode")


def circle(a: float) -> Solution:
    r"""The closed circle: N = 0, k1 = 2 pi, q = (sin, -cos, sin, cos)(pi s)/sqrt 2; the start of everything."""
    parameters = {**rod_problem().parameters, "a": a, "psi0": math.pi, "dL": 1.0}

    def fields(s: np.ndarray) -> np.ndarray:
        t, nothing = math.pi * s, np.zeros((len(s), 3))
        q = np.column_stack([np.sin(t), -np.cos(t), np.sin(t), np.cos(t)]) / math.sqrt(2)
        center = np.column_stack([-np.sin(2 * t), 1 - np.cos(2 * t), 0 * t]) / (2 * math.pi)
        moment = np.array(LinearLaw(a).moment((2 * math.pi, 0.0, 0.0), reaction=(0.0, 0.0, 0.0)))
        circle = Sections.loaded(LinearLaw(a), nothing, nothing + moment, q, center)
        return FULL.values(circle, parameters)

    return Solution.from_function(fields, FULL.unknowns, parameters)


def planar_states(
    a: float, angle: float, compression: float, tolerance: float = 1e-8
) -> tuple[dict[str, Solution], str]:
    """The planar states U, W and 'third mode' at dD = 0.

    Parameters
    ----------
    a : EI1/GJ; angle : psi0 in radians, 0 <= psi0 < pi; compression : dL.

    Returns
    -------
    dict from name to solution, and why the search ended before it had all three ('' when it has them).
    """
    check_setting(a, angle, compression)
    options = _options(tolerance)
    near = first_mode(a, compression) if compression < SHALLOW else circle(a)
    here = solve(rod_problem(), near, ("dL",), options)
    found: dict[str, Solution] = {}
    legs = [("", "dL", compression, False), ("U", "psi0", angle, False), ("W", "psi0", -angle, False),
            ("third mode", "psi0", -angle, True)]  # fmt: skip
    for name, parameter, value, beyond in legs:
        branch = _leg(here, parameter, value, beyond, options)
        here = branch.points[-1].solution if branch else here
        if not math.isclose(here[parameter], value, abs_tol=1e-9):
            missing = ", ".join(n for n in PLANAR if n not in found)
            if branch and branch.ends[1] is EndReason.FOLD_LIMIT:
                return found, f"{missing}: the curve of planar states turns back before it reaches this angle"
            why = branch.ends[1].value if branch else "no path"
            return found, f"{missing}: {why} at {parameter} = {here[parameter]:.6g}"
        if name:
            found[name] = _alone(mirror_angle(here) if name != "U" else here, options)
    return found, ""


def inverted_third_mode(third: Solution, tolerance: float = 1e-8) -> Solution | None:
    """The third elastica mode of the other sign, from that of :func:`planar_states` at psi0 >= 0.

    At psi0 = 0 it is its image in the angle mirror; at other angles the image belongs to -psi0, and is followed from
    there to psi0. None where that curve turns back before.
    """
    options = _options(tolerance)
    image, angle = mirror_angle(third), third["psi0"]
    if angle == 0.0:
        return image
    options = replace(options, bounds={"psi0": (-angle, angle)}, max_folds=0, locate=("fold",))
    end = trace(rod_problem(), image, ("psi0",), options, both=False).points[-1].solution
    return _alone(end, options) if math.isclose(end["psi0"], angle, abs_tol=1e-9) else None


def _alone(state: Solution, options: TraceOptions) -> Solution:
    """The state solved with every parameter held; as it is where that is singular, at a bifurcation in shear."""
    try:
        return solve(rod_problem(), state, ("dD",), options)
    except NotConverged:
        return state


def _options(tolerance: float) -> TraceOptions:
    return TraceOptions(mesh=MeshControl(tolerance=tolerance), step=StepControl(maximum=0.3), locate=())


def _leg(start: Solution, name: str, value: float, beyond: bool, options: TraceOptions) -> Branch | None:
    """Change a parameter to a value, or lower it past a fold and back up to it when `beyond` is set; None when it is
    there."""
    if not beyond and start[name] == value:
        return None
    bounds = (-10.0, value) if beyond else (min(value, start[name]), max(value, start[name]))
    direction = 1.0 if value > start[name] and not beyond else -1.0
    options = replace(options, bounds={name: bounds}, max_points=2000, max_folds=2, locate=("fold",))
    return trace(rod_problem(), start, (name,), options, both=False, direction=direction)
