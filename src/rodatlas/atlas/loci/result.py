"""Loci of numbered bifurcations in the plane of clamp angle and shear, as a result: tables, JSON and file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas import __version__
from rodatlas.atlas.slices.settings import ALGORITHM as SLICES
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Locus, LocusEvent, LocusPoint, Solution
from rodatlas.rods.band import check_between, check_number, limiting_shear, near_limit

if TYPE_CHECKING:
    from rodatlas.atlas.loci.events import PlaneEvent
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/loci/1"
ALGORITHM = 1  # raised with every change of the program after which loci hold something else
KNOWN = tuple(range(19))
"""The paper's numbers of bifurcations."""
REFERENCE_SHEARS = (-0.1, 0.86)  # range at compression 1/2; the same parts of the limiting shear at others


@dataclass(frozen=True)
class LociSettings:
    """Loci of the bifurcations of a band; angle and shear vary, all else is fixed.

    Attributes
    ----------
    compression, poisson, tolerance : as for a slice.
    angle_max : largest clamp angle in degrees; the smallest is zero.
    """

    compression: float = 0.5
    poisson: float = 0.25
    angle_max: float = 80.0
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        check_between("compression", self.compression, 0.0, 1.0, "a number between 0 and 1 (exclusive)")
        check_number("angle-max", self.angle_max, 15.0, 89.999999, "degrees with 15 <= angle-max < 90")
        self.slice_at(15.0)  # checks the others

    def slice_at(self, angle_deg: float) -> SliceSettings:
        """Settings of a slice of the same band."""
        return SliceSettings(angle_deg, self.compression, self.poisson, tolerance=self.tolerance)

    @property
    def shears(self) -> tuple[float, float]:
        """Range of shear: from -0.1 to 0.86 at dL = 1/2."""
        part = limiting_shear(self.compression) / limiting_shear(0.5)
        return REFERENCE_SHEARS[0] * part, REFERENCE_SHEARS[1] * part

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values: fields, range of shear, program and algorithms."""
        algorithm = f"{ALGORITHM}, slices {SLICES}"
        return {"rodatlas": __version__, "algorithm": algorithm, **asdict(self), "shears": list(self.shears)}

    def identity_of(self, numbers: Sequence[int]) -> dict[str, object]:
        """As :meth:`identity`, of some loci only."""
        some = {} if set(numbers) == set(KNOWN) else {"numbers": sorted(set(numbers))}
        return {**self.identity(), **some}

    @classmethod
    def from_identity(cls, identity: Mapping[str, object]) -> LociSettings:
        """The settings behind :meth:`identity`, of whatever version."""
        return cls(**{f.name: float(identity[f.name]) for f in fields(cls)})  # type: ignore[arg-type]


@dataclass(frozen=True)
class PieceEvent:
    """A special point of a locus and the numbers of the other loci that it belongs to."""

    event: LocusEvent
    numbers: tuple[int, ...] = ()

    @property
    def angle_deg(self) -> float:
        return float(np.degrees(self.event.solution["psi0"]))

    @property
    def shear(self) -> float:
        return self.event.solution["dD"]

    def __repr__(self) -> str:
        with_ = f" with {', '.join(map(str, self.numbers))}" if self.numbers else ""
        return f"PieceEvent({self.event.kind}{with_}: {self.angle_deg:.5g} deg, shear {self.shear:.6g})"


@dataclass(frozen=True)
class Piece:
    """A piece of a curve of bifurcations along which the angle grows: the locus of one bifurcation of each slice.

    Attributes
    ----------
    number : the paper's number or None.
    kind : 'fold', 'pitchfork' or 'branch point'.
    points : in order of increasing angle, the special points that bound it included.
    events : special points on it and at its ends, and on unnumbered or very short pieces next to it.
    curve : position of its curve among those of the result.
    own : the special points on it and at its ends only.
    """

    number: int | None
    kind: str
    points: tuple[Solution, ...] = field(repr=False)
    events: tuple[PieceEvent, ...]
    curve: int = 0
    own: tuple[LocusEvent, ...] = field(default=(), repr=False)

    @property
    def angles_deg(self) -> tuple[float, float]:
        """Smallest and largest angle."""
        return tuple(float(np.degrees(p["psi0"])) for p in (self.points[0], self.points[-1]))  # type: ignore[return-value]

    def at(self, angle_deg: float) -> tuple[float, float]:
        """Shear and height at an angle inside, from a spline through the computed points."""
        found = at_angle(self.points, float(np.radians(angle_deg)))
        if found is None:
            low, high = self.angles_deg
            raise ValueError(f"angle: expected one from {low:g} to {high:g} degrees, got {angle_deg:g}")
        return float(found[0]), float(found[1])


@dataclass(frozen=True)
class Loci:
    """Loci found from some slices; see :func:`rodatlas.atlas.compute_loci`.

    Attributes
    ----------
    curves : as followed, each once.
    pieces : of the curves, cut where the angle turns.
    wanted : numbers that were asked for.
    warnings : what was asked for and not found; empty when all is well.
    """

    settings: LociSettings
    curves: tuple[Locus, ...]
    pieces: tuple[Piece, ...]
    wanted: tuple[int, ...]
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    def __repr__(self) -> str:
        numbers = sorted({p.number for p in self.pieces if p.number is not None})
        return f"Loci({len(self.curves)} curves with the loci {', '.join(map(str, numbers))})"

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers: the settings, and which loci were asked for unless all were."""
        return self.settings.identity_of(self.wanted)

    def numbered(self, number: int) -> Piece | None:
        """The locus of a number; None where it was not followed or not found.

        Raises
        ------
        ValueError
            for a number that no bifurcation has.
        """
        if number not in KNOWN:
            raise ValueError(f"number: expected one of {KNOWN[0]} to {KNOWN[-1]}, got {number}")
        return next((p for p in self.pieces if p.number == number), None)

    def events(self) -> tuple[PlaneEvent, ...]:
        """The special points of all loci, each once, in order of angle, with descriptions."""
        from rodatlas.atlas.loci.events import plane_events

        return plane_events(self.pieces)

    def remarks(self, numbers: Sequence[int] = ()) -> tuple[str, ...]:
        """What a reader should know of some loci, or of all that were wanted: the warnings, and whether special points
        lie near the limiting shear."""
        wanted = [p for p in self.pieces if p.number in (numbers or self.wanted)]
        far = {p.number: max((abs(e.shear) for e in p.events), default=0.0) for p in wanted}
        near = {n: x for n, x in far.items() if n is not None and near_limit(x, self.settings.compression)}
        if not near:
            return self.warnings
        told = near_limit(max(near.values()), self.settings.compression)
        return (*self.warnings, f"{told} (special points of locus {', '.join(map(str, sorted(near)))})")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.atlas.loci.store import save_loci

        save_loci(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Loci:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.atlas.loci.store import load_loci

        return load_loci(path)

    def to_frame(self) -> Table:
        """A table with one row for each special point of each locus that was wanted."""
        from rodatlas.continuation.table import Table

        told = self.events()
        numbered = [p for p in self.pieces if p.number in self.wanted]
        return Table([{"number": p.number, **_event_json(e, told)} for p in numbered for e in p.events])

    def to_json(self, numbers: Sequence[int] = ()) -> dict[str, Any]:
        """The object that `rodatlas loci --json` prints, for some numbers or all that were wanted.

        Others that were followed to tell what meets these are left out: what meets them was not looked for.
        """
        numbers = numbers or self.wanted
        wanted = sorted((p for p in self.pieces if p.number in numbers), key=lambda p: p.number or 0)
        told = self.events()
        return {
            "schema": SCHEMA,
            "compression": self.settings.compression,
            "poisson": self.settings.poisson,
            "angle_max": self.settings.angle_max,
            "tolerance": self.settings.tolerance,
            "seconds": round(self.seconds, 3),
            "warnings": list(self.remarks(numbers)),
            "loci": [_piece_json(p, told) for p in wanted],
            "events": [e.to_json() for e in told if {str(p.number) for p in wanted} & set(e.labels)],
        }


def at_angle(solutions: Sequence[Solution], angle: float) -> np.ndarray | None:
    """Shear and height (2,) at an angle (radians) of a piece of a locus, from a cubic spline along it."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import brentq

    values = np.array([[s["psi0"], s["dD"], s["height"]] for s in solutions])
    if len(values) < 3 or not values[:, 0].min() <= angle <= values[:, 0].max():
        return None
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
    curve = CubicSpline(length, values)
    i = int(np.flatnonzero((values[:-1, 0] - angle) * (values[1:, 0] - angle) <= 0)[0])
    return curve(brentq(lambda s: float(curve(s)[0]) - angle, length[i], length[i + 1]))[1:]


def point_of(point: LocusPoint | LocusEvent) -> tuple[float, float, float]:
    """Angle in degrees, shear and height."""
    s = point.solution
    return float(np.degrees(s["psi0"])), s["dD"], s["height"]


def _piece_json(piece: Piece, told: Sequence[PlaneEvent]) -> dict[str, Any]:
    return {
        "number": piece.number,
        "kind": piece.kind,
        "points": [[float(np.degrees(p["psi0"])), p["dD"], p["height"]] for p in piece.points],
        "events": [_event_json(e, told) for e in piece.events],
    }


def _event_json(e: PieceEvent, told: Sequence[PlaneEvent]) -> dict[str, Any]:
    return {
        "kind": e.event.kind,
        "angle_deg": e.angle_deg,
        "shear": e.shear,
        "height": e.event.solution["height"],
        "with": list(e.numbers),
        "status": e.event.status.value,
        "parameter": {"psi0": "angle", "dD": "shear"}.get(e.event.parameter, ""),
        "what": e.event.what,
        "description": next((t.description for t in told if t.holds(e.event)), ""),
    }
