"""Measured ranges of stability beside the computed ones of a slice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.experiments.measured import BEYOND, Measurement
from rodatlas.atlas.experiments.sensitivity import sensitivity
from rodatlas.atlas.slices.result import Slice, State, StateEnd
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.rods.band import limiting_shear
from rodatlas.rods.units import BandUnits, ClampErrors

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/overlay/1"
SHEAR = "shear"
SAME = 1e-9  # an end of a state and its bifurcation are one solution


@dataclass(frozen=True)
class EndCheck:
    """One end of a measured range beside the computed one; shears in the unit of the comparison.

    Attributes
    ----------
    measured : where the state was last seen.
    computed : where it ends; None when there is nothing to compare with, and `note` says why.
    error : of the measured value; None when unknown.
    stated : whether the error was given with the data, rather than estimated from the clamps.
    kind, number : of the bifurcation that ends the computed state.
    note : why the ends cannot be compared: 'no such state', 'from rest' (the experiment started at zero shear, the
        state goes on beyond), 'slice ends' (and the computed state goes on, or the measured end lies beyond the shears
        of the slice and no state of the name on it).
    """

    measured: float
    computed: float | None = None
    error: float | None = None
    stated: bool = False
    kind: str = ""
    number: int | None = None
    note: str = ""

    @property
    def difference(self) -> float | None:
        """Measured less computed."""
        return None if self.computed is None else self.measured - self.computed

    @property
    def inside(self) -> bool | None:
        """Whether the difference is within the error; None when one of them is missing."""
        if self.difference is None or self.error is None:
            return None
        return abs(self.difference) <= self.error

    @property
    def verdict(self) -> str:
        """In words: 'inside', 'outside', 'no error known', or why there is nothing to compare."""
        if self.difference is None:
            return self.note
        return {True: "inside", False: "outside", None: "no error known"}[self.inside]

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "measured": self.measured, "computed": self.computed, "difference": self.difference, "error": self.error,
            "error_stated": self.stated, "inside": self.inside, "kind": self.kind or None, "number": self.number,
            "verdict": self.verdict,
        }  # fmt: skip


@dataclass(frozen=True)
class RangeCheck:
    """A measured range, the computed state that it is compared with (None: there is none), and both ends."""

    measurement: Measurement
    computed: State | None
    low: EndCheck
    high: EndCheck

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        m = self.measurement
        return {
            "state": m.state, "family": m.family, "label": m.label, "aspect": m.aspect, "place": m.place,
            "low": self.low.to_json(), "high": self.high.to_json(),
        }  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """Measured ranges beside a slice, see :func:`compare`.

    Attributes
    ----------
    normalized : whether shears are parts of the limiting shear (of the band for measured ones, of the rod for
        computed ones) rather than multiples of L.
    limit : limiting shear of the rod [L].
    """

    checks: tuple[RangeCheck, ...]
    normalized: bool
    limit: float

    def __repr__(self) -> str:
        ends = [e for c in self.checks for e in (c.low, c.high)]
        inside, outside = (sum(e.inside is which for e in ends) for which in (True, False))
        return f"Comparison({len(self.checks)} ranges: {inside} ends inside their errors, {outside} outside)"

    @property
    def scale(self) -> float:
        """Multiply a shear of this comparison by it for a place on the axis of a slice [L]."""
        return self.limit if self.normalized else 1.0

    def to_json(self) -> dict[str, Any]:
        """The object that goes into the file of `rodatlas slice --overlay`."""
        unit = "limit" if self.normalized else "L"
        return {
            "schema": SCHEMA, "unit": unit, "limiting_shear_of_rod": self.limit,
            "ranges": [c.to_json() for c in self.checks],
        }  # fmt: skip

    def to_frame(self) -> Table:
        """A table with a row for each end."""
        from rodatlas.continuation.table import Table

        rows = []
        for c in self.checks:
            for side, end in (("low", c.low), ("high", c.high)):
                rows.append({"state": c.measurement.state, "label": c.measurement.label, "end": side, **end.to_json()})
        return Table(rows)


def compare(slice_: Slice, measurements: Sequence[Measurement], errors: ClampErrors | None = None) -> Comparison:
    """Compare measured ranges with the stable states of a slice.

    The comparison is in L, and normalized by limiting shears when any row is. Where no error is given with the data, it
    is estimated from how well clamps are set, if the length of the band is known: the bifurcation's slopes with angle
    and compression times their errors, and the error of the shear itself.

    Parameters
    ----------
    errors : of the clamps; 1 degree and 0.5 mm by default.

    Raises
    ------
    ValueError
        when a row lacks what its conversion needs, or lies beyond the limiting shear.
    """
    check_along_shear(slice_.settings)
    compression = slice_.settings.setting["compression"]
    normalized, ranges = converted(measurements, compression)
    limit = limiting_shear(compression)
    errors = errors or ClampErrors()
    checks = tuple(
        _check(slice_, m, ends, normalized, limit, errors) for m, ends in zip(measurements, ranges, strict=True)
    )
    return Comparison(checks, normalized, limit)


def check_along_shear(settings: SliceSettings) -> None:
    """ValueError for a slice along another control than the shear, of which ranges are measured."""
    if settings.along != SHEAR:
        raise ValueError(f"overlay: expected a slice along {SHEAR}, of which ranges are measured, got one along "
                         f"{settings.along}")  # fmt: skip


def converted(measurements: Sequence[Measurement], compression: float) -> tuple[bool, list[tuple[float, float]]]:
    """Whether ranges are compared in parts of limiting shears, and their ends in that unit, or in L.

    Raises
    ------
    ValueError
        as :func:`compare`.
    """
    normalized, limit = any(m.unit == "limit" for m in measurements), limiting_shear(compression)
    ranges = []
    for m in measurements:
        low, high = (m.convert(value, compression, normalized) for value in (m.low, m.high))
        for column, value in (("shear_min", low), ("shear_max", high)):
            part = value if normalized else value / limit
            if abs(part) > BEYOND:
                raise ValueError(
                    f"{m.place}, column {column}: expected at most the limiting shear for compression "
                    f"{compression:g}, got {part:.4g} times that, read in the unit {m.unit}"
                )
        ranges.append((low, high))
    return normalized, ranges


def _check(
    slice_: Slice, m: Measurement, ends: tuple[float, float], normalized: bool, limit: float, errors: ClampErrors
) -> RangeCheck:
    """One measured range with the computed one."""
    compression, scale = slice_.settings.setting["compression"], limit if normalized else 1.0
    low, high = ends
    state = _nearest(slice_, m.family, low * scale, high * scale)
    given = None if m.error is None else abs(m.convert(m.error, compression, normalized))
    if state is None:
        seen = slice_.settings.low, slice_.settings.high
        beyond = [m.family is not None and not seen[0] <= v * scale <= seen[1] for v in ends]
        notes = ["slice ends" if b else "no such state" for b in beyond]
        alone = [EndCheck(v, error=given, stated=given is not None, note=n) for v, n in zip(ends, notes, strict=True)]
        return RangeCheck(m, None, alone[0], alone[1])

    def check(value: float, end: StateEnd) -> EndCheck:
        rest = value == 0.0 and end is state.low and end.value < 0.0
        note = "from rest" if rest else "slice ends" if end.kind == "range" else ""
        error = given if given is not None else _clamp_error(slice_, end, m, errors, normalized)
        computed = None if note else end.value / scale
        return EndCheck(value, computed, error, given is not None, end.kind, end.number, note)

    return RangeCheck(m, state, check(low, state.low), check(high, state.high))


def _nearest(slice_: Slice, family: str | None, low: float, high: float) -> State | None:
    """The stable range of a name that shares the most with a measured one, or the nearest if none shares anything."""
    fitting = [s for s in slice_.states if s.name == family]
    return max(fitting, key=lambda s: min(high, s.high.value) - max(low, s.low.value), default=None)


def _clamp_error(slice_: Slice, end: StateEnd, m: Measurement, errors: ClampErrors, normalized: bool) -> float | None:
    """Error of a measured end as these clamps would give it; None when the band or the slopes are unknown."""
    if m.band is None or end.kind in ("range", "smooth"):
        return None
    here = [
        e.special for b in slice_.branches for e in b.events  # a pitchfork is an event of the branch that it is on
        if math.hypot(e.value - end.value, e.response - end.response) < SAME
    ]  # fmt: skip
    slopes = sensitivity(here[0], slice_.settings.tolerance) if here else None
    if slopes is None:
        return None
    units = BandUnits(m.band, slice_.settings.setting["compression"])
    error = slopes.error(errors, units)
    if not normalized:
        return error
    return math.hypot(error, end.value / units.limit * errors.of_limit(units)) / units.limit
