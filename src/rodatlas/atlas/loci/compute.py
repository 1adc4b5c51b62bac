"""Follow the bifurcations of slices in angle and shear."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from rodatlas.atlas.loci.cache import LocusCache
from rodatlas.atlas.loci.numbering import ENDS, Stretch, lies_on, numbered, pieces, stretches
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
from rodatlas.continuation.checks import check_has, check_type
from rodatlas.progress import Progress, tells
from rodatlas.rods.perfectly_anisotropic import rod_problem

PLANE = ("dD", "psi0")
ANGLES = {16: 55.0, 17: 60.0}  # degrees at which a slice has these bifurcations; the others come from that at 15


def check_numbers(numbers: Sequence[int]) -> None:
    """Raise ValueError for numbers whose loci cannot be found."""
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
    numbers : loci that are wanted, all known ones when empty. Those of the slice at 15 degrees are followed in any
        case, to tell what meets at their special points; 16 and 17 need slices of their own.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    cache : asked for every locus before it is followed, and given it afterwards.
    """
    check_type("settings", settings, LociSettings, "LociSettings such as LociSettings()")
    check_has("slice_of", slice_of, ("__call__",), "a function that gives the slice at an angle in degrees")
    check_numbers(numbers)
    cache = LocusCache() if cache is None else cache
    start = time.perf_counter()
    options = trace_options(settings)
    curves: list[Locus] = []
    parts: list[Stretch] = []
    warnings: list[str] = []
    wanted = set(numbers or KNOWN)
    angles = dict.fromkeys([REFERENCE_ANGLE_DEG, *[a for n, a in ANGLES.items() if n in wanted]])
    for angle in (a for a in angles if a <= settings.angle_max):
        for event in _anchors(slice_of(angle), wanted, angle):
            if progress is not None:
                progress(f"locus {event.number}", len(curves), 0)
            parts = _with_curve(event, parts, curves, warnings, options, cache)
        parts = _born_folds(numbered(parts), curves, options, cache)
    missing = sorted(set(numbers) - {p.number for p in parts})
    warnings += [f"locus {number}: not found from the slices up to {settings.angle_max:g} deg" for number in missing]
    seconds = time.perf_counter() - start
    return Loci(
        settings, tuple(curves), tuple(pieces(parts, curves)), tuple(sorted(wanted)), tuple(warnings), seconds
    )  # fmt: skip


def trace_options(settings: LociSettings) -> TraceOptions:
    """Options of every locus: as those of the branches of a slice."""
    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=200.0),
        bounds={"dD": settings.shears, "psi0": (0.0, math.radians(settings.angle_max))},
    )


def _anchors(found: Slice, wanted: set[int], angle: float) -> list[Event]:
    """The numbered bifurcations of a slice, each once."""
    events: dict[int, Event] = {}
    for b in found.branches:
        for e in b.events:
            if e.number is None or e.special.status is not Status.CONVERGED:
                continue
            if angle == REFERENCE_ANGLE_DEG or (e.number in wanted and ANGLES.get(e.number) == angle):
                events.setdefault(e.number, e)
    return [events[n] for n in sorted(events)]


def _with_curve(
    event: Event, parts: list[Stretch], curves: list[Locus], warnings: list[str], options: TraceOptions,
    cache: LocusCache,
) -> list[Stretch]:  # fmt: skip
    """The stretches with that of one more bifurcation, followed unless it lies on a known curve."""
    solution = event.special.solution
    place = next((i for i, p in enumerate(parts) if lies_on(p, event.special.kind, solution)), None)
    if place is None:
        curve = cache.get(f"locus-{event.number}")
        if curve is None:
            try:
                curve = follow_locus(rod_problem(), event.special, PLANE, options)
            except NotConverged as error:
                warnings.append(f"locus {event.number}: {error}")
                return parts
            cache.put(f"locus-{event.number}", curve)
        curves.append(curve)
        first = len(parts)
        parts = [*parts, *stretches(curve, len(curves) - 1)]
        place = min(range(first, len(parts)), key=lambda i: _distance(parts[i], event))
    parts = list(parts)
    if parts[place].number is None:
        parts[place] = replace(parts[place], number=event.number)
    return parts


def _distance(part: Stretch, event: Event) -> float:
    """How far a stretch is from a bifurcation, at its angle."""
    here = part.at(event.special.solution["psi0"])
    return math.inf if here is None else math.hypot(here[0] - event.shear, here[1] - event.height)


def _born_folds(
    parts: list[Stretch], curves: list[Locus], options: TraceOptions, cache: LocusCache
) -> list[Stretch]:
    """The folds that are born where numbered pitchforks turn subcritical, unless they are known."""
    out = list(parts)
    for part in parts:
        number = ENDS.get(part.number or 0)
        born = [e for e in part.events if e.kind == "criticality"]
        if number is None or not born or any(p.number == number for p in out):
            continue
        curve = cache.get(f"born-{number}")
        if curve is None:
            curve = fold_locus_at(rod_problem(), curves[part.curve], born[0], options)
            if curve is None:
                continue
            cache.put(f"born-{number}", curve)
        curves.append(curve)
        found = stretches(curve, len(curves) - 1)
        end = 0 if curve.ends[0].name == "CRITICALITY" else -1
        found[end] = replace(found[end], number=number)
        out += found
    return out
