"""The special points of the plane told with the states and branches that slices near them have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, Roles, describe
from rodatlas.atlas.slices.result import Slice, SliceBranch

TOUCH, DRIFT, MOST = 0.01, 0.02, 0.06  # distance in shear and height from a special point within which a branch of a
# slice passes it: at its angle, more for each degree between, and at most


def told(events: Sequence[PlaneEvent], roles: Roles, slices: Sequence[Slice]) -> tuple[PlaneEvent, ...]:
    """The events with descriptions from what the loci bound and from the slices at the angles next to each event.

    Parameters
    ----------
    slices : in order of angle.
    """
    return tuple(replace(e, description=describe(e, roles, touching(e, slices), turning(e, slices))) for e in events)


def touching(event: PlaneEvent, slices: Sequence[Slice]) -> tuple[str, str] | None:
    """Names of the two branches that come together where two folds are born or annihilate.

    They are seen on the side where the folds do not exist: each branch is named after its nearest stable state.
    """
    if event.kind != "extremum" or event.parameter != "angle" or not event.what.startswith("two branches"):
        return None
    side = [s for s in slices if (s.settings.angle_deg < event.angle_deg) == event.above]
    if not side:
        return None
    near = min(side, key=lambda s: abs(s.settings.angle_deg - event.angle_deg))
    like = [b for b in near.branches if b.followed.symmetric == event.symmetric]
    passes = sorted(p for b in like for p in _passes(b, event, near))
    reach = min(TOUCH + DRIFT * abs(near.settings.angle_deg - event.angle_deg), MOST)
    names = [name for distance, name in passes if distance < reach]
    return (names[0], names[1]) if len(names) > 1 else None


def turning(event: PlaneEvent, slices: Sequence[Slice]) -> str:
    """'sub' or 'super', what a numbered pitchfork is at the next slice above a change; '' if that is not known."""
    numbers = [int(n) for n in event.passing if n.isdigit()]
    if event.kind != "criticality" or not numbers:
        return ""
    kinds: dict[bool, str] = {}
    for one in sorted(slices, key=lambda s: -abs(s.settings.angle_deg - event.angle_deg)):
        for e in (e for b in one.branches for e in b.events):
            if e.number == numbers[0] and e.criticality:
                kinds[one.settings.angle_deg > event.angle_deg] = e.criticality
    return kinds[True] if set(kinds) == {True, False} and kinds[True] != kinds[False] else ""


def _passes(b: SliceBranch, event: PlaneEvent, one: Slice) -> list[tuple[float, str]]:
    """Distance and name for each time that a branch comes nearest to a special point."""
    points = np.array([[p.solution["dD"], p.solution["height"]] for p in b.followed.branch.points])
    distance = np.linalg.norm(points - [event.shear, event.height], axis=1)
    padded = np.concatenate([[np.inf], distance, [np.inf]])
    nearest = np.flatnonzero((distance < padded[:-2]) & (distance <= padded[2:]))
    return [(float(distance[i]), _name(b, points[i], one)) for i in nearest]


def _name(b: SliceBranch, place: np.ndarray, one: Slice) -> str:
    """Name of the stable stretch of a branch that is nearest to a place on it, 'U-w' say."""
    states = [s for s in one.states if s.branch == b.id]
    if not states:
        return "unstable"
    ends = {
        s.path: min(float(np.hypot(*(np.array([x["dD"], x["height"]]) - place))) for x in s.solutions) for s in states
    }
    return min(ends, key=lambda path: ends[path])
