"""Which stable states live in each face of the plane, from the slices that pass through it, and what contradicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, Role
from rodatlas.atlas.phase.arrangement import Rings, chords, extent
from rodatlas.atlas.phase.complete import Completion, stable_names
from rodatlas.atlas.phase.cover import THIN
from rodatlas.atlas.phase.lines import Line, Place, label_at
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.result import Slice

INSIDE = 2e-5  # units: a state that ends further inside a face than this contradicts the face
AT_LINE = 1e-6  # units within which a side of a face is a line
PAIR = "+-"


@dataclass(frozen=True, eq=False)
class Face:
    """A part of the plane in which the same stable states exist everywhere.

    Attributes
    ----------
    rings : outer boundary and holes, (n, 2) each: second control, and control along slices.
    states : names of the stable states, each as often as there are such states; None when they are not known.
    samples : (second, value) of the points at which that was found; none in a face so thin that it follows from its
        neighbors.
    """

    rings: Rings
    states: tuple[str, ...] | None
    samples: tuple[tuple[float, float], ...]

    @property
    def count(self) -> int | None:
        """Number of stable states, both members of a pair counted."""
        return None if self.states is None else sum(2 if name.endswith(PAIR) else 1 for name in self.states)

    def __repr__(self) -> str:
        states = ", ".join(self.states) if self.states is not None else "not sampled"
        return f"Face({states}: {len(self.samples)} samples, {len(self.rings[0])} vertices)"


@dataclass(frozen=True)
class Crossing:
    """What changes across a line on a slice, from smaller to larger values."""

    label: str
    kind: str
    second: float
    value: float
    lost: tuple[str, ...]
    gained: tuple[str, ...]

    @property
    def allowed(self) -> bool:
        """Whether a locus of this kind can do that.

        At a fold one state appears or ends. At a pitchfork a symmetric state gains or loses stability, alone or in
        exchange for a pair. Along a smooth change of name one state takes the place of another.
        """
        if self.kind == "smooth":
            return len(self.lost) == len(self.gained) == 1
        if self.kind == "fold":
            return len(self.lost) + len(self.gained) <= 1
        if self.kind == "pitchfork":
            single = [n for n in (*self.lost, *self.gained) if not n.endswith(PAIR)]
            pairs = [n for n in (*self.lost, *self.gained) if n.endswith(PAIR)]
            exchanged = not pairs or bool(self.lost) == bool(self.gained)
            return len(single) <= 1 and len(pairs) <= len(single) and exchanged
        return not self.lost and not self.gained

    def __repr__(self) -> str:
        changes = [*(f"-{n}" for n in self.lost), *(f"+{n}" for n in self.gained)]
        return f"Crossing({self.kind} {self.label} at {self.second:g}, {self.value:.6g}: {' '.join(changes)})"


def assign(
    rings: Sequence[Rings], slices: Sequence[Slice], settings: PhaseSettings, completions: Sequence[Completion] = ()
) -> tuple[list[Face], list[str]]:
    """The faces with their states, and warnings where slices contradict each other or end a state inside a face."""
    faces, warnings = [], []
    for ring in rings:
        found: dict[tuple[float, float], tuple[str, ...]] = {}
        for one in slices:
            second = one.settings.setting[settings.second]
            for low, high in chords(ring, second):
                if high - low < THIN * settings.units[1]:
                    continue
                middle = 0.5 * (low + high)
                found[second, middle] = stable_names(one, middle, settings, completions)
                warnings += _ends_inside(one, low, high, settings)
        kinds = set(found.values())
        if len(kinds) > 1:
            seen = "; ".join(f"({a:g}, {d:.5g}): {', '.join(n)}" for (a, d), n in found.items())
            warnings.append(f"face with different stable states: {seen}")
        faces.append(Face(ring, next(iter(kinds)) if len(kinds) == 1 else None, tuple(found)))
    return faces, warnings


def _ends_inside(one: Slice, low: float, high: float, settings: PhaseSettings) -> list[str]:
    """A warning for each stable state of a slice that ends between two values."""
    where, inside = f"slice at {one.settings.place_text}", INSIDE * settings.units[1]
    return [
        f"{where}: {state.name} ends at {settings.along} {end.value:.6g} ({end.text}), inside a face"
        for state in one.states for end in (state.low, state.high)
        if end.kind != "range" and low + inside < end.value < high - inside
    ]  # fmt: skip


def crossings(
    rings: Sequence[Rings], lines: Sequence[Line], slices: Sequence[Slice], settings: PhaseSettings,
    completions: Sequence[Completion] = (),
) -> list[Crossing]:  # fmt: skip
    """What changes across the lines on the slices; places where several lines meet are left out."""
    found = []
    for one in slices:
        second = one.settings.setting[settings.second]
        spans = sorted(span for ring in rings for span in chords(ring, second))
        for (low, at), (_, high) in pairwise(spans):
            here = _lines_at(lines, second, at, settings)
            if len(here) != 1 or min(at - low, high - at) < THIN * settings.units[1]:
                continue
            below, above = (
                Counter(stable_names(one, 0.5 * (at + end), settings, completions)) for end in (low, high)
            )  # fmt: skip
            lost, gained = (tuple(sorted(x.elements())) for x in (below - above, above - below))
            found.append(Crossing(here[0].label, here[0].kind, second, at, lost, gained))
    return found


def _lines_at(lines: Sequence[Line], second: float, value: float, settings: PhaseSettings) -> list[Line]:
    """The lines that pass a point."""
    return [x for x in lines if abs(_value_of(x, second) - value) < AT_LINE * settings.units[1]]


def deduced(
    faces: Sequence[Face], lines: Sequence[Line], found: Sequence[Crossing], events: Sequence[PlaneEvent],
    settings: PhaseSettings,
) -> list[Face]:  # fmt: skip
    """The faces, those too thin to be sampled with the states of a neighbor from which an idle line parts them.

    A line is idle from one special point to the next if slices saw that nothing changes across it there. A face with
    no such side stays without states.
    """
    out, near = list(faces), AT_LINE * settings.units[1]
    for i in [k for k, f in enumerate(faces) if not f.samples] * 2:  # twice: one may follow from another
        second, spans = _widest(out[i].rings)
        beside: dict[tuple[str, ...], float] = {}
        for at in (d for span in spans for d in span):
            here = [x.label for x in _lines_at(lines, second, at, settings)]
            if here and all(_idle(label, second, found, events, settings) for label in here):
                beside |= {
                    f.states: at for k, f in enumerate(out) if k != i and f.states is not None
                    and any(abs(d - at) < near for span in chords(f.rings, second) for d in span)
                }  # fmt: skip
        if len(beside) == 1:
            out[i] = replace(out[i], states=next(iter(beside)))
    return out


def _widest(rings: Rings) -> tuple[float, list[tuple[float, float]]]:
    """A value of the second control at which a face is wide, and its intervals there."""
    low, high = extent(rings)
    trials = [(float(a), chords(rings, float(a))) for a in np.linspace(low, high, 19)[1:-1]]
    return max(trials, key=lambda t: max((b - a for a, b in t[1]), default=0.0))


def _idle(
    label: str, second: float, found: Sequence[Crossing], events: Sequence[PlaneEvent], settings: PhaseSettings
) -> bool:
    """Whether slices saw that nothing changes across a line between the special points around a place."""
    special = [e.second for e in events if label in e.labels and e.parameter != settings.along]
    low = max((a for a in special if a <= second), default=-np.inf)
    high = min((a for a in special if a > second), default=np.inf)
    seen = [c for c in found if c.label == label and low < c.second < high]
    return bool(seen) and not any(c.lost or c.gained for c in seen)


def _value_of(line: Line, second: float) -> float:
    if not line.points[0, 0] <= second <= line.points[-1, 0]:
        return float("nan")
    return float(np.interp(second, line.points[:, 0], line.points[:, 1]))


def check_crossings(found: Sequence[Crossing], events: Sequence[PlaneEvent]) -> list[str]:
    """Warnings for lines that do what their kind cannot, or that change what they do without a special point."""
    warnings = [f"{c!r} is more than a {c.kind} can do" for c in found if not c.allowed]
    for label in dict.fromkeys(c.label for c in found):
        along = sorted((c for c in found if c.label == label), key=lambda c: c.second)
        for one, two in pairwise(along):
            special = [e for e in events if label in e.labels and one.second < e.second < two.second]
            if (one.lost, one.gained) != (two.lost, two.gained) and not special and one.kind != "smooth":
                warnings.append(f"without a special point between: {one!r}, {two!r}")
    return warnings


def roles_of(
    places: Sequence[Place], slices: Sequence[Slice], settings: PhaseSettings
) -> tuple[dict[str, frozenset[Role]], list[str]]:
    """What each locus bounds, from the ends of the stable states of slices, and warnings for ends on no locus."""
    found: dict[str, set[Role]] = {}
    warnings = []
    for one in slices:
        for state in one.states:
            for side, end in (("low", state.low), ("high", state.high)):
                if end.kind in ("range", "smooth"):
                    continue
                label = label_at(places, end.kind, end.solution, settings)
                if label:
                    name = settings.nomenclature.in_plane(state.name)
                    found.setdefault(label, set()).add(Role(name, side))
                else:
                    warnings.append(f"slice at {one.settings.place_text}: {state.name} ends at {settings.along} "
                                    f"{end.value:.6g} ({end.text}), on no locus")  # fmt: skip
    return {label: frozenset(roles) for label, roles in found.items()}, warnings
