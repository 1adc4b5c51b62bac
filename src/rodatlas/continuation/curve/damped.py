"""Newton's method from far away: steps shortened until the next correction is smaller, or merely cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Row, Scale
from rodatlas.continuation.discrete.mesh import halved
from rodatlas.continuation.discrete.newton import Condition, NewtonCode, NewtonOptions, NewtonResult, fixed, newton
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns, Factorization
from rodatlas.continuation.problem.bvp import BVP

MAX_ITERATIONS = 60
FINER = 3  # meshes on which the iteration is tried, each with twice the intervals
SMALLEST = 1e-4  # share of a correction
TAKE_OVER = 0.05  # size of a correction, in scaled variables, from which undamped Newton is tried
LARGEST_STEPS = (2.0, 0.5)  # one after the other, in scaled variables, where no share makes the next correction smaller


def approached(
    bvp: BVP, guess: Solution, free: list[int], options: TraceOptions, scale: Scale | None = None
) -> Solution | None:
    """The solution that the damped iteration reaches from a guess at its own parameters; None when it reaches none.

    It is tried on the mesh of the guess and on finer ones: coarse equations need not have the solution at all.
    """
    scale, name = scale or Scale.of(bvp, guess), bvp.parameter_names[free[0]]
    mesh = guess.mesh
    for _ in range(FINER):
        colloc = Collocation(bvp, mesh, guess.points, guess.parameters, free, scale, options.backend)
        held = fixed(name, guess.parameter(name))(colloc)
        found = damped_newton(colloc, colloc.state(guess), [held], options.newton)
        if found.converged:
            return colloc.solution(found.state)
        if 2 * (len(mesh) - 1) > options.mesh.intervals[1]:
            return None
        mesh = halved(mesh)
    return None


def damped_newton(
    colloc: Collocation, x: Columns, conditions: Sequence[Condition] = (), options: NewtonOptions | None = None
) -> NewtonResult:
    r"""Solve F(x) = 0 and the conditions by corrections :math:`x + \lambda d` with natural monotonicity,

    .. math:: \|\bar d(x + \lambda d)\| \le (1 - \lambda / 4) \|d\|, \qquad F'(x) \bar d(y) = -F(y),

    a test that does not depend on how the equations are scaled. Where the right-hand side cannot be evaluated at
    :math:`x + \lambda d` the step is shortened too. An iteration that insists on descent may be caught in a valley
    without a solution; from there on steps are only cut to a largest size, as in a search for other solutions.

    Source: P. Deuflhard, "Newton Methods for Nonlinear Problems" (2004), section 3.3.
    """
    options = options or NewtonOptions()
    results = (_iterated(colloc, x, conditions, options, largest) for largest in (None, *LARGEST_STEPS))
    first: NewtonResult | None = None
    for result in results:
        if result.converged:
            return result
        first = first or result
    assert first is not None
    return first


@dataclass(frozen=True)
class _Correction:
    """Newton's correction d of a state, its size, and what solves for the next one with the same derivative."""

    d: Columns
    size: float
    fac: Factorization
    rows: list[Row]


def _iterated(
    colloc: Collocation, x: Columns, conditions: Sequence[Condition], options: NewtonOptions, largest: float | None
) -> NewtonResult:
    """Damped corrections or, with `largest`, corrections cut to that size, until undamped Newton converges."""
    sizes: list[float] = []
    share = 1.0
    for _ in range(MAX_ITERATIONS):
        at = _correction(colloc, x, conditions)
        if isinstance(at, NewtonCode):
            return NewtonResult(at, x, None, tuple(sizes), np.inf)
        if at.size < TAKE_OVER:
            last = newton(colloc, x, conditions, options)
            if last.converged:
                return replace(last, corrections=(*sizes, *last.corrections))
        share = _share(colloc, x, at, conditions, share) if largest is None else min(1.0, largest / at.size)
        if share < SMALLEST:
            return NewtonResult(NewtonCode.DIVERGED, x, None, tuple(sizes), np.inf)
        sizes.append(at.size)
        x = add(x, (share, at.d))
    return NewtonResult(NewtonCode.SLOW, x, None, tuple(sizes), np.inf)


def _correction(colloc: Collocation, x: Columns, conditions: Sequence[Condition]) -> _Correction | NewtonCode:
    lin, values, rows = _evaluated(colloc, x, conditions)
    if not (lin.is_finite and np.isfinite(values).all()):
        return NewtonCode.NOT_FINITE
    fac = colloc.factor(lin, rows)
    if fac.sign == 0.0:
        return NewtonCode.SINGULAR
    d = colloc.kept_symmetric(fac.solve(colloc.right_hand_side(lin.residual, rows, [-v for v in values])))
    size = colloc.norm(d)
    return _Correction(d, size, fac, rows) if np.isfinite(size) else NewtonCode.SINGULAR


def _share(colloc: Collocation, x: Columns, at: _Correction, conditions: Sequence[Condition], before: float) -> float:
    """The largest share of a correction, of twice the one before and its halves, that passes the monotonicity test."""
    share = min(1.0, 2.0 * before)
    while share >= SMALLEST:
        lin, values, _ = _evaluated(colloc, add(x, (share, at.d)), conditions)
        if lin.is_finite and np.isfinite(values).all():
            rest = at.fac.solve(colloc.right_hand_side(lin.residual, at.rows, [-v for v in values]))
            if colloc.norm(colloc.kept_symmetric(rest)) <= (1 - share / 4) * at.size:
                return share
        share *= 0.5
    return 0.0


def _evaluated(
    colloc: Collocation, x: Columns, conditions: Sequence[Condition]
) -> tuple[Linearization, list[float], list[Row]]:
    with np.errstate(all="ignore"):
        lin = colloc.linearize(x)
        found = [c(x) for c in conditions]
    return lin, [value for value, _ in found], [row for _, row in found]
