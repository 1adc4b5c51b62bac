"""A state followed from its clamps and its stiffness to others, one parameter after another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rodatlas.continuation import EndReason, MeshControl, Solution, StepControl, TraceOptions, trace
from rodatlas.continuation.checks import as_finite, check_type
from rodatlas.rods.perfectly_anisotropic import check_rod, rod_problem

THERE = 1e-12  # difference of a parameter from its goal below which it need not be followed
ARRIVED = 1e-9  # and below which a branch has ended at its goal


@dataclass(frozen=True, eq=False)
class Carried:
    """How far a state was followed.

    Attributes
    ----------
    solution : the last state, at the goal where `parameter` is empty.
    parameter : the one that could not be followed to its goal, '' when all were.
    end : why its branch ended: `EndReason.FOLD_LIMIT` where the state turns back at a fold; None when all arrived.
    limit : the value at which the branch turns back or ends; None when all arrived.
    """

    solution: Solution
    parameter: str = ""
    end: EndReason | None = None
    limit: float | None = None

    def __repr__(self) -> str:
        return f"Carried({'arrived' if self.arrived else self.reason})"

    @property
    def arrived(self) -> bool:
        """Whether the state was followed to all that was asked for."""
        return not self.parameter

    @property
    def reason(self) -> str:
        """Why it did not arrive, in words; '' when it did."""
        if self.arrived or self.end is None:
            return ""
        why = "turns back at a fold" if self.end is EndReason.FOLD_LIMIT else f"ends ({self.end.value})"
        return f"the branch in {self.parameter} {why} at {self.limit:.6g}"


def carried(
    solution: Solution, parameters: Mapping[str, float], tolerance: float = 1e-8, step: StepControl | None = None
) -> Carried:
    """Follow a state to other parameters, one after another in the order given, and never past a fold.

    Bifurcations on the way are passed on the same branch, whatever its stability.

    Parameters
    ----------
    solution : of :func:`rodatlas.rods.rod_problem`.
    parameters : goals by name; those that are missing stay as they are.
    tolerance : of the mesh.
    step : as for :class:`rodatlas.continuation.TraceOptions`.

    Returns
    -------
    the state at the goal, or what came in the way.

    Raises
    ------
    ValueError
        for a parameter that the problem does not have, or no finite number.
    NotConverged
        when a branch cannot be started.

    Examples
    --------
    From clamps of 15 degrees to one of 20 and one of 35, its partner by reversal:

    >>> end = carried(state_at(Ends(15.0)), Ends.unequal(20.0, 35.0).parameters)
    >>> end.arrived, RodState(end.solution).energy
    """
    check_rod(solution)
    check_type("parameters", parameters, Mapping, "a mapping of names to numbers")
    goals = {name: as_finite("parameters", name, value) for name, value in parameters.items()}
    for name in goals:
        rod_problem().parameter_index(name)
    for name, goal in goals.items():
        here = solution[name]
        if abs(goal - here) <= THERE:
            continue
        options = TraceOptions(
            mesh=MeshControl(tolerance=tolerance), step=step or StepControl(), locate=("fold",), max_folds=0,
            bounds={name: (min(here, goal), max(here, goal))},
        )  # fmt: skip
        branch = trace(rod_problem(), solution, (name,), options, both=False, direction=math.copysign(1.0, goal - here))
        solution = branch.points[-1].solution
        if branch.ends[1] is not EndReason.RANGE or abs(solution[name] - goal) > ARRIVED:
            folds = branch.of_kind("fold")
            limit = folds[0].solution[name] if folds else solution[name]
            return Carried(solution, name, branch.ends[1], limit)
    return Carried(solution)
