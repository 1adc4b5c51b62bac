"""Newton's method on the bordered collocation system, with result codes that say what to do next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from numbers import Integral

import numpy as np

from rodatlas.continuation.checks import check_fields, check_flag, check_type
from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.random_fields import displacement
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization

Condition = Callable[[Columns], tuple[float, Row]]
"""One more equation: state -> (residual, its gradient as a row)."""


class NewtonCode(Enum):
    """Why Newton stopped; the value is a sentence for the user."""

    CONVERGED = "converged"
    DIVERGED = "Newton's corrections grow: start closer to a solution, or take a smaller step"
    SLOW = "Newton converges too slowly: start closer to a solution, take a smaller step or refine the mesh"
    SINGULAR = (
        "the linearised problem is singular: check that boundary conditions are independent, declare the continuous "
        "symmetry that may move this state (ContinuousSymmetry), or leave this point"
    )
    NOT_FINITE = "the right-hand side or a boundary condition returned NaN or infinity: keep the unknowns in its domain"


CONTRACTION = 0.1  # largest ratio of two corrections with the same factors, else the matrix is factored again


@dataclass(frozen=True)
class NewtonOptions:
    """Tolerance on the estimated remaining error (scaled variables), and limits.

    Attributes
    ----------
    tolerance : largest error left, by estimate.
    max_iterations, max_growth : corrections, and the largest ratio of two of them.
    chord : whether a step of a branch is corrected with one factorization, that of its predicted point, as long as
        corrections shrink to a tenth each time. It takes one or two corrections more, so it pays where factoring is
        most of the work. Special points do not depend on it: they are solved for by Newton's method in any case, and
        where the weakest mode changes much on the way the matrix is factored again.
    """

    tolerance: float = 1e-9
    max_iterations: int = 8
    max_growth: float = 2.0
    chord: bool = False

    def __post_init__(self) -> None:
        check_flag("chord", self.chord)
        check_fields(self, "tolerance", "max_growth")
        check_type("max_iterations", self.max_iterations, Integral, "a whole number")
        if not (0 < self.tolerance < float("inf") and self.max_iterations >= 1 and self.max_growth > 0):
            raise ValueError(
                "newton: expected tolerance > 0 and finite, max_iterations >= 1 and max_growth > 0, got "
                f"{self.tolerance}, {self.max_iterations}, {self.max_growth}"
            )


@dataclass(frozen=True)
class NewtonResult:
    """Outcome of one Newton run.

    Attributes
    ----------
    state : Columns, the last iterate; factorization : of the derivative at the iterate before it, or, when `chord`, at
        an earlier one.
    corrections : sizes of the corrections made, in the scaled L2 norm.
    estimate : size of the next correction, estimated from the last two.
    """

    code: NewtonCode
    state: Columns
    factorization: Factorization | None
    corrections: tuple[float, ...]
    estimate: float
    chord: bool = False

    @property
    def converged(self) -> bool:
        return self.code is NewtonCode.CONVERGED


def newton(
    colloc: Collocation, x: Columns, conditions: Sequence[Condition], options: NewtonOptions | None = None,
    chord: bool = False,
) -> NewtonResult:  # fmt: skip
    r"""Solve F(x) = 0 together with as many conditions as there are free parameters beyond the problem's own.

    Convergence is quadratic, so after two corrections :math:`\delta_1, \delta_2` the next one is about
    :math:`\delta_2^3/\delta_1^2`; the run ends when that estimate is below the tolerance, without an evaluation
    that would only confirm it. State and corrections are projected on the subspace of the discretisation, if it has
    one. With `chord` the first factors serve as long as corrections shrink fast.
    """
    options = options or NewtonOptions()
    sizes: list[float] = []
    factorization, old = None, False
    estimate = np.inf

    def result(code: NewtonCode) -> NewtonResult:
        return NewtonResult(code, x, factorization, tuple(sizes), float(estimate), old)

    if colloc.within is not None:
        x = colloc.within.state(x)
    for _ in range(options.max_iterations):
        values, rows = zip(*[c(x) for c in conditions], strict=True) if conditions else ((), ())
        if chord and factorization is not None:
            with np.errstate(all="ignore"):
                right = colloc.right_hand_side(colloc.residual(x), rows, [-v for v in values])
            dx, size = _correction(colloc, factorization, right)
            old = size <= CONTRACTION * sizes[-1]
        if not old:
            with np.errstate(all="ignore"):
                lin = colloc.linearize(x)
                finite = lin.is_finite
            if not (finite and np.isfinite(values).all()):
                return result(NewtonCode.NOT_FINITE)
            factorization = colloc.factor(lin, rows)
            if factorization.sign == 0.0:
                return result(NewtonCode.SINGULAR)
            right = colloc.right_hand_side(lin.residual, rows, [-v for v in values])
            dx, size = _correction(colloc, factorization, right)
        if not np.isfinite(size):
            return result(NewtonCode.SINGULAR)
        if sizes and size > options.max_growth * sizes[-1]:
            return result(NewtonCode.DIVERGED)
        x = add(x, (1.0, dx))
        # with the same factors the next correction shrinks as this one did, or, after the first one, twice as little
        estimate = 2.0 * size * size / sizes[-1] if old else _next_correction(sizes, size)
        sizes.append(size)
        if estimate < options.tolerance:
            return result(NewtonCode.CONVERGED)
    return result(NewtonCode.SLOW)


def _correction(colloc: Collocation, factorization: Factorization, right: Blocks) -> tuple[Columns, float]:
    """A correction with given factors, and its size."""
    dx = colloc.kept_symmetric(factorization.solve(right))
    return dx, colloc.norm(dx)


def _next_correction(sizes: list[float], size: float) -> float:
    """Estimate of the correction that would follow one of `size`, from quadratic convergence."""
    if not sizes or sizes[-1] == 0.0:
        return size**1.5
    return max(size * (size / sizes[-1]) ** 2, size**2)


def is_singular_around(colloc: Collocation, x: Columns, row: Row, tangent: Columns | None = None) -> bool:
    """Whether the problem, bordered by a row, is singular to round-off at x and at states near it.

    At a branch point the first holds but not the second. Both hold where conditions repeat one another or leave
    something undetermined: then a consistent right-hand side has many solutions, and Newton finds an arbitrary one.
    What is left undetermined only by the solutions themselves, as the period of an oscillation of amplitude zero, shows
    nowhere else than along them: with a tangent, the states near by are also those along it and along each parameter.
    """
    rng = np.random.default_rng(17)
    near = add(x, (1e-3, displacement(colloc, rng, len(x.scalars), terms=2)))
    if not _is_singular(colloc, x, row, rng):
        return False
    if _is_singular(colloc, near, row, rng):
        return True
    if tangent is None:
        return False
    k = len(colloc.free)
    ways = [tangent, *(Columns(0 * x.stage, 0 * x.mesh, unit) for unit in np.eye(k))] if k > 1 else []
    return bool(ways) and all(_is_singular(colloc, add(x, (1e-3, way)), row, rng) for way in ways)


def _is_singular(colloc: Collocation, x: Columns, row: Row, rng: np.random.Generator) -> bool:
    """Whether the response to a load changes by more than a thousandth when the derivative changes by 1e-14.

    Entries change in proportion, those of the parameters also by that much in scaled variables. (The size of the
    response would not tell: it is large, and accurate, for growing solutions.)
    """
    n_int, _, n = x.stage.shape
    load = Blocks(
        colloc.step[:, None, None] * rng.normal(size=x.stage.shape), np.zeros((n_int, n)),
        rng.normal(size=colloc.bvp.n_boundary + (row.stage is None)),
        rng.normal(size=colloc.bvp.n_integral + (row.stage is not None)),
    )  # fmt: skip
    responses = []
    with np.errstate(all="ignore"):
        lin = colloc.linearize(x)
        if not lin.is_finite:
            return False
        keys = ("jac", "stage_scal", "b_left", "b_right", "b_scal", "dense", "dense_scal")
        blocks = {key: getattr(lin, key) for key in keys}
        for noise in (0.0, 1e-14):
            blurred = {key: block * (1.0 + noise * rng.normal(size=block.shape)) for key, block in blocks.items()}
            for key in ("stage_scal", "b_scal", "dense_scal"):  # a parameter without effect has a column of zeros
                blurred[key] = blurred[key] + noise * rng.normal(size=blurred[key].shape)
            factorization = colloc.factor(replace(lin, **blurred), [row])
            if factorization.sign == 0.0:
                return True
            responses.append(factorization.solve(load))
        change = colloc.norm(add(responses[0], (-1.0, responses[1])))
        return not change < 1e-3 * colloc.norm(responses[0])


def fixed(name: str, value: float) -> Callable[[Collocation], Condition]:
    """Condition 'parameter or observable equals value', to be bound to a discretisation."""

    def bind(colloc: Collocation) -> Condition:
        def condition(x: Columns) -> tuple[float, Row]:
            current, row = colloc.observable_row(name, x)
            return current - colloc.bvp.coordinate(name, value), row

        return condition

    return bind


def plane(colloc: Collocation, normal: Columns, point: Columns) -> Condition:
    """Condition <normal, x - point> = 0: the pseudo-arclength condition."""
    row = colloc.row(normal)
    offset = row.dot(point)

    def condition(x: Columns) -> tuple[float, Row]:
        return row.dot(x) - offset, row

    return condition
