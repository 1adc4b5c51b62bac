"""The whole state from what a table of states keeps of it: force and moment at the left clamp."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodatlas.continuation import NotConverged, Solution
from rodatlas.continuation.problem.tracing import Named
from rodatlas.rods.band import bending_ratio
from rodatlas.rods.ends import Ends
from rodatlas.rods.formulation import Sections
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import FULL, rates, setting, settled

POINTS = 65
TOLD = ("angle", "shear")  # of a setting even where they are zero
CLOSE = 1e-5  # relative difference of the energy beyond which another state was found


def rebuilt(
    ends: Ends, force: Sequence[float], moment: Sequence[float], energy: float, poisson: float = 0.25,
    tolerance: float = 1e-8,
) -> Solution:  # fmt: skip
    """Integrate from the left clamp, and solve the boundary value problem from there.

    Parameters
    ----------
    force, moment : body components N(0) [GJ/L^2] and M(0) [GJ/L], (3,) each.
    energy : of the state [GJ/L], to be found again.

    Raises
    ------
    ValueError
        when no state of that energy results: the numbers are not those of a state at these ends.
    """
    from scipy.integrate import solve_ivp

    law = LinearLaw(bending_ratio(poisson))
    parameters, left = setting(law, ends), ends.clamps.left
    loads, pose = np.array([force, moment], dtype=float), (np.array(left.quaternion), np.array(left.position))
    start = FULL.values(Sections.loaded(law, loads[0], loads[1], *pose), parameters)
    known = Named(tuple(parameters), tuple(parameters.values()))

    def rate(_: float, u: np.ndarray) -> np.ndarray:
        return np.array(rates(Named(FULL.unknowns, u.tolist()), known))

    at = np.linspace(0.0, 1.0, POINTS)
    run = solve_ivp(rate, (0.0, 1.0), start, method="DOP853", t_eval=at, rtol=1e-11, atol=1e-11)
    where = ", ".join(f"{name} {x:g}" for name, x in ends.setting.items() if name in TOLD or x)
    wrong = f"state: expected N0, M0 of a state at {where} with energy {energy:g}"
    if not run.success or not np.isfinite(run.y).all():
        raise ValueError(f"{wrong}, got a curve that cannot be integrated ({run.message})")
    guess = Solution.from_values(at, run.y.T, FULL.unknowns, parameters)
    try:
        found = settled(guess, tolerance)
    except NotConverged as error:
        raise ValueError(f"{wrong}, got numbers from which none is reached ({error})") from None
    if abs(found["energy"] - energy) > CLOSE * max(1.0, energy):
        raise ValueError(f"{wrong}, got one of {found['energy']:g} (is Poisson's ratio {poisson:g}?)")
    return found
