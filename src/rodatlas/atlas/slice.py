"""A slice of the atlas: branches, named stable states, numbered bifurcations."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

from rodatlas.atlas.cuts import cut_segment
from rodatlas.atlas.follow import BranchCache, Followed, Frontier, Progress, follow_slice, same_state
from rodatlas.atlas.numbering import ENDS, number_neighbours
from rodatlas.atlas.segments import Bound, Segment, stable_segments
from rodatlas.atlas.settings import SliceSettings
from rodatlas.continuation import Solution, SpecialPoint
from rodatlas.continuation.events import turns_at
from rodatlas.rods.symmetry import is_symmetric
from rodatlas.states.names import NAMES, name_parts

SCHEMA = "rodatlas/slice/1"


@dataclass(frozen=True)
class Event:
    """A fold or branch point of a slice, as a user reads it.

    kind : 'fold', 'pitchfork' or 'branch point'; number : the paper's number or None;
    criticality : 'super', 'sub' or None, of pitchforks whose side branch was followed.
    """

    kind: str
    special: SpecialPoint
    number: int | None = None
    criticality: str | None = None


@dataclass(frozen=True)
class StateEnd:
    """Where a stable state ends, and whether it snaps there.

    kind : 'fold', 'pitchfork', 'branch point', 'range' (the shear range ends first) or 'smooth' (the state becomes
    the next named one without a bifurcation).
    """

    kind: str
    solution: Solution
    number: int | None = None
    snap: bool = False

    @property
    def shear(self) -> float:
        return self.solution["dD"]

    @property
    def height(self) -> float:
        return self.solution["height"]


@dataclass(frozen=True)
class State:
    """A named stable state over a range of shear.

    solutions : in order of increasing shear, ends included. path : the whole stable segment's name, 'U-w' say.
    """

    name: str
    branch: str
    pair: bool
    path: str
    solutions: tuple[Solution, ...]
    low: StateEnd
    high: StateEnd

    @property
    def shear(self) -> tuple[float, float]:
        return self.low.shear, self.high.shear

    def __repr__(self) -> str:
        return f"State({self.name}: shear {self.low.shear:.6g} to {self.high.shear:.6g}, on branch {self.branch})"


@dataclass(frozen=True)
class SliceBranch:
    """A followed branch with its events, one for each special point that is a fold or branch point."""

    followed: Followed
    events: tuple[Event, ...]

    @property
    def id(self) -> str:
        return self.followed.id


@dataclass(frozen=True)
class Slice:
    """All that was found at one setting; see :func:`compute_slice`."""

    settings: SliceSettings
    branches: tuple[SliceBranch, ...]
    states: tuple[State, ...]
    warnings: tuple[str, ...]
    seconds: float

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(s.name for s in self.states))
        return f"Slice(angle {self.settings.angle_deg:g} deg: {len(self.branches)} branches; stable: {names})"

    def state(self, name: str, shear: float) -> State | None:
        """The stable state of a name that exists at a shear."""
        fitting = [s for s in self.states if s.name == name and s.shear[0] <= shear <= s.shear[1]]
        return fitting[0] if fitting else None

    def to_json(self) -> dict[str, Any]:
        """The object that `rodatlas slice --json` prints."""
        s = self.settings
        return {
            "schema": SCHEMA,
            "angle_deg": s.angle_deg,
            "compression": s.compression,
            "poisson": s.poisson,
            "shear_range": [s.shear_min, s.shear_max],
            "tolerance": s.tolerance,
            "seconds": round(self.seconds, 3),
            "warnings": list(self.warnings),
            "states": [_state_json(x) for x in self.states],
            "branches": [_branch_json(x) for x in self.branches],
        }


def compute_slice(
    settings: SliceSettings, cache: BranchCache | None = None, progress: Progress | None = None, carry: bool = True
) -> Slice:
    """Follow all branches of a slice, name the stable states and number the bifurcations.

    Parameters
    ----------
    cache : keeps finished branches, so that an interrupted run can be resumed.
    progress : called as the work goes on.
    carry : whether states that are not connected within the slice are carried over from a reference angle.
    """
    start = time.perf_counter()
    frontier = follow_slice(settings, cache, progress, carry)
    branches = [SliceBranch(f, _bare_events(f, frontier)) for f in frontier.branches]
    segments = [s for b in branches for s in stable_segments(b.followed, _origin(b.followed, branches))]
    parts = [(segment, name_parts(segment.solutions, segment.followed.symmetric)) for segment in segments]
    branches = _numbered(branches, parts)
    states = [state for segment, names in parts for state in _states(segment, names, branches, settings)]
    states.sort(key=lambda s: (NAMES.index(s.name), s.low.shear))
    return Slice(settings, tuple(branches), tuple(states), tuple(frontier.warnings), time.perf_counter() - start)


def _bare_events(followed: Followed, frontier: Frontier) -> tuple[Event, ...]:
    """Events of a branch without numbers; pitchforks are told by the directions of the two curves."""
    events = []
    for special in followed.branch.special:
        if special.kind not in ("fold", "branch point"):
            continue
        pitchfork = special.kind == "branch point" and _is_pitchfork(special)
        if pitchfork and _turns(followed, special) and special.index[1] is None:
            special = replace(special, index=(special.index[0],) * 2)  # beyond it lies the reversed branch
        criticality = _criticality(special, frontier) if pitchfork else None
        events.append(Event("pitchfork" if pitchfork else special.kind, special, None, criticality))
    return tuple(events)


def _is_pitchfork(special: SpecialPoint) -> bool:
    """One of the two curves through the point has no component along the continuation parameter."""
    if len(special.directions) < 2:
        return False
    return any(abs(d.scalars[0]) < 1e-3 for d in special.directions)


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


def _numbered(
    branches: list[SliceBranch], parts: list[tuple[Segment, list[tuple[str, int, int]]]]
) -> list[SliceBranch]:
    """Give the paper's numbers: first to the ends of named states, then to their neighbours."""
    given: list[tuple[SpecialPoint, int]] = []
    for segment, names in parts:
        for end, bound, name in (("low", segment.low, names[0][0]), ("high", segment.high, names[-1][0])):
            if bound.special is not None:
                event = _find_event(branches, bound.special)
                number = ENDS.get((name, end, event.kind)) if event else None
                if number is not None:
                    given.append((bound.special, number))

    out = []
    for b in branches:
        known = {}
        for i, special in enumerate(b.followed.branch.special):
            for other, number in given:
                if special.kind == other.kind and same_state(special.solution, other.solution):
                    known[i] = number
        numbers = number_neighbours(b.followed.branch, known)
        positions = [i for i, x in enumerate(b.followed.branch.special) if x.kind in ("fold", "branch point")]
        events = tuple(replace(e, number=numbers.get(i)) for i, e in zip(positions, b.events, strict=True))
        out.append(replace(b, events=events))
    return out


def _states(
    segment: Segment, names: list[tuple[str, int, int]], branches: list[SliceBranch], settings: SliceSettings
) -> list[State]:
    solutions = segment.solutions
    parts = cut_segment(solutions, names, settings) if len(names) > 1 else [solutions]
    path = "-".join(name for name, _, _ in names)
    states = []
    for k, ((name, _, _), part) in enumerate(zip(names, parts, strict=True)):
        low = _end(segment.low, branches) if k == 0 else StateEnd("smooth", part[0])
        high = _end(segment.high, branches) if k == len(names) - 1 else StateEnd("smooth", part[-1])
        states.append(State(name, segment.followed.id, segment.followed.pair, path, tuple(part), low, high))
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


def _state_json(state: State) -> dict[str, Any]:
    return {
        "name": state.name,
        "pair": state.pair,
        "path": state.path,
        "branch": state.branch,
        "shear": [state.low.shear, state.high.shear],
        "height": [state.low.height, state.high.height],
        "ends": [
            {"kind": e.kind, "number": e.number, "shear": e.shear, "height": e.height, "snap": e.snap}
            for e in (state.low, state.high)
        ],
    }


def _branch_json(b: SliceBranch) -> dict[str, Any]:
    branch = b.followed.branch
    return {
        "id": b.id,
        "points": len(branch),
        "symmetric": b.followed.symmetric,
        "pair": b.followed.pair,
        "closed": branch.closed,
        "end_reasons": [reason.name.lower() for reason in branch.ends],
        "special": [
            {
                "kind": e.kind,
                "number": e.number,
                "shear": e.special.solution["dD"],
                "height": e.special.solution["height"],
                "index": list(e.special.index),
                "criticality": e.criticality,
                "status": e.special.status.value,
            }
            for e in b.events
        ],
    }
