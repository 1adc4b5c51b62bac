"""Slices before, between and after the events of a transition: figures 9 and 14 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.paper.drawn import Drawn
from rodatlas.paper.phase import meeting, number_of

if TYPE_CHECKING:
    from rodatlas.atlas import Event, Loci, Slice
    from rodatlas.paper.sources import Sources

Meeting = tuple[str, tuple[str, ...]]
"""Kind of a special point of loci, and the loci that meet there."""

MARGIN = 0.3  # of the extent of the events, around the window
SAME = 1e-3  # a locus passes through a bifurcation that is this near: where loci meet, splines lose some accuracy
ONE = 1e-6  # events this near are one, listed by several branches


def draw(sources: Sources, meetings: Sequence[Meeting], numbers: Sequence[int], beyond: float = 1.0) -> Drawn:
    """Windows of slices at angles around some special points of the loci.

    Parameters
    ----------
    meetings : the special points, in order of angle.
    numbers : bifurcations that are to be seen.
    beyond : how far outside the special points the first and last angles are, in mean distances between them.
    """
    from rodatlas.atlas.slices.close_up import close_up
    from rodatlas.plot.slices.close_ups import Panel, draw_close_ups

    loci = sources.loci()
    events = [meeting(loci, kind, *labels) for kind, labels in meetings]
    angles = angles_around([e.second for e in events], beyond)
    shears, heights = window_of(loci, numbers, angles)
    closer = [numbered(close_up(s, (shears, heights)), loci) for s in sources.slices_at(angles)]
    panels = [Panel(s, shears, heights) for s in closer]
    caption = (
        f"The slice around shear {np.mean(shears):.3f} and height {np.mean(heights):.3f} at "
        f"{', '.join(f'{a:g}' for a in angles)} degrees: before, between and after what is listed."
    )
    warnings = [f"{s.settings.setting['angle']:g} deg: {w}" for s in closer for w in s.warnings]
    return Drawn(draw_close_ups(panels, "angle"), caption, tuple(number_of(e) for e in events), tuple(warnings))


def numbered(slice_: Slice, loci: Loci) -> Slice:
    """A slice whose bifurcations have the numbers of the loci that pass through them.

    A slice tells numbers by the states that end; loci keep them where no state ends any more.
    """
    angle = slice_.settings.setting["angle"]
    events = [e for b in slice_.branches for e in b.events]
    taken = {e.number for e in events}
    given: list[tuple[tuple[float, float], int]] = []
    for piece in loci.pieces:
        low, high = piece.span
        if piece.number is None or piece.number in taken or not low <= angle <= high:
            continue
        place = piece.at(angle)
        alike = [e for e in events if e.number is None and (e.kind == "fold") == (piece.kind == "fold")]
        nearest = min(alike, key=lambda e: _distance(e, place), default=None)
        if nearest is not None and _distance(nearest, place) < SAME:
            given.append(((nearest.value, nearest.response), piece.number))

    def named(event: Event) -> Event:
        found = [number for place, number in given if _distance(event, place) < ONE]
        return replace(event, number=found[0]) if found and event.number is None else event

    branches = [replace(b, events=tuple(named(e) for e in b.events)) for b in slice_.branches]
    return replace(slice_, branches=tuple(branches))


def _distance(event: Event, place: tuple[float, float]) -> float:
    return max(abs(event.value - place[0]), abs(event.response - place[1]))


def angles_around(events: Sequence[float], beyond: float = 1.0) -> list[float]:
    """An angle before the first event, one between each two, and one after the last, in degrees.

    Parameters
    ----------
    events : angles, increasing. beyond : distance of the first and the last, in mean distances between events.
    """
    if len(events) < 2 or any(b <= a for a, b in pairwise(events)):
        raise ValueError(f"events: expected at least two angles, increasing, got {list(events)}")
    outside = beyond * (events[-1] - events[0]) / (len(events) - 1)
    inner = [0.5 * (a + b) for a, b in pairwise(events)]
    return [round(a, 4) for a in (events[0] - outside, *inner, events[-1] + outside)]


def window_of(
    loci: Loci, numbers: Sequence[int], angles: Sequence[float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges of shear and height that hold the bifurcations of some numbers at some angles, with a margin."""
    places = []
    for piece in (p for p in loci.pieces if p.number in numbers):
        low, high = piece.span
        places += [piece.at(a) for a in angles if low <= a <= high]
    least, largest = np.min(places, axis=0), np.max(places, axis=0)
    margin = MARGIN * (largest - least)
    (x0, y0), (x1, y1) = least - margin, largest + margin
    return (float(x0), float(x1)), (float(y0), float(y1))
