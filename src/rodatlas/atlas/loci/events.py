"""The special points of all loci, each once: merged where several loci see the same one, and described in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from rodatlas.atlas.loci.result import Piece
from rodatlas.atlas.loci.settings import PlaneSettings
from rodatlas.atlas.loci.stretches import SAME, same_place
from rodatlas.continuation import Effect, LocusEvent
from rodatlas.model.orbit import is_alone

RANK = ("criticality", "coalescence", "crossing", "cusp", "extremum")  # what a point is that is several of these
ON_MIRROR = 1e-6  # units: nearer to zero a locus meets its image, where a mirror turns the sign of what varies


class Role(NamedTuple):
    """A locus bounds the range of a stable state: its name, and which end."""

    state: str
    side: str  # 'low' or 'high'


Roles = Mapping[str, frozenset[Role]]
"""Label of a locus -> what it bounds."""


@dataclass(frozen=True)
class PlaneEvent:
    """A special point in the plane of two controls.

    Attributes
    ----------
    kind : 'cusp', 'extremum', 'criticality', 'coalescence' or 'crossing', as of a
        :class:`rodatlas.continuation.LocusEvent`.
    parameter : the control that is extreme, of an extremum, else ''.
    second, value, response : where it is: second control, control along slices, and quantity.
    ending : labels of the loci that end there, all on the side `above`, in order of their values near by.
    passing : labels of those that go through.
    above : whether the loci that end there exist at larger values of the second control.
    mirrored : whether loci meet their own images there.
    size : 'largest' or 'smallest', where the control along slices is extreme.
    effect : name of the :class:`rodatlas.continuation.Effect` on branches, '' where there is none.
    status : 'converged', or 'bracketed' when it is known to the bracket only.
    symmetric : whether the solution there equals its reversal.
    what : what happens to the solutions, in the words of the engine.
    description : what happens to the states, in words.
    """

    kind: str
    parameter: str
    second: float
    value: float
    response: float
    ending: tuple[str, ...]
    passing: tuple[str, ...]
    above: bool
    status: str
    symmetric: bool
    what: str
    description: str = ""
    kinds: Mapping[str, str] = field(default_factory=dict, repr=False)  # label -> kind of locus
    mirrored: bool = False
    size: str = ""
    effect: str = ""

    @property
    def labels(self) -> tuple[str, ...]:
        """All loci that it belongs to."""
        return tuple(sorted({*self.ending, *self.passing}, key=_order))

    def holds(self, place: Sequence[float], settings: PlaneSettings) -> bool:
        """Whether a special point of one locus is this one."""
        return settings.near((self.second, self.value, self.response), place, SAME)

    def to_json(self, settings: PlaneSettings) -> dict[str, Any]:
        """As plain values."""
        return {
            "kind": self.kind, "parameter": self.parameter, settings.second_control.key: self.second,
            settings.along_control.key: self.value, settings.against: self.response, "loci": list(self.labels),
            "status": self.status, "description": self.description,
        }  # fmt: skip


def labels(pieces: Sequence[Piece], settings: PlaneSettings) -> list[str]:
    """A short name for each piece: its number, or for one without the number of the nearest on its curve and a prime.

    What shrinks to a point, between two turns at one place, has the name ''.
    """
    found: list[str] = []
    for i, piece in enumerate(pieces):
        if piece.number is not None:
            found.append(str(piece.number))
            continue
        known = [(abs(k - i), k) for k, p in enumerate(pieces) if p.curve == piece.curve and p.number is not None]
        name = f"{pieces[min(known)[1]].number}'" if known else f"c{piece.curve}'"
        while name in found:
            name += "'"
        found.append(name if np.ptp(piece.span) > SAME * settings.units[0] else "")
    return found


def plane_events(
    pieces: Sequence[Piece], settings: PlaneSettings, roles: Mapping[int, frozenset[tuple[str, str]]]
) -> tuple[PlaneEvent, ...]:
    """The special points of pieces of loci, each once, in order of both controls, with descriptions.

    Parameters
    ----------
    roles : what numbered loci bound.
    """
    names = labels(pieces, settings)
    by_label = {str(number): frozenset(Role(*role) for role in some) for number, some in roles.items()}
    groups: list[list[tuple[int, LocusEvent]]] = []
    for i, piece in enumerate(pieces):
        for event in piece.own if names[i] else ():
            home = next((g for g in groups if same_place(g[0][1], event, settings)), None)
            if home is None:
                groups.append([(i, event)])
            else:
                home.append((i, event))
    events = [_merged(group, pieces, names, settings) for group in groups]
    events.sort(key=lambda e: (round(e.second, 6), e.value))
    return tuple(replace(e, description=describe(e, by_label)) for e in events)


def _merged(
    group: Sequence[tuple[int, LocusEvent]], pieces: Sequence[Piece], names: Sequence[str], settings: PlaneSettings
) -> PlaneEvent:
    best = min((e for _, e in group), key=lambda e: (RANK.index(e.kind), e.status.value != "converged"))
    place = settings.point(best)
    ending = [i for i in dict.fromkeys(i for i, _ in group) if _ends_at(pieces[i], place, settings)]
    passing = {names[i] for i, _ in group if i not in ending}
    above = any(2 * place[0] < sum(pieces[i].span) for i in ending)
    parameter = settings.control_of(best.parameter) if best.kind == "extremum" else ""
    along = parameter == settings.along
    what = best.what if not along else f"at fixed {settings.along}, {best.what}"
    size = ("largest" if _is_highest(pieces[group[0][0]], place) else "smallest") if along else ""
    kinds = {names[i]: pieces[i].kind for i, _ in group}
    return PlaneEvent(
        best.kind, parameter, *place, tuple(names[i] for i in _upward(pieces, ending)),
        tuple(sorted(passing, key=_order)), above, best.status.value,
        is_alone(settings.model, best.solution), what, "", kinds,
        settings.mirrored and abs(place[1]) < ON_MIRROR * settings.units[1],
        size, best.effect.name if best.effect is not None else "",
    )  # fmt: skip


def _ends_at(piece: Piece, place: Sequence[float], settings: PlaneSettings) -> bool:
    """Whether a special point is at an end of a piece."""
    return any(settings.near(end, place, SAME) for end in (piece.places[0], piece.places[-1]))


def _upward(pieces: Sequence[Piece], ending: Sequence[int]) -> list[int]:
    """Pieces that end at one point, in order of their values near by."""
    low = max((pieces[i].span[0] for i in ending), default=0.0)
    high = min((pieces[i].span[1] for i in ending), default=0.0)
    return sorted(ending, key=lambda i: pieces[i].at(0.5 * (low + high))[0]) if high > low else list(ending)


def _is_highest(piece: Piece, place: Sequence[float]) -> bool:
    """Whether the value of a locus is largest, not smallest, at an extremum inside."""
    near = np.argsort(np.abs(piece.places[:, 0] - place[0]))[:3]
    return float(np.mean(piece.places[near, 1])) < place[1]


def _order(label: str) -> tuple[int, str]:
    number = label.rstrip("'")
    return (int(number) if number.isdigit() else 99, label)


def describe(event: PlaneEvent, roles: Roles, touching: tuple[str, str] | None = None, turns: str = "") -> str:
    """What happens at a special point, in words.

    Parameters
    ----------
    roles : which states the loci bound.
    touching : names of the two branches that touch, where folds are born so.
    turns : 'sub' or 'super', what a pitchfork becomes as the second control grows, if it is known otherwise.
    """
    if event.kind == "criticality":
        return _criticality(event, roles, turns)
    if event.kind == "coalescence":
        folds = [n for n in event.labels if event.kinds[n] == "fold"]
        others = [n for n in event.labels if event.kinds[n] != "fold"]
        if not folds:
            return f"{_kind(event, others)} {_list(others)} passes a fold without a number"
        other = f"{_kind(event, others)} {_list(others)}" if others else "a branch point without a number"
        return f"fold {_list(folds)} passes {other}"
    if event.kind == "crossing":
        return f"{_kind(event, event.labels)} {_list(event.labels)} meets another branch point"
    if event.size:
        return f"{_kind(event, event.labels)} {_list(event.labels)} reaches its {event.size} {event.parameter}"
    return _meeting(event, roles, touching)


def _meeting(event: PlaneEvent, roles: Roles, touching: tuple[str, str] | None) -> str:
    """Two loci that end at one point: a cusp, or where they turn back."""
    fold = all(event.kinds[n] == "fold" for n in event.ending)
    images = [n for n in event.ending if n.endswith("'")] if event.mirrored else []
    named = [n for n in event.ending if n not in images]
    meet = f"{_kind(event, event.ending)}s {_list(named)}"
    if images:
        meet = f"{_kind(event, named)} {_list(named)} and its mirror image"
    told = f"{meet} {'are born' if event.above else 'annihilate'}{' in a cusp' if event.kind == 'cusp' else ''}"
    if event.kind == "cusp" and event.above:
        told = f"{meet} meet in a cusp"
    lone = _lone(event, roles, mirrored=bool(images))
    if lone and fold:
        return f"{lone} {'is born' if event.above else 'vanishes'}: {told}"
    if lone:
        return f"{lone} {'becomes stable' if event.above else 'is no longer stable'}: {told}"
    if fold and event.kind == "extremum":
        if event.effect in (Effect.APPEARS.name, Effect.VANISHES.name):
            return f"a closed branch {'appears' if event.above else 'vanishes'}: {told}"
        pair = "two branches touch"
        if touching:
            other = "itself" if touching[0] == touching[1] else f"the {touching[1]} branch"
            pair = f"the {touching[0]} branch touches {other}"
        return f"{pair}: {told}"
    joined = joined_states(event, roles)
    if joined:
        return f"{joined[0]} {'separates from' if event.above else 'joins'} {joined[1]}: {told}"
    return told


def _lone(event: PlaneEvent, roles: Roles, mirrored: bool) -> str:
    """The state whose range shrinks to a point: it lies between the two loci that meet."""
    bounds = [roles.get(n, frozenset()) for n in event.ending]
    if mirrored:
        return min((a.state for bound in bounds for a in bound), default="")
    if len(bounds) != 2:
        return ""
    return next((a.state for a in sorted(bounds[0]) if a.side == "low" and Role(a.state, "high") in bounds[1]), "")


def joined_states(event: PlaneEvent, roles: Roles) -> tuple[str, str] | None:
    """Two states of which one ends and the other starts at the loci that meet."""
    bounds = [roles.get(n, frozenset()) for n in event.ending]
    if len(bounds) != 2:
        return None
    for one, two in (bounds, bounds[::-1]):
        highs = [a.state for a in sorted(one) if a.side == "high"]
        lows = [a.state for a in sorted(two) if a.side == "low"]
        if highs and lows:
            return highs[0], lows[0]
    return None


def _criticality(event: PlaneEvent, roles: Roles, turns: str) -> str:
    """A pitchfork that turns super- or subcritical, and the fold that is born or vanishes there."""
    pitchforks = [n for n in event.labels if event.kinds[n] != "fold"]
    folds = [n for n in event.ending if event.kinds[n] == "fold"]
    name = f"pitchfork {_list(pitchforks)}" if pitchforks else "a pitchfork without a number"
    if folds and pitchforks:
        pair, base = (roles.get(n[0], frozenset()) for n in (folds, pitchforks))
        sides = {a.side == b.side for a in pair for b in base if not b.state.endswith("+-")}
        # Where the fold exists, the pair starts at the pitchfork if it has the fold at the end at which its base has
        # the pitchfork: it is supercritical there. Otherwise the pair reaches back over its base: subcritical.
        if len(sides) == 1:
            turns = "super" if sides == {event.above} else "sub"
    told = f"{name} turns {turns}critical" if turns else f"{name} changes between super- and subcritical"
    if not folds:
        return told
    states = sorted({a.state for a in roles.get(folds[0], frozenset())})
    of = f" ({', '.join(states)})" if states else ""
    return f"{told}: fold {_list(folds)}{of} {'is born' if event.above else 'vanishes'}"


def _kind(event: PlaneEvent, among: Sequence[str]) -> str:
    kinds = {event.kinds[n] for n in among}
    return kinds.pop() if len(kinds) == 1 else "branch point"


def _list(names: Sequence[str]) -> str:
    return " and ".join(sorted(names, key=_order))
