"""Reach one named state at one setting."""

from __future__ import annotations

from dataclasses import replace

from rodatlas.atlas.slices.cache import BranchCache, MemoryCache
from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.follow import Progress
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.rods.symmetry import pair_member, reverse
from rodatlas.states.names import NAMES


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
            if name.endswith("+-"):
                return name, "-" if sign == "-" else "+"
            return name, ""
    known = ", ".join(n.replace("+-", "+, ") + n[:-2] + "-" if n.endswith("+-") else n for n in NAMES)
    raise ValueError(f"state: expected one of {known}, got '{text}'")


def reach(
    settings: SliceSettings, name: str, shear: float, cache: BranchCache | None = None, progress: Progress | None = None
) -> tuple[Solution, Slice]:
    """The stable state of a name at a shear, and the slice in which it was found.

    Raises
    ------
    ValueError
        when no stable state of that name exists there; the message says which ones do.
    """
    wanted, sign = split_name(name)
    covering = _covering(settings, shear)
    cache = MemoryCache() if cache is None else cache
    found = compute_slice(covering, cache, progress, carry=False)
    state = found.state(wanted, shear)
    if state is None:
        found = compute_slice(covering, cache, progress)
        state = found.state(wanted, shear)
    if state is None:
        there = ", ".join(dict.fromkeys(s.name for s in found.states if s.shear[0] <= shear <= s.shear[1]))
        ranges = "; ".join(f"{s.shear[0]:.4f} to {s.shear[1]:.4f}" for s in found.states if s.name == wanted)
        raise ValueError(
            f"state: expected one that is stable at angle {settings.angle_deg:g} and shear {shear:g} ({there}), "
            f"got '{name}'" + (f", which is stable for shear {ranges}" if ranges else "")
        )
    solution = solve_state(state, shear, settings)
    if solution is None:
        raise ValueError(f"shear: expected a value at which the state can be solved for, got {shear:g}")
    return (reverse(solution) if sign and pair_member(solution) != sign else solution), found


def _covering(settings: SliceSettings, shear: float) -> SliceSettings:
    """Settings whose shear range holds a shear with some room."""
    if shear < settings.shear_min:
        return replace(settings, shear_min=shear)
    return replace(settings, shear_max=max(settings.shear_max, shear))
