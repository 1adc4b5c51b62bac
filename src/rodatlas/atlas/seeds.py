"""Where the branches of a slice start: planar states without shear, and states carried over from another angle."""

from __future__ import annotations

import math
from collections.abc import Iterable

from rodatlas.atlas.cache import BranchCache
from rodatlas.atlas.match import crossings
from rodatlas.atlas.settings import SliceSettings
from rodatlas.continuation import (
    Branch,
    EndReason,
    MeshControl,
    NotConverged,
    Solution,
    StepControl,
    TraceOptions,
    trace,
)
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.planar import planar_states
from rodatlas.rods.symmetry import mirror_angle

Seed = tuple[str, Solution]
"""The name that a branch gets, and a solution on it."""


def planar_seeds(settings: SliceSettings) -> tuple[list[Seed], list[str]]:
    """U, W and the third mode (M3) at dD = 0, and a warning for what is missing.

    At psi0 = 0 the angle mirror maps the slice to itself: U to W, and the third mode to another one (M3i).
    """
    states, missing = planar_states(settings.a, settings.angle, settings.compression, settings.tolerance)
    names = {"U": "U", "W": "W", "third mode": "M3"}
    seeds = [(names[family], solution) for family, solution in states.items()]
    if settings.angle == 0.0 and "third mode" in states:
        seeds.append(("M3i", mirror_angle(states["third mode"])))
    return seeds, [f"planar states not reached: {missing}"] if missing else []


def carried_seeds(
    reference: Iterable[tuple[str, Branch]], settings: SliceSettings, cache: BranchCache
) -> tuple[list[Seed], list[str]]:
    """States of a reference slice with index 0 or 1, followed in the angle at fixed shears; and warnings.

    Parameters
    ----------
    reference : names and branches of the slice at `settings.reference_angle_deg`.
    cache : keeps the branches in the angle.
    """
    here, there = settings.at_reference().angle, settings.angle
    options = TraceOptions(  # no events and no index: the branch only carries a state, and must not pass a fold
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=2.0),
        bounds={"psi0": (min(here, there), max(here, there))},
        locate=("fold",),
        max_folds=0,
    )
    seeds: list[Seed] = []
    warnings: list[str] = []
    for ident, branch in reference:
        for k, start in enumerate(crossings(branch, settings.carried_shears, settings)):
            name = f"{ident}@{settings.reference_angle_deg:g}.{k + 1}"
            path = cache.get(f"angle-{name}")
            if path is None:
                try:
                    path = trace(rod_problem(), start, ("psi0",), options, both=False,
                                 direction=math.copysign(1.0, there - here))  # fmt: skip
                except NotConverged as error:
                    warnings.append(f"branch {name}: not carried over in angle: {error}")
                    continue
                cache.put(f"angle-{name}", path)
            end = path.points[-1].solution
            if path.ends[1] is EndReason.RANGE and abs(end["psi0"] - there) < 1e-9:
                seeds.append((name, end))
    return seeds, warnings
