"""What a first guess is made of: names, numbers and tables, checked and joined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import as_finite, check_distinct, check_type, shown
from rodatlas.continuation.linear.gauss import MOST_POINTS

if TYPE_CHECKING:
    import pandas as pd


def read_csv(path: str) -> pd.DataFrame:
    """A table from a file; comment lines come first, if any, and their last may name the columns."""
    import pandas as pd

    last, skipped = "", 0
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            if not line.startswith("#"):
                break
            last, skipped = line, skipped + 1
        else:
            line = ""
    names = None
    if skipped and _is_number(line.split(",")[0]):
        names = [name.strip() for name in last.lstrip("# ").split(",")]
    return pd.read_csv(path, skipinitialspace=True, skiprows=skipped, names=names)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def checked_names(unknowns: Sequence[str], parameters: Mapping[str, float]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the unknowns and values of the parameters (np,)."""
    what = "a sequence of names such as ('u', 'v')"
    check_distinct("unknowns", unknowns, what)
    if not len(unknowns):
        raise ValueError(f"unknowns: expected {what}, got {shown(unknowns)}")
    check_type("parameters", parameters, Mapping, "a mapping of names to numbers")
    check_distinct("parameters", parameters, "a mapping of names to numbers")
    return tuple(unknowns), np.array([as_finite("parameters", name, parameters[name]) for name in parameters], float)


def check_points(points: object) -> None:
    """Raise ValueError for what is no number of Gauss points per interval."""
    check_type("points", points, Integral, "a whole number")
    if not 1 <= points <= MOST_POINTS:  # type: ignore[operator]
        raise ValueError(f"points: expected 1 to {MOST_POINTS} Gauss points per interval, got {points}")


def checked_table(field: str, values: Any, rows: int, names: tuple[str, ...]) -> np.ndarray:
    """Values (rows, n), finite."""
    try:
        if np.iscomplexobj(values):
            raise TypeError
        table = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{field}: expected real numbers, got {shown(values)}") from None
    if len(names) == 1 and table.shape == (rows,):
        table = table[:, None]
    if table.shape != (rows, len(names)):
        raise ValueError(f"{field}: expected shape {(rows, len(names))}, a column for each of {', '.join(names)}, got "
                         f"{table.shape}")  # fmt: skip
    for name, column in zip(names, table.T, strict=True):
        if not np.isfinite(column).all():
            bad = int(np.flatnonzero(~np.isfinite(column))[0])
            raise ValueError(f"{field}: expected finite values of '{name}', got {column[bad]} in row {bad + 1}")
    return table.copy()


def joined(s: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubic spline through a table, at other places; straight lines through less than four points."""
    if len(s) < 4:
        return np.column_stack([np.interp(at, s, column) for column in values.T])
    from scipy.interpolate import CubicSpline

    return CubicSpline(s, values)(at)
