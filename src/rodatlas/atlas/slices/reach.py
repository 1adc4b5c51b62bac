"""Reach one named state at one setting."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rodatlas.atlas.slices.cache import BranchCache, MemoryCache
from rodatlas.atlas.slices.coexisting import numbered_state
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.obtain import related_slices, stored_slice
from rodatlas.atlas.slices.pick import member
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.progress import Progress, silent, tells
from rodatlas.rods.band import near_limit
from rodatlas.rods.ends import Ends
from rodatlas.states.discover import find_states
from rodatlas.states.labels import Wanted, parse_label
from rodatlas.states.result import Discovery

STARTS = 512  # of the first search for one state; named states attract one band in a hundred at least


class Reached(NamedTuple):
    """A state, and where it comes from: 'stored slice', 'search' or 'slice'."""

    solution: Solution
    source: str


@tells("state")
def reach(
    settings: SliceSettings, name: str, shear: float, cache: BranchCache | None = None,
    progress: Progress | None = None, folder: Path | None = None,
) -> Reached:  # fmt: skip
    """The stable state of a name at a shear.

    From the slice that a folder holds, if any; otherwise from a search at the setting, which takes a second or two and
    names what it finds as the slice does (:func:`rodatlas.states.single.names_of`). Where that search has no state of
    the name, a longer one decides that there is none. Near the limiting shear, or where no band converges, a search
    tells nothing: there the whole slice is computed.

    Parameters
    ----------
    name : 'U', or a member of a pair, 'US+' or 'US-'; 'W:2' where several states are called W there.
    folder : where a computed slice may lie.

    Raises
    ------
    ValueError
        when no stable state of that name exists there, or several and no number tells which is meant; the message says
        which ones do.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    check_type("name", name, str, "the name of a state such as US+")
    wanted = parse_label(name)
    say = progress or silent
    stored = stored_slice(folder, settings) if folder else None
    if stored is not None and (solution := _of_slice(stored, wanted, shear)) is not None:
        return Reached(member(solution, wanted.sign), "stored slice")
    if near_limit(shear, settings.compression):
        say("slice, since searches miss states so near the limiting shear", 0, 1)
        return Reached(member(_of_computed(settings, name, shear, cache, progress), wanted.sign), "slice")
    first = STARTS if wanted.number is None else None  # a number counts all states of the name
    say(f"search with {first} starts" if first else "search until it looks complete", 0, 1)
    found = _searched(settings, shear, first, progress)
    state = found.named(wanted.label)
    if state is None and not found.failed and first:
        say(f"longer search, since {STARTS} starts met no {wanted.member}", 0, 1)
        found = _searched(settings, shear, None, progress)
        state = found.named(wanted.label)
    if state is not None:
        return Reached(state.solution, "search")
    if not found.failed:
        known = [stored] if stored else related_slices(folder, settings) if folder else []
        raise ValueError(_missing(settings, wanted, shear, found, known))
    say("slice, since no start of the search converged", 0, 1)
    return Reached(member(_of_computed(settings, name, shear, cache, progress), wanted.sign), "slice")


def _searched(settings: SliceSettings, shear: float, starts: int | None, progress: Progress | None) -> Discovery:
    """The stable states that a search at one setting finds."""
    ends = Ends(settings.angle_deg, settings.compression, shear)
    return find_states(
        ends, settings.poisson, "+", starts, stable_only=True, tolerance=settings.tolerance, progress=progress
    )


def _missing(
    settings: SliceSettings, wanted: Wanted, shear: float, found: Discovery, known: list[Slice]
) -> str:  # fmt: skip
    """That a search has no state of a name: what it has, how complete it looks, and where to look on.

    Parameters
    ----------
    known : slices of the band that are there, of any shears.
    """
    there = ", ".join(label or "one without a name" for label in dict.fromkeys(found.labels))
    least = min((s.count for s in found.states), default=0)
    sure = f"{found.converged} of {found.starts} starts converged, and each of these was met {least} times or more"
    told = [(s, ranges) for s in known if (ranges := _ranges(s, wanted.name))]
    if told:
        one, ranges = max(told, key=lambda t: t[0].settings.shear_max - t[0].settings.shear_min)
        hint = f"{wanted.name} is stable for shear {ranges}"
        if one.settings != settings:
            hint += f" in the slice from {one.settings.shear_min:g} to {one.settings.shear_max:g}"
    else:
        hint = f"'rodatlas slice --angle {settings.angle_deg:g}{_options(settings)}' tells where it is"
    return (
        f"state: expected one that is stable at angle {settings.angle_deg:g} and shear {shear:g} ({there}; {sure}), "
        f"got '{wanted.label}'; {hint}"
    )


def _options(settings: SliceSettings) -> str:
    """The options of a setting that are not those by default."""
    compression = f" --compression {settings.compression:g}" if settings.compression != 0.5 else ""
    return compression + (f" --poisson {settings.poisson:g}" if settings.poisson != 0.25 else "")


def _ranges(found: Slice, name: str) -> str:
    """Where a state is stable in a slice; '' when nowhere."""
    return "; ".join(f"{s.shear[0]:.4f} to {s.shear[1]:.4f}" for s in found.states if s.name == name)


def _of_computed(
    settings: SliceSettings, name: str, shear: float, cache: BranchCache | None, progress: Progress | None
) -> Solution:
    """The state of a slice that is computed for it."""
    wanted = parse_label(name)
    covering = _covering(settings, shear)
    cache = MemoryCache() if cache is None else cache
    found = compute_slice(covering, cache, progress, carry=False)
    if not found.states_at(shear, wanted.name):
        found = compute_slice(covering, cache, progress)
    if not found.states_at(shear, wanted.name):
        there = ", ".join(dict.fromkeys(s.name for s in found.states_at(shear)))
        ranges = _ranges(found, wanted.name)
        raise ValueError(
            f"state: expected one that is stable at angle {settings.angle_deg:g} and shear {shear:g} ({there}), "
            f"got '{name}'" + (f"; {wanted.name} is stable for shear {ranges}" if ranges else "")
        )
    solution = _of_slice(found, wanted, shear)
    if solution is None:
        raise ValueError(f"shear: expected a value at which the state can be solved for, got {shear:g}")
    return solution


def _of_slice(found: Slice, wanted: Wanted, shear: float) -> Solution | None:
    """The state of a slice that a label means, exactly at a shear; None where it has none or it is not solved for."""
    state = numbered_state(found, wanted, shear)
    return state.solution if state is not None and state.exact else None


def _covering(settings: SliceSettings, shear: float) -> SliceSettings:
    """Settings whose shear range holds a shear with some room."""
    if shear < settings.shear_min:
        return replace(settings, shear_min=shear)
    return replace(settings, shear_max=max(settings.shear_max, shear))
