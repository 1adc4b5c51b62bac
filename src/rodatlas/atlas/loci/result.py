"""Loci of bifurcations in a plane of two controls, as a result: tables, JSON and file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.continuation import Locus, LocusEvent, Solution

if TYPE_CHECKING:
    from rodatlas.atlas.loci.events import PlaneEvent
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/loci/1"


@dataclass(frozen=True)
class PieceEvent:
    """A special point of a locus and the numbers of the other loci that it belongs to.

    Attributes
    ----------
    second, value, response : where it is: second control, control along slices, and quantity.
    """

    event: LocusEvent
    second: float
    value: float
    response: float
    numbers: tuple[int, ...] = ()

    def __repr__(self) -> str:
        with_ = f" with {', '.join(map(str, self.numbers))}" if self.numbers else ""
        return f"PieceEvent({self.event.kind}{with_}: {self.second:.5g}, {self.value:.6g})"


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a curve of bifurcations along which the second control grows: that of one bifurcation of each slice.

    Attributes
    ----------
    number : that the bifurcation has, or None.
    kind : 'fold', 'pitchfork' or 'branch point'.
    points : in order of the second control, the special points that bound it included.
    places : (n, 3) of the points: second control, control along slices, and quantity.
    lengths : (n,) along the piece, in which it is interpolated.
    events : special points on it and at its ends, and on unnumbered or very short pieces next to it.
    curve : position of its curve among those of the result.
    own : the special points on it and at its ends only.
    """

    number: int | None
    kind: str
    points: tuple[Solution, ...] = field(repr=False)
    places: np.ndarray = field(repr=False)
    lengths: np.ndarray = field(repr=False)
    events: tuple[PieceEvent, ...]
    curve: int = 0
    own: tuple[LocusEvent, ...] = field(default=(), repr=False)

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value of the second control."""
        return float(self.places[0, 0]), float(self.places[-1, 0])

    def at(self, second: float) -> tuple[float, float]:
        """Value along slices and response at a value of the second control, from a spline through the points."""
        found = at_second(self.places, self.lengths, second)
        if found is None:
            low, high = self.span
            raise ValueError(f"second: expected one from {low:g} to {high:g}, got {second:g}")
        return float(found[0]), float(found[1])


@dataclass(frozen=True)
class Loci:
    """Loci found from some slices; see :func:`rodatlas.atlas.compute_loci`.

    Attributes
    ----------
    curves : as followed, each once.
    pieces : of the curves, cut where the second control turns.
    wanted : numbers that were asked for; empty where all were, of a model whose numbers are not known before.
    roles : what loci bound, by number: (name of a state, 'low' or 'high' end).
    warnings : what was asked for and not found; empty when all is well.
    """

    settings: LociSettings
    curves: tuple[Locus, ...]
    pieces: tuple[Piece, ...]
    wanted: tuple[int, ...]
    roles: Mapping[int, frozenset[tuple[str, str]]] = field(default_factory=dict, repr=False)
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers that were wanted, or all that there are."""
        return self.wanted or tuple(sorted({p.number for p in self.pieces if p.number is not None}))

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
        self.settings.check_numbers((number,))
        return next((p for p in self.pieces if p.number == number), None)

    def events(self) -> tuple[PlaneEvent, ...]:
        """The special points of all loci, each once, in order of the second control, with descriptions."""
        from rodatlas.atlas.loci.events import plane_events

        return plane_events(self.pieces, self.settings, self.roles)

    def remarks(self, numbers: Sequence[int] = ()) -> tuple[str, ...]:
        """What a reader should know of some loci, or of all that were wanted: the warnings, and what is to be said of
        the places of special points."""
        care = self.settings.along_control.care
        if care is None:
            return self.warnings
        s = self.settings
        wanted = [p for p in self.pieces if p.number in (numbers or self.numbers)]
        far = [(p.number or 0, e) for p in wanted for e in p.events if care(e.value, {**s.setting, s.second: e.second})]
        if not far:
            return self.warnings
        worst = max((e for _, e in far), key=lambda e: abs(e.value))
        told = care(worst.value, {**s.setting, s.second: worst.second})
        return (*self.warnings, f"{told} (special points of locus {', '.join(map(str, sorted({n for n, _ in far})))})")

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
        numbered = [p for p in self.pieces if p.number in self.numbers]
        return Table([{"number": p.number, **_event_json(e, told, self.settings)} for p in numbered for e in p.events])

    def to_json(self, numbers: Sequence[int] = ()) -> dict[str, Any]:
        """The object that `rodatlas loci --json` prints, for some numbers or all that were wanted.

        Others that were followed to tell what meets these are left out: what meets them was not looked for.
        """
        numbers = numbers or self.numbers
        wanted = sorted((p for p in self.pieces if p.number in numbers), key=lambda p: p.number or 0)
        told, s = self.events(), self.settings
        unnumbered = [] if self.wanted else [p for p in self.pieces if p.number is None]
        return {
            "schema": SCHEMA,
            **s.head_json(),
            f"{s.second}_max": s.second_high,
            f"{s.second_control.key}_range": [s.second_low, s.second_high],
            f"{s.along_control.key}_range": [s.low, s.high],
            "seconds": round(self.seconds, 3),
            "warnings": list(self.remarks(numbers)),
            "loci": [_piece_json(p, told, s) for p in (*wanted, *unnumbered)],
            "events": [
                e.to_json(s) for e in told if not self.wanted or {str(p.number) for p in wanted} & set(e.labels)
            ],
        }


def at_second(places: np.ndarray, lengths: np.ndarray, second: float) -> np.ndarray | None:
    """Value along slices and response (2,) at a value of the second control, from a cubic spline along a piece.

    Parameters
    ----------
    places : (n, 3), lengths : (n,), as of a :class:`Piece`.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import brentq

    if len(places) < 3 or not places[:, 0].min() <= second <= places[:, 0].max():
        return None
    curve = CubicSpline(lengths, places)
    i = int(np.flatnonzero((places[:-1, 0] - second) * (places[1:, 0] - second) <= 0)[0])
    return curve(brentq(lambda s: float(curve(s)[0]) - second, lengths[i], lengths[i + 1]))[1:]


def _piece_json(piece: Piece, told: Sequence[PlaneEvent], settings: LociSettings) -> dict[str, Any]:
    return {
        "number": piece.number,
        "kind": piece.kind,
        "points": piece.places.tolist(),
        "events": [_event_json(e, told, settings) for e in piece.events],
    }


def _event_json(e: PieceEvent, told: Sequence[PlaneEvent], settings: LociSettings) -> dict[str, Any]:
    place = (e.second, e.value, e.response)
    return {
        "kind": e.event.kind,
        settings.second_control.key: e.second,
        settings.along_control.key: e.value,
        settings.against: e.response,
        "with": list(e.numbers),
        "status": e.event.status.value,
        "parameter": settings.control_of(e.event.parameter),
        "what": e.event.what,
        "description": next((t.description for t in told if t.holds(place, settings)), ""),
    }
