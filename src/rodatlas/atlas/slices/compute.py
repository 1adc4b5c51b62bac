"""Compute a slice: follow all branches, name the stable states, number the bifurcations."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise

from rodatlas.atlas.slices.cache import BranchCache
from rodatlas.atlas.slices.coexisting import overlaps
from rodatlas.atlas.slices.contact import contact_warnings, with_contact
from rodatlas.atlas.slices.crosscheck import empty_searches, missed_states
from rodatlas.atlas.slices.cuts import cut_segment
from rodatlas.atlas.slices.follow import Followed, Frontier, Reference, follow_slice
from rodatlas.atlas.slices.match import same_state
from rodatlas.atlas.slices.mirror import broken_symmetries, mirror_partners
from rodatlas.atlas.slices.numbering import ENDS, number_neighbors, number_without_states
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.segments import Bound, Segment, stable_segments, with_chained_indices
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import SpecialPoint
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.curve.events import turns_at
from rodatlas.progress import Progress, tells
from rodatlas.rods.symmetry import is_symmetric
from rodatlas.states.names import NAMES, OTHER, Part, name_parts
from rodatlas.states.winding import is_curled


@tells("slice")
def compute_slice(
    settings: SliceSettings, cache: BranchCache | None = None, progress: Progress | None = None, carry: bool = True,
    reference: Reference | None = None,
) -> Slice:  # fmt: skip
    """Follow all branches of a slice, name the stable states and number the bifurcations.

    Parameters
    ----------
    cache : keeps finished branches, so that an interrupted run can be resumed.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    carry : whether branches that are not connected within the slice are looked for: carried over from a reference
        angle, and found by a search.
    reference : branches of the slices at reference angles as far as they are known, see
        :func:`rodatlas.atlas.slices.follow.planar_branches`.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    start = time.perf_counter()
    frontier = follow_slice(settings, cache, progress, carry, reference)
    branches = [SliceBranch(f, _bare_events(f, frontier)) for f in frontier.branches]
    segments = [s for b in branches for s in stable_segments(b.followed, _origin(b.followed, branches))]
    inverted = {f.id for f in frontier.branches if _holds_w(f)}
    named = [(s, name_parts(s.solutions, s.followed.symmetric, s.followed.id in inverted)) for s in segments]
    branches = _numbered(branches, named)
    warnings = list(frontier.warnings)
    if settings.angle == 0.0:
        partners, missing = mirror_partners(frontier.branches, settings)
        branches = [replace(b, mirror=partners.get(b.id)) for b in branches]
        warnings += missing
    states = [state for segment, parts in named for state in _states(segment, parts, branches, settings)]
    states = with_contact(sorted(states, key=lambda s: ((*NAMES, OTHER).index(s.name), s.low.shear)), settings)
    warnings += [*empty_searches(frontier.searches), *missed_states(frontier.searches, states, settings)]
    warnings += [*overlaps(states), *contact_warnings(states)]
    return Slice(settings, tuple(branches), tuple(states), tuple(warnings), time.perf_counter() - start)


def _holds_w(followed: Followed) -> bool:
    """Whether a branch passes a stable symmetric state of negative height at dD = 0."""
    points = followed.branch.points
    return followed.symmetric and any(
        one.solution["dD"] * two.solution["dD"] <= 0
        and one.index == two.index == 0
        and one.solution["height"] < 0
        and not is_curled(one.solution)
        for one, two in pairwise(points)
    )


def _bare_events(followed: Followed, frontier: Frontier) -> tuple[Event, ...]:
    """Events of a branch without numbers; pitchforks are told by the directions of the two curves."""
    events = []
    for special in with_chained_indices(followed.bifurcations):
        pitchfork = special.kind == "branch point" and _is_pitchfork(special)
        if pitchfork and _turns(followed, special) and None in special.index:
            here = special.index[0] if special.index[1] is None else special.index[1]
            special = replace(special, index=(here, here))  # beyond it lies the reversed branch
        if pitchfork and not special.breaks:
            special = replace(special, breaks=broken_symmetries(special))
        criticality = _criticality(special, frontier) if pitchfork else None
        events.append(Event("pitchfork" if pitchfork else special.kind, special, None, criticality))
    return tuple(events)


def _is_pitchfork(special: SpecialPoint) -> bool:
    """Whether a branch through a branch point loses the reversal symmetry, or leaves with the shear unchanged."""
    form = special.normal_form
    return "reversal" in special.breaks or (form is not None and form.kind == "pitchfork")


def _turns(followed: Followed, special: SpecialPoint) -> bool:
    """Whether a branch is the side branch at a pitchfork: the shear turns, or its broken symmetry is restored."""
    return turns_at(special) or (not followed.symmetric and is_symmetric(special.solution))


def _criticality(special: SpecialPoint, frontier: Frontier) -> str | None:
    """Supercritical when the curve that turns has the smaller of the two indices of the curve that passes.

    The curves are this point's branch, the branches that start here and those that were met here by others.
    """
    passing: set[int] = set()
    turning: set[int] = set()
    for f in frontier.branches:
        for number, other in enumerate(f.branch.special):
            if other.kind != "branch point" or not same_state(other.solution, special.solution):
                continue
            turns = _turns(f, other)
            (turning if turns else passing).update(i for i in other.index if i is not None)
            first = [g.branch.points[1].index for g in frontier.branches if g.origin == (f.id, number)]
            starting = [i for i in first if i is not None]
            (passing if turns else turning).update(starting)
    if len(passing) != 2 or len(turning) != 1:
        return None
    return "super" if turning == {min(passing)} else "sub"


def _origin(followed: Followed, branches: list[SliceBranch]) -> SpecialPoint | None:
    """The branch point at which a side branch starts."""
    if followed.origin is None:
        return None
    ident, number = followed.origin
    parent = next(b for b in branches if b.id == ident)
    return parent.followed.branch.special[number]


def _find_event(branches: list[SliceBranch], special: SpecialPoint) -> Event | None:
    """The event of a special point; the one on the main branch is preferred, since it knows the criticality."""
    same = [
        e for b in branches for e in b.events
        if (e.special.kind == "fold") == (special.kind == "fold") and same_state(e.special.solution, special.solution)
    ]  # fmt: skip
    return max(same, key=lambda e: (e.criticality is not None, e.number is not None), default=None)


def _numbered(branches: list[SliceBranch], named: list[tuple[Segment, list[Part]]]) -> list[SliceBranch]:
    """Give the paper's numbers: first to the ends of named states, then to their neighbors."""
    given = _numbers_of_ends(branches, named)
    out = []
    for b in branches:
        special = b.followed.bifurcations
        known = {
            i: number for i, x in enumerate(special) for other, number in given
            if x.kind == other.kind and same_state(x.solution, other.solution)
        }  # fmt: skip
        closed = b.followed.branch.closed
        numbers = number_neighbors(special, known, closed)
        if not numbers and b.followed.symmetric and _has_positive_height(b.followed):
            numbers = number_without_states(special, closed)
        out.append(replace(b, events=tuple(replace(e, number=numbers.get(i)) for i, e in enumerate(b.events))))
    return out


def _has_positive_height(followed: Followed) -> bool:
    """Whether a branch lies above the clamp plane; at psi0 = 0 the other half of the slice is its mirror image."""
    return all(p.solution["height"] > 0 for p in followed.branch.points)


def _numbers_of_ends(
    branches: list[SliceBranch], named: list[tuple[Segment, list[Part]]]
) -> list[tuple[SpecialPoint, int]]:
    """The numbers of bifurcations at which named states end."""
    given = []
    for segment, parts in named:
        for side, bound, name in (("low", segment.low, parts[0].name), ("high", segment.high, parts[-1].name)):
            event = _find_event(branches, bound.special) if bound.special is not None else None
            number = ENDS.get((name, side, event.kind)) if event is not None else None
            if bound.special is not None and number is not None:
                given.append((bound.special, number))
    return given


def _states(segment: Segment, parts: list[Part], branches: list[SliceBranch], settings: SliceSettings) -> list[State]:
    """The named states of a stable segment, with their ends."""
    solutions = cut_segment(segment.solutions, parts, settings)
    path = "-".join(part.name for part in parts)
    states = []
    for k, (part, inside) in enumerate(zip(parts, solutions, strict=True)):
        low = _end(segment.low, branches) if k == 0 else StateEnd("smooth", inside[0])
        high = _end(segment.high, branches) if k == len(parts) - 1 else StateEnd("smooth", inside[-1])
        states.append(State(part.name, segment.followed.id, segment.followed.pair, path, tuple(inside), low, high))
    return states


def _end(bound: Bound, branches: list[SliceBranch]) -> StateEnd:
    """A bound as the user reads it: a state snaps at a fold and at a pitchfork that is not supercritical."""
    if bound.special is None:
        return StateEnd(bound.kind, bound.solution)
    event = _find_event(branches, bound.special)
    if event is None:
        return StateEnd(bound.kind, bound.solution, snap=True)
    snap = event.kind != "pitchfork" or event.criticality != "super"
    return StateEnd(event.kind, bound.solution, event.number, snap)
