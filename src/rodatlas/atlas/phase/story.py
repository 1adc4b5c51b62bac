"""The special points of the plane told with the states and branches that slices near them have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, Roles, describe
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.result import Slice, SliceBranch
from rodatlas.continuation import Effect

TOUCH, DRIFT, MOST = 0.01, 0.02, 0.06  # distance from a special point within which a branch of a slice passes it, in
# units of value and response: at its place, more for each unit of the second control between, and at most


def told(
    events: Sequence[PlaneEvent], roles: Roles, slices: Sequence[Slice], settings: PhaseSettings
) -> tuple[PlaneEvent, ...]:
    """The events with descriptions from what the loci bound and from the slices next to each event.

    Parameters
    ----------
    slices : in order of the second control.
    """
    return tuple(
        replace(e, description=describe(e, roles, touching(e, slices, settings), turning(e, slices, settings)))
        for e in events
    )


def touching(event: PlaneEvent, slices: Sequence[Slice], settings: PhaseSettings) -> tuple[str, str] | None:
    """Names of the two branches that come together where two folds are born or annihilate.

    They are seen on the side where the folds do not exist: each branch is named after its nearest stable state.
    """
    if event.parameter != settings.second or event.effect != Effect.TOUCH.name:
        return None
    side = [s for s in slices if (s.settings.setting[settings.second] < event.second) == event.above]
    if not side:
        return None
    near = min(side, key=lambda s: abs(s.settings.setting[settings.second] - event.second))
    like = [b for b in near.branches if b.followed.symmetric == event.symmetric]
    passes = sorted(p for b in like for p in _passes(b, event, near, settings))
    apart = abs(near.settings.setting[settings.second] - event.second) / settings.units[0]
    reach = min(TOUCH + DRIFT * apart, MOST)
    names = [name for distance, name in passes if distance < reach]
    return (names[0], names[1]) if len(names) > 1 else None


def turning(event: PlaneEvent, slices: Sequence[Slice], settings: PhaseSettings) -> str:
    """'sub' or 'super', what a numbered pitchfork is at the next slice above a change; '' if that is not known."""
    numbers = [int(n) for n in event.passing if n.isdigit()]
    if event.kind != "criticality" or not numbers:
        return ""
    kinds: dict[bool, str] = {}
    for one in sorted(slices, key=lambda s: -abs(s.settings.setting[settings.second] - event.second)):
        for e in (e for b in one.branches for e in b.events):
            if e.number == numbers[0] and e.criticality:
                kinds[one.settings.setting[settings.second] > event.second] = e.criticality
    return kinds[True] if set(kinds) == {True, False} and kinds[True] != kinds[False] else ""


def _passes(b: SliceBranch, event: PlaneEvent, one: Slice, settings: PhaseSettings) -> list[tuple[float, str]]:
    """Distance in units and name for each time that a branch comes nearest to a special point."""
    points = np.array([settings.point(p.solution)[1:] for p in b.followed.branch.points]) / settings.units[1:]
    distance = np.linalg.norm(points - np.array([event.value, event.response]) / settings.units[1:], axis=1)
    padded = np.concatenate([[np.inf], distance, [np.inf]])
    nearest = np.flatnonzero((distance < padded[:-2]) & (distance <= padded[2:]))
    return [(float(distance[i]), _name(b, points[i], one, settings)) for i in nearest]


def _name(b: SliceBranch, place: np.ndarray, one: Slice, settings: PhaseSettings) -> str:
    """Name of the stable stretch of a branch that is nearest to a place on it, 'U-w' say."""
    states = [s for s in one.states if s.branch == b.id]
    if not states:
        return "unstable"
    ends = {
        s.path: min(
            float(np.linalg.norm(np.array(settings.point(x)[1:]) / settings.units[1:] - place)) for x in s.solutions
        ) for s in states
    }  # fmt: skip
    return min(ends, key=lambda path: ends[path])
