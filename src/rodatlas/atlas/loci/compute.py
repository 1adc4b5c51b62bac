"""Follow the bifurcations of slices in angle and shear."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from rodatlas.atlas.loci.cache import LocusCache
from rodatlas.atlas.loci.numbering import ENDS, Stretch, numbered, pieces, stretches
from rodatlas.atlas.loci.partners import next_partner, place_of, with_sources
from rodatlas.atlas.loci.result import KNOWN, Loci, LociSettings
from rodatlas.atlas.slices.result import Event, Slice
from rodatlas.atlas.slices.settings import REFERENCE_ANGLE_DEG
from rodatlas.continuation import (
    Locus,
    MeshControl,
    NotConverged,
    Status,
    StepControl,
    TraceOptions,
    fold_locus_at,
    follow_locus,
)
from rodatlas.continuation.checks import check_each, check_has, check_type
from rodatlas.progress import Progress, tells
from rodatlas.rods.perfectly_anisotropic import rod_problem

PLANE = ("dD", "psi0")
IMAGE = 6  # digits of shear to which a bifurcation agrees with its image in the shear mirror
ANGLES = {16: 55.0, 17: 60.0}  # degrees at which a slice has these bifurcations; the others come from that at 15


def check_numbers(numbers: Sequence[int]) -> None:
    """Raise ValueError for numbers whose loci cannot be found."""
    check_each("numbers", numbers, int, f"a sequence of whole numbers from {KNOWN[0]} to {KNOWN[-1]}")
    for number in numbers:
        if number not in KNOWN:
            raise ValueError(f"number: expected one of {KNOWN[0]} to {KNOWN[-1]}, got {number}")


@tells("loci")
def compute_loci(
    settings: LociSettings, slice_of: Callable[[float], Slice], numbers: Sequence[int] = (),
    progress: Progress | None = None, cache: LocusCache | None = None,
) -> Loci:  # fmt: skip
    """Follow the numbered bifurcations of the slice at 15 degrees, and what meets them, in angle and shear.

    Parameters
    ----------
    slice_of : gives the slice at an angle in degrees.
    numbers : loci that are wanted, all known ones when empty. Others are followed as far as wanted ones come from them,
        or as it takes to tell what meets at the special points of wanted ones; 16 and 17 need slices of their own.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    cache : asked for every locus before it is followed, and given it afterwards.
    """
    check_type("settings", settings, LociSettings, "LociSettings such as LociSettings()")
    check_has("slice_of", slice_of, ("__call__",), "a function that gives the slice at an angle in degrees")
    check_numbers(numbers)
    start = time.perf_counter()
    wanted = set(numbers or KNOWN)
    needed = with_sources(wanted)
    work = _Work(trace_options(settings), LocusCache() if cache is None else cache, progress)
    anchors: list[Event] = []
    angles = dict.fromkeys([REFERENCE_ANGLE_DEG, *[a for n, a in ANGLES.items() if n in wanted]])
    for angle in (a for a in angles if a <= settings.angle_max):
        here, several = _anchors(_slice_at(angle, slice_of, settings), wanted, angle)
        work.warnings += several
        anchors += here
        for event in (e for e in here if e.number in needed):
            work.follow(event, "" if event.number in wanted else f", from which {_drawn_from(event, wanted)} may come")
        work.number(anchors, wanted, needed)
    others = [e for e in anchors if e.number not in needed]
    while (meeting := next_partner(work.parts, others, wanted)) is not None:
        event, number = meeting
        near = with_sources({event.number} if event.number is not None else set())
        for one in [e for e in others if e.number in near]:  # from where it would be followed if all were wanted
            others.remove(one)
            work.follow(one, f", which may meet {number}")
        work.number(anchors, wanted, needed)
    missing = sorted(set(numbers) - {p.number for p in work.parts})
    work.warnings += [f"locus {n}: not found from the slices up to {settings.angle_max:g} deg" for n in missing]
    curves, parts = work.sorted()
    return Loci(
        settings, tuple(curves), tuple(pieces(parts, curves)), tuple(sorted(wanted)),
        tuple(work.warnings), time.perf_counter() - start,
    )  # fmt: skip


def trace_options(settings: LociSettings) -> TraceOptions:
    """Options of every locus: as those of the branches of a slice."""
    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=200.0),
        bounds={"dD": settings.shears, "psi0": (0.0, math.radians(settings.angle_max))},
    )


def _slice_at(angle: float, slice_of: Callable[[float], Slice], settings: LociSettings) -> Slice:
    """The slice that a user's function gives, or ValueError when it is one of another band or angle."""
    found = slice_of(angle)
    check_type("slice_of", found, Slice, "a function that gives slices, see compute_slice")
    wanted, got = ((s.angle_deg, s.compression, s.poisson) for s in (settings.slice_at(angle), found.settings))
    if wanted != got:
        names = ("angle {:g}, compression {:g}, Poisson's ratio {:g}".format(*s) for s in (wanted, got))
        raise ValueError("slice_of: expected the slice at {}, got that at {}".format(*names))
    return found


def _anchors(found: Slice, wanted: set[int], angle: float) -> tuple[list[Event], list[str]]:
    """The numbered bifurcations of a slice, each once; warnings where different ones have one number."""
    events: dict[int, list[Event]] = {}
    for b in found.branches:
        for e in b.events:
            if e.number is None or e.special.status is not Status.CONVERGED:
                continue
            if angle == REFERENCE_ANGLE_DEG or (e.number in wanted and ANGLES.get(e.number) == angle):
                events.setdefault(e.number, []).append(e)
    warnings = []
    for number, same in events.items():
        # the image in the shear mirror is no other bifurcation
        shears = sorted({round(abs(e.shear), IMAGE) for e in same if number in wanted})
        if len(shears) > 1:
            places = " and ".join(f"{x:g}" for x in shears)
            warnings.append(
                f"locus {number}: the slice at {angle:g} deg has {len(shears)} bifurcations of this number, at shear "
                f"{places}; only the one at {same[0].shear:.{IMAGE}g} is followed"
            )
    return [events[n][0] for n in sorted(events)], warnings


def _drawn_from(event: Event, wanted: set[int]) -> str:
    """The wanted numbers that may be on the curve of a bifurcation, or be born on it."""
    return " and ".join(str(n) for n in sorted(wanted) if event.number in with_sources({n}))


class _Work:
    """Curves followed so far, their stretches, and warnings."""

    def __init__(self, options: TraceOptions, cache: LocusCache, progress: Progress | None):
        self.curves: list[Locus] = []
        self._ranks: list[tuple[bool, float, int]] = []  # of the curves: born ones last, by angle and number
        self.parts: list[Stretch] = []
        self.warnings: list[str] = []
        self._options, self._cache, self._progress = options, cache, progress

    def follow(self, event: Event, why: str = "") -> None:
        """Add the curve of a bifurcation, unless it lies on a known one, and give its number to the stretch there.

        Parameters
        ----------
        why : what is said after the number, where it was not asked for.
        """
        place = place_of(self.parts, event)
        if place is None:
            if self._progress is not None:
                self._progress(f"locus {event.number}{why}", len(self.curves), 0)
            curve = self._cache.get(f"locus-{event.number}")
            if curve is None:
                try:
                    curve = follow_locus(rod_problem(), event.special, PLANE, self._options)
                except NotConverged as error:
                    self.warnings.append(f"locus {event.number}: {error}")
                    return
                self._cache.put(f"locus-{event.number}", curve)
            self.curves.append(curve)
            self._ranks.append((False, event.special.solution["psi0"], event.number or 0))
            first = len(self.parts)
            self.parts += stretches(curve, len(self.curves) - 1)
            place = min(range(first, len(self.parts)), key=lambda i: _distance(self.parts[i], event))
        self._give(place, event)

    def number(self, anchors: Sequence[Event], wanted: set[int], needed: set[int]) -> None:
        """Number what follows: bifurcations on known curves, stretches by their neighbors, and folds that are born."""
        there = {p.number for p in self.parts}
        for event in (e for e in anchors if e.number not in there):
            place = place_of(self.parts, event)
            if place is not None:
                self._give(place, event)
        there |= {p.number for p in self.parts}
        elsewhere = {e.number for e in anchors if e.number is not None and e.number not in needed | there}
        self.parts = numbered(self.parts, elsewhere)
        self._add_born_folds(wanted, needed, elsewhere)

    def sorted(self) -> tuple[list[Locus], list[Stretch]]:
        """Curves and stretches in an order that does not depend on which were followed first."""
        order = sorted(range(len(self.curves)), key=lambda i: self._ranks[i])
        places = {old: new for new, old in enumerate(order)}
        parts = sorted((replace(p, curve=places[p.curve]) for p in self.parts), key=lambda p: p.curve)
        return [self.curves[i] for i in order], parts

    def _give(self, place: int, event: Event) -> None:
        if self.parts[place].number is None:
            self.parts[place] = replace(self.parts[place], number=event.number)

    def _add_born_folds(self, wanted: set[int], needed: set[int], elsewhere: set[int]) -> None:
        """The folds that are born where numbered pitchforks turn subcritical, unless they are known."""
        for part in list(self.parts):
            number = ENDS.get(part.number or 0)
            born = [e for e in part.events if e.kind == "criticality"]
            asked = part.number in wanted or number in needed
            if number is None or not born or not asked or number in elsewhere:
                continue
            if any(p.number == number for p in self.parts):
                continue
            curve = self._cache.get(f"born-{number}")
            if curve is None:
                curve = fold_locus_at(rod_problem(), self.curves[part.curve], born[0], self._options)
                if curve is None:
                    continue
                self._cache.put(f"born-{number}", curve)
            self.curves.append(curve)
            self._ranks.append((True, 0.0, number))
            found = stretches(curve, len(self.curves) - 1)
            end = 0 if curve.ends[0].name == "CRITICALITY" else -1
            found[end] = replace(found[end], number=number)
            self.parts += found


def _distance(part: Stretch, event: Event) -> float:
    """How far a stretch is from a bifurcation, at its angle."""
    here = part.at(event.special.solution["psi0"])
    return math.inf if here is None else math.hypot(here[0] - event.shear, here[1] - event.height)
