"""Where the branches of a slice start: planar and twisted states without shear, and states carried over in angle."""

from __future__ import annotations

import math
from collections.abc import Iterable

from rodatlas.atlas.slices.cache import BranchCache
from rodatlas.atlas.slices.match import crossings
from rodatlas.atlas.slices.settings import (
    REFERENCE_ANGLE_DEG,
    REFERENCE_COMPRESSION,
    REFERENCE_POISSON,
    SliceSettings,
)
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
from rodatlas.rods.band import bending_ratio, limiting_shear
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.planar import inverted_third_mode, planar_states
from rodatlas.rods.twisted import twisted_states

INVERTED_UP_TO_DEG = 10.0

Seed = tuple[str, Solution]
"""The name that a branch gets, and a solution on it."""


def planar_seeds(settings: SliceSettings) -> tuple[list[Seed], list[str]]:
    """U, W and the third mode (M3) at dD = 0, and a warning for what is missing.

    At psi0 = 0 the angle mirror maps the slice to itself: U to W, and the third mode to another one (M3i). Near it the
    branch of M3i still resembles that of M3 upside down, with wi for w; far from it nothing on it is stable.
    """
    states, missing = planar_states(settings.a, settings.angle, settings.compression, settings.tolerance)
    names = {"U": "U", "W": "W", "third mode": "M3"}
    seeds = [(names[family], solution) for family, solution in states.items()]
    if settings.angle_deg <= INVERTED_UP_TO_DEG and "third mode" in states:
        inverted = inverted_third_mode(states["third mode"], settings.tolerance)
        seeds += [("M3i", inverted)] if inverted is not None else []
    return seeds, [f"planar states not reached: {missing}"] if missing else []


def twisted_seeds(settings: SliceSettings, cache: BranchCache) -> tuple[list[Seed], list[str]]:
    """States at dD = 0 on the closed loops of TU and TW, and warnings.

    The stable ones are found at a reference setting, where both exist; their loops are followed in shear to more
    states without shear. Each is carried to the settings (stiffness, compression, angle), unless it ends on the way.

    Parameters
    ----------
    cache : keeps the loops and the branches on the way.
    """
    angle, a = math.radians(REFERENCE_ANGLE_DEG), bending_ratio(REFERENCE_POISSON)
    states, missing = twisted_states(a, angle, REFERENCE_COMPRESSION, settings.tolerance)
    warnings = [f"twisted states not reached: {missing}"] if missing else []
    seeds: list[Seed] = []
    for name, state in states.items():
        try:
            on_loop = [state, *crossings(_half_loop(name, state, cache), (0.0,), settings)]
        except NotConverged as error:
            warnings.append(f"loop of {name}: {error}")
            continue
        for k, start in enumerate(on_loop):
            ident = name if k == 0 else f"{name}-{k + 1}"
            try:
                end = _carried(ident, start, settings, cache)
            except NotConverged as error:
                warnings.append(f"branch {ident}: not carried over: {error}")
                continue
            if end is not None:
                seeds.append((ident, end))
    return seeds, warnings


def _half_loop(name: str, state: Solution, cache: BranchCache) -> Branch:
    """Half the closed branch in shear through a twisted state at the reference.

    Reversal and shear mirror together map the loop to itself, dD to -dD, and the states in the middle of both halves
    to themselves: past two folds from the stable one lies the other.
    """
    branch = cache.get(f"loop-{name}")
    if branch is None:
        limit = 0.9 * limiting_shear(state["dL"])
        options = TraceOptions(
            mesh=MeshControl(tolerance=1e-6), step=StepControl(maximum=20.0), bounds={"dD": (-limit, limit)},
            locate=("fold",), max_folds=2,
        )  # fmt: skip
        branch = trace(rod_problem(), state, ("dD",), options, both=False)
        cache.put(f"loop-{name}", branch)
    return branch


def carried_seeds(
    reference: Iterable[tuple[str, Branch]], start: SliceSettings, settings: SliceSettings, cache: BranchCache
) -> tuple[list[Seed], list[str]]:
    """States of a reference slice followed to another setting at fixed shears; and warnings.

    Stable states are carried at many shears, since one that is stable at the reference may end at a fold on the way
    at some shears and not at others; at high shear, states of index one too. First the compression changes, then the
    angle.

    Parameters
    ----------
    reference : names and branches of the slice at the settings `start`.
    cache : keeps the branches on the way.
    """
    seeds: list[Seed] = []
    warnings: list[str] = []
    for ident, branch in reference:
        starts = crossings(branch, settings.carried_shears(start), start, most=0)
        starts += crossings(branch, settings.carried_high_shears(start), start, most=1)
        for k, state in enumerate(starts):
            name = f"{ident}@{start.angle_deg:g},{start.compression:g}.{k + 1}"
            try:
                end = _carried(name, state, settings, cache)
            except NotConverged as error:
                warnings.append(f"branch {name}: not carried over: {error}")
                continue
            if end is not None:
                seeds.append((name, end))
    return seeds, warnings


def _carried(name: str, state: Solution, settings: SliceSettings, cache: BranchCache) -> Solution | None:
    """A state followed in stiffness, compression and angle to the settings; None when it meets a fold on the way."""
    for parameter, value in (("a", settings.a), ("dL", settings.compression), ("psi0", settings.angle)):
        here = state[parameter]
        if abs(here - value) < 1e-12:
            continue
        path = cache.get(f"{parameter}-{name}")
        if path is None:
            options = TraceOptions(  # no events and no index: the branch only carries a state, and must not pass a fold
                mesh=MeshControl(tolerance=settings.tolerance),
                step=StepControl(maximum=2.0),
                bounds={parameter: (min(here, value), max(here, value))},
                locate=("fold",),
                max_folds=0,
            )
            direction = math.copysign(1.0, value - here)
            path = trace(rod_problem(), state, (parameter,), options, both=False, direction=direction)
            cache.put(f"{parameter}-{name}", path)
        state = path.points[-1].solution
        if path.ends[1] is not EndReason.RANGE or abs(state[parameter] - value) > 1e-9:
            return None
    return state
