"""Planar states without shear, reached from the circle: where every study of a clamped band begins.

The circle (psi0 = pi, dL = 1) is opened to the wanted compression and its clamps are turned. Lowering psi0 gives the
first-mode elastica U; past psi0 = 0 it is the inverted state W of the opposite angle, seen in the angle mirror; past
a fold (near -86 degrees for dL = 1/2) the same curve comes back as the branch of the third elastica mode.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rodatlas.continuation import MeshControl, Solution, StepControl, TraceOptions, solve, trace
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.symmetry import mirror_angle

PLANAR = ("U", "W", "third mode")


def circle(a: float) -> Solution:
    r"""The closed circle: N = 0, k1 = 2 pi, q = (sin, -cos, sin, cos)(pi s)/sqrt 2; the start of everything."""
    bvp = rod_problem()

    def fields(s: np.ndarray) -> np.ndarray:
        out = np.zeros((len(s), bvp.size))
        t = math.pi * s
        out[:, 4] = 2 * math.pi
        out[:, 6:10] = np.column_stack([np.sin(t), -np.cos(t), np.sin(t), np.cos(t)]) / math.sqrt(2)
        out[:, 10] = -np.sin(2 * t) / (2 * math.pi)
        out[:, 11] = (1 - np.cos(2 * t)) / (2 * math.pi)
        return out

    return Solution.from_function(fields, bvp.unknowns, {**bvp.parameters, "a": a, "psi0": math.pi, "dL": 1.0})


def planar_states(
    a: float, angle: float, compression: float, tolerance: float = 1e-8, names: tuple[str, ...] = PLANAR
) -> dict[str, Solution]:
    """The planar states U, W and 'third mode' at dD = 0.

    Parameters
    ----------
    a : EI1/GJ; angle : psi0 in radians, 0 <= psi0 < pi; compression : dL; names : which ones are wanted.

    Returns
    -------
    dict from name to solution; 'third mode' is left out where the curve does not come back to the angle.
    """
    follow = _leg(tolerance)
    here = follow(solve(rod_problem(), circle(a), ("dL",), _options(tolerance)), "dL", compression, -1.0)
    found = {}
    if here is not None:
        here = follow(here, "psi0", angle, -1.0)
    if here is not None and "U" in names:
        found["U"] = here
    if here is not None and set(names) - {"U"}:
        here = follow(here, "psi0", -angle, -1.0) if angle > 0 else here
        if here is not None and "W" in names:
            found["W"] = mirror_angle(here)
        if here is not None and "third mode" in names:
            here = follow(here, "psi0", -angle, -1.0, True)
            if here is not None:
                found["third mode"] = mirror_angle(here)
    return {name: solve(rod_problem(), state, ("dD",), _options(tolerance)) for name, state in found.items()}


def _options(tolerance: float) -> TraceOptions:
    return TraceOptions(mesh=MeshControl(tolerance=tolerance), step=StepControl(maximum=0.3), locate=())


def _leg(tolerance: float):  # type: ignore[no-untyped-def]
    """A function that follows one parameter to a value, past a fold and back when `beyond` is set."""

    def follow(start: Solution, name: str, value: float, direction: float, beyond: bool = False) -> Solution | None:
        far = (-10.0, value) if beyond else (min(value, start[name]), max(value, start[name]))
        if not beyond and start[name] == value:
            return start
        options = replace(_options(tolerance), bounds={name: far}, max_points=300, max_folds=2, locate=("fold",))
        branch = trace(rod_problem(), start, (name,), options, both=False, direction=direction)
        end = branch.points[-1].solution
        return end if math.isclose(end[name], value, abs_tol=1e-9) else None

    return follow
