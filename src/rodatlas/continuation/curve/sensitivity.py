r"""Derivatives of a special point with respect to the parameters that are held fixed there.

A special point solves H(X, p) = 0: the equations F = 0 for state and free parameters X, and conditions h = 0 on the
kernel (a fold, an extremum: one; a branch point: two) or on an observable. For any quantity q(X, p)

.. math:: \frac{dq}{dp} = q_p - w\cdot F_p - \gamma\cdot h_p, \qquad
          K^\mathsf{T} w = q_X - \gamma\cdot h_X, \quad (h_X V)^\mathsf{T}\gamma = V^\mathsf{T} q_X,

with the kernel vectors V, and K the bordered matrix that gave them: one transposed solve for all parameters. At a fold
and for its own parameter :math:`\gamma = 0`, and w is the left kernel vector, :math:`d\lambda/dp = -\psi\cdot F_p /
\psi\cdot F_\lambda`. Gradients of h are those of minimally augmented systems (Govaerts 2000, chapter 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.checks import check_type, shown
from rodatlas.continuation.curve.start import IDLE, NotConverged
from rodatlas.continuation.discrete.collocation import Collocation, Row, Scale
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.discrete.phase import phased
from rodatlas.continuation.discrete.random_fields import displacement
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import SpecialPoint, Status
from rodatlas.continuation.singular.augmented import solve_branch_point, solve_fold
from rodatlas.continuation.singular.bordered import norm_of, overlap
from rodatlas.continuation.singular.extremum import KIND, ValueView

PERSISTS = 1e-6  # share of a parameter's effect along the left kernel vector that is round-off


def sensitivity(bvp: BVP, special: SpecialPoint, of: str | None = None) -> dict[str, float]:
    """How a special point moves with each parameter that is not free: exact first derivatives.

    Parameters
    ----------
    bvp : BVP
    special : a converged fold, branch point, zero or extremum.
    of : the free parameter or observable whose value at the point is differentiated; the continuation parameter unless
        it is given.

    Returns
    -------
    name of a parameter -> d of / d parameter along the points of this kind, in units of both. NaN where the point does
    not persist: most branch points are gone once a symmetry is.

    Raises
    ------
    ValueError
        when the point was only bracketed, or is a multiple branch point.
    NotConverged
        when the point does not solve the problem.

    Examples
    --------
    >>> branch = trace(bvp, start, ("lam",))
    >>> sensitivity(bvp, branch.of_kind("fold")[0])
    {'eps': 1.2...}
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("special", special, SpecialPoint, "a special point of a branch")
    if special.status is Status.BRACKETED:
        raise ValueError(f"special: expected a converged point, got a bracketed {special.kind}")
    if special.multiplicity > 1:
        raise ValueError(f"special: expected a simple point, got one of multiplicity {special.multiplicity}")
    of, free = special.free[0] if of is None else of, special.free
    if of not in (*free, *bvp.observables):
        raise ValueError(f"of: expected one of {', '.join((*free, *bvp.observables))}, got {shown(of)}")
    scale = special.scale or Scale.of(bvp, special.solution)
    solution, kind = special.solution, special.kind
    if special.is_branch_point:
        kind = "branch point"
    elif kind.startswith(KIND):
        view = ValueView.of(bvp, special.name)
        scale, solution = view.scale(scale, solution[special.name]), view.solution(solution)
        bvp, free, kind = view.inside, view.free(free), "fold"
    others = [name for name in bvp.parameter_names if name not in free]
    bvp, index = phased(bvp, solution, [bvp.parameter_index(name) for name in free], scale)
    colloc, count = Collocation.at(bvp, solution, [*index, *map(bvp.parameter_index, others)], scale), len(index)
    x = colloc.state(solution)
    point = _zero(colloc, x, special.name, count) if special.is_zero else _singular(colloc, x, kind, count)
    if point is None:
        raise NotConverged(NewtonCode.SINGULAR, f"sensitivity of {special!r}")
    slopes = dict(zip(others, point.slopes(of, count), strict=True))
    at = special.solution
    of_value = at[of] if of in bvp.log else 1.0  # parameters followed in their logarithm: d log x = dx / x
    return {
        name: of_value * value / (at[name] if name in bvp.log else 1.0)
        for name, value in slopes.items()
        if name in at.parameter_names
    }


@dataclass(frozen=True)
class _Point:
    """The linear problem at a special point, with all parameters as scalars, the free ones first.

    row : of the observable that is held, or None; vectors : V; gradients : of h, in X and all parameters; left : at a
    branch point, the left kernel vector.
    """

    colloc: Collocation
    x: Columns
    fac: Factorization
    row: Row | None = None
    vectors: tuple[Columns, ...] = ()
    gradients: tuple[Columns, ...] = ()
    left: Blocks | None = None

    def slopes(self, name: str, count: int) -> list[float]:
        """Derivatives of an observable or parameter with respect to the scalars from `count` on, in their units."""
        colloc, lin = self.colloc, self.colloc.linearize(self.x)
        q = _gradient(colloc, name, self.x)
        if self.vectors:
            form = np.array([[g.dot(v) for v in self.vectors] for g in self.gradients])
            gamma = np.linalg.solve(form.T, [q.dot(v) for v in self.vectors])
            q = add(q, *zip((-gamma).tolist(), self.gradients, strict=True))
        extra = np.zeros(0 if self.left is None else 1)
        w = self.fac.solve_transposed(Columns(q.stage, q.mesh, np.append(q.scalars[:count], extra)))
        units = colloc.scale.parameters[colloc.free]
        found = []
        for i in range(count, len(q.scalars)):
            column = lin.column(i)
            value = q.scalars[i] - overlap(w, column)
            if self.row is not None:
                value -= self.row.scalars[i] * (w.ends if self.row.stage is None else w.dense)[-1]
            found.append(float(value / units[i]) if self._persists(column) else float("nan"))
        return found

    def _persists(self, column: Blocks) -> bool:
        """Whether a parameter with this effect on the equations leaves the branch point one."""
        if self.left is None:
            return True
        return abs(overlap(self.left, column)) <= norm_of(self.left) * max(PERSISTS * norm_of(column), IDLE)


def _zero(colloc: Collocation, x: Columns, name: str, count: int) -> _Point | None:
    """Where an observable keeps its value."""
    row = colloc.observable_row(name, x)[1]
    fac = colloc.factor(colloc.linearize(x).with_scalars(range(count)), [row])
    return None if fac.sign == 0.0 else _Point(colloc, x, fac, row)


def _singular(colloc: Collocation, x: Columns, kind: str, count: int) -> _Point | None:
    """A fold or branch point: its kernel from the augmented system, and the gradients of what vanishes there."""
    free, points = list(colloc.free[:count]), colloc.scheme.points
    own = Collocation(colloc.bvp, colloc.mesh, points, colloc.base, free, colloc.scale, colloc.backend)
    start = Columns(x.stage, x.mesh, x.scalars[:count])
    solve = solve_fold if kind == "fold" else solve_branch_point
    some = displacement(own, np.random.default_rng(11), count, 2)  # no kernel vector is likely to be normal to it
    found = solve(own, start, scaled(some, 1.0 / own.norm(some)))
    if not found.converged:
        return None
    vectors = tuple(_with_zeros(v, len(x.scalars)) for v in found.vectors)
    rows = [colloc.row(scaled(v, 1.0 / colloc.norm(v))) for v in vectors]
    columns: Sequence[Blocks] = () if found.column is None else (found.column,)
    x = Columns(found.state.stage, found.state.mesh, np.append(found.state.scalars, x.scalars[count:]))
    fac = colloc.factor(colloc.linearize(x).with_scalars(range(count)), rows, columns)
    if fac.sign == 0.0:
        return None
    one = np.zeros(count + len(columns))
    one[-1 if columns else 0] = 1.0
    left = fac.solve_transposed(Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), one))
    gradients = tuple(scaled(colloc.second(x, v, left), -1.0) for v in vectors)
    return _Point(colloc, x, fac, None, vectors, gradients, left if columns else None)


def _gradient(colloc: Collocation, name: str, x: Columns) -> Columns:
    row = colloc.observable_row(name, x)[1]
    stage, mesh = (np.zeros_like(x.stage) if row.stage is None else row.stage), np.zeros_like(x.mesh)
    if row.ends is not None:
        mesh[0], mesh[-1] = row.ends
    return Columns(stage, mesh, row.scalars)


def _with_zeros(v: Columns, count: int) -> Columns:
    return Columns(v.stage, v.mesh, np.append(v.scalars, np.zeros(count - len(v.scalars))))
