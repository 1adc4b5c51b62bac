"""Compute a phase diagram: cut the plane by loci, sample every face with slices, and check that all adds up."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.phase.arrangement import Rings, cut_plane, extent
from rodatlas.atlas.phase.changes import change_lines
from rodatlas.atlas.phase.complete import complete
from rodatlas.atlas.phase.cover import choose_values, nearly
from rodatlas.atlas.phase.lines import Line, locus_lines, places_of, slice_knots
from rodatlas.atlas.phase.regions import Face, assign, check_crossings, crossings, deduced, roles_of
from rodatlas.atlas.phase.result import Interval, PhaseDiagram
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.phase.story import told
from rodatlas.atlas.slices.contact import contact_of_slices, contact_warnings
from rodatlas.atlas.slices.mirror import further_symmetries
from rodatlas.atlas.slices.result import Slice
from rodatlas.continuation.checks import check_type
from rodatlas.progress import Progress, tells

Slices = Callable[[Sequence[float]], Iterable[Slice]]
"""Gives the slices at some values of the second control, in any order; they may be computed at the same time."""

ROUNDS = 3  # how often more slices are asked for where faces were not met


@dataclass(frozen=True)
class _Drawn:
    """The plane as some slices show it."""

    lines: tuple[Line, ...]
    faces: tuple[Face, ...]
    events: tuple[PlaneEvent, ...]
    completed: tuple[str, ...]
    warnings: tuple[str, ...]


@tells("phase diagram")
def compute_phase(
    settings: PhaseSettings, loci: Loci, slices: Slices, given: Sequence[float] = (), progress: Progress | None = None
) -> PhaseDiagram:
    """A plane of two controls cut into faces in which the same stable states exist.

    The loci cut the plane into faces. A few slices, chosen so that they pass through every face and across every locus,
    tell which states are stable there. In each face all of them must agree, no state may end inside, and
    across a locus must happen what its kind allows; what does not add up becomes a warning. A state that one slice
    has in a face and another lacks is followed there, and completes that slice if it is stable all the way.

    Parameters
    ----------
    loci : all that have numbers, with the settings `settings.loci`.
    slices : gives slices with the settings `settings.slice_at(second)`.
    given : values of the second control whose slices cost nothing, used first.
    """
    check_type("settings", settings, PhaseSettings, "PhaseSettings, see PhaseSettings.of")
    check_type("loci", loci, Loci, "Loci, see compute_loci and Loci.load")
    wanted_plane, plane = ((s.model, s.setting, s.along, s.second) for s in (settings, loci.settings))
    if wanted_plane != plane:
        raise ValueError(f"loci: expected those of {settings!r}, got those of {loci.settings!r}")
    start = time.perf_counter()
    frame, events = settings.frame, loci.events()
    lines = locus_lines(loci.pieces, events, settings)
    free = [a for a in given if frame[0] < a < frame[1]]
    wanted, _ = choose_values(cut_plane(lines, settings), lines, settings, free)
    edges = [a for a in frame[:2] if is_mirror(settings, a)]
    places = sorted({*free, *wanted, *edges})
    known: dict[float, Slice] = {}
    for _ in range(ROUNDS):
        new = [a for a in places if a not in known]
        if progress is not None:
            progress(f"{len(new)} slices", len(known), len(new))
        known |= {s.settings.setting[settings.second]: s for s in slices(new)}
        ordered = [known[a] for a in sorted(known)]
        drawn = _draw(settings, loci, [known[a] for a in sorted(known) if a not in edges])
        missed = [f.rings for f in drawn.faces if not f.samples]
        wanted, _ = choose_values(missed, [], settings, sorted(known))
        places = [a for a in {*wanted, *_doubtful(drawn, known, settings)} if a not in known]
        if not places:
            break
    on_edge = tuple(Interval(a, s.name, *s.span) for a in edges for s in known[a].states)
    warnings = [f"loci: {w}" for w in loci.warnings]
    warnings += slice_warnings(ordered, settings)
    return PhaseDiagram(
        settings, drawn.lines, drawn.faces, on_edge, drawn.events, tuple(sorted(known)), drawn.completed,
        (*warnings, *drawn.warnings), time.perf_counter() - start,
    )  # fmt: skip


def is_mirror(settings: PhaseSettings, second: float) -> bool:
    """Whether a further symmetry leaves a slice alone, as between level clamps: it has states of its own."""
    return bool(further_symmetries(settings.slice_at(second)))


def slice_warnings(slices: Iterable[Slice], settings: PhaseSettings) -> list[str]:
    """Warnings of slices with their places; that a band touches itself is said once for each name."""
    warnings, slices = [], list(slices)
    for s in slices:
        merged = set(contact_warnings(s.states, s.settings))
        warnings += [f"slice at {s.settings.place_text}: {w}" for w in s.warnings if w not in merged]
    return warnings + contact_of_slices(slices, settings.second)


def _doubtful(drawn: _Drawn, known: Iterable[float], settings: PhaseSettings) -> list[float]:
    """Places between the special points along faces on which slices disagree, where there is no slice yet.

    A change of name that starts at a special point shows only in a slice beyond it.
    """
    found = []
    for face in (f for f in drawn.faces if f.samples and f.states is None):
        low, high = extent(face.rings)
        special = {e.second for e in drawn.events if low < e.second < high and e.parameter != settings.along}
        for a, b in pairwise(sorted({low, high, *special})):
            if not any(a < x < b for x in known):
                found.append(nearly(0.5 * (a + b), 0.25 * (b - a)))
    return found


def _draw(settings: PhaseSettings, loci: Loci, slices: Sequence[Slice]) -> _Drawn:
    """Lines through the bifurcations of slices, the faces between them with their states, and what contradicts."""
    places = places_of(loci.pieces, settings)
    roles, unmatched = roles_of(places, slices, settings)
    events = told(loci.events(), roles, slices, settings)
    changes, broken = change_lines(slices, events, roles, settings)
    loci_lines = locus_lines(loci.pieces, events, settings, slice_knots(places, slices, settings))
    lines = [*loci_lines, *changes]
    rings: list[Rings] = cut_plane(lines, settings)
    missed = complete(rings, slices, settings)
    faces, contradictions = assign(rings, slices, settings, missed)
    across = crossings(rings, lines, slices, settings, missed)
    impossible = check_crossings(across, events)
    faces = deduced(faces, lines, across, events, settings)
    inside = tuple(e for e in events if settings.second_low <= e.second <= settings.second_high)
    warnings = (*unmatched, *broken, *contradictions, *impossible)
    return _Drawn(tuple(lines), tuple(faces), inside, tuple(map(str, missed)), warnings)
