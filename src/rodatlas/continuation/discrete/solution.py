"""One solution of a boundary value problem on a mesh."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import (
    as_array,
    as_finite,
    check_each,
    check_function,
    check_type,
    shown,
)
from rodatlas.continuation.discrete.guess import check_points, checked_names, checked_table, joined, read_csv
from rodatlas.continuation.linear.gauss import gauss_scheme

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

UNIT = np.array([[0.0, 0.0], [1.0, 1.0]])
ROUND_OFF = 1e-9  # a place this far outside the interval is meant to be its end


@dataclass(frozen=True, eq=False)
class Solution:
    """Piecewise polynomial solution: mesh, values at mesh and Gauss points, and all parameters.

    Attributes
    ----------
    unknowns, parameter_names : names of the columns of `values` and of the entries of `parameters`.
    mesh : (N+1,) mesh points of the reference interval, from 0 to 1; :attr:`s` holds the places that they stand for.
    values : (N+1, n) unknowns at the mesh points (order 2m accurate).
    stages : (N, m, n) unknowns at the Gauss points.
    parameters : (np,) values of all parameters.
    error : float
        estimated largest error at mesh points relative to the scale of each unknown; nan when not estimated.
    observables : mapping of str to float.
    places : (K+1, 2) reference coordinates of the ends of all pieces, and the places s that they stand for, which s is
        linear between. At an inner point, where unknowns may jump, one place has two coordinates.
    """

    unknowns: tuple[str, ...]
    parameter_names: tuple[str, ...]
    mesh: np.ndarray
    values: np.ndarray
    stages: np.ndarray
    parameters: np.ndarray
    error: float = float("nan")
    observables: Mapping[str, float] = field(default_factory=dict)
    places: np.ndarray = field(default_factory=lambda: UNIT.copy())

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.6g}" for k, v in zip(self.parameter_names, self.parameters, strict=True))
        seen = "".join(f", {k}={v:.6g}" for k, v in self.observables.items())
        return f"Solution({values}{seen}; {self.intervals} intervals, error {self.error:.1e})"

    @property
    def intervals(self) -> int:
        return len(self.mesh) - 1

    @property
    def points(self) -> int:
        """Gauss points per interval, m."""
        return self.stages.shape[1]

    def parameter(self, name: str) -> float:
        """The value of one parameter."""
        return float(self.parameters[self._place_of(name)])

    def _place_of(self, parameter: str) -> int:
        if parameter not in self.parameter_names:
            raise ValueError(f"parameter: expected one of {', '.join(self.parameter_names)}, got {shown(parameter)}")
        return self.parameter_names.index(parameter)

    def __getitem__(self, name: str) -> Any:
        """A parameter or observable (float), or an unknown at the mesh points (N+1,)."""
        if name in self.parameter_names:
            return self.parameter(name)
        if name in self.unknowns:
            return self.values[:, self.unknowns.index(name)]
        if isinstance(name, str) and name in self.observables:
            return self.observables[name]
        known = ", ".join((*self.unknowns, *self.parameter_names, *self.observables))
        raise KeyError(f"name: expected one of {known}, got {shown(name)}")

    @property
    def s(self) -> np.ndarray:
        """(N+1,) places of the mesh points; where unknowns jump one place comes twice, with both values."""
        return np.interp(self.mesh, *self.places.T)

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the interval on which the solution is defined."""
        return float(self.places[0, 1]), float(self.places[-1, 1])

    def __call__(self, s: np.ndarray | float, name: str | None = None, side: str = "right") -> np.ndarray:
        """Unknowns (len(s), n), or one of them (len(s),), at any places of the interval; ValueError outside.

        Where an unknown jumps, `side` tells which of its values is wanted, 'left' or 'right'.
        """
        if side not in ("left", "right"):
            raise ValueError(f"side: expected 'left' or 'right', got {side!r}")
        if name is not None and name not in self.unknowns:
            raise ValueError(f"name: expected one of {', '.join(self.unknowns)}, got {name!r}")
        s = np.atleast_1d(as_array("s", s))
        (a, b), slack = self.interval, ROUND_OFF * max(1.0, *np.abs(self.interval))
        outside = ~((s >= a - slack) & (s <= b + slack))
        if outside.any():
            raise ValueError(f"s: expected places from {a:g} to {b:g}, got {s[outside][0]:g}")
        out = self._at(self._reference(s, side))
        return out if name is None else out[:, self.unknowns.index(name)]

    def _at(self, x: np.ndarray) -> np.ndarray:
        """Unknowns (len(x), n) at places of the reference interval."""
        return Interpolation(self.mesh, self.points, x)(self.values, self.stages)

    def _reference(self, s: np.ndarray, side: str) -> np.ndarray:
        """Reference coordinates of places, on one side of inner points."""
        x, at = self.places.T
        piece = np.searchsorted(at, s, side=side) - 1  # type: ignore[call-overload]
        pieces = np.flatnonzero(np.diff(at) > 0)
        piece = pieces[np.clip(np.searchsorted(pieces, piece, side="right") - 1, 0, len(pieces) - 1)]
        share = (s - at[piece]) / (at[piece + 1] - at[piece])
        return np.asarray(x[piece] + np.clip(share, 0.0, 1.0) * (x[piece + 1] - x[piece]))

    def gauss_points(self) -> np.ndarray:
        """(N, m) reference coordinates of the stages."""
        return stage_points(self.mesh, self.points)

    def mean(self, density: np.ndarray) -> float:
        """Integral over the interval of a density given at the Gauss points (N, m)."""
        return float(np.diff(self.s) @ (density @ gauss_scheme(self.points).weights))

    def remesh(self, mesh: np.ndarray, points: int | None = None) -> Solution:
        """The same functions interpolated on another mesh (to be corrected by Newton before use)."""
        points = self.points if points is None else points
        check_points(points)
        mesh = as_array("mesh", mesh)
        if mesh.ndim != 1 or len(mesh) < 2 or not (mesh[0] == 0.0 and mesh[-1] == 1.0 and (np.diff(mesh) > 0).all()):
            raise ValueError(f"mesh: expected strictly increasing numbers from 0 to 1, got {shown(mesh)}")
        gauss = stage_points(mesh, points)
        stages = self._at(gauss.ravel()).reshape(*gauss.shape, -1)
        return replace(self, mesh=mesh, values=self._at(mesh), stages=stages, error=float("nan"))

    def laid_out(self, places: np.ndarray, mesh: np.ndarray, points: int) -> Solution:
        """The same functions over another interval or other pieces: the ends are carried to the new ones.

        Parameters
        ----------
        places : (K+1, 2), as the attribute; mesh : (N+1,) in its reference interval.
        """
        (a, b), (first, last) = self.interval, places[[0, -1], 1]

        def carried(x: np.ndarray) -> np.ndarray:
            there = np.interp(x, *places.T)
            return self._at(self._reference(a + (b - a) * (there - first) / (last - first), "right"))

        gauss = stage_points(mesh, points)
        stages = carried(gauss.ravel()).reshape(*gauss.shape, -1)
        return replace(self, mesh=mesh, values=carried(mesh), stages=stages, error=float("nan"), places=places)

    def with_parameters(self, **values: float) -> Solution:
        """A copy with some parameters changed; it solves the problem only after a new correction."""
        parameters = self.parameters.copy()
        for key, value in values.items():
            parameters[self._place_of(key)] = as_finite("parameters", key, value)
        return replace(self, parameters=parameters)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.continuation.store.solutions import save_solution

        save_solution(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Solution:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.continuation.store.solutions import load_solution

        return load_solution(path)

    def to_frame(self) -> Table:
        """Places of the mesh points and unknowns as a table; at inner points there are two rows, with both values."""
        from rodatlas.continuation.table import Table

        x, at = self.places.T
        part = np.clip(np.searchsorted(x, self.mesh, side="right") - 1, 0, len(x) - 2)
        amid = (np.diff(at) == 0)[part] & (self.mesh > x[part])  # neither side of an inner point
        return Table(np.column_stack([self.s, self.values])[~amid], columns=["s", *self.unknowns])

    @classmethod
    def from_function(
        cls,
        function: Any,
        unknowns: Sequence[str],
        parameters: Mapping[str, float],
        intervals: int = 20,
        points: int = 4,
        interval: tuple[float, float] = (0.0, 1.0),
    ) -> Solution:
        """Sample `function(s) -> (len(s), n)` on a uniform mesh: a first guess.

        Its interval is carried to that of the problem, so that relative places from 0 to 1 do for any length.

        Raises
        ------
        ValueError
            when the function returns another shape, or NaN.
        """
        check_function("function", function)
        check_type("intervals", intervals, Integral, "a whole number")
        if intervals < 1:
            raise ValueError(f"intervals: expected at least 1, got {intervals}")
        check_points(points)
        names, numbers = checked_names(unknowns, parameters)
        check_each("interval", interval, Real, "two numbers a < b")
        if len(interval) != 2 or not -math.inf < interval[0] < interval[1] < math.inf:
            raise ValueError(f"interval: expected two numbers a < b, got {shown(interval)}")
        mesh, places = np.linspace(0.0, 1.0, intervals + 1), np.column_stack([[0.0, 1.0], interval])
        gauss = stage_points(mesh, points)
        values, stages = (
            checked_table(f"function({len(x)} values of s)", function(np.interp(x, *places.T)), len(x), names)
            for x in (mesh, gauss.ravel())
        )
        stages = stages.reshape(*gauss.shape, len(names))
        return cls(names, tuple(parameters), mesh, values, stages, numbers, places=places)

    @classmethod
    def from_values(
        cls, s: Any, values: Any, unknowns: Sequence[str], parameters: Mapping[str, float], points: int = 4
    ) -> Solution:
        """A first guess from a table of values, joined by a cubic spline (lines where there are less than four).

        Parameters
        ----------
        s : (N+1,) increasing places, which become the mesh; the first and the last are the ends of the interval, and
            are carried to those of the problem.
        values : (N+1, n) unknowns there; with one unknown also (N+1,).

        Raises
        ------
        ValueError
            when `s` does not increase, or `values` has another shape, or either holds NaN.
        """
        names, numbers = checked_names(unknowns, parameters)
        check_points(points)
        at = as_array("s", s)
        if at.ndim != 1 or len(at) < 2 or not np.isfinite(at).all() or not (np.diff(at) > 0).all():
            raise ValueError(f"s: expected at least two finite, strictly increasing numbers, got {shown(at)}")
        mesh = (at - at[0]) / (at[-1] - at[0])
        if not (np.diff(mesh) > 0).all():
            raise ValueError(f"s: expected places that can be told apart, got {shown(at)}")
        table = checked_table("values", values, len(mesh), names)
        gauss = stage_points(mesh, points)
        stages = joined(mesh, table, gauss.ravel()).reshape(*gauss.shape, len(names))
        return cls(names, tuple(parameters), mesh, table, stages, numbers)

    @classmethod
    def from_table(
        cls,
        table: Any,
        unknowns: Sequence[str],
        parameters: Mapping[str, float],
        points: int = 4,
        s: str = "s",
    ) -> Solution:
        """A first guess from a CSV file or a table with named columns, such as what :meth:`to_frame` returns.

        Parameters
        ----------
        table : path of a CSV file whose first line, or last comment line (#) before the rows, names the columns; or a
            DataFrame or mapping of columns.
        unknowns : columns to read, in the order of the problem.
        s : column of places; see :meth:`from_values`.

        Raises
        ------
        ValueError
            when a column is missing, or is not what :meth:`from_values` expects.
        """
        import pandas as pd

        names, _ = checked_names(unknowns, parameters)
        check_points(points)
        check_type("s", s, str, "the name of a column")
        where = "table"
        if isinstance(table, (str, os.PathLike)):
            where = os.fspath(table)
            try:
                table = read_csv(where)
            except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
                raise ValueError(f"{where}: expected a CSV file with named columns, got: {error}") from None
        elif not isinstance(table, (pd.DataFrame, Mapping)):
            raise ValueError(f"table: expected a path, a DataFrame or a mapping of columns, got {shown(table)}")
        found = [str(name) for name in table]
        if missing := [name for name in (s, *names) if name not in found]:
            raise ValueError(f"{where}: expected the columns {', '.join((s, *names))}, got {', '.join(found)} "
                             f"(missing: {', '.join(missing)})")  # fmt: skip
        try:
            columns = [np.asarray(table[name], dtype=float) for name in (s, *names)]
        except (TypeError, ValueError) as error:
            raise ValueError(f"{where}: expected numbers in the columns {', '.join((s, *names))}: {error}") from None
        return cls.from_values(columns[0], np.column_stack(columns[1:]), names, parameters, points)


def stage_points(mesh: np.ndarray, points: int) -> np.ndarray:
    """(N, m) Gauss points of every interval."""
    return mesh[:-1, None] + np.diff(mesh)[:, None] * gauss_scheme(points).nodes


class Interpolation:
    """Evaluation at fixed s of piecewise polynomials on one mesh: on each interval the collocation polynomial."""

    def __init__(self, mesh: np.ndarray, points: int, s: np.ndarray):
        self._interval = np.clip(np.searchsorted(mesh, s, side="right") - 1, 0, len(mesh) - 2)
        left = mesh[self._interval]
        basis = gauss_scheme(points).basis((s - left) / (mesh[self._interval + 1] - left))
        self._left, self._stages = basis[:, :1], basis[:, None, 1:]
        self._end = s == mesh[-1]

    def __call__(self, values: np.ndarray, stages: np.ndarray) -> np.ndarray:
        """Values (len(s), n)."""
        out = self._left * values[self._interval] + np.matmul(self._stages, stages[self._interval])[:, 0]
        out[self._end] = values[-1]
        return out
