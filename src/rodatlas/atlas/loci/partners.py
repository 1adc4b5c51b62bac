"""Which loci must be followed when some are wanted: what they come from, and what meets them at special points."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set

from rodatlas.atlas.loci.settings import PlaneSettings
from rodatlas.atlas.loci.stretches import Stretch, events_of, lies_on, same_place
from rodatlas.atlas.slices.result import Event
from rodatlas.continuation import LocusEvent
from rodatlas.model.nomenclature import LocusTables
from rodatlas.model.orbit import is_alone

MEETINGS = ("criticality", "coalescence", "crossing")
"""Special points at which another curve has one too; at others one curve turns back."""


def with_sources(wanted: Set[int], tables: LocusTables) -> set[int]:
    """Some numbers, and those from whose curves they may come: 4 with 12, which is born where 4 turns subcritical."""
    pairs = [*((number, source) for (source, _), number in tables.successors.items())]
    pairs += [*((n, p) for p, n in tables.born.items()), *tables.shared.items()]
    found = set(wanted)
    while more := {source for number, source in pairs if number in found} - found:
        found |= more
    return found


def place_of(parts: Sequence[Stretch], event: Event, settings: PlaneSettings) -> int | None:
    """Position of the stretch that a bifurcation of a slice lies on, if any."""
    special = event.special
    return next((i for i, p in enumerate(parts) if lies_on(p, special.kind, special.solution, settings)), None)


def next_partner(
    parts: Sequence[Stretch], anchors: Sequence[Event], wanted: Set[int], settings: PlaneSettings
) -> tuple[Event, int] | None:
    """A bifurcation whose locus may be the one that meets a wanted locus somewhere, and the number of that one.

    Parameters
    ----------
    anchors : bifurcations of slices. Those on curves that are known are no candidates.

    Returns
    -------
    the candidate nearest to such a special point, of the kind that can meet there; None when all are told.
    """
    free = [e for e in anchors if place_of(parts, e, settings) is None]
    for i, part in enumerate(parts):
        if part.number not in wanted or part.number is None:
            continue
        for event in events_of(parts, i, settings):
            if event.kind in MEETINGS and not _is_met(event, part.curve, parts, settings):
                fitting = [e for e in free if _may_meet(e, event, part.kind, settings)]
                if fitting:
                    return min(fitting, key=lambda e: _distance(e, event, settings)), part.number
    return None


def _is_met(event: LocusEvent, curve: int, parts: Sequence[Stretch], settings: PlaneSettings) -> bool:
    """Whether a special point of a curve is one of another curve too."""
    return any(
        same_place(event, e, settings)
        for p in parts if p.curve != curve for e in (*p.ends, *p.events) if e is not None
    )  # fmt: skip


def _may_meet(anchor: Event, event: LocusEvent, kind: str, settings: PlaneSettings) -> bool:
    """Whether the locus of a bifurcation can be the other one at a special point of a locus of a kind.

    Branch points cross each other; at other meetings one curve is of folds and one of branch points. Where they
    coalesce both lie on one branch, and are symmetric or not together; a fold that is born at a pitchfork lies on the
    side branch.
    """
    if event.kind == "crossing":
        return anchor.special.kind != "fold"
    if (anchor.special.kind == "fold") == (kind == "fold"):
        return False
    alone = [is_alone(settings.model, s) for s in (anchor.special.solution, event.solution)]
    alike = alone[0] == alone[1]
    return alike if event.kind == "coalescence" or kind == "fold" else not alike


def _distance(anchor: Event, event: LocusEvent, settings: PlaneSettings) -> float:
    _, value, response = settings.point(event)
    return math.hypot(anchor.value - value, anchor.response - response)
