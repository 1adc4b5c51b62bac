"""Tension, strains and energy density of the five stable states at 30 degrees, dD = 0.625: figure 11 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.names.yu_hanna import COLORS

if TYPE_CHECKING:
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources

ANGLE_DEG, SHEAR = 30.0, 0.625
NEAR_CLAMPS = 0.25  # of the length at each end


def draw(sources: Sources) -> Drawn:
    """Profiles of all stable states that coexist there."""
    from rodatlas.plot import draw_profiles

    states = stable_states(sources)
    caption = (
        f"The {len(states)} stable states at {ANGLE_DEG:g} degrees and shear {SHEAR:g}: tension, curvature, twist and "
        "twice the energy density along the band."
    )
    return Drawn(draw_profiles(states, COLORS), caption, numbers_of(states), remarks_on(states))


def stable_states(sources: Sources) -> dict[str, Solution]:
    """Name -> solution, both members of a pair."""
    from rodatlas.atlas import coexisting_states
    from rodatlas.rods import reverse

    states: dict[str, Solution] = {}
    for name, solution in coexisting_states(sources.slice_at(ANGLE_DEG), SHEAR).items():
        states[name] = solution
        if name.endswith("+"):
            states[f"{name[:-1]}-"] = reverse(solution)
    return states


def numbers_of(states: dict[str, Solution]) -> tuple[Number, ...]:
    """How many states there are; of each, energy, height, range of tension and share of energy near the clamps."""
    numbers = [Number("number of stable states", float(len(states)), "", "five-states")]
    for name, solution in states.items():
        if name.endswith("-"):
            continue
        low, high = tension_range(solution)
        known = name == "uUui"
        numbers += [
            Number(f"energy of {name}", solution["energy"], "GJ/L", "uUui-energy-30" if known else ""),
            Number(f"height of {name}", solution["height"], "L", "uUui-height-30" if known else ""),
            Number(f"least tension in {name}", low, "GJ/L²"),
            Number(f"largest tension in {name}", high, "GJ/L²"),
            Number(f"share of the energy of {name} in the outer quarters", share_near_clamps(solution)),
        ]
    return tuple(numbers)


def tension_range(solution: Solution) -> tuple[float, float]:
    """Least and largest N3 along the band [GJ/L^2]."""
    from rodatlas.rods import RodState

    tension = RodState(solution).at(np.linspace(0.0, 1.0, 2001)).tension
    return float(tension.min()), float(tension.max())


def share_near_clamps(solution: Solution) -> float:
    """Part of the energy that is stored in the first and the last quarter of the length."""
    from rodatlas.rods import RodState

    s = np.linspace(0.0, 1.0, 4001)
    density = RodState(solution).at(s).energy_density
    outer = (s <= NEAR_CLAMPS) | (s >= 1.0 - NEAR_CLAMPS)
    return float(density[outer].sum() / density.sum())


def _tense_in_the_middle(solution: Solution) -> bool:
    """Whether the band is compressed at both ends and in tension between them."""
    from rodatlas.rods import RodState

    left, middle, right = RodState(solution).at(np.array([0.0, 0.5, 1.0])).tension
    return bool(middle > 0 > max(left, right))


def remarks_on(states: dict[str, Solution]) -> tuple[str, ...]:
    """What the paper says of the states, as the numbers have it."""
    remarks = []
    shares = [share_near_clamps(s) for s in states.values()]
    if min(shares) > 2 * NEAR_CLAMPS:
        remarks.append(f"Every state stores more near the clamps: {min(shares):.0%} or more in the outer half.")
    tensile = [name for name, s in states.items() if tension_range(s)[0] > 0]
    remarks.append(f"In tension all along: {', '.join(tensile) or 'none'}.")
    middle = [name for name, s in states.items() if _tense_in_the_middle(s)]
    if middle:
        remarks.append(f"Compressed near the ends and in tension in the middle: {', '.join(middle)}.")
    return tuple(remarks)
