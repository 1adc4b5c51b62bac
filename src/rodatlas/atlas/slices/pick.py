"""Take one named state out of a slice."""

from __future__ import annotations

from rodatlas.atlas.slices.coexisting import numbered_state
from rodatlas.atlas.slices.result import Slice
from rodatlas.continuation import Solution
from rodatlas.rods.symmetry import pair_member, reverse
from rodatlas.states.labels import parse_label


def pick_state(slice_: Slice, name: str, shear: float) -> Solution:
    """The stable state of a name, solved exactly at a shear.

    Parameters
    ----------
    name : 'U', or a member of a pair, 'US+' or 'US-'; 'W:2' where several are called W.

    Raises
    ------
    ValueError
        when the slice has no such stable state there, or several; the message says which it has, or over which shears.
    """
    wanted = parse_label(name)
    found = numbered_state(slice_, wanted, shear)
    angle = slice_.settings.angle_deg
    if found is None:
        ranges = [s.shear for s in slice_.states if s.name == wanted.name]
        if ranges:
            spans = " or ".join(f"from {low:.5f} to {high:.5f}" for low, high in ranges)
            what = f"one at which {wanted.name} is stable at {angle:g} deg, {spans}"
            raise ValueError(f"shear: expected {what}, got {shear:g}")
        there = ", ".join(dict.fromkeys(s.name for s in slice_.states)) or "none"
        raise ValueError(f"state: expected one that is stable in the slice at {angle:g} deg ({there}), got '{name}'")
    if not found.exact:
        raise ValueError(f"shear: expected a value at which {name} can be solved for, got {shear:g}")
    return member(found.solution, wanted.sign)


def member(solution: Solution, sign: str) -> Solution:
    """The member of a pair that a sign names; the solution itself without a sign."""
    return reverse(solution) if sign and pair_member(solution) != sign else solution
