"""Compute a slice: follow all branches, name the stable states, number the bifurcations."""

from __future__ import annotations

import time
from dataclasses import replace

from rodatlas.atlas.cache import Cache
from rodatlas.atlas.slices.branches.follow import Reference, follow_slice
from rodatlas.atlas.slices.branches.frontier import Followed, Frontier
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.coexisting import overlaps
from rodatlas.atlas.slices.states.contact import contact_warnings, with_contact
from rodatlas.atlas.slices.states.crosscheck import empty_searches, missed_states
from rodatlas.atlas.slices.states.mirror import broken_products, further_symmetries, mirror_partners
from rodatlas.atlas.slices.states.names import SeenNames
from rodatlas.atlas.slices.states.segments import Bound, Segment, stable_segments, with_chained_indices
from rodatlas.continuation import SpecialPoint
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.curve.events import turns_at
from rodatlas.model import Model, Nomenclature, Part
from rodatlas.model.orbit import own_symmetries, pairing, same_state
from rodatlas.progress import Progress, tells


@tells("slice")
def compute_slice(
    settings: SliceSettings, cache: Cache | None = None, progress: Progress | None = None, carry: bool = True,
    reference: Reference | None = None,
) -> Slice:  # fmt: skip
    """Follow all branches of a slice, name the stable states and number the bifurcations.

    Parameters
    ----------
    cache : keeps finished branches, so that an interrupted run can be resumed.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    carry : whether branches that are not connected within the slice are looked for: carried over from reference
        settings, and found by a search.
    reference : branches of the slices at reference settings as far as they are known, see
        :func:`rodatlas.atlas.slices.branches.follow.carried_from`.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings, see SliceSettings.of")
    start = time.perf_counter()
    frontier = follow_slice(settings, cache, progress, carry, reference)
    names = _nomenclature(settings)
    branches = [SliceBranch(f, _bare_events(f, frontier)) for f in frontier.branches]
    segments = [s for b in branches for s in stable_segments(b.followed, _origin(b.followed, branches), settings.value)]
    named = list(zip(segments, names.parts(frontier.branches, segments), strict=True))
    branches = _numbered(branches, named, names, settings.local)
    warnings = list(frontier.warnings)
    for symmetry in further_symmetries(settings)[:1]:
        partners, missing = mirror_partners(frontier.branches, symmetry, settings)
        branches = [replace(b, mirror=partners.get(b.id)) for b in branches]
        warnings += missing
    states = [state for segment, parts in named for state in _states(segment, parts, branches, names, settings)]
    order = {name: i for i, name in enumerate((*names.names, names.other))}
    states = with_contact(
        sorted(states, key=lambda s: (order.get(s.name, len(order)), s.name, s.low.value)), settings
    )  # fmt: skip
    warnings += empty_searches(frontier.searches, settings)
    warnings += missed_states(frontier.searches, states, settings)
    warnings += [*overlaps(states, settings), *contact_warnings(states, settings)]
    return Slice(settings, tuple(branches), tuple(states), tuple(warnings), time.perf_counter() - start)


def _nomenclature(settings: SliceSettings) -> Nomenclature:
    """Who names the states: the nomenclature of the model where it knows them, else what is seen."""
    known = settings.model.nomenclature
    return known if known is not None and settings.named else SeenNames(settings)


def _bare_events(followed: Followed, frontier: Frontier) -> tuple[Event, ...]:
    """Events of a branch without numbers; pitchforks are told by the directions of the two curves."""
    events = []
    settings = frontier.settings
    for special in with_chained_indices(followed.bifurcations):
        pitchfork = special.kind == "branch point" and _is_pitchfork(special, settings.local)
        if pitchfork and _turns(followed, special, settings.local) and None in special.index:
            here = special.index[0] if special.index[1] is None else special.index[1]
            special = replace(special, index=(here, here))  # beyond it lies the image of the branch
        if pitchfork and not special.breaks:
            special = replace(special, breaks=broken_products(special, settings))
        criticality = _criticality(special, frontier) if pitchfork else None
        events.append(Event.at(settings, "pitchfork" if pitchfork else special.kind, special, None, criticality))
    return tuple(events)


def _is_pitchfork(special: SpecialPoint, model: Model) -> bool:
    """Whether a branch through a branch point loses a pairing symmetry, or leaves with what varies unchanged."""
    form = special.normal_form
    lost = any(name in special.breaks for name in pairing(model))
    return lost or (form is not None and form.kind == "pitchfork")


def _turns(followed: Followed, special: SpecialPoint, model: Model) -> bool:
    """Whether a branch is the side branch at a pitchfork: what varies turns, or its broken symmetry is restored."""
    return turns_at(special) or own_symmetries(model, special.solution) > followed.symmetries


def _criticality(special: SpecialPoint, frontier: Frontier) -> str | None:
    """Supercritical when the curve that turns has the smaller of the two indices of the curve that passes.

    The curves are this point's branch, the branches that start here and those that were met here by others.
    """
    passing: set[int] = set()
    turning: set[int] = set()
    model = frontier.settings.local
    for f in frontier.branches:
        for number, other in enumerate(f.branch.special):
            if other.kind != "branch point" or not same_state(model, other.solution, special.solution):
                continue
            turns = _turns(f, other, model)
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


def _find_event(branches: list[SliceBranch], special: SpecialPoint, model: Model) -> Event | None:
    """The event of a special point; the one on the main branch is preferred, since it knows the criticality."""
    same = [
        e for b in branches for e in b.events
        if (e.special.kind == "fold") == (special.kind == "fold")
        and same_state(model, e.special.solution, special.solution)
    ]  # fmt: skip
    return max(same, key=lambda e: (e.criticality is not None, e.number is not None), default=None)


def _numbered(
    branches: list[SliceBranch], named: list[tuple[Segment, list[Part]]], names: Nomenclature, model: Model
) -> list[SliceBranch]:
    """Give the numbers of a nomenclature."""

    def event_at(special: SpecialPoint) -> Event | None:
        return _find_event(branches, special, model)

    out = []
    for b, numbers in zip(branches, names.numbers([b.followed for b in branches], named, event_at), strict=True):
        out.append(replace(b, events=tuple(replace(e, number=numbers.get(i)) for i, e in enumerate(b.events))))
    return out


def _states(
    segment: Segment, parts: list[Part], branches: list[SliceBranch], names: Nomenclature, settings: SliceSettings
) -> list[State]:
    """The named states of a stable segment, with their ends."""
    solutions = names.cut(segment.solutions, parts, settings.tolerance)
    path = "-".join(part.name for part in parts)
    states = []
    for k, (part, inside) in enumerate(zip(parts, solutions, strict=True)):
        low = _end(segment.low, branches, settings) if k == 0 else StateEnd.at(settings, "smooth", inside[0])
        last = k == len(parts) - 1
        high = _end(segment.high, branches, settings) if last else StateEnd.at(settings, "smooth", inside[-1])
        states.append(State(part.name, segment.followed.id, segment.followed.pair, path, tuple(inside), low, high))
    return states


def _end(bound: Bound, branches: list[SliceBranch], settings: SliceSettings) -> StateEnd:
    """A bound as the user reads it: a state snaps at a fold and at a pitchfork that is not supercritical."""
    if bound.special is None:
        return StateEnd.at(settings, bound.kind, bound.solution)
    event = _find_event(branches, bound.special, settings.local)
    if event is None:
        return StateEnd.at(settings, bound.kind, bound.solution, snap=True)
    snap = event.kind != "pitchfork" or event.criticality != "super"
    return StateEnd.at(settings, event.kind, bound.solution, event.number, snap)
