"""The phase diagram as a result: lines, faces, regions of stability, events; tables, JSON and file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.phase.arrangement import Rings, covers, united
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.regions import Face
from rodatlas.atlas.phase.settings import PhaseSettings

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/phase/1"
SHORT = 1e-6  # units: length of a side that is not listed
ON_SIDE = 1e-7  # units: distance of the middle of a polygon's side from the line that it is part of


@dataclass(frozen=True)
class Interval:
    """A stable state on a border of the plane where two mirror images of one another meet, as where clamps are level.

    Attributes
    ----------
    second : where the border is; low, high : the range of the state there.
    """

    second: float
    name: str
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Side:
    """A part of the boundary of a region: `label` of a locus, 'U|w' of a smooth change, or 'frame'; points (n, 2)."""

    label: str
    points: np.ndarray


@dataclass(frozen=True, eq=False)
class Region:
    """A connected part of the plane in which a state is stable.

    Attributes
    ----------
    state : its name.
    rings : outer boundary and holes, (n, 2) each: second control, and control along slices.
    sides : what bounds it, in order along the boundary.
    """

    state: str
    rings: Rings
    sides: tuple[Side, ...]

    @property
    def bounds(self) -> tuple[str, ...]:
        """Labels of the sides."""
        return tuple(label for label, _ in groupby(side.label for side in self.sides))

    def __repr__(self) -> str:
        (a0, d0), (a1, d1) = self.rings[0].min(axis=0), self.rings[0].max(axis=0)
        return f"Region({self.state}: {a0:.5g} to {a1:.5g}, {d0:.5g} to {d1:.5g}; bounded by {', '.join(self.bounds)})"


@dataclass(frozen=True, eq=False)
class PhaseDiagram:
    """A plane of two controls with its loci and regions; see :func:`rodatlas.atlas.compute_phase`.

    Attributes
    ----------
    lines : loci and curves of smooth changes of name.
    faces : the parts of the plane between them.
    edge : stable states on borders where a further symmetry holds, and slices have states of their own (S+-).
    events : special points, each once, in order of the second control.
    places : values of the second control of the slices that were used.
    completed : states that a slice had missed and that were followed into it from another, in words.
    warnings : what does not add up; empty when all is well.
    """

    settings: PhaseSettings
    lines: tuple[Line, ...]
    faces: tuple[Face, ...]
    edge: tuple[Interval, ...]
    events: tuple[PlaneEvent, ...]
    places: tuple[float, ...]
    completed: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    def __repr__(self) -> str:
        return (
            f"PhaseDiagram({len(self.lines)} lines, {len(self.faces)} faces, {len(self.events)} events; "
            f"stable: {', '.join(self.names)})"
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The states that are stable somewhere."""
        there = {n for f in self.faces for n in f.states or ()} | {i.name for i in self.edge}
        known = self.settings.nomenclature.names
        return (*(n for n in known if n in there), *sorted(n for n in there if n not in known))

    def stable_at(self, second: float, value: float) -> tuple[str, ...]:
        """Names of the stable states at a point, sorted; on a line those of one of its sides.

        Raises
        ------
        ValueError
            outside the range of the diagram, or in a face that was too thin to sample.
        """
        s = self.settings
        if not s.second_low <= second <= s.second_high:
            raise ValueError(f"{s.second}: expected one from {s.second_low:g} to {s.second_high:g}, got {second:g}")
        low, high = s.range_at(second)
        if not low <= value <= high:
            raise ValueError(f"{s.along}: expected one from {low:g} to {high:g}, got {value:g}")
        if on_edge := [i for i in self.edge if i.second == second]:
            return tuple(sorted(i.name for i in on_edge if i.low <= value <= i.high))
        face = next((f for f in self.faces if f.states is not None and covers(f.rings, second, value)), None)
        if face is None or face.states is None:
            raise ValueError(f"{s.along}: expected a point of a sampled face, got {value:g} at {s.second} {second:g}")
        return face.states

    def state_regions(self, name: str) -> tuple[Region, ...]:
        """The parts of the plane in which a state is stable, from small to large values of the second control.

        Raises
        ------
        ValueError
            for a name that no state has.
        """
        known = self.settings.nomenclature.names or self.names
        if name not in known:
            raise ValueError(f"name: expected one of {', '.join(known)}, got '{name}'")
        rings = united([f.rings for f in self.faces if name in (f.states or ())])
        return tuple(Region(name, r, tuple(side for ring in r for side in self._sides(ring))) for r in rings)

    def _sides(self, ring: np.ndarray) -> list[Side]:
        """A ring cut where one line takes the place of another."""
        import shapely

        middles = shapely.points(0.5 * (ring[1:] + ring[:-1]))
        distance = [shapely.distance(middles, shapely.LineString(line.points)) for line in self.lines]
        best = np.argmin(np.reshape(distance, (-1, len(middles))), axis=0) if distance else np.zeros(len(middles), int)
        near = ON_SIDE * self.settings.units[1]
        names = [
            self.lines[i].label if distance and distance[i][k] < near else "frame" for k, i in enumerate(best)
        ]  # fmt: skip
        starts = [k for k in range(len(names)) if names[k] != names[k - 1]]
        if not starts:
            return [Side(names[0], ring)]
        turned = np.concatenate([ring[starts[0] : -1], ring[: starts[0] + 1]])  # starts where a side starts
        at = [k - starts[0] for k in starts] + [len(names)]
        sides = [Side(names[k], turned[low : high + 1]) for k, (low, high) in zip(starts, pairwise(at), strict=True)]
        # Where lines meet, the nearest one is arbitrary for a length of round-off.
        short, scale = SHORT * self.settings.units[1], self.settings.second_scale
        return [s for s in sides if np.ptp(s.points, axis=0) @ [1 / scale, 1.0] > short]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.atlas.phase.store import save_phase

        save_phase(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> PhaseDiagram:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.atlas.phase.store import load_phase

        return load_phase(path)

    def to_frame(self, of: str = "events") -> Table:
        """A table with one row for each special point (`of='events'`), face (`'faces'`) or region (`'regions'`)."""
        from rodatlas.continuation.table import Table

        if of == "events":
            return Table([e.to_json(self.settings) for e in self.events])
        if of == "faces":
            return Table([_face_json(f) for f in self.faces]).drop(columns=["rings"])
        if of == "regions":
            return Table([_extent(r, self.settings) for name in self.names for r in self.state_regions(name)])
        raise ValueError(f"of: expected 'events', 'faces' or 'regions', got '{of}'")

    def to_json(self) -> dict[str, Any]:
        """The object that `rodatlas phase --json` prints."""
        s = self.settings
        second, along = s.second_control.key, s.along_control.key
        return {
            "schema": SCHEMA,
            **s.head_json(),
            f"{s.second}_range": [s.second_low, s.second_high],
            f"{s.along}_range": [s.low, s.high],
            "seconds": round(self.seconds, 3),
            "warnings": list(self.warnings),
            "slices": list(self.places),
            "completed": list(self.completed),
            "events": [e.to_json(s) for e in self.events],
            "lines": [{"label": x.label, "number": x.number, "kind": x.kind, "points": x.points.tolist()}
                      for x in self.lines],
            "faces": [_face_json(f) for f in self.faces],
            "regions": [_extent(r, s) | {"rings": [ring.tolist() for ring in r.rings]}
                        for name in self.names for r in self.state_regions(name)],
            "edge": [{"name": i.name, second: i.second, along: [i.low, i.high]} for i in self.edge],
        }  # fmt: skip


def _face_json(face: Face) -> dict[str, Any]:
    return {
        "states": None if face.states is None else list(face.states),
        "count": face.count,
        "names": None if face.states is None else len(set(face.states)),
        "samples": [list(p) for p in face.samples],
        "rings": [ring.tolist() for ring in face.rings],
    }


def _extent(region: Region, settings: PhaseSettings) -> dict[str, Any]:
    low, high = region.rings[0].min(axis=0), region.rings[0].max(axis=0)
    return {
        "state": region.state, settings.second_control.key: [low[0], high[0]],
        settings.along_control.key: [low[1], high[1]],
        "area": _area(region.rings), "bounds": list(region.bounds),
    }  # fmt: skip


def _area(rings: Iterable[np.ndarray]) -> float:
    """Area (product of both controls) of a polygon with holes, by the shoelace formula."""
    parts = [0.5 * abs(float(np.sum(r[:-1, 0] * r[1:, 1] - r[1:, 0] * r[:-1, 1]))) for r in rings]
    return parts[0] - sum(parts[1:])
