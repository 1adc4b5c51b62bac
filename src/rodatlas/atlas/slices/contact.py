"""Where along a named state the band touches itself, as ranges of shear."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.result import State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.rods.band import NARROW
from rodatlas.rods.contact import may_touch, self_contact
from rodatlas.rods.kinematics import ribbon

SPACING = 0.5  # of the width: how far apart in shear states are looked at; strands pass each other within a width
SLACK = 0.5  # of the width, added to it where a state is only interpolated
ACCURACY = 5e-5  # of the ends, in shear
COARSE = np.linspace(0.0, 1.0, 81)  # cross-sections of interpolated ribbons

Range = tuple[float, float]


def with_contact(states: Iterable[State], settings: SliceSettings) -> list[State]:
    """The states with the ranges of shear in which their bands touch themselves."""
    return [replace(state, contact=contact_ranges(state, settings)) for state in states]


def contact_ranges(state: State, settings: SliceSettings, width: float = NARROW) -> tuple[Range, ...]:
    """Ranges of shear in which the band of a state meets itself.

    The computed solutions are tested, and between them, half a width apart in shear, states at which the interpolated
    ribbon comes close to itself. The ends of the ranges are found by bisection, each time on a state solved for.

    Parameters
    ----------
    width : w, in units of the length.

    Returns
    -------
    (low, high) in order; the first may start and the last may end with the state itself.

    Raises
    ------
    ValueError
        when the width is not a positive number.
    """
    known = {s["dD"]: s for s in state.solutions}
    told = {shear: self_contact(s, width) is not None for shear, s in known.items()}

    def touches(shear: float) -> bool | None:
        """None where no state can be solved for; one solved for is where the next starts from."""
        if shear not in known:
            solution = solve_state(replace(state, solutions=tuple(known.values())), shear, settings)
            if solution is None:
                return None
            known[shear] = solution
            told[shear] = self_contact(solution, width) is not None
        return told[shear]

    for one, two in pairwise(state.solutions):
        if not (told[one["dD"]] and told[two["dD"]]):
            for shear in _close_calls(one, two, width):
                touches(shear)
    return _ranges(told, touches)


def _ranges(told: dict[float, bool], touches: Callable[[float], bool | None]) -> tuple[Range, ...]:
    """Ranges between the changes among known answers, each located by bisection as far as there are more answers."""
    ranges: list[Range] = []
    edge = -math.inf  # where the last change was
    places = sorted(told)
    for low, high in pairwise(places):
        if told[low] == told[high]:
            continue
        inside, outside = (low, high) if told[low] else (high, low)
        while abs(inside - outside) > ACCURACY and (here := touches(middle := 0.5 * (inside + outside))) is not None:
            inside, outside = (middle, outside) if here else (inside, middle)
        if told[low]:
            ranges.append((max(edge, places[0]), inside))
        edge = inside
    if told[places[-1]]:
        ranges.append((max(edge, places[0]), places[-1]))
    return tuple(ranges)


def _close_calls(one: Solution, two: Solution, width: float) -> list[float]:
    """Shears between two neighboring solutions at which the ribbon between them comes close to itself."""
    low, high = one["dD"], two["dD"]
    count = math.ceil((high - low) / (SPACING * width))
    if count < 2:
        return []
    (center, frame), (next_center, next_frame) = (ribbon(s, COARSE) for s in (one, two))
    parts = np.arange(1, count) / count
    return [
        low + part * (high - low) for part in parts.tolist()
        if may_touch(center + part * (next_center - center), frame + part * (next_frame - frame), (1 + SLACK) * width)
    ]  # fmt: skip


def ranges_text(ranges: Iterable[Range]) -> str:
    """Ranges in words: '-0.01200 to 0.01200, 0.30000 to 0.40000'."""
    return ", ".join(f"{low:.5f} to {high:.5f}" for low, high in ranges)


def contact_warnings(states: Iterable[State]) -> list[str]:
    """A sentence for each state whose band touches itself somewhere."""
    return [
        f"{s.name}: a band {width_text(NARROW)} wide passes through itself at shear {ranges_text(s.contact)}; "
        "forces of contact are not modeled"
        for s in states if s.contact
    ]  # fmt: skip


def width_text(width: float) -> str:
    """A width as a part of the length: 'L/80', '0.03 L'."""
    whole = round(1.0 / width)
    return f"L/{whole}" if math.isclose(whole * width, 1.0, rel_tol=1e-9) else f"{width:g} L"
