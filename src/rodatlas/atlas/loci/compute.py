"""Follow the bifurcations of slices as two controls vary."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from rodatlas.atlas.cache import LOCUS, Cache, MemoryCache
from rodatlas.atlas.loci.partners import next_partner, place_of, with_sources
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.loci.stretches import Stretch, numbered, pieces, stretches
from rodatlas.atlas.slices.result import Event, Slice
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

FEW, LEAST = 40, 3  # points of a curve: for a good spline, and to be a curve at all
IMAGE = 6  # digits to which a bifurcation agrees with its image in a mirror
Roles = dict[int, frozenset[tuple[str, str]]]


@tells("loci")
def compute_loci(
    settings: LociSettings, slice_of: Callable[[float], Slice], numbers: Sequence[int] = (),
    progress: Progress | None = None, cache: Cache | None = None,
) -> Loci:  # fmt: skip
    """Follow the bifurcations of some slices, and what meets them, in a plane of two controls.

    Parameters
    ----------
    slice_of : gives the slice at a value of the second control.
    numbers : loci that are wanted, all when empty. Others are followed as far as wanted ones come from them, or as it
        takes to tell what meets at the special points of wanted ones.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    cache : asked for every locus before it is followed, and given it afterwards.
    """
    check_type("settings", settings, LociSettings, "LociSettings, see LociSettings.of")
    check_has("slice_of", slice_of, ("__call__",), "a function that gives the slice at a value of the second control")
    check_each("numbers", numbers, int, "a sequence of whole numbers")
    settings.check_numbers(numbers)
    start = time.perf_counter()
    work = _Work(settings, MemoryCache() if cache is None else cache, progress)
    tables = settings.tables
    slices: list[Slice] = []
    wanted = set(numbers or tables.known)
    needed = with_sources(wanted, tables)
    anchors: list[Event] = []
    first, *more = [a for a in settings.starts if settings.second_low <= a <= settings.second_high]
    further = [a for a in more if (a in [tables.elsewhere.get(n) for n in wanted] if tables.known else not numbers)]
    for place in (first, *further):
        slices.append(_slice_at(place, slice_of, settings))
        here, several = _anchors(slices[-1], wanted, place, first, settings)
        if not tables.known and place == first and not numbers:
            wanted = needed = {e.number for e in here if e.number is not None}
        work.warnings += several
        anchors += here
        for event in (e for e in here if e.number in needed):
            work.follow(
                event, "" if event.number in wanted else f", from which {_drawn_from(event, wanted, settings)} may come"
            )
        if not tables.known and not numbers:
            work.follow_others(slices[-1], place)
        work.number(anchors, wanted, needed)
    others = [e for e in anchors if e.number not in needed]
    while (meeting := next_partner(work.parts, others, wanted, settings)) is not None:
        event, number = meeting
        near = with_sources({event.number} if event.number is not None else set(), tables)
        for one in [e for e in others if e.number in near]:  # from where it would be followed if all were wanted
            others.remove(one)
            work.follow(one, f", which may meet {number}")
        work.number(anchors, wanted, needed)
    missing = sorted(set(numbers) - {p.number for p in work.parts})
    work.warnings += [f"locus {n}: not found from the slices at {settings.second} {settings.second_low:g} to "
                      f"{settings.second_high:g}" for n in missing]  # fmt: skip
    curves, parts = work.sorted()
    roles = dict(tables.roles) or _roles_in(slices[:1])
    listed = tuple(sorted(wanted)) if tables.known or numbers else ()
    return Loci(
        settings, tuple(curves), tuple(pieces(parts, curves, settings)), listed, roles,
        tuple(work.warnings), time.perf_counter() - start,
    )  # fmt: skip


def _roles_in(slices: Sequence[Slice]) -> Roles:
    """What numbered bifurcations bound in some slices."""
    found: dict[int, set[tuple[str, str]]] = {}
    for state in (state for one in slices for state in one.states):
        for side, end in (("low", state.low), ("high", state.high)):
            if end.number is not None:
                found.setdefault(end.number, set()).add((state.name, side))
    return {number: frozenset(roles) for number, roles in found.items()}


def trace_options(settings: LociSettings) -> TraceOptions:
    """Options of every locus: as those of the branches of a slice."""
    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=200.0),
        bounds=_bounds(settings),
    )


def _bounds(settings: LociSettings) -> dict[str, tuple[float, float]]:
    """The ranges of both controls as bounds of a locus."""
    parameters = settings.slice_at(settings.anchor).parameters
    ranges = ((settings.along_control, settings.low, settings.high),
              (settings.second_control, settings.second_low, settings.second_high))  # fmt: skip
    found = {}
    for control, low, high in ranges:
        one, two = sorted((control.raw(low, parameters), control.raw(high, parameters)))
        found[control.parameter] = (one, two)
    return found


def _slice_at(place: float, slice_of: Callable[[float], Slice], settings: LociSettings) -> Slice:
    """The slice that a user's function gives, or ValueError when it is one of another setting."""
    found = slice_of(place)
    check_type("slice_of", found, Slice, "a function that gives slices, see compute_slice")
    wanted, got = settings.slice_at(place), found.settings
    if (wanted.model, wanted.setting, wanted.along) != (got.model, got.setting, got.along):
        raise ValueError(f"slice_of: expected the slice at {wanted.place_text}, got that at {got.place_text}")
    return found


def _anchors(
    found: Slice, wanted: set[int], place: float, first: float, settings: LociSettings
) -> tuple[list[Event], list[str]]:
    """The numbered bifurcations of a slice, each once; warnings where different ones have one number."""
    events: dict[int, list[Event]] = {}
    elsewhere = settings.tables.elsewhere
    for b in found.branches:
        for e in b.events:
            outside = not settings.low <= e.value <= settings.high
            if e.number is None or e.special.status is not Status.CONVERGED or outside:
                continue
            if place == first or (e.number in wanted and elsewhere.get(e.number) == place):
                events.setdefault(e.number, []).append(e)
    warnings = []
    for number, same in events.items():
        # the image in a mirror is no other bifurcation
        values = sorted(
            {round(abs(e.value) if settings.mirrored else e.value, IMAGE) for e in same if number in wanted}
        )
        if len(values) > 1:
            places = " and ".join(f"{x:g}" for x in values)
            warnings.append(
                f"locus {number}: the slice at {settings.second} {place:g} has {len(values)} bifurcations of this "
                f"number, at {settings.along} {places}; only the one at {same[0].value:.{IMAGE}g} is followed"
            )
    return [events[n][0] for n in sorted(events)], warnings


def _drawn_from(event: Event, wanted: set[int], settings: LociSettings) -> str:
    """The wanted numbers that may be on the curve of a bifurcation, or be born on it."""
    drawn = (n for n in sorted(wanted) if event.number in with_sources({n}, settings.tables))
    return " and ".join(str(n) for n in drawn)


def _resolved(
    follow: Callable[[TraceOptions], Locus | None], options: TraceOptions, first: Locus | None = None
) -> Locus:
    """A locus with so many points that a spline through them is a good curve: it is followed again where it has few."""
    curve = follow(options) if first is None else first
    assert curve is not None
    if len(curve.points) >= FEW:
        return curve
    length = curve.points[-1].arclength - curve.points[0].arclength
    step = options.step
    finer = replace(step, maximum=min(max(length / FEW, step.initial), step.maximum))
    return follow(replace(options, step=finer)) or curve


class _Work:
    """Curves followed so far, their stretches, and warnings."""

    def __init__(self, settings: LociSettings, cache: Cache, progress: Progress | None):
        self.curves: list[Locus] = []
        self._ranks: list[tuple[bool, float, int]] = []  # of the curves: born ones last, by place and number
        self.parts: list[Stretch] = []
        self.warnings: list[str] = []
        self._settings, self._cache, self._progress = settings, cache, progress
        self._options = trace_options(settings)

    def follow(self, event: Event, why: str = "") -> None:
        """Add the curve of a bifurcation, unless it lies on a known one, and give its number to the stretch there.

        Parameters
        ----------
        why : what is said after the number, where it was not asked for.
        """
        place = place_of(self.parts, event, self._settings)
        if place is None:
            first = len(self.parts)
            if not self._add(event, str(event.number), why):
                return
            place = min(range(first, len(self.parts)), key=lambda i: self._distance(self.parts[i], event))
        self._give(place, event)

    def follow_others(self, found: Slice, place: float) -> None:
        """Add the curves of the bifurcations of another slice that lie on no known one; they have no numbers."""
        s = self._settings
        found_there = [e for b in found.branches for e in b.events if s.low <= e.value <= s.high]
        events = [e for e in found_there if e.special.status is Status.CONVERGED]
        for k, event in enumerate(events):
            if place_of(self.parts, event, self._settings) is None:
                self._add(event, f"{place:g}-{k}", f" of the slice at {self._settings.second} {place:g}")

    def _add(self, event: Event, key: str, why: str) -> bool:
        """Follow the curve of a bifurcation and cut it; False when that fails, with a warning."""
        if self._progress is not None:
            self._progress(f"locus {key}{why}", len(self.curves), 0)
        curve = self._cache.get(f"locus-{key}", LOCUS)
        if curve is None:
            follow = partial(follow_locus, self._settings.model.problem, event.special, self._settings.free)
            try:
                curve = _resolved(follow, self._options)
            except NotConverged as error:
                self.warnings.append(f"locus {key}: {error}")
                return False
            self._cache.put(f"locus-{key}", curve, LOCUS)
        if len(curve.points) < LEAST:
            self.warnings.append(f"locus {key}: {curve.ends[1].value}")
            return False
        self.curves.append(curve)
        self._ranks.append((False, self._settings.second_value(event.special.solution), event.number or 0))
        self.parts += stretches(curve, len(self.curves) - 1, self._settings)
        return True

    def number(self, anchors: Sequence[Event], wanted: set[int], needed: set[int]) -> None:
        """Number what follows: bifurcations on known curves, stretches by their neighbors, and folds that are born."""
        there = {p.number for p in self.parts}
        for event in (e for e in anchors if e.number not in there):
            place = place_of(self.parts, event, self._settings)
            if place is not None:
                self._give(place, event)
        there |= {p.number for p in self.parts}
        elsewhere = {e.number for e in anchors if e.number is not None and e.number not in needed | there}
        self.parts = numbered(self.parts, self._settings.tables.successors, elsewhere)
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
            number = self._settings.tables.born.get(part.number or 0)
            born = [e for e in part.events if e.kind == "criticality"]
            asked = part.number in wanted or number in needed
            if number is None or not born or not asked or number in elsewhere:
                continue
            if any(p.number == number for p in self.parts):
                continue
            curve = self._cache.get(f"born-{number}", LOCUS)
            if curve is None:
                follow = partial(fold_locus_at, self._settings.model.problem, self.curves[part.curve], born[0])
                first = follow(self._options)
                if first is None:
                    continue
                curve = _resolved(follow, self._options, first)
                self._cache.put(f"born-{number}", curve, LOCUS)
            self.curves.append(curve)
            self._ranks.append((True, 0.0, number))
            found = stretches(curve, len(self.curves) - 1, self._settings)
            end = 0 if curve.ends[0].name == "CRITICALITY" else -1
            found[end] = replace(found[end], number=number)
            self.parts += found

    def _distance(self, part: Stretch, event: Event) -> float:
        """How far a stretch is from a bifurcation, at its value of the second control."""
        here = part.at(self._settings.second_value(event.special.solution))
        return math.inf if here is None else math.hypot(here[0] - event.value, here[1] - event.response)
