"""Reach one named state at one setting."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rodatlas.atlas.cache import Cache, MemoryCache
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.obtain import related_slices, stored_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.coexisting import numbered_state
from rodatlas.atlas.slices.states.pick import member, pick_state
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.progress import Progress, silent, tells
from rodatlas.states.labels import Wanted, parse_label
from rodatlas.states.result import Discovery

STARTS = 512  # of the first search for one state; named states attract one band in a hundred at least


class Reached(NamedTuple):
    """A state, and where it comes from: 'stored slice', 'search' or 'slice'."""

    solution: Solution
    source: str


@tells("state")
def reach(
    settings: SliceSettings, name: str, value: float, cache: Cache | None = None,
    progress: Progress | None = None, folder: Path | None = None,
) -> Reached:  # fmt: skip
    """The stable state of a name at a value of what varies along a slice.

    From the slice that a folder holds, if any; otherwise from a search at the setting, which takes a second or two and
    names what it finds as the slice does. Where that search has no state of the name, a longer one decides that there
    is none. Near limits of what varies, where nothing converges, and for models whose search knows no names, the whole
    slice is computed.

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
    check_type("settings", settings, SliceSettings, "SliceSettings, see SliceSettings.of")
    check_type("name", name, str, "the name of a state such as US+")
    say = progress or silent
    stored = stored_slice(folder, settings) if folder else None
    nomenclature = settings.model.nomenclature
    if nomenclature is None or not settings.named:  # names are told by all states of the slice
        whole = compute_slice(settings, cache, progress) if stored is None else stored
        return Reached(pick_state(whole, name, value), "slice" if stored is None else "stored slice")
    wanted = parse_label(name, nomenclature.names)
    if stored is not None and (solution := _of_slice(stored, wanted, value)) is not None:
        return Reached(member(settings.model, solution, wanted.sign), "stored slice")
    known, care = settings.model.search, settings.control.care
    if known is None or not known.names:
        return _computed(settings, wanted, value, cache, progress)
    if care is not None and care(value, settings.setting):
        say(f"slice, since searches miss states at {settings.along} {value:g}", 0, 1)
        return _computed(settings, wanted, value, cache, progress)
    first = STARTS if wanted.number is None else None  # a number counts all states of the name
    say(f"search with {first} starts" if first else "search until it looks complete", 0, 1)
    at = settings.whole_setting(value)
    found = known.discover(at, first, settings.tolerance, progress)
    state = found.named(wanted.label)
    if state is None and not found.failed and first:
        say(f"longer search, since {STARTS} starts met no {wanted.member}", 0, 1)
        found = known.discover(at, None, settings.tolerance, progress)
        state = found.named(wanted.label)
    if state is not None:
        return Reached(state.solution, "search")
    if not found.failed:
        there = [stored] if stored else related_slices(folder, settings) if folder else []
        raise ValueError(_missing(settings, wanted, value, found, there))
    say("slice, since no start of the search converged", 0, 1)
    return _computed(settings, wanted, value, cache, progress)


def _missing(
    settings: SliceSettings, wanted: Wanted, value: float, found: Discovery, known: list[Slice]
) -> str:  # fmt: skip
    """That a search has no state of a name: what it has, how complete it looks, and where to look on.

    Parameters
    ----------
    known : slices at the setting that are there, of any range.
    """
    there = ", ".join(label or "one without a name" for label in dict.fromkeys(found.labels))
    least = min((s.count for s in found.states), default=0)
    sure = f"{found.converged} of {found.starts} starts converged, and each of these was met {least} times or more"
    told = [(s, ranges) for s in known if (ranges := _ranges(s, wanted.name))]
    if told:
        one, ranges = max(told, key=lambda t: t[0].settings.high - t[0].settings.low)
        hint = f"{wanted.name} is stable for {settings.along} {ranges}"
        if one.settings != settings:
            hint += f" in the slice from {one.settings.low:g} to {one.settings.high:g}"
    else:
        hint = f"'rodatlas slice{_options(settings)}' tells where it is"
    where = f"{settings.place_text} and {settings.along} {value:g}"
    return f"state: expected one that is stable at {where} ({there}; {sure}), got '{wanted.label}'; {hint}"


def _options(settings: SliceSettings) -> str:
    """The options of a setting that are not those by default."""
    model = settings.model
    held = ((name, value, model.control(name)) for name, value in reversed(list(settings.setting.items())))
    told = (f" --{name} {value:g}" for name, value, control in held if value != control.default or control.short == "")
    return "".join(told)


def _ranges(found: Slice, name: str) -> str:
    """Where a state is stable in a slice; '' when nowhere."""
    return "; ".join(f"{s.span[0]:.4f} to {s.span[1]:.4f}" for s in found.states if s.name == name)


def _computed(
    settings: SliceSettings, wanted: Wanted, value: float, cache: Cache | None, progress: Progress | None
) -> Reached:
    """The state of a slice that is computed for it."""
    covering = replace(settings, low=min(settings.low, value), high=max(settings.high, value))
    cache = MemoryCache() if cache is None else cache
    found = compute_slice(covering, cache, progress, carry=False)
    if not found.states_at(value, wanted.name):
        found = compute_slice(covering, cache, progress)
    if not found.states_at(value, wanted.name):
        there = ", ".join(dict.fromkeys(s.name for s in found.states_at(value)))
        ranges = _ranges(found, wanted.name)
        raise ValueError(
            f"state: expected one that is stable at {settings.place_text} and {settings.along} {value:g} ({there}), "
            f"got '{wanted.label}'" + (f"; {wanted.name} is stable for {settings.along} {ranges}" if ranges else "")
        )
    solution = _of_slice(found, wanted, value)
    if solution is None:
        raise ValueError(f"{settings.along}: expected a value at which the state can be solved for, got {value:g}")
    return Reached(member(settings.model, solution, wanted.sign), "slice")


def _of_slice(found: Slice, wanted: Wanted, value: float) -> Solution | None:
    """The state of a slice that a label means, exactly at a value; None where it has none or it is not solved for."""
    if wanted.name not in found.known_names:
        return None
    state = numbered_state(found, wanted, value)
    return state.solution if state is not None and state.exact else None
