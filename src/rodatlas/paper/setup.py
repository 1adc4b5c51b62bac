"""Sketch of the set-up, with a U-like and an S-like band: figure 1 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn
from rodatlas.paper.names.yu_hanna import COLORS

if TYPE_CHECKING:
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources

ANGLE_DEG = 30.0
SHOWN = (("U", 0.3, 0.42), ("US+", 0.5, 0.45))  # state, shear, arclength of the directors


def draw(sources: Sources) -> Drawn:
    """Both bands with clamp angle, lengths and directors."""
    from rodatlas.plot.shapes.setup import draw_setup

    states = {name: (_state(sources, name, shear), at) for name, shear, at in SHOWN}
    caption = (
        f"The set-up: a band held in two clamps at angle ψ0 (here {ANGLE_DEG:g} degrees), compressed by ΔL and "
        "sheared by ΔD along the width direction z; directors d1 (width), d2 (normal), d3 (tangent). A U-like and an "
        "S-like state."
    )
    return Drawn(draw_setup(states, COLORS), caption)


def _state(sources: Sources, name: str, shear: float) -> Solution:
    from rodatlas.atlas import coexisting_states

    return coexisting_states(sources.slice_at(ANGLE_DEG), shear)[name]
