"""Which loci must be followed when some are wanted: what they come from, and what meets them at special points."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set

from rodatlas.atlas.loci.numbering import ENDS, SUCCESSORS, Stretch, events_of, lies_on, same_place
from rodatlas.atlas.slices.result import Event
from rodatlas.continuation import LocusEvent
from rodatlas.rods.symmetry import is_symmetric

SHARED = {10: 8}  # number -> another one on the same curve, which is followed from there: the two annihilate
MEETINGS = ("criticality", "coalescence", "crossing")
"""Special points at which another curve has one too; at a cusp, or where the angle is extreme, one curve turns back."""


def with_sources(wanted: Set[int]) -> set[int]:
    """Some numbers, and those from whose curves they may come: 4 with 12, which is born where 4 turns subcritical."""
    pairs = [*((number, source) for (source, _), number in SUCCESSORS.items()), *((n, p) for p, n in ENDS.items())]
    pairs += SHARED.items()
    found = set(wanted)
    while more := {source for number, source in pairs if number in found} - found:
        found |= more
    return found


def place_of(parts: Sequence[Stretch], event: Event) -> int | None:
    """Position of the stretch that a bifurcation of a slice lies on, if any."""
    return next((i for i, p in enumerate(parts) if lies_on(p, event.special.kind, event.special.solution)), None)


def next_partner(parts: Sequence[Stretch], anchors: Sequence[Event], wanted: Set[int]) -> tuple[Event, int] | None:
    """A bifurcation whose locus may be the one that meets a wanted locus somewhere, and the number of that one.

    Parameters
    ----------
    anchors : bifurcations of slices. Those on curves that are known are no candidates.

    Returns
    -------
    the candidate nearest to such a special point, of the kind that can meet there; None when all are told.
    """
    free = [e for e in anchors if place_of(parts, e) is None]
    for i, part in enumerate(parts):
        if part.number not in wanted or part.number is None:
            continue
        for event in events_of(parts, i):
            if event.kind in MEETINGS and not _is_met(event, part.curve, parts):
                fitting = [e for e in free if _may_meet(e, event, part.kind)]
                if fitting:
                    return min(fitting, key=lambda e: _distance(e, event)), part.number
    return None


def _is_met(event: LocusEvent, curve: int, parts: Sequence[Stretch]) -> bool:
    """Whether a special point of a curve is one of another curve too."""
    return any(
        same_place(event, e) for p in parts if p.curve != curve for e in (*p.ends, *p.events) if e is not None
    )  # fmt: skip


def _may_meet(anchor: Event, event: LocusEvent, kind: str) -> bool:
    """Whether the locus of a bifurcation can be the other one at a special point of a locus of a kind.

    Branch points cross each other; at other meetings one curve is of folds and one of branch points. Where they
    coalesce both lie on one branch, and are symmetric or not together; a fold that is born at a pitchfork lies on the
    side branch.
    """
    if event.kind == "crossing":
        return anchor.special.kind != "fold"
    if (anchor.special.kind == "fold") == (kind == "fold"):
        return False
    alike = is_symmetric(anchor.special.solution) == is_symmetric(event.solution)
    return alike if event.kind == "coalescence" or kind == "fold" else not alike


def _distance(anchor: Event, event: LocusEvent) -> float:
    return math.hypot(anchor.shear - event.solution["dD"], anchor.height - event.solution["height"])
