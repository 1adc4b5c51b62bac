"""Mesh: where to put the points, and how many are needed for a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral

import numpy as np

from rodatlas.continuation.checks import check_each, check_fields, check_type
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.jumps import jump_error, residual_of
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.gauss import MOST_POINTS
from rodatlas.continuation.linear.matrix import Columns, Factorization

MIN_INTERVALS = 4
ACCEPTED = 10.0  # errors up to this multiple of the tolerance: between two adaptations a mesh lags behind the solution
MIN_WIDTH = 1e-12  # narrowest interval, in units of the mean one: below about 1e-14 two mesh points could coincide


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
        check_fields(self, "tolerance", "points", "every")
        check_each("intervals", self.intervals, Integral, "(fewest, most), whole numbers")
        if len(self.intervals) != 2:
            raise ValueError(f"intervals: expected (fewest, most), got {self.intervals}")
        for name in ("points", "every"):
            check_type(name, getattr(self, name), Integral, "a whole number")
        if not 0 < self.tolerance < 1:
            raise ValueError(f"tolerance: expected a number between 0 and 1, got {self.tolerance}")
        if not 1 <= self.points <= MOST_POINTS:
            raise ValueError(f"points: expected 1 to {MOST_POINTS} Gauss points per interval, got {self.points}")
        if self.every < 1:
            raise ValueError(f"every: expected at least 1 step between adaptations, got {self.every}")
        if not MIN_INTERVALS <= self.intervals[0] <= self.intervals[1]:
            raise ValueError(f"intervals: expected {MIN_INTERVALS} <= fewest <= most, got {self.intervals}")

    @property
    def is_fixed_size(self) -> bool:
        return self.intervals[0] == self.intervals[1]

    def accepts(self, error: float) -> bool:
        """Whether an estimated error is one to return without a word; on a mesh of fixed size none is estimated."""
        return self.is_fixed_size or error <= ACCEPTED * self.tolerance


def monitor(colloc: Collocation, x: Columns) -> np.ndarray:
    r"""Density of the mesh (N,): :math:`|u^{(m+1)}|^{1/(m+1)}`, from jumps of the m-th derivative.

    The m-th derivative of the piecewise polynomial is constant on each interval; its jump over the distance of two
    mid-points estimates the next derivative (de Boor 1973; Ascher, Mattheij & Russell 1995, section 9.2). A tenth
    of the mean is added, so that no interval grows without bound where the solution happens to be flat.
    """
    m, step, layout = colloc.scheme.points, colloc.step, colloc.bvp.layout
    top = colloc.scheme.top
    derivative = (top[0] * x.mesh[:-1] + np.einsum("i,jia->ja", top[1:], x.stage)) / step[:, None] ** m
    if len(layout.weights) == 1:
        density = _density(derivative, step, m)
    else:
        density = np.zeros(len(step))
        for part in np.flatnonzero(~layout.is_inner):  # each piece by itself: derivatives may jump between them
            mine = colloc.part == part
            density[mine] = _density(derivative[mine], step[mine], m)
    mean = float(density @ step)
    density = density + 0.1 * mean if mean > 0 else np.ones_like(density)
    density[layout.is_inner[colloc.part]] = 0.0
    return density


def _density(derivative: np.ndarray, step: np.ndarray, m: int) -> np.ndarray:
    """The density (N,) on one piece from the m-th derivatives (N, n) there."""
    if len(step) < 2:
        return np.zeros(len(step))
    change = derivative[1:] - derivative[:-1]
    jump = np.sqrt(np.einsum("ja,ja->j", change, change)) / ((step[1:] + step[:-1]) / 2)
    return np.concatenate([jump[:1], (jump[1:] + jump[:-1]) / 2, jump[-1:]]) ** (1.0 / (m + 1))


def equidistribute(mesh: np.ndarray, density: np.ndarray, intervals: int) -> np.ndarray:
    """Mesh of `intervals` that all hold the same integral of a piecewise constant density.

    Intervals that would be too narrow for two floating-point numbers to differ are widened.
    """
    cumulative = np.concatenate([[0.0], np.cumsum(density * np.diff(mesh))])
    new = np.interp(np.linspace(0.0, cumulative[-1], intervals + 1), cumulative, mesh)
    new[0], new[-1] = mesh[0], mesh[-1]
    mean = (mesh[-1] - mesh[0]) / intervals
    if np.diff(new).min() < MIN_WIDTH * mean:
        new += 1e2 * MIN_WIDTH * (np.linspace(mesh[0], mesh[-1], intervals + 1) - new)
    return new


def halved(mesh: np.ndarray) -> np.ndarray:
    """Every interval cut in two."""
    out = np.empty(2 * len(mesh) - 1)
    out[::2] = mesh
    out[1::2] = (mesh[1:] + mesh[:-1]) / 2
    return out


@dataclass(frozen=True)
class ErrorEstimate:
    """Largest error at mesh points, and the part of it that is round-off and that no mesh can remove.

    Errors of an unknown are relative to its largest value, or absolute where that is below one. `jumps` says that the
    right-hand side seems to jump inside an interval.
    """

    error: float
    round_off: float
    jumps: bool = False

    @property
    def is_round_off(self) -> bool:
        """Whether round-off dominates; of a large error the second correction is what is left of nonlinearity."""
        return self.error < 1e-5 and self.round_off > 0.2 * self.error


@dataclass(frozen=True)
class Halves:
    """The discretisation on halved intervals, the factored matrix there (bordered), and the error that it tells."""

    colloc: Collocation
    factorization: Factorization
    estimate: ErrorEstimate


def error_estimate(colloc: Collocation, x: Columns, tangent: Columns | None = None) -> ErrorEstimate:
    """Error of the solution at its mesh points, see :func:`halves_of`."""
    return halves_of(colloc, x, tangent).estimate


def halves_of(colloc: Collocation, x: Columns, tangent: Columns | None = None) -> Halves:
    r"""Error of the solution at its mesh points.

    The solution is carried to the mesh of halved intervals, where the collocation error is about
    :math:`2^{-2m}` of the present one, and corrected there once; the correction at the old mesh points is the
    error. Because Newton is quadratic and the interpolant is accurate to :math:`h^{m+1}`, one correction is enough;
    a second one, with the same factors, measures round-off. Corrections are made across the tangent when it is
    given (so that nothing special happens at folds), else at fixed continuation parameter.
    """
    fine = colloc.on(halved(colloc.mesh))
    carry = colloc.carrier(fine)
    y = carry(x)
    lin = fine.linearize(y)
    if tangent is None:
        _, row = fine.observable_row(colloc.bvp.parameter_names[colloc.free[0]], y)
    else:
        row = fine.row(carry(tangent))
    factorization = fine.factor(lin, [row])
    if factorization.sign == 0.0:
        return Halves(fine, factorization, ErrorEstimate(float("nan"), float("nan")))
    dx = factorization.solve(fine.right_hand_side(lin.residual, [row], [0.0]))
    again = factorization.solve(fine.right_hand_side(fine.residual(add(y, (1.0, dx))), [row], [0.0]))
    error, noise = (relative_change(colloc, x, Columns(d.stage, d.mesh[::2], d.scalars)) for d in (dx, again))
    jump = jump_error(residual_of(colloc, x), colloc.step)
    error = max(error, jump, fine.unfolding(add(y, (1.0, dx))))
    return Halves(fine, factorization, ErrorEstimate(error, noise, jump > 0.0))


def relative_change(colloc: Collocation, x: Columns, dx: Columns) -> float:
    """Largest change at mesh points, of each unknown relative to its largest value (or to one)."""
    su, sp = colloc.scale.unknowns, colloc.scale.parameters[colloc.free]
    size = np.maximum(1.0, np.abs(x.mesh).max(axis=0) * su)
    changes = np.abs(dx.mesh).max(axis=0) * su / size
    amount = np.maximum(1.0, np.abs(x.scalars[: len(sp)]) * sp)
    amount[[colloc.bvp.parameter_names[i] in colloc.bvp.log for i in colloc.free]] = 1.0  # relative as it is
    scalars = np.abs(dx.scalars) * sp / amount
    return float(max(changes.max(), scalars.max(initial=0.0)))


def wanted_intervals(control: MeshControl, intervals: int, estimate: ErrorEstimate) -> int:
    """Intervals that bring the error to 0.3 of the tolerance, from its order 2m; changes are damped.

    The mesh does not grow when what is left of the error is round-off.
    """
    if control.is_fixed_size or not np.isfinite(estimate.error):
        return int(np.clip(intervals, *control.intervals))
    ratio = (max(estimate.error, 1e-16) / (0.3 * control.tolerance)) ** (1.0 / (2 * control.points))
    wanted = intervals * float(np.clip(ratio, 0.7, 2.0))
    if 0.85 < ratio < 1.0 or (ratio > 1.0 and estimate.is_round_off):
        wanted = intervals
    return int(np.clip(round(wanted), *control.intervals))
