"""Loci of bifurcations 0 to 18 in the plane of clamp angle and shear: figure 18 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.loci_events import meeting

if TYPE_CHECKING:
    from rodatlas.atlas import Loci
    from rodatlas.paper.sources import Sources

# what happens, kind of the special point, numbers of the loci that meet there, key in the table of known numbers
EVENTS: tuple[tuple[str, str, tuple[int, ...], str], ...] = (
    ("w is born: folds 6 and 7 meet in a cusp", "cusp", (6, 7), "w-born"),
    ("pitchfork 4 turns subcritical, fold 12 is born", "criticality", (4, 12), ""),
    ("fold 7 passes branch point 9", "coalescence", (7, 9), ""),
    ("the branch of w touches that of U: folds 13 and 18 are born", "extremum", (13, 18), "w-meets-U"),
    ("folds 7 and 18 meet in a cusp", "cusp", (7, 18), ""),
    ("pitchforks 4 and 9 vanish together", "extremum", (4, 9), ""),
    ("U-w meets uUui: folds 6 and 14", "extremum", (6, 14), "uUui-meets-w"),
    ("pitchfork 3 turns subcritical: WS is gone", "criticality", (3, 5), ""),
    ("fold 14 passes pitchfork 10", "coalescence", (10, 14), ""),
    ("pitchforks 8 and 10 vanish together", "extremum", (8, 10), ""),
    ("pitchforks 11 and 15 vanish together: uUu is gone", "extremum", (11, 15), "uUu-gone"),
    ("W is gone: pitchfork 3 reaches shear 0", "extremum", (3,), "W-gone"),
)


def draw(sources: Sources) -> Drawn:
    """All loci with their special points."""
    from rodatlas.plot import draw_loci_figure

    loci = sources.loci()
    caption = (
        "Loci of bifurcations 0 to 18 in the plane of clamp angle and shear, and the special points on them. The "
        "diagram is symmetric in shear."
    )
    return Drawn(draw_loci_figure(loci), caption, numbers_of(loci), tuple(loci.warnings))


def numbers_of(loci: Loci) -> tuple[Number, ...]:
    """Angle of each event."""
    numbers = []
    for what, kind, meet, key in EVENTS:
        event = meeting(loci, kind, *meet)
        if event is not None:
            numbers.append(Number(f"{what}, at shear {event.shear:.5f}", event.angle_deg, "deg", key))
    return tuple(numbers)
