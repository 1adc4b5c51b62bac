"""Mesh: where to put the points, and how many are needed for a tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.collocation import Collocation
from rodatlas.continuation.linear import Columns

MIN_INTERVALS = 4


@dataclass(frozen=True)
class MeshControl:
    """How the mesh follows the solution.

    Attributes
    ----------
    tolerance : largest error at mesh points, relative to the scale of each unknown.
    points : Gauss points per interval, m.
    intervals : (fewest, most); equal values fix the size, and only the places move.
    every : steps between two adaptations.
    """

    tolerance: float = 1e-8
    points: int = 4
    intervals: tuple[int, int] = (10, 400)
    every: int = 3

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1:
            raise ValueError(f"tolerance: expected a number between 0 and 1, got {self.tolerance}")
        if not 1 <= self.points <= 9:
            raise ValueError(f"points: expected 1 to 9 Gauss points per interval, got {self.points}")
        if self.every < 1:
            raise ValueError(f"every: expected at least 1 step between adaptations, got {self.every}")
        if not MIN_INTERVALS <= self.intervals[0] <= self.intervals[1]:
            raise ValueError(f"intervals: expected {MIN_INTERVALS} <= fewest <= most, got {self.intervals}")

    @property
    def is_fixed_size(self) -> bool:
        return self.intervals[0] == self.intervals[1]


def monitor(colloc: Collocation, x: Columns) -> np.ndarray:
    r"""Density of the mesh (N,): :math:`|u^{(m+1)}|^{1/(m+1)}`, from jumps of the m-th derivative.

    The m-th derivative of the piecewise polynomial is constant on each interval; its jump over the distance of two
    mid-points estimates the next derivative (de Boor 1973; Ascher, Mattheij & Russell 1995, section 9.2). A tenth
    of the mean is added, so that no interval grows without bound where the solution happens to be flat.
    """
    m = colloc.scheme.points
    top = colloc.scheme.top
    derivative = (top[0] * x.mesh[:-1] + np.einsum("i,jia->ja", top[1:], x.stage)) / colloc.step[:, None] ** m
    if len(colloc.step) == 1:
        return np.ones(1)
    middle = (colloc.step[1:] + colloc.step[:-1]) / 2
    jump = np.linalg.norm(np.diff(derivative, axis=0), axis=1) / middle
    next_derivative = np.concatenate([[jump[0]], (jump[1:] + jump[:-1]) / 2, [jump[-1]]])
    density = next_derivative ** (1.0 / (m + 1))
    mean = float(density @ colloc.step)
    return density + 0.1 * mean if mean > 0 else np.ones_like(density)


def equidistribute(mesh: np.ndarray, density: np.ndarray, intervals: int) -> np.ndarray:
    """Mesh of `intervals` that all hold the same integral of a piecewise constant density."""
    cumulative = np.concatenate([[0.0], np.cumsum(density * np.diff(mesh))])
    new = np.interp(np.linspace(0.0, cumulative[-1], intervals + 1), cumulative, mesh)
    new[0], new[-1] = mesh[0], mesh[-1]
    return new


def halved(mesh: np.ndarray) -> np.ndarray:
    """Every interval cut in two."""
    out = np.empty(2 * len(mesh) - 1)
    out[::2] = mesh
    out[1::2] = (mesh[1:] + mesh[:-1]) / 2
    return out


def error_estimate(colloc: Collocation, x: Columns) -> float:
    r"""Largest error of the solution at its mesh points, in scaled variables.

    The solution is carried to the mesh of halved intervals, where the collocation error is about
    :math:`2^{-2m}` of the present one, and corrected there once; the correction at the old mesh points is the
    error. Because Newton is quadratic and the interpolant is accurate to :math:`h^{m+1}`, one correction is enough.
    The continuation parameter is held.
    """
    fine = Collocation(
        colloc.bvp, halved(colloc.mesh), colloc.scheme.points, colloc.base, list(colloc.free), colloc.scale,
        colloc.backend,
    )  # fmt: skip
    y = colloc.interpolate(x, fine)
    lin = fine.linearize(y)
    _, row = fine.observable_row(colloc.bvp.parameter_names[colloc.free[0]], y)
    factorization = fine.factor(lin, [row])
    if factorization.sign == 0.0:
        return float("nan")
    dx = factorization.solve(fine.right_hand_side(lin.residual, [row], [0.0]))
    return float(max(np.abs(dx.mesh[::2]).max(), np.abs(dx.scalars).max()))


def wanted_intervals(control: MeshControl, intervals: int, error: float) -> int:
    """Intervals that bring the error to half the tolerance, from its order 2m; changes are damped."""
    if control.is_fixed_size or not np.isfinite(error):
        return int(np.clip(intervals, *control.intervals))
    ratio = (max(error, 1e-16) / (0.3 * control.tolerance)) ** (1.0 / (2 * control.points))
    wanted = intervals * float(np.clip(ratio, 0.7, 2.0))
    if 0.85 < ratio < 1.0:
        wanted = intervals
    return int(np.clip(round(wanted), *control.intervals))


