"""States next to known ones, by deflation: an option of the search, slower than more starts.

Newton's method from perturbations of the known states, with all of these divided out
(:mod:`rodatlas.continuation.curve.deflation`). The perturbations follow the lowest modes and random smooth loads.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions
from rodatlas.continuation.curve.deflation import deflated_solve, perturbed
from rodatlas.rods.perfectly_anisotropic import HELD, rod_problem
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import has_partner, reverse


def deflated(known: Sequence[Solution], attempts: int, tolerance: float, largest_force: float) -> list[Solution]:
    """States that are not known, one of each +/- pair where there are pairs.

    Parameters
    ----------
    known : all known states at one setting, both members of pairs; those of least energy are perturbed first.
    attempts : deflated solves at most.
    largest_force : states with a larger |N| are left out [GJ/L^2].
    """
    options = TraceOptions(mesh=MeshControl(tolerance=tolerance))
    out, found = list(known), []
    queue = sorted(known, key=lambda s: s["energy"])
    guesses = (guess for state in queue for guess in perturbed(rod_problem(), state, HELD, options))
    for _, guess in zip(range(attempts), guesses, strict=False):
        try:
            new = deflated_solve(rod_problem(), guess, out, HELD, options)
        except NotConverged:
            continue
        out += [new, reverse(new)] if has_partner(new) else [new]
        if np.linalg.norm(RodState(new).force[0]) <= largest_force:
            found.append(new)
    return found
