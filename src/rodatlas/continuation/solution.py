"""One solution of a boundary value problem on a mesh."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.gauss import gauss_scheme

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Solution:
    """Piecewise polynomial solution: mesh, values at mesh and Gauss points, and all parameters.

    Attributes
    ----------
    unknowns, parameter_names : names of the columns of `values` and of the entries of `parameters`.
    mesh : (N+1,) mesh points, from 0 to 1.
    values : (N+1, n) unknowns at the mesh points (order 2m accurate).
    stages : (N, m, n) unknowns at the Gauss points.
    parameters : (np,) values of all parameters.
    error : float
        estimated largest error at mesh points relative to the scale of each unknown; nan when not estimated.
    observables : mapping of str to float.
    """

    unknowns: tuple[str, ...]
    parameter_names: tuple[str, ...]
    mesh: np.ndarray
    values: np.ndarray
    stages: np.ndarray
    parameters: np.ndarray
    error: float = float("nan")
    observables: Mapping[str, float] = field(default_factory=dict)

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
        return float(self.parameters[self.parameter_names.index(name)])

    def __getitem__(self, name: str) -> Any:
        """A parameter or observable (float), or an unknown at the mesh points (N+1,)."""
        if name in self.parameter_names:
            return self.parameter(name)
        if name in self.unknowns:
            return self.values[:, self.unknowns.index(name)]
        return self.observables[name]

    def __call__(self, s: np.ndarray | float, name: str | None = None) -> np.ndarray:
        """Unknowns (len(s), n), or one of them (len(s),), at any s in [0, 1]."""
        s = np.atleast_1d(np.asarray(s, dtype=float))
        out = Interpolation(self.mesh, self.points, s)(self.values, self.stages)
        return out if name is None else out[:, self.unknowns.index(name)]

    def gauss_points(self) -> np.ndarray:
        """(N, m) abscissae of the stages."""
        return stage_points(self.mesh, self.points)

    def mean(self, density: np.ndarray) -> float:
        """Integral over [0, 1] of a density given at the Gauss points (N, m)."""
        return float(np.diff(self.mesh) @ (density @ gauss_scheme(self.points).weights))

    def remesh(self, mesh: np.ndarray, points: int | None = None) -> Solution:
        """The same functions interpolated on another mesh (to be corrected by Newton before use)."""
        points = points or self.points
        gauss = stage_points(mesh, points)
        stages = self(gauss.ravel()).reshape(*gauss.shape, -1)
        return replace(self, mesh=mesh, values=self(mesh), stages=stages, error=float("nan"))

    def with_parameters(self, **values: float) -> Solution:
        """A copy with some parameters changed; it solves the problem only after a new correction."""
        parameters = self.parameters.copy()
        for key, value in values.items():
            parameters[self.parameter_names.index(key)] = value
        return replace(self, parameters=parameters)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.continuation.store import save_solution

        save_solution(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Solution:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.continuation.store import load_solution

        return load_solution(path)

    def to_frame(self) -> pd.DataFrame:
        """Mesh points and unknowns as a table."""
        import pandas as pd

        return pd.DataFrame(np.column_stack([self.mesh, self.values]), columns=["s", *self.unknowns])

    @classmethod
    def from_function(
        cls,
        function: Any,
        unknowns: Sequence[str],
        parameters: Mapping[str, float],
        intervals: int = 20,
        points: int = 4,
    ) -> Solution:
        """Sample `function(s) -> (len(s), n)` on a uniform mesh: a first guess."""
        mesh = np.linspace(0.0, 1.0, intervals + 1)
        gauss = stage_points(mesh, points)
        values = np.asarray(function(mesh), dtype=float).reshape(len(mesh), len(unknowns))
        stages = np.asarray(function(gauss.ravel()), dtype=float).reshape(*gauss.shape, len(unknowns))
        return cls(tuple(unknowns), tuple(parameters), mesh, values, stages, np.array(list(parameters.values()), float))


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
