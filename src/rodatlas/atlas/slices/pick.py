"""Take one named state out of a slice."""

from __future__ import annotations

from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.reach import split_name
from rodatlas.atlas.slices.result import Slice
from rodatlas.continuation import Solution
from rodatlas.rods.symmetry import pair_member, reverse


def pick_state(slice_: Slice, name: str, shear: float) -> Solution:
    """The stable state of a name, solved exactly at a shear.

    Parameters
    ----------
    name : 'U', or a member of a pair, 'US+' or 'US-'.

    Raises
    ------
    ValueError
        when the slice has no such stable state there; the message says which it has, or over which shears.
    """
    wanted, sign = split_name(name)
    state = slice_.state(wanted, shear)
    angle = slice_.settings.angle_deg
    if state is None:
        ranges = [s.shear for s in slice_.states if s.name == wanted]
        if ranges:
            spans = " or ".join(f"from {low:.5f} to {high:.5f}" for low, high in ranges)
            what = f"one at which {wanted} is stable at {angle:g} deg, {spans}"
            raise ValueError(f"shear: expected {what}, got {shear:g}")
        there = ", ".join(dict.fromkeys(s.name for s in slice_.states)) or "none"
        raise ValueError(f"state: expected one that is stable in the slice at {angle:g} deg ({there}), got '{name}'")
    solution = solve_state(state, shear, slice_.settings)
    if solution is None:
        raise ValueError(f"shear: expected a value at which {name} can be solved for, got {shear:g}")
    return reverse(solution) if sign and pair_member(solution) != sign else solution
