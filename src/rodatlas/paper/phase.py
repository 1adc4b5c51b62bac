"""Loci of bifurcations 0 to 18 in the plane of clamp angle and shear: figure 18 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.model import band_phase
from rodatlas.plot.planes.phase import CloseUp

if TYPE_CHECKING:
    from rodatlas.atlas import Loci, PhaseSettings, PlaneEvent
    from rodatlas.paper.sources import Sources

# kind of a special point, loci that meet there -> key in the table of known numbers
KNOWN_EVENTS: dict[tuple[str, tuple[str, ...]], str] = {
    ("cusp", ("6", "7")): "w-born",
    ("extremum", ("13", "18")): "w-meets-U",
    ("extremum", ("6'", "14")): "uUui-meets-w",
    ("extremum", ("11", "15")): "uUu-gone",
    ("extremum", ("3", "3'")): "W-gone",
}


# drawn of a plane of angle and shear that covers them
CLOSE_UPS = (
    CloseUp((0.0, 0.7, 0.5465, 0.5505), "birth of w", "lower"),
    CloseUp((26.0, 28.4, 0.305, 0.385), "w meets U", "upper"),
    CloseUp((30.56, 30.72, 0.6335, 0.6405), "U–w meets uUui", "upper"),
    CloseUp((71.6, 74.2, 0.355, 0.465), "between 12 and 17", "upper"),
)


PANELS = ("U", "w", "uUui", "uUu", "US+-", "WS+-", "W", "S+-", "TU+-", "TW+-")
"""States in the order of their panels."""


def close_ups_of(settings: PhaseSettings) -> tuple[CloseUp, ...]:
    """What is too small to be seen in the whole plane, of the plane of the paper."""
    same = settings.tables.known and settings.setting == band_phase().setting
    return CLOSE_UPS if same else ()


def draw(sources: Sources) -> Drawn:
    """All loci with their special points, shaded by the number of stable states, and close-ups."""
    from rodatlas.plot import draw_phase_figure

    diagram, loci = sources.phase(), sources.loci()
    caption = (
        "Loci of bifurcations 0 to 18 in the plane of clamp angle and shear, the special points on them, and the "
        "number of stable states in each region. Close-ups show what is too small to be seen. The diagram is "
        "symmetric in shear."
    )
    return Drawn(draw_phase_figure(diagram, CLOSE_UPS), caption, numbers_of(loci), (*loci.warnings, *diagram.warnings))


def numbers_of(loci: Loci) -> tuple[Number, ...]:
    """Angle of each special point at which the slices change, in order of angle."""
    return tuple(number_of(e) for e in loci.events() if e.parameter != "shear")


def number_of(event: PlaneEvent) -> Number:
    """Angle of a special point of the loci, with what happens there."""
    what = f"{event.description} (shear {abs(event.value):.5f})"
    return Number(what, event.second, "deg", KNOWN_EVENTS.get((event.kind, event.labels), ""))


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
