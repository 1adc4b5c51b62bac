"""Curves of bifurcations cut where the angle turns, and the pieces numbered as in the paper.

At one angle each piece is one bifurcation of the slice there. A piece has the number of that bifurcation in a slice,
or follows from its neighbors along the curve, as in the table below.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.result import Piece, PieceEvent, at_angle, point_of
from rodatlas.continuation import Locus, LocusEvent, Solution

# (number, kinds of the turns passed from there on) -> number
SUCCESSORS = {
    (4, ("extremum",)): 9,  # the two pitchforks of U vanish together
    (11, ("extremum",)): 15,  # those that bound uUu, too
    (6, ("cusp",)): 7,  # the folds that bound w
    (7, ("cusp",)): 18,  # 7 vanishes with one of the two folds born when w touches U
    (7, ("cusp", "extremum")): 13,  # the other one
    (6, ("cusp", "extremum")): 14,  # born when U-w meets uUui
}
ENDS = {3: 5, 4: 12}  # number of a pitchfork -> that of the fold born where it turns subcritical

SHORT = 1.0  # degrees: at the end of a shorter piece happens what concerns its neighbor, too
SAME = 1e-4  # largest difference in angle (degrees), shear and height of one special point on two curves


@dataclass(frozen=True)
class Stretch:
    """Part of a curve between two turns of the angle: solutions in order of the curve and the turns at its ends."""

    curve: int
    kind: str
    solutions: tuple[Solution, ...]
    ends: tuple[LocusEvent | None, LocusEvent | None]
    events: tuple[LocusEvent, ...]
    number: int | None = None

    @property
    def span(self) -> float:
        """Range of angle in degrees."""
        return float(np.degrees(np.ptp([s["psi0"] for s in self.solutions])))

    def at(self, angle: float) -> np.ndarray | None:
        """Shear and height at an angle inside (radians)."""
        return at_angle(self.solutions, angle)


def stretches(curve: Locus, ident: int) -> list[Stretch]:
    """A curve cut at cusps and where the angle is extreme."""
    turns = [e for e in curve.events if e.kind == "cusp" or (e.kind == "extremum" and e.parameter == "psi0")]
    bounds = [None, *turns, None]
    found = []
    for low, high in pairwise(bounds):
        a = -np.inf if low is None else low.arclength
        b = np.inf if high is None else high.arclength
        solutions = [p.solution for p in curve.points if a < p.arclength < b]
        solutions = [*[e.solution for e in (low,) if e], *solutions, *[e.solution for e in (high,) if e]]
        inside = tuple(e for e in curve.events if a < e.arclength < b)
        found.append(Stretch(ident, curve.kind, tuple(solutions), (low, high), inside))
    return found


def lies_on(stretch: Stretch, kind: str, solution: Solution, tolerance: float = 1e-3) -> bool:
    """Whether a bifurcation of a slice is the one that a stretch has at its angle."""
    here = stretch.at(solution["psi0"]) if stretch.kind == kind else None
    return here is not None and bool(np.abs(here - [solution["dD"], solution["height"]]).max() < tolerance)


def numbered(parts: Sequence[Stretch], elsewhere: Collection[int] = ()) -> list[Stretch]:
    """Give numbers to the neighbors of numbered stretches, by the turns between them.

    Parameters
    ----------
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
                number = SUCCESSORS.get((part.number or 0, kinds))
                if out[at].number is None and number is not None and number not in given:
                    out[at] = replace(out[at], number=number)
                    given.add(number)
                elif out[at].number is not None:
                    break
    return out


def pieces(parts: Sequence[Stretch], curves: Sequence[Locus]) -> list[Piece]:
    """The stretches as pieces, with what meets at their special points."""
    owners = [(e, p.number) for p in parts if p.number is not None for e in (*p.ends, *p.events) if e is not None]
    found = []
    for i, part in enumerate(parts):
        curve = curves[part.curve]
        kind = "pitchfork" if curve.pitchfork else curve.kind
        events = []
        for e in events_of(parts, i):
            others = {n for other, n in owners if same_place(e, other)} | _across(parts, i, e)
            events.append(PieceEvent(e, tuple(sorted(n for n in others if n is not None and n != part.number))))
        rising = part.solutions[-1]["psi0"] >= part.solutions[0]["psi0"]
        solutions = part.solutions if rising else part.solutions[::-1]
        own = tuple(e for e in (part.ends[0], *part.events, part.ends[1]) if e is not None)
        found.append(Piece(part.number, kind, tuple(solutions), tuple(events), part.curve, own))
    return found


def same_place(one: LocusEvent, two: LocusEvent) -> bool:
    """Whether special points of two curves are one."""
    return max(abs(a - b) for a, b in zip(point_of(one), point_of(two), strict=True)) < SAME


def events_of(parts: Sequence[Stretch], i: int) -> list[LocusEvent]:
    """Special points of a stretch: at its ends, on it, and on to the far ends of short or unnumbered ones beside it."""
    part = parts[i]
    found = [e for e in (part.ends[0], *part.events, part.ends[1]) if e is not None]
    for step, side in ((-1, 0), (1, 1)) if part.number is not None else ():
        at = i + step
        bounded = part.ends[side] is not None and 0 <= at < len(parts) and parts[at].curve == part.curve
        if bounded and (parts[at].number is None or parts[at].span < SHORT):
            end = parts[at].ends[side]
            found += [*parts[at].events, *([end] if end else [])]
    return found


def _across(parts: Sequence[Stretch], i: int, event: LocusEvent) -> set[int]:
    """Numbers of the stretches of the same curve that end at a special point."""
    return {
        number for p in parts
        if p.curve == parts[i].curve and any(e is event for e in p.ends) and (number := p.number) is not None
    }  # fmt: skip
