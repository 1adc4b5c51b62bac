"""Reach one named state at one setting."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rodatlas.atlas.slices.cache import BranchCache, MemoryCache
from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.obtain import stored_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.progress import Progress, tells
from rodatlas.rods.ends import Ends
from rodatlas.rods.symmetry import pair_member, reverse
from rodatlas.states.discover import find_states
from rodatlas.states.names import NAMES

SIGNS = ("", "+", "-", "+-")  # that may follow the name of a pair
STARTS = 512  # of the search for one state; named states attract one band in a hundred at least


def split_name(text: str) -> tuple[str, str]:
    """('US+-', '+') from 'US+', 'US' or 'US+-'; ('U', '') from 'U'.

    Raises
    ------
    ValueError
        when there is no such name.
    """
    bare = text.rstrip("+-")
    for name in NAMES:
        if bare == name.rstrip("+-") and (name.endswith("+-") or text == name):
            sign = text[len(bare) :]
            if sign not in SIGNS:
                break
            if name.endswith("+-"):
                return name, "-" if sign == "-" else "+"
            return name, ""
    known = ", ".join(n.replace("+-", "+, ") + n[:-2] + "-" if n.endswith("+-") else n for n in NAMES)
    raise ValueError(f"state: expected one of {known}, got '{text}'")


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
    names what it finds as the slice does (:func:`rodatlas.states.single.names_of`). Where the search has no state of
    the name, or several, the whole slice is computed and decides.

    Parameters
    ----------
    folder : where a computed slice may lie.

    Raises
    ------
    ValueError
        when no stable state of that name exists there; the message says which ones do.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    check_type("name", name, str, "the name of a state such as US+")
    wanted, sign = split_name(name)
    stored = stored_slice(folder, settings) if folder else None
    if stored is not None and (solution := _of_slice(stored, wanted, shear)) is not None:
        return Reached(_member(solution, sign), "stored slice")
    found = _searched(settings, wanted, shear, progress)
    if found is not None:
        return Reached(_member(found, sign), "search")
    return Reached(_member(_of_computed(settings, name, shear, cache, progress), sign), "slice")


def _searched(settings: SliceSettings, wanted: str, shear: float, progress: Progress | None) -> Solution | None:
    """The only state of a name that a search at one setting finds."""
    ends = Ends(settings.angle_deg, settings.compression, shear)
    found = find_states(
        ends, settings.poisson, "+", STARTS, stable_only=True, tolerance=settings.tolerance, progress=progress
    )
    fitting = [s.solution for s in found.states if s.name == wanted.replace("+-", "+")]
    return fitting[0] if len(fitting) == 1 else None


def _of_computed(
    settings: SliceSettings, name: str, shear: float, cache: BranchCache | None, progress: Progress | None
) -> Solution:
    """The state of a slice that is computed for it."""
    wanted, _ = split_name(name)
    covering = _covering(settings, shear)
    cache = MemoryCache() if cache is None else cache
    found = compute_slice(covering, cache, progress, carry=False)
    if found.state(wanted, shear) is None:
        found = compute_slice(covering, cache, progress)
    if found.state(wanted, shear) is None:
        there = ", ".join(dict.fromkeys(s.name for s in found.states if s.shear[0] <= shear <= s.shear[1]))
        ranges = "; ".join(f"{s.shear[0]:.4f} to {s.shear[1]:.4f}" for s in found.states if s.name == wanted)
        raise ValueError(
            f"state: expected one that is stable at angle {settings.angle_deg:g} and shear {shear:g} ({there}), "
            f"got '{name}'" + (f", which is stable for shear {ranges}" if ranges else "")
        )
    solution = _of_slice(found, wanted, shear)
    if solution is None:
        raise ValueError(f"shear: expected a value at which the state can be solved for, got {shear:g}")
    return solution


def _of_slice(found: Slice, wanted: str, shear: float) -> Solution | None:
    state = found.state(wanted, shear)
    return None if state is None else solve_state(state, shear, found.settings)


def _member(solution: Solution, sign: str) -> Solution:
    """The member of a pair that a sign names."""
    return reverse(solution) if sign and pair_member(solution) != sign else solution


def _covering(settings: SliceSettings, shear: float) -> SliceSettings:
    """Settings whose shear range holds a shear with some room."""
    if shear < settings.shear_min:
        return replace(settings, shear_min=shear)
    return replace(settings, shear_max=max(settings.shear_max, shear))
