"""The discrete problem: residual, bordered matrix and second derivatives of Gauss collocation on one mesh.

All vectors here are in scaled variables: unknown a is measured in units of `scale.unknowns[a]`, parameter b in
units of `scale.parameters[b]`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rodatlas.continuation.discrete.product import gradient_of_product
from rodatlas.continuation.discrete.solution import Interpolation, Solution, stage_points
from rodatlas.continuation.linear.gauss import gauss_scheme
from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns, Factorization, factor
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.problem.evaluator import evaluator

if TYPE_CHECKING:
    from rodatlas.continuation.discrete.phase import Phase


class Projection(Protocol):
    """Projection of states, and of tangents and corrections, on a subspace that Newton's method keeps to.

    `mesh` makes a mesh symmetric, as the subspace may need it.
    """

    def mesh(self, mesh: np.ndarray) -> np.ndarray: ...

    def state(self, x: Columns) -> Columns: ...

    def __call__(self, v: Columns) -> Columns: ...


@dataclass(frozen=True)
class Scale:
    """Units of the unknowns (n,) and of all parameters (np,): they define the arclength norm."""

    unknowns: np.ndarray
    parameters: np.ndarray

    @classmethod
    def of(cls, bvp: BVP, solution: Solution) -> Scale:
        """The problem's declared scales; else max(1, largest value in the solution); parameters: one."""
        largest = np.maximum(1.0, np.abs(solution.stages).max(axis=(0, 1)))
        unknowns = [bvp.scales.get(name, largest[i]) for i, name in enumerate(bvp.unknowns)]
        return cls(np.array(unknowns, float), np.array([bvp.scales.get(name, 1.0) for name in bvp.parameters], float))

    def with_unfolding(self, bvp: BVP) -> Scale:
        """The units with those of the problem's unfolding parameters, one each, behind the user's."""
        return replace(self, parameters=with_unfolding(bvp, self.parameters, 1.0))


def with_unfolding(bvp: BVP, parameters: np.ndarray, value: float = 0.0) -> np.ndarray:
    """The user's parameters and the problem's unfolding parameters, which are zero when they were not among them."""
    count = len(bvp.parameters)
    return np.append(parameters[:count], np.full(max(0, count - len(parameters)), value))


@dataclass(frozen=True)
class Row:
    """One more condition, linearised: weights on stages (or None), on both ends (or None) and on the scalars."""

    scalars: np.ndarray
    stage: np.ndarray | None = None
    ends: tuple[np.ndarray, np.ndarray] | None = None

    def dot(self, x: Columns) -> float:
        total = float(self.scalars @ x.scalars[: len(self.scalars)])
        if self.stage is not None:
            total += float(np.vdot(self.stage, x.stage))
        if self.ends is not None:
            total += float(self.ends[0] @ x.mesh[0] + self.ends[1] @ x.mesh[-1])
        return total


@dataclass(frozen=True)
class Linearization:
    """Residual and derivative blocks at one state; :meth:`Collocation.factor` borders and factors them."""

    residual: Blocks
    jac: np.ndarray
    stage_scal: np.ndarray
    b_left: np.ndarray
    b_right: np.ndarray
    b_scal: np.ndarray
    dense: np.ndarray
    dense_scal: np.ndarray

    @property
    def is_finite(self) -> bool:
        """Whether no residual or derivative is NaN or infinite (a sum is, when one of its terms is)."""
        r = self.residual
        parts = (r.stage, r.chain, r.ends, r.dense, self.jac, self.stage_scal, self.b_left, self.b_right, self.b_scal,
                 self.dense, self.dense_scal)  # fmt: skip
        return math.isfinite(sum(float(np.add.reduce(part, axis=None)) for part in parts if part.size))

    def with_scalars(self, keep: Sequence[int]) -> Linearization:
        """The same with the columns of some free parameters only."""
        index = np.array(keep, dtype=np.int64)
        return replace(
            self, stage_scal=self.stage_scal[:, :, index], b_scal=self.b_scal[:, index],
            dense_scal=self.dense_scal[:, index],
        )  # fmt: skip

    def column(self, scalar: int) -> Blocks:
        """Derivative of the equations with respect to one free parameter."""
        stage = self.stage_scal[:, :, scalar].reshape(self.residual.stage.shape)
        return Blocks(stage, np.zeros_like(self.residual.chain), self.b_scal[:, scalar], self.dense_scal[:, scalar])


class Collocation:
    """Gauss collocation of `bvp` on one mesh, with some parameters free.

    Parameters
    ----------
    bvp : BVP
    mesh : (N+1,) of the reference interval; knots of the problem's layout are made points of it
    points : Gauss points per interval
    base : (np,) values of all parameters; the free ones are overridden by the state, whose scalars are coordinates
        of the free ones, see :meth:`BVP.coordinates`
    free : indices of the free parameters, the first one being the continuation parameter
    scale : Scale
    within : subspace of symmetric states in which Newton's method stays, see
        :mod:`rodatlas.continuation.symmetric.isotropy`

    A problem with room for phase conditions (:meth:`BVP.unfolded`) gets them in :meth:`hold`, or from the first state
    that is linearised.
    """

    def __init__(
        self, bvp: BVP, mesh: np.ndarray, points: int, base: np.ndarray, free: Sequence[int], scale: Scale,
        backend: str | None = None, within: Projection | None = None,
    ):  # fmt: skip
        scale, self.base = scale.with_unfolding(bvp), with_unfolding(bvp, base)
        self.bvp, self.scheme, self.scale, self.backend, self.within = bvp, gauss_scheme(points), scale, backend, within
        self.free, self._coordinates = np.array(free, dtype=np.int64), bvp.coordinates(self.base)
        self.phase: Phase | None = None
        self.mesh = bvp.layout.fitted(mesh)
        self.step = np.diff(self.mesh)
        self.count = len(self.step) * points
        self.gauss = stage_points(self.mesh, points)
        self.part = bvp.layout.part_of_intervals(self.mesh)
        self._su, self._sp = scale.unknowns, scale.parameters[self.free]
        sp = bvp.sparsity
        self._jac_scale = self._su[sp.cols] / self._su[sp.rows]
        self.quadrature = (self.step[:, None] * self.scheme.weights)[:, :, None]
        self._weight = self.step[:, None, None] / self._su
        self._scal_weight = -np.repeat(self._weight, points, axis=0).transpose(0, 2, 1) * self._sp
        self._norm = bvp.layout.weights[self.part][:, None, None] * self.quadrature
        self._field = evaluator(bvp.traced.field, self.count)
        self.moving = moving_among(bvp, self.free)
        self._ends = evaluator(bvp.traced.ends, 1)
        self._has_densities = bvp.traced.densities.numel_out(0) > 0
        if self._has_densities:
            self._densities = evaluator(bvp.traced.densities, self.count)
        self._kept: dict[str, Any] = {}
        self._carrier: tuple[Collocation, Callable[[Columns], Columns]] | None = None  # the last one

    @classmethod
    def at(
        cls, bvp: BVP, solution: Solution, free: Sequence[int], scale: Scale | None = None, backend: str | None = None
    ) -> Collocation:
        """On the mesh of a solution, at its parameters, in its scales if none are given."""
        scale = scale or Scale.of(bvp, solution)
        return cls(bvp, solution.mesh, solution.points, solution.parameters, free, scale, backend)

    def hold(
        self, reference: Columns, like: Phase | None = None, tangent: Columns | None = None,
        away: Columns | None = None,
    ) -> None:  # fmt: skip
        """Refer the phase conditions, if the problem has some, to a state; `like` those of a state near by.

        `away` is a state on the branch that leaves there, whose orbit counts where the state itself is not moved.
        """
        from rodatlas.continuation.discrete.phase import phase_at, renewed

        if self.bvp.phases and like is not None and tangent is not None:
            self.phase = renewed(self, reference, like, tangent, away)
        elif self.bvp.phases:
            self.phase = phase_at(self, reference, away)

    def on(self, mesh: np.ndarray) -> Collocation:
        """The same discretisation on another mesh."""
        new = Collocation(
            self.bvp, mesh, self.scheme.points, self.base, list(self.free), self.scale, self.backend, self.within
        )  # fmt: skip
        new.phase = self.phase and self.phase.on(self, new)
        return new

    def kept(self, key: str, make: Callable[[], Any]) -> Any:
        """Something that belongs to this discretisation, made when it is first asked for."""
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    # -- states ---------------------------------------------------------------------------------------------------

    def state(self, solution: Solution) -> Columns:
        """Scaled state of a solution, interpolated when its mesh, or its breakpoints, are others."""
        layout = self.bvp.layout
        if not np.array_equal(solution.places[:, 0], layout.knots):
            to = self.bvp.places(solution.parameters)
            solution = solution.laid_out(to, self.mesh, self.scheme.points)
        elif not np.array_equal(solution.mesh, self.mesh) or solution.points != self.scheme.points:
            solution = solution.remesh(self.mesh, self.scheme.points)
        scalars = self.bvp.coordinates(solution.parameters)[self.free] / self._sp
        return Columns(solution.stages / self._su, solution.values / self._su, scalars)

    def parameters(self, x: Columns) -> np.ndarray:
        """Coordinates (np,) of all parameters at a state."""
        p = self._coordinates.copy()
        p[self.free] = x.scalars[: len(self.free)] * self._sp
        return p

    def solution(self, x: Columns, error: float = float("nan")) -> Solution:
        names, p = self.bvp.own_parameters, self.bvp.values(self.parameters(x))
        values, stages, places = x.mesh * self._su, x.stage * self._su, self.bvp.places(p)
        bare = Solution(self.bvp.unknowns, names, self.mesh, values, stages, p[: len(names)], error, places=places)
        return replace(bare, observables=self.observables(x))

    def observables(self, x: Columns) -> dict[str, float]:
        """Values of the problem's observables."""
        slots = self.bvp.observable_slots()
        ends = self._ends(x.mesh[[0, -1]] * self._su, self.parameters(x))[0][0] if slots else None
        dens = self._integrand(x)[0] if slots and self._has_densities else None
        weights = self.quadrature.reshape(-1)
        out = {}
        for name, (kind, i) in slots.items():
            value = ends[i] if kind == "end" else weights @ dens[:, i]  # type: ignore[index]
            out[name] = float(value)
        return out

    def carrier(self, other: Collocation) -> Callable[[Columns], Columns]:
        """Function that interpolates states or tangents of this mesh on the mesh of another one (scales equal)."""
        if self._carrier is not None and self._carrier[0] is other:
            return self._carrier[1]
        at = Interpolation(self.mesh, self.scheme.points, np.concatenate([other.gauss.ravel(), other.mesh]))
        shape, count = (*other.gauss.shape, len(self._su)), other.gauss.size

        def carry(x: Columns) -> Columns:
            values = at(x.mesh, x.stage)
            return Columns(values[:count].reshape(shape), values[count:], x.scalars.copy())

        self._carrier = other, carry
        return carry

    def interpolate(self, x: Columns, other: Collocation) -> Columns:
        """One state or tangent on the mesh of another discretisation."""
        return self.carrier(other)(x)

    def kept_symmetric(self, v: Columns) -> Columns:
        """The part of a correction or tangent that stays in the subspace `within`; all of it when there is none."""
        return v if self.within is None else self.within(v)

    def row(self, v: Columns) -> Row:
        """The functional <v, .> of the mesh-independent inner product."""
        return Row(v.scalars.copy(), self._norm * v.stage)

    def weights(self, scalars: int) -> np.ndarray:
        """Weights of the inner product on stages, mesh values and so many scalars, one after the other."""
        stage = np.broadcast_to(self._norm, (*self.gauss.shape, len(self._su))).ravel()
        return np.concatenate([stage, np.zeros(self.mesh.size * len(self._su)), np.ones(scalars)])

    def inner(self, v: Columns, w: Columns) -> float:
        r"""Inner product :math:`\int v \cdot w\,ds / L + \sum v_p w_p` in scaled variables, L the interval's length."""
        return float(np.vdot(self._norm * v.stage, w.stage) + v.scalars @ w.scalars)

    def norm(self, v: Columns) -> float:
        return float(np.sqrt(self.inner(v, v)))

    @property
    def unfolding_scalars(self) -> np.ndarray:
        """Numbers, among the free parameters, of those that unfold phase conditions."""
        return np.flatnonzero(self.free >= len(self.bvp.own_parameters))

    def unfolding(self, x: Columns) -> float:
        """Largest unfolding parameter of the phase conditions, which vanishes at solutions."""
        return float(np.abs(x.scalars[self.unfolding_scalars]).max(initial=0.0))

    # -- first derivatives ----------------------------------------------------------------------------------------

    def linearize(self, x: Columns) -> Linearization:
        """Residual and derivatives at the state x (only its first len(free) scalars are used).

        Phase conditions that refer to no state yet refer to this one from here on.
        """
        if not self.bvp.phases:
            return self.bare_linearization(x)
        if self.phase is None:
            self.hold(x)
        assert self.phase is not None
        return self.phase.added(self, x, self.bare_linearization(x))

    def residual(self, x: Columns) -> Blocks:
        """The residual alone: without derivatives it costs a fraction of :meth:`linearize`."""
        if self.bvp.phases:
            return self.linearize(x).residual
        values = self.kept("values", lambda: evaluator(self.bvp.traced.values, self.count))
        p = self.parameters(x)
        (f,), b = values(self.gauss, x.stage * self._su, p), self._ends(x.mesh[[0, -1]] * self._su, p)[0]
        return self._residual(x, f, b, self._integrand(x)[0] if self.bvp.n_integral else None)

    def _residual(self, x: Columns, f: np.ndarray, b: np.ndarray, densities: np.ndarray | None) -> Blocks:
        """Residual of the equations from right-hand side (N*m, n), end conditions and densities (N*m, .) at a state."""
        stage = np.matmul(self.scheme.d, x.stage) + self.scheme.d0[:, None] * x.mesh[:-1, None, :]
        stage -= self._weight * f.reshape(x.stage.shape)
        chain = x.mesh[1:] - self.scheme.c_left * x.mesh[:-1] - np.matmul(self.scheme.c_stage, x.stage)
        dense = np.zeros(0) if densities is None else self.quadrature.reshape(-1) @ densities[:, : self.bvp.n_integral]
        return Blocks(stage, chain, b[0, : self.bvp.n_boundary].copy(), dense)

    def bare_linearization(self, x: Columns) -> Linearization:
        """The same without phase conditions, for which rows and columns of zeros stand."""
        n_int, m, n = x.stage.shape
        k = len(self.free)
        p = self.parameters(x)
        f, jac, f_p = self._field(self.gauss, x.stage * self._su, p)
        stage_scal = np.zeros((self.count, n, k))
        for i, at in self.moving:
            np.multiply(f_p.reshape(self.count, -1, n)[:, at], self._scal_weight[:, :, i], out=stage_scal[:, :, i])
        q = self.bvp.n_boundary
        b, b_u, b_p = self._ends(x.mesh[[0, -1]] * self._su, p)
        b_u = b_u.reshape(2, n, -1) * self._su[None, :, None]
        dense = np.zeros((self.bvp.n_integral, n_int, m, n))
        dense_scal = np.zeros((self.bvp.n_integral, k))
        densities = None
        if self.bvp.n_integral:
            densities, g_u, g_p = self._integrand(x)
            w = self.quadrature.reshape(-1)
            for i in range(self.bvp.n_integral):
                dense[i] = (w[:, None] * g_u[:, :, i] * self._su).reshape(n_int, m, n)
                dense_scal[i] = (w @ g_p[:, :, i])[self.free] * self._sp
        return Linearization(
            self._residual(x, f, b, densities), jac * self._jac_scale, stage_scal,
            np.ascontiguousarray(b_u[0, :, :q].T), np.ascontiguousarray(b_u[1, :, :q].T),
            b_p.reshape(-1, b.shape[1])[self.free, :q].T * self._sp, dense, dense_scal,
        )  # fmt: skip

    def _integrand(self, x: Columns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Densities (count, ng), their derivatives (count, n, ng) and (count, np, ng)."""
        n = x.stage.shape[2]
        g, g_u, g_p = self._densities(self.gauss, x.stage * self._su, self.parameters(x))
        return g.copy(), g_u.reshape(self.count, n, -1), g_p.reshape(self.count, -1, g.shape[1])

    def observable_row(self, name: str, x: Columns) -> tuple[float, Row]:
        """Value of an observable, or coordinate of a parameter, and its gradient as a row."""
        k = len(self.free)
        if name in self.bvp.parameters:
            i = int(np.flatnonzero(self.free == self.bvp.parameter_index(name))[0])
            return float(self.parameters(x)[self.free[i]]), Row(np.eye(k)[i] * self._sp[i])
        kind, i = self.bvp.observable_slots()[name]
        if kind == "end":
            b, b_u, b_p = self._ends(x.mesh[[0, -1]] * self._su, self.parameters(x))
            left, right = b_u.reshape(2, len(self._su), -1)[:, :, i] * self._su
            scal = b_p.reshape(-1, b.shape[1])[self.free, i] * self._sp
            return float(b[0, i]), Row(scal, ends=(left, right))
        g, g_u, g_p = self._integrand(x)
        w = self.quadrature.reshape(-1)
        stage = (w[:, None] * g_u[:, :, i] * self._su).reshape(x.stage.shape)
        return float(w @ g[:, i]), Row((w @ g_p[:, :, i])[self.free] * self._sp, stage)

    def factor(self, lin: Linearization, rows: Sequence[Row] = (), columns: Sequence[Blocks] = ()) -> Factorization:
        """Factor the matrix of :meth:`bordered`."""
        return factor(self.bordered(lin, rows, columns), self.backend)

    def bordered(self, lin: Linearization, rows: Sequence[Row] = (), columns: Sequence[Blocks] = ()) -> BorderedMatrix:
        """The derivative bordered by rows (end rows first, then dense ones) and artificial columns."""
        k, extra = lin.stage_scal.shape[2], len(columns)
        end_rows = [r for r in rows if r.stage is None]
        dense_rows = [r for r in rows if r.stage is not None]
        n = len(self._su)
        zero = (np.zeros(n), np.zeros(n))
        pad = np.zeros(extra)
        stage_scal, b_scal, dense_scal = lin.stage_scal, lin.b_scal, lin.dense_scal
        if extra:
            stage_scal = np.concatenate([stage_scal, *[c.stage.reshape(self.count, n, 1) for c in columns]], axis=2)
            b_scal = np.concatenate([b_scal, *[c.ends[:, None] for c in columns]], axis=1)
            dense_scal = np.concatenate([dense_scal, *[c.dense[:, None] for c in columns]], axis=1)
        ends = [r.ends or zero for r in end_rows]
        padded = {id(r): np.concatenate([r.scalars[:k], pad]) for r in rows}
        return BorderedMatrix(
            self.scheme, self.bvp.sparsity, self.step, lin.jac, np.ascontiguousarray(stage_scal),
            _below(lin.b_left, [e[0] for e in ends]), _below(lin.b_right, [e[1] for e in ends]),
            _below(b_scal, [padded[id(r)] for r in end_rows]),
            _below(lin.dense, [r.stage for r in dense_rows if r.stage is not None]),
            _below(dense_scal, [padded[id(r)] for r in dense_rows]),
        )  # fmt: skip

    def right_hand_side(self, residual: Blocks | None, rows: Sequence[Row], values: Sequence[float]) -> Blocks:
        """Minus the residual (zero when None), with `values` on the extra rows, in the order of :meth:`factor`."""
        ends = [v for r, v in zip(rows, values, strict=True) if r.stage is None]
        dense = [v for r, v in zip(rows, values, strict=True) if r.stage is not None]
        if residual is None:
            n_int, m, n = len(self.step), self.scheme.points, len(self._su)
            residual = Blocks(
                np.zeros((n_int, m, n)), np.zeros((n_int, n)), np.zeros(self.bvp.n_boundary),
                np.zeros(self.bvp.n_integral),
            )  # fmt: skip
        return Blocks(
            -residual.stage, -residual.chain, np.concatenate([-residual.ends, ends]),
            np.concatenate([-residual.dense, dense]),
        )  # fmt: skip

    # -- second derivatives ---------------------------------------------------------------------------------------

    def second(self, x: Columns, v: Columns, w: Blocks) -> Columns:
        """Gradient with respect to the state of w^T F'(x) v: what minimally augmented systems need."""
        return gradient_of_product(self, x, v, w)


def _below(block: np.ndarray, rows: Sequence[np.ndarray]) -> np.ndarray:
    """A block, contiguous, with rows below it."""
    if not rows:
        return np.ascontiguousarray(block)
    if len(rows) == 1 and not len(block):
        return np.ascontiguousarray(rows[0])[None]
    return np.concatenate([block, np.array(rows)])


def moving_among(bvp: BVP, free: np.ndarray) -> list[tuple[int, int]]:
    """Positions among the free parameters of those that the right-hand side depends on, and among all of these."""
    known = bvp.traced.moving.tolist()
    return [(i, known.index(p)) for i, p in enumerate(free.tolist()) if p in known]


def free_indices(bvp: BVP, free: Sequence[str]) -> list[int]:
    """Indices of the named free parameters, their number checked against the problem's conditions."""
    names = list(free)
    if isinstance(free, str):
        raise ValueError(f"free: expected a sequence of names, got the string '{free}': write ('{free}',)")
    if not bvp.parameters:
        raise ValueError("parameters: expected at least one to follow a branch or search along it, got none")
    held = 0 if bvp.phases else len(bvp.generators)  # phase conditions may determine more
    if not bvp.n_free <= len(names) <= bvp.n_free + held or len(set(names)) != len(names):
        raise ValueError(
            f"free: expected {bvp.n_free} parameter name(s) ({bvp.conditions} conditions - {bvp.size} unknowns + 1), "
            f"got {list(free)}"
        )
    return [bvp.parameter_index(name) for name in names]
