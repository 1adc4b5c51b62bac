"""Where the branches of a slice start: seeds of the model, and states carried over from other settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from rodatlas.atlas.cache import BRANCH, Cache
from rodatlas.atlas.slices.branches.match import crossings
from rodatlas.atlas.slices.settings import SliceSettings
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
from rodatlas.model import Seed
from rodatlas.model.model import Keep, Source, parameters_of
from rodatlas.model.orbit import fixing, images

SHARES = (0.35, 0.45, 0.55, 0.65)  # of the reach of what varies, at which stable states are carried
HIGH_SHARES = (0.72, 0.86)  # states of index one too
REACHED = 1e-9  # of a parameter, to which a path has come
NEAR = 1e-12  # a parameter that differs by less is there


def seeds_of(source: Source, settings: SliceSettings, cache: Cache) -> tuple[list[Seed], list[str]]:
    """The seeds of one source, followed to the setting of a slice; and warnings."""
    found, warnings = source.find(settings.whole_setting(settings.anchor), settings.tolerance, _keep(cache))
    return _all_carried(found, settings, cache, warnings)


def carried_seeds(
    reference: Iterable[tuple[str, Branch]], start: SliceSettings, settings: SliceSettings, cache: Cache
) -> tuple[list[Seed], list[str]]:
    """States of a reference slice followed to another setting at fixed values of what varies; and warnings.

    Stable states are carried at many values, since one that is stable at the reference may end at a fold on the way
    at some and not at others; at high values, states of index one too.

    Parameters
    ----------
    reference : names and branches of the slice at the settings `start`.
    cache : keeps the branches on the way.
    """
    found: list[Seed] = []
    place = ",".join(start.model.stem_parts(start.setting))
    for ident, branch in reference:
        starts = crossings(branch, _inside(SHARES, start, settings), start, most=0)
        starts += crossings(branch, _inside(HIGH_SHARES, start, settings), start, most=1)
        found += [Seed(f"{ident}@{place}.{k + 1}", state) for k, state in enumerate(starts)]
    return _all_carried(found, settings, cache, [])


def _inside(shares: tuple[float, ...], start: SliceSettings, settings: SliceSettings) -> tuple[float, ...]:
    """Values at shares of the smaller reach, inside both ranges."""
    values = (min(s.part(share) for s in (start, settings)) for share in shares)
    return tuple(value for value in values if value < min(settings.high, start.high))


def _all_carried(
    found: Iterable[Seed], settings: SliceSettings, cache: Cache, warnings: list[str]
) -> tuple[list[Seed], list[str]]:
    """Seeds followed to the setting, without those that end on the way; and warnings."""
    seeds: list[Seed] = []
    for name, state in _with_lost_images(found, settings):
        try:
            end = carried(name, state, settings, cache)
        except NotConverged as error:
            warnings.append(f"branch {name}: not carried over: {error}")
            continue
        if end is not None:
            seeds.append(Seed(name, end))
    return seeds, warnings


def _with_lost_images(found: Iterable[Seed], settings: SliceSettings) -> list[Seed]:
    """Seeds, and their images under symmetries that their setting has and the wanted one has not.

    Where these states are one up to a symmetry, there they are several: both members of a pair between equal clamps
    become states of their own between unequal ones.
    """
    model = settings.model
    at_anchor = fixing(model, list(model.parameters(settings.whole_setting(settings.anchor)).values()))
    # what a nomenclature names is known to be whole; elsewhere an image that the slice does not identify may lie on
    # another branch, as the mirror image of a state at zero shear lies on one that is followed to negative shears
    kept = set(at_anchor if settings.named else settings.symmetries)
    seeds = []
    for name, state in found:
        lost = [symmetry for symmetry in fixing(model, state.parameters) if symmetry not in kept]
        for k, one in enumerate(images(model, state, lost) if lost else [state]):
            seeds.append(Seed(name if k == 0 else f"{name}~{k}", one))
    return seeds


def carried(name: str, state: Solution, settings: SliceSettings, cache: Cache) -> Solution | None:
    """A state followed to the setting, control by control; None when it meets a fold on the way.

    What varies along the slice is left as it is where it lies in the range, else it is carried to the anchor.
    """
    model = settings.model
    wanted = settings.parameters
    inside = settings.low <= settings.value(state) <= settings.high
    wanted[settings.parameter] = state[settings.parameter] if inside else settings.raw(settings.anchor)
    for parameter in dict.fromkeys(c.parameter for c in model.controls):
        here, value = state[parameter], wanted[parameter]
        if abs(here - value) < NEAR:
            continue
        path = _keep(cache)(f"{parameter}-{name}", _path(state, parameter, value, settings))
        state = path.points[-1].solution
        if path.ends[1] is not EndReason.RANGE or abs(state[parameter] - value) > REACHED:
            return None
    return state


def _path(state: Solution, parameter: str, value: float, settings: SliceSettings) -> Callable[[], Branch]:
    """The branch on which a state is carried in one parameter."""
    here = parameters_of(state)[parameter]
    options = TraceOptions(  # no events and no index: the branch only carries a state, and must not pass a fold
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=2.0),
        bounds={parameter: (min(here, value), max(here, value))},
        locate=("fold",),
        max_folds=0,
    )
    free = (parameter, *settings.model.free)
    direction = math.copysign(1.0, value - here)
    return lambda: trace(settings.model.problem, state, free, options, both=False, direction=direction)


def _keep(cache: Cache) -> Keep:
    """What a cache has of a branch, or the branch made now and kept."""

    def keep(key: str, make: Callable[[], Branch]) -> Branch:
        known = cache.get(key, BRANCH)
        if known is None:
            known = make()
            cache.put(key, known, BRANCH)
        return known

    return keep
