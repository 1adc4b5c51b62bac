"""Curves along which a stable state changes its name without a bifurcation: U becomes w, w becomes uUui."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, Roles, joined_states
from rodatlas.atlas.phase.arrangement import Frame
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.slices.match import FREE
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.states.names import middle_curvature

STEP = 2.0  # degrees between two points of such a curve at most
REACH = 0.02  # shear within which the change lies at the next angle
PARTS = 10  # of this range, for a first look at the depth of the dimple
TOLERANCE = 1e-8
NOT_FOUND = 1e3  # far above any curvature; not infinite, for the sake of interpolating minimizers
PRECISE = 1e-7  # shear to which a change is solved for


@dataclass(frozen=True)
class _Place:
    """A change at one angle (degrees)."""

    angle: float
    solution: Solution

    @property
    def point(self) -> tuple[float, float]:
        return self.angle, self.solution["dD"]


def change_lines(
    slices: Sequence[Slice], events: Sequence[PlaneEvent], roles: Roles, frame: Frame
) -> tuple[list[Line], list[str]]:
    """The curves of smooth changes of name that slices meet, and warnings.

    Such a curve ends on the frame, or where the two states first join at a bifurcation: there a line of constant angle
    goes on to that special point, since on its other side the whole range has one name.

    Parameters
    ----------
    slices : in order of angle.
    events, roles : special points of the loci, and what the loci bound.
    """
    found: dict[tuple[str, str], list[_Place]] = {}
    for one in slices:
        for before, after in _changes(one):
            found.setdefault((before.name, after.name), []).append(
                _Place(one.settings.angle_deg, before.high.solution)
            )  # fmt: skip
    lines, warnings = [], []
    angles = [s.settings.angle_deg for s in slices]
    for names, places in found.items():
        for chain in _chains(places, angles):
            line, missing = _line(names, chain, angles, events, roles, frame)
            lines.append(line)
            warnings += missing
    return lines, warnings


def _changes(one: Slice) -> list[tuple[State, State]]:
    """Neighbors on a stable stretch of a slice, the one of smaller shear first."""
    smooth = [s for s in one.states if "smooth" in (s.low.kind, s.high.kind)]
    return [
        (a, b) for a in smooth for b in smooth
        if a.branch == b.branch and a.high.kind == b.low.kind == "smooth" and abs(a.high.shear - b.low.shear) < 1e-9
    ]  # fmt: skip


def _chains(places: Sequence[_Place], angles: Sequence[float]) -> list[list[_Place]]:
    """Places of one kind at successive slices."""
    chains: list[list[_Place]] = []
    for place in sorted(places, key=lambda p: p.angle):
        at = angles.index(place.angle)
        if chains and angles.index(chains[-1][-1].angle) == at - 1:
            chains[-1].append(place)
        else:
            chains.append([place])
    return chains


def _line(
    names: tuple[str, str], chain: list[_Place], angles: Sequence[float], events: Sequence[PlaneEvent], roles: Roles,
    frame: Frame,
) -> tuple[Line, list[str]]:  # fmt: skip
    """One curve, solved for between the slices and up to its ends."""
    place_at = _solver(names)
    points = [p.point for p in chain]
    for one, two in pairwise(chain):
        points += [p.point for p in _march(place_at, one, two.angle)[:-1]]
    warnings = []
    tails = []
    for side, end in ((-1, chain[0]), (1, chain[-1])):
        at = angles.index(end.angle) + side
        beyond = angles[at] if 0 <= at < len(angles) else frame[0 if side < 0 else 1]
        target, event = beyond, None
        if 0 <= at < len(angles):
            event = _joint(names, events, roles, *sorted((end.angle, beyond)))
            if event is None:
                warnings.append(
                    f"change of {names[0]} to {names[1]}: it ends between {end.angle:g} and {beyond:g} deg, "
                    "where no locus of either does"
                )  # fmt: skip
                continue
            target = event.angle_deg
        path = _march(place_at, end, target)
        if not path or path[-1].angle != target:
            warnings.append(f"change of {names[0]} to {names[1]}: not found from {end.angle:g} to {target:g} deg")
        points += [p.point for p in path]
        if event is not None and path:
            tails.append((side, (event.angle_deg, event.shear)))
    curve = np.array(sorted(set(points)))
    for side, tail in tails:
        curve = np.vstack([[tail], curve] if side < 0 else [curve, [tail]])
    return Line("|".join(names), "smooth", curve), warnings


def _joint(
    names: tuple[str, str], events: Sequence[PlaneEvent], roles: Roles, low: float, high: float
) -> PlaneEvent | None:
    """The special point between two angles at which two states join."""
    inside = [e for e in events if low < e.angle_deg < high and e.parameter != "shear"]
    return next((e for e in inside if joined_states(e, roles) == names), None)


def _march(place_at: Callable[[_Place, float], _Place | None], start: _Place, target: float) -> list[_Place]:
    """The change at angles from a known one up to a target, as far as it is found."""
    count = max(1, math.ceil(abs(target - start.angle) / STEP))
    found: list[_Place] = []
    for angle in np.linspace(start.angle, target, count + 1)[1:]:
        place = place_at(found[-1] if found else start, float(angle))
        if place is None:
            break
        found.append(place)
    return found


def _solver(names: tuple[str, str]) -> Callable[[_Place, float], _Place | None]:
    """How a change is found at an angle: w becomes uUui where the dimple is deepest, U becomes w where k1(1/2) = 0."""

    def place_at(near: _Place, angle: float) -> _Place | None:
        bend = _Bend(near.solution, math.radians(angle))
        shear = (_deepest if names[0] == "w" else _straight)(bend, near.solution["dD"])
        if shear is None or bend(shear) >= NOT_FOUND:
            return None
        return _Place(angle, bend.last)

    return place_at


def _straight(bend: _Bend, near: float) -> float | None:
    """The shear at which the middle is straight."""
    from scipy.optimize import brentq

    low, high = near - REACH, near + REACH
    ends = bend(low), bend(high)
    good = ends[0] * ends[1] < 0 and max(ends) < NOT_FOUND
    return brentq(bend, low, high, xtol=PRECISE) if good else None


def _deepest(bend: _Bend, near: float) -> float | None:
    """The shear at which the dimple is deepest, looked for downward: close below it may lie the cusp of 6."""
    from scipy.optimize import minimize_scalar

    step = REACH / PARTS
    values = [bend(near + REACH)]
    while values[-1] == min(values) and len(values) <= 2 * PARTS:
        values.append(bend(near + REACH - len(values) * step))
    last = near + REACH - (len(values) - 1) * step
    if len(values) < 3 or values[-1] == min(values):
        return None
    options = {"xatol": PRECISE}
    return float(minimize_scalar(bend, bounds=(last, last + 2 * step), method="bounded", options=options).x)


class _Bend:
    """k1(1/2) of a state as a function of the shear at one angle, `NOT_FOUND` where there is none.

    `last` is the last state that was.
    """

    def __init__(self, near: Solution, angle: float):
        self.last = near.with_parameters(psi0=angle)
        self._known: list[Solution] = []
        self._options = TraceOptions(mesh=MeshControl(tolerance=TOLERANCE))

    def __call__(self, shear: float) -> float:
        guess = min(self._known, key=lambda s: abs(s["dD"] - shear), default=self.last)
        try:
            self.last = solve(rod_problem(), guess.with_parameters(dD=shear), FREE, self._options)
        except NotConverged:
            return NOT_FOUND
        self._known.append(self.last)
        return middle_curvature(self.last)
