"""Loci of bifurcations 0 to 18 in the plane of clamp angle and shear: figure 18 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number

if TYPE_CHECKING:
    from rodatlas.atlas import Loci, PlaneEvent
    from rodatlas.paper.sources import Sources

# kind of a special point, loci that meet there -> key in the table of known numbers
KNOWN_EVENTS: dict[tuple[str, tuple[str, ...]], str] = {
    ("cusp", ("6", "7")): "w-born",
    ("extremum", ("13", "18")): "w-meets-U",
    ("extremum", ("6'", "14")): "uUui-meets-w",
    ("extremum", ("11", "15")): "uUu-gone",
    ("extremum", ("3", "3'")): "W-gone",
}


def draw(sources: Sources) -> Drawn:
    """All loci with their special points, shaded by the number of stable states, and close-ups."""
    from rodatlas.plot import draw_phase_figure

    diagram, loci = sources.phase(), sources.loci()
    caption = (
        "Loci of bifurcations 0 to 18 in the plane of clamp angle and shear, the special points on them, and the "
        "number of stable states in each region. Close-ups show what is too small to be seen. The diagram is "
        "symmetric in shear."
    )
    return Drawn(draw_phase_figure(diagram), caption, numbers_of(loci), (*loci.warnings, *diagram.warnings))


def numbers_of(loci: Loci) -> tuple[Number, ...]:
    """Angle of each special point at which the slices change, in order of angle."""
    return tuple(number_of(e) for e in loci.events() if e.parameter != "shear")


def number_of(event: PlaneEvent) -> Number:
    """Angle of a special point of the loci, with what happens there."""
    what = f"{event.description} (shear {abs(event.shear):.5f})"
    return Number(what, event.angle_deg, "deg", KNOWN_EVENTS.get((event.kind, event.labels), ""))


def meeting(loci: Loci, kind: str, *labels: str) -> PlaneEvent:
    """The special point of a kind at which certain loci meet.

    Raises
    ------
    ValueError
        when the loci have none.
    """
    for event in loci.events():
        if event.kind == kind and set(labels) <= set(event.labels) and event.parameter != "shear":
            return event
    raise ValueError(f"loci: expected a point of kind '{kind}' where {' and '.join(labels)} meet, got {loci!r}")
