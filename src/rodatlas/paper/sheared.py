"""The branch of U at 45 degrees as the shear grows: the rod's part of figure 27 of the paper."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.model import band

if TYPE_CHECKING:
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources

ANGLE_DEG = 45.0
SHEARS = (0.2, 0.4, 0.56, 0.6)
BRACKET = (0.4, 0.56)  # of the shear at which the middle becomes straight


def draw(sources: Sources) -> Drawn:
    """Renderings, curvature and twist at four shears."""
    from rodatlas.plot.shapes.sequence import draw_sequence

    states = [state_at_shear(shear) for shear in SHEARS]
    where = inflection_shear()
    caption = (
        f"The band at {ANGLE_DEG:g} degrees as the shear grows: curvature and twist of the rod. At shear {where:.5f} "
        "the middle is straight; beyond, it is bent the other way, with two more inflections."
    )
    return Drawn(draw_sequence(states, band().control("shear")), caption, numbers_of(where), _REMARKS)


_REMARKS = (
    "The curves of Wunderlich strips of widths 1/80 and 1/8 are not drawn: they need the model of inextensible strips.",
)


@lru_cache(maxsize=16)
def state_at_shear(shear: float) -> Solution:
    """The state on the branch of U."""
    from rodatlas.rods import Ends, state_at

    return state_at(Ends(ANGLE_DEG, shear=shear))


@lru_cache(maxsize=1)
def inflection_shear() -> float:
    """The shear at which k1(1/2) = 0."""
    from scipy.optimize import brentq

    from rodatlas.atlas.slices.branches.match import state_at as solved
    from rodatlas.paper.names.segments import middle_curvature
    from rodatlas.paper.sources import slice_settings

    near = state_at_shear(BRACKET[0])

    def middle(shear: float) -> float:
        nonlocal near
        found = solved(near, shear, slice_settings(ANGLE_DEG))
        near = state_at_shear(shear) if found is None else found
        return middle_curvature(near)

    return float(brentq(middle, *BRACKET, xtol=1e-10))


def numbers_of(where: float) -> tuple[Number, ...]:
    """Height, energy and clamp force at the first shear; curvature in the middle; the new inflections."""
    from rodatlas.paper.names.segments import middle_curvature
    from rodatlas.rods import RodState

    first = RodState(state_at_shear(SHEARS[0]))
    at = f"at shear {SHEARS[0]:g}"
    numbers = [
        Number("shear at which two inflections appear", where, "L", "inflections-at-45"),
        Number(f"height {at}", first.height, "L", "U-height-45"),
        Number(f"energy {at}", first.energy, "GJ/L", "U-energy-45"),
    ]
    numbers += [Number(f"M{k + 1}(0) {at}", float(first.moment_body[0, k]), "GJ/L", f"U-M{k + 1}-45") for k in range(3)]
    numbers += [Number(f"N{k + 1}(0) {at}", float(first.force_body[0, k]), "GJ/L²", f"U-N{k + 1}-45") for k in range(3)]
    numbers += [Number(f"k1(1/2) at shear {s:g}", middle_curvature(state_at_shear(s)), "1/L") for s in SHEARS]
    return tuple(numbers)
