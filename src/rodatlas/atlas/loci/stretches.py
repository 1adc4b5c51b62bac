"""Curves of bifurcations cut where the second control turns, and the pieces numbered by a nomenclature.

At one value of the second control each piece is one bifurcation of the slice there. A piece has the number of that
bifurcation in a slice, or follows from its neighbors along the curve.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.result import Piece, PieceEvent, at_second
from rodatlas.atlas.loci.settings import PlaneSettings
from rodatlas.continuation import Locus, LocusEvent, Solution
from rodatlas.continuation.discrete.collocation import Scale

SHORT = 1.0  # unit of the second control: at the end of a shorter piece happens what concerns its neighbor, too
SAME = 1e-4  # units by which the places of one special point on two curves differ at most
ON_CHORD = 0.1  # of a chord: how far the curve may lie from it
ON_CURVE = 1e-3  # units by which a bifurcation of a slice differs from its locus at most


@dataclass(frozen=True, eq=False)
class Stretch:
    """Part of a curve between two turns of the second control: solutions in order, and the turns at its ends.

    Attributes
    ----------
    places : (n, 3) and lengths : (n,), as of a :class:`rodatlas.atlas.loci.result.Piece`.
    """

    curve: int
    kind: str
    solutions: tuple[Solution, ...]
    places: np.ndarray
    lengths: np.ndarray
    ends: tuple[LocusEvent | None, LocusEvent | None]
    events: tuple[LocusEvent, ...]
    number: int | None = None

    @property
    def span(self) -> float:
        """Range of the second control."""
        return float(np.ptp(self.places[:, 0]))

    def at(self, second: float) -> np.ndarray | None:
        """Value along slices and response at a value of the second control inside."""
        return at_second(self.places, self.lengths, second)


def stretches(curve: Locus, ident: int, settings: PlaneSettings) -> list[Stretch]:
    """A curve cut at cusps and where the second control is extreme."""
    second = settings.second_control.parameter
    turns = [e for e in curve.events if e.kind == "cusp" or (e.kind == "extremum" and e.parameter == second)]
    bounds = [None, *turns, None]
    found = []
    for low, high in pairwise(bounds):
        a = -np.inf if low is None else low.arclength
        b = np.inf if high is None else high.arclength
        solutions = [p.solution for p in curve.points if a < p.arclength < b]
        solutions = [*[e.solution for e in (low,) if e], *solutions, *[e.solution for e in (high,) if e]]
        inside = tuple(e for e in curve.events if a < e.arclength < b)
        places = np.array([settings.point(s) for s in solutions])
        found.append(
            Stretch(ident, curve.kind, tuple(solutions), places, settings.lengths(places), (low, high), inside)
        )
    return found


def lies_on(stretch: Stretch, kind: str, solution: Solution, settings: PlaneSettings) -> bool:
    """Whether a bifurcation of a slice is the one that a stretch has at its value of the second control."""
    if stretch.kind != kind:
        return False
    place = settings.point(solution)
    here = stretch.at(place[0])
    if here is not None and settings.near((place[0], *here), place, ON_CURVE):
        return True
    return any(on_chord(one, two, solution, settings) for one, two in pairwise(stretch.solutions))


def on_chord(one: Solution, two: Solution, solution: Solution, settings: PlaneSettings) -> bool:
    """Whether a bifurcation lies between two computed ones of a curve: where these are far apart a spline is no
    measure, but a whole solution next to their chord is one of the curve."""
    a, b, here = (settings.second_value(s) for s in (one, two, solution))
    if not min(a, b) <= here <= max(a, b) or a == b:
        return False
    part = (here - a) / (b - a)
    s = np.linspace(0.0, 1.0, 101)
    scale = Scale.of(settings.model.problem, solution).unknowns
    first, last, value = (x(s) / scale for x in (one, two, solution))
    chord = np.linalg.norm(last - first)
    return bool(np.linalg.norm((1.0 - part) * first + part * last - value) < ON_CHORD * chord)


def numbered(
    parts: Sequence[Stretch], successors: Mapping[tuple[int, tuple[str, ...]], int], elsewhere: Collection[int] = ()
) -> list[Stretch]:
    """Give numbers to the neighbors of numbered stretches, by the turns between them.

    Parameters
    ----------
    successors : (number, kinds of the turns passed from there on) -> number.
    elsewhere : numbers of bifurcations that lie on other curves.
    """
    out = list(parts)
    given = {p.number for p in parts if p.number is not None} | set(elsewhere)
    for i, part in enumerate(parts):
        for step in (1, -1) if part.number is not None else ():
            kinds: tuple[str, ...] = ()
            at = i
            while True:
                turn = out[at].ends[1 if step > 0 else 0]
                at += step
                if turn is None or not 0 <= at < len(out) or out[at].curve != part.curve:
                    break
                kinds += (turn.kind,)
                number = successors.get((part.number or 0, kinds))
                if out[at].number is None and number is not None and number not in given:
                    out[at] = replace(out[at], number=number)
                    given.add(number)
                elif out[at].number is not None:
                    break
    return out


def pieces(parts: Sequence[Stretch], curves: Sequence[Locus], settings: PlaneSettings) -> list[Piece]:
    """The stretches as pieces, with what meets at their special points."""
    owners = [(e, p.number) for p in parts if p.number is not None for e in (*p.ends, *p.events) if e is not None]
    found = []
    for i, part in enumerate(parts):
        curve = curves[part.curve]
        kind = "pitchfork" if curve.pitchfork else curve.kind
        events = []
        for e in events_of(parts, i, settings):
            others = {n for other, n in owners if same_place(e, other, settings)} | _across(parts, i, e)
            meeting = tuple(sorted(n for n in others if n is not None and n != part.number))
            events.append(PieceEvent(e, *settings.point(e), meeting))
        step = 1 if part.places[-1, 0] >= part.places[0, 0] else -1
        places = part.places[::step]
        own = tuple(e for e in (part.ends[0], *part.events, part.ends[1]) if e is not None)
        found.append(Piece(part.number, kind, part.solutions[::step], places, settings.lengths(places), tuple(events),
                           part.curve, own))  # fmt: skip
    return found


def same_place(one: LocusEvent, two: LocusEvent, settings: PlaneSettings) -> bool:
    """Whether special points of two curves are one."""
    return settings.near(settings.point(one), settings.point(two), SAME)


def events_of(parts: Sequence[Stretch], i: int, settings: PlaneSettings) -> list[LocusEvent]:
    """Special points of a stretch: at its ends, on it, and on to the far ends of short or unnumbered ones beside it."""
    part = parts[i]
    found = [e for e in (part.ends[0], *part.events, part.ends[1]) if e is not None]
    for step, side in ((-1, 0), (1, 1)) if part.number is not None else ():
        at = i + step
        bounded = part.ends[side] is not None and 0 <= at < len(parts) and parts[at].curve == part.curve
        if bounded and (parts[at].number is None or parts[at].span < SHORT * settings.units[0]):
            end = parts[at].ends[side]
            found += [*parts[at].events, *([end] if end else [])]
    return found


def _across(parts: Sequence[Stretch], i: int, event: LocusEvent) -> set[int]:
    """Numbers of the stretches of the same curve that end at a special point."""
    return {
        number for p in parts
        if p.curve == parts[i].curve and any(e is event for e in p.ends) and (number := p.number) is not None
    }  # fmt: skip
