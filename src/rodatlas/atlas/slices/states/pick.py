"""Take one named state out of a slice."""

from __future__ import annotations

from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.states.coexisting import numbered_state
from rodatlas.continuation import Solution
from rodatlas.model import Model
from rodatlas.states.labels import parse_label


def pick_state(slice_: Slice, name: str, value: float) -> Solution:
    """The stable state of a name, solved exactly at a value of what varies.

    Parameters
    ----------
    name : 'U', or a member of a pair, 'US+' or 'US-'; 'W:2' where several are called W.

    Raises
    ------
    ValueError
        when the slice has no such stable state there, or several; the message says which it has, or over which shears.
    """
    settings = slice_.settings
    wanted = parse_label(name, slice_.known_names)
    found = numbered_state(slice_, wanted, value)
    if found is None:
        ranges = [s.span for s in slice_.states if s.name == wanted.name]
        if ranges:
            spans = " or ".join(f"from {low:.5f} to {high:.5f}" for low, high in ranges)
            what = f"one at which {wanted.name} is stable at {settings.place_text}, {spans}"
            raise ValueError(f"{settings.along}: expected {what}, got {value:g}")
        there = ", ".join(dict.fromkeys(s.name for s in slice_.states)) or "none"
        raise ValueError(
            f"state: expected one that is stable in the slice at {settings.place_text} ({there}), got '{name}'"
        )
    if not found.exact:
        raise ValueError(f"{settings.along}: expected a value at which {name} can be solved for, got {value:g}")
    return member(settings.model, found.solution, wanted.sign)


def member(model: Model, solution: Solution, sign: str) -> Solution:
    """The member of a pair that a sign names; the solution itself without a sign."""
    return model.member(solution, sign) if sign else solution
