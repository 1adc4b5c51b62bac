"""Measured ranges of stability, read from a table."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from rodatlas.continuation.checks import WrongInput
from rodatlas.rods.band import WIDEST, Band, check_between, limiting_shear, number_from_text, ratio_from_text
from rodatlas.states.labels import known_names, parse_label

REQUIRED = ("state", "shear_min", "shear_max")
OPTIONAL = ("unit", "width", "band", "label", "error")
UNITS = ("L", "mm", "limit")
WIDE_ONLY = ("wi",)  # seen in wide bands; the rod has no such state
BEYOND = 1.02  # a shear may exceed the limiting one by this factor: an error of measurement, no more

T = TypeVar("T")


@dataclass(frozen=True)
class Measurement:
    """One measured range of shear over which a state was seen.

    Attributes
    ----------
    state : as written: 'U', 'US+', 'U1' (one of two states into which width splits U).
    family : name of the state of the rod that it belongs to, 'US+-' say; None when there is none.
    low, high : ends of the range, in `unit`: 'L', 'mm', or 'limit' (parts of the limiting shear of its band).
    error : half-width of the interval in which each end lies, in `unit`; None when it was not given.
    band : in mm, when known. aspect : width over length, when known.
    label : what the legend calls its band.
    place : where it stands, 'data.csv, line 4'.
    """

    state: str
    family: str | None
    low: float
    high: float
    unit: str = "L"
    error: float | None = None
    band: Band | None = None
    aspect: float | None = None
    label: str = "measured"
    place: str = "data"

    def convert(self, value: float, compression: float, normalized: bool) -> float:
        """A shear of this row in L, or with `normalized` as a part of the limiting shear of its band.

        Raises
        ------
        ValueError
            when that needs the width or the length of the band, and they are not known.
        """
        if self.unit == "limit" and normalized:
            return value
        if self.unit == "mm" and self.band is None:
            raise ValueError(f"{self.place}, column band: expected LENGTHxWIDTHxTHICKNESS in mm (or --band), which a "
                             f"shear in mm needs, got none")  # fmt: skip
        shear = value / self.band.length if self.unit == "mm" and self.band is not None else value
        if self.unit != "limit" and not normalized:
            return shear
        if self.aspect is None:
            raise ValueError(f"{self.place}, column width: expected the width over the length (or a band), on which "
                             f"the limiting shear depends, got none")  # fmt: skip
        limit = limiting_shear(compression, self.aspect)
        return shear * limit if self.unit == "limit" else shear / limit


def read_measurements(path: str | os.PathLike[str], band: Band | None = None) -> tuple[Measurement, ...]:
    """Read a CSV table of measured ranges.

    The first line that is no comment (#) names the columns: `state`, `shear_min`, `shear_max`, and any of `unit` (L,
    mm or limit; L by default), `band` (240x3x0.127, in mm), `width` (1/80, 0.0125 or '3 mm'), `label`, `error` (in the
    unit of the row).

    Parameters
    ----------
    band : of the rows that name none.

    Raises
    ------
    ValueError
        one line that names the file, the line and the column, what was expected and what came.
    """
    where = Path(path)
    try:
        text = where.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ValueError(f"overlay: expected a CSV file, got '{where}' ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ValueError(f"overlay: expected a CSV file in UTF-8, got '{where}', which is not") from None
    except ValueError as error:  # a name that the system does not take
        raise ValueError(f"overlay: expected a CSV file, got '{where}' ({error})") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise ValueError(f"{where}: expected a line with the columns {', '.join(REQUIRED)}, got no line but comments")
    columns = _header(f"{where}, line {lines[0][0]}", lines[0][1])
    if len(lines) == 1:
        raise ValueError(f"{where}: expected at least one row below the names of the columns, got none")
    return tuple(_measurement(_row(f"{where}, line {i}", columns, line), band) for i, line in lines[1:])


def family_of(state: str) -> str | None:
    """The state of the rod to which a measured one belongs: 'US+-' for 'US2+' and 'US'; None for 'wi'.

    Raises
    ------
    ValueError
        for any other name.
    """
    if state in WIDE_ONLY:
        return None
    try:
        return parse_label(re.sub(r"[12](?=[+-]*$)", "", state)).name
    except ValueError:
        known = f"{known_names()}, or U1, U2, wi .. of wide bands"
        raise WrongInput("state", f"expected one of {known}, got '{state}'") from None


@dataclass(frozen=True)
class _Row:
    """One line of the table: where it stands, and its fields that are not empty."""

    place: str
    cells: dict[str, str]

    def read(self, column: str, convert: Callable[[str], T], default: T | None = None) -> T:
        """A field converted; ValueError that names the column when it is empty without a default, or wrong."""
        place = f"{self.place}, column {column}"
        if column not in self.cells:
            if default is None:
                raise WrongInput(place, "expected a value, got none")
            return default
        try:
            return convert(self.cells[column])
        except ValueError as error:
            rest = error.rest if isinstance(error, WrongInput) else str(error)  # the field is known by line and column
            raise WrongInput(place, rest) from None


def _fields(place: str, line: str) -> list[str]:
    """The fields of a line."""
    try:
        return next(csv.reader([line], skipinitialspace=True))
    except csv.Error as error:
        raise ValueError(f"{place}: expected fields separated by commas, got a line that is none ({error})") from None


def _header(place: str, line: str) -> list[str]:
    """Names of the columns."""
    columns = [name.strip().lower() for name in _fields(place, line)]
    for name in columns:
        if name not in (*REQUIRED, *OPTIONAL):
            known = ", ".join((*REQUIRED, *OPTIONAL))
            raise ValueError(f"{place}: expected columns among {known}, separated by commas, got '{name}'")
        if columns.count(name) > 1:
            raise ValueError(f"{place}: expected each column once, got '{name}' twice")
    if missing := [name for name in REQUIRED if name not in columns]:
        raise ValueError(f"{place}: expected the columns {', '.join(REQUIRED)}, got none named {missing[0]}")
    return columns


def _row(place: str, columns: list[str], line: str) -> _Row:
    fields = [field.strip() for field in _fields(place, line)]
    if len(fields) != len(columns):
        raise ValueError(f"{place}: expected {len(columns)} fields ({', '.join(columns)}), got {len(fields)}")
    return _Row(place, {name: field for name, field in zip(columns, fields, strict=True) if field})


def _measurement(row: _Row, default: Band | None) -> Measurement:
    state = row.read("state", str)
    family = row.read("state", lambda text: (family_of(text),))[0]
    low, high = (row.read(name, _number) for name in REQUIRED[1:])
    if high < low:
        raise ValueError(f"{row.place}, column shear_max: expected at least shear_min = {low:g}, got {high:g}")
    band = row.read("band", Band.from_text) if "band" in row.cells else default
    aspect = band.aspect if band is not None else None
    if "width" in row.cells:
        aspect, band = row.read("width", lambda text: _widened(text, band))
    label = row.cells.get("label") or (f"D/L = {_fraction(aspect)}" if aspect is not None else "measured")
    error = row.read("error", _error) if "error" in row.cells else None
    return Measurement(
        state, family, low, high, row.read("unit", _unit, "L"), error, band, aspect, label, row.place
    )  # fmt: skip


def _number(text: str, field: str = "shear") -> float:
    try:
        value = number_from_text(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise WrongInput(field, f"expected a number, got '{text}'")
    return value


def _error(text: str) -> float:
    value = _number(text, "error")
    if value < 0:
        raise WrongInput("error", f"expected a number of at least 0, got {text}")
    return value


def _unit(text: str) -> str:
    for unit in UNITS:
        if text.lower() == unit.lower():
            return unit
    raise WrongInput("unit", f"expected one of {', '.join(UNITS)}, got '{text}'")


def _aspect(text: str, band: Band | None) -> float:
    """Width over length from '1/80', '0.0125' or '3 mm'."""
    if not text.endswith("mm"):
        return ratio_from_text(text)
    if band is None:
        raise WrongInput("width", f"expected the width over the length where no band is named, got '{text}'")
    ratio = _number(text.removesuffix("mm"), "width") / band.length
    return check_between("width", ratio, 0.0, WIDEST, f"a positive width up to {WIDEST * band.length:g} mm")


def _widened(text: str, band: Band | None) -> tuple[float, Band | None]:
    """Width over length, and the band of a row with this width."""
    aspect = _aspect(text, band)
    return aspect, None if band is None else replace(band, width=aspect * band.length)


def _fraction(value: float) -> str:
    """'1/80' for 0.0125, digits for what is no simple fraction."""
    whole = round(1.0 / value)
    return f"1/{whole}" if whole > 1 and abs(1.0 / value - whole) < 1e-6 * whole else f"{value:.4g}"
