"""The closed branches in shear through the strongly twisted states, and their states without shear."""

from __future__ import annotations

from rodatlas.continuation import Branch, MeshControl, Solution, StepControl, TraceOptions, trace
from rodatlas.model.places import crossings
from rodatlas.rods.band import limiting_shear
from rodatlas.rods.perfectly_anisotropic import rod_problem

PART = 0.9  # of the limiting shear, to which a loop is followed


def half_loop(state: Solution) -> Branch:
    """Half the closed branch in shear through a twisted state.

    Reversal and shear mirror together map the loop to itself, dD to -dD, and the states in the middle of both halves
    to themselves: past two folds from the stable one lies the other.
    """
    limit = PART * limiting_shear(state["dL"])
    options = TraceOptions(
        mesh=MeshControl(tolerance=1e-6), step=StepControl(maximum=20.0), bounds={"dD": (-limit, limit)},
        locate=("fold",), max_folds=2,
    )  # fmt: skip
    return trace(rod_problem(), state, ("dD",), options, both=False)


def without_shear(loop: Branch, tolerance: float) -> list[Solution]:
    """The states of a loop at dD = 0 that it passes."""
    return crossings(rod_problem(), loop, "dD", (0.0,), tolerance)
