r"""Second and third derivatives of the discrete equations along one direction, exact.

Normal forms need :math:`F''[v,v]` and :math:`F'''[v,v,v]` as vectors; CasADi differentiates
:math:`t \mapsto F(X + t v)` twice and three times at t = 0.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.problem.evaluator import Evaluator


@lru_cache(maxsize=32)
def _functions(bvp: BVP) -> tuple[Any, Any, Any]:
    """CasADi functions (argument, p, v, vp) -> second and third derivative, for field, ends and densities."""
    import casadi as ca

    t = bvp.traced
    return _along(ca, t.field, True), _along(ca, t.ends, False), _along(ca, t.densities, True)


@lru_cache(maxsize=32)
def _mixed_functions(bvp: BVP) -> tuple[Any, Any, Any]:
    """CasADi functions (argument, p, v, vp, w, wp) -> mixed second derivative, for field, ends and densities."""
    import casadi as ca

    t = bvp.traced
    return _mixed(ca, t.field, True), _mixed(ca, t.ends, False), _mixed(ca, t.densities, True)


def _mixed(ca: Any, function: Any, has_place: bool) -> Any:
    sizes = [function.numel_in(i) for i in range(function.n_in())]
    place = [ca.SX.sym("s")] if has_place else []
    u, v, w = (ca.SX.sym(name, sizes[-2]) for name in ("u", "v", "w"))
    p, vp, wp = (ca.SX.sym(name, sizes[-1]) for name in ("p", "vp", "wp"))
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    moved = function(*place, u + a * v + b * w, p + a * vp + b * wp)[0]
    if moved.numel():
        moved = ca.substitute(ca.jtimes(moved, a, ca.SX(1)), a, ca.SX(0))
        moved = ca.densify(ca.substitute(ca.jtimes(moved, b, ca.SX(1)), b, ca.SX(0)))
    return ca.Function("mixed", [*place, u, p, v, vp, w, wp], [moved if moved.numel() else ca.SX(0, 1)])


def _along(ca: Any, function: Any, has_place: bool) -> Any:
    sizes = [function.numel_in(i) for i in range(function.n_in())]
    place = [ca.SX.sym("s")] if has_place else []
    u, p = ca.SX.sym("u", sizes[-2]), ca.SX.sym("p", sizes[-1])
    v, vp, t = ca.SX.sym("v", sizes[-2]), ca.SX.sym("vp", sizes[-1]), ca.SX.sym("t")
    moved = function(*place, u + t * v, p + t * vp)[0]
    derivatives = []
    for _ in range(3):
        moved = ca.jtimes(moved, t, ca.SX(1)) if moved.numel() else moved
        derivatives.append(ca.densify(ca.substitute(moved, t, ca.SX(0))) if moved.numel() else ca.SX(0, 1))
    return ca.Function("along", [*place, u, p, v, vp], derivatives[1:])


def _evaluators(colloc: Collocation) -> tuple[Evaluator, Evaluator, Evaluator]:
    field, ends, densities = _functions(colloc.bvp)
    return Evaluator(field, colloc.count), Evaluator(ends, 1), Evaluator(densities, colloc.count)


def derivatives_along(colloc: Collocation, x: Columns, v: Columns) -> tuple[Blocks, Blocks]:
    """F''[v, v] and F'''[v, v, v] in the rows of the discrete problem, scaled as its residual."""
    field, ends, densities = colloc.kept("directional", lambda: _evaluators(colloc))
    bvp, su, n_int = colloc.bvp, colloc.scale.unknowns, len(colloc.step)
    p, vp = colloc.parameters(x), np.zeros(len(colloc.base))
    vp[colloc.free] = v.scalars[: len(colloc.free)] * colloc.scale.parameters[colloc.free]
    u, vu = x.stage * su, v.stage * su
    of_field = field(colloc.gauss, u, p, vu, vp)
    of_ends = ends(x.mesh[[0, -1]] * su, p, v.mesh[[0, -1]] * su, vp)
    of_densities = densities(colloc.gauss, u, p, vu, vp) if bvp.n_integral else None
    weights = (colloc.step[:, None] * colloc.scheme.weights).reshape(-1)
    out = []
    for i in range(2):
        stage = -colloc.step[:, None, None] * of_field[i].reshape(x.stage.shape) / su
        dense = np.zeros(0) if of_densities is None else weights @ of_densities[i][:, : bvp.n_integral]
        out.append(Blocks(stage, np.zeros((n_int, len(su))), of_ends[i][0, : bvp.n_boundary].copy(), dense))
    return out[0], out[1]


def mixed_derivative(colloc: Collocation, x: Columns, v: Columns, w: Columns) -> Blocks:
    """F''[v, w] in the rows of the discrete problem, scaled as its residual."""

    def evaluators() -> tuple[Evaluator, Evaluator, Evaluator]:
        field, ends, densities = _mixed_functions(colloc.bvp)
        return Evaluator(field, colloc.count), Evaluator(ends, 1), Evaluator(densities, colloc.count)

    field, ends, densities = colloc.kept("mixed", evaluators)
    bvp, su, n_int = colloc.bvp, colloc.scale.unknowns, len(colloc.step)
    p, vp, wp = colloc.parameters(x), np.zeros(len(colloc.base)), np.zeros(len(colloc.base))
    for numbers, vector in ((vp, v), (wp, w)):
        numbers[colloc.free] = vector.scalars[: len(colloc.free)] * colloc.scale.parameters[colloc.free]
    (of_field,) = field(colloc.gauss, x.stage * su, p, v.stage * su, vp, w.stage * su, wp)
    stage = -colloc.step[:, None, None] * of_field.reshape(x.stage.shape) / su
    at_ends = [y.mesh[[0, -1]] * su for y in (x, v, w)]
    (of_ends,) = ends(at_ends[0], p, at_ends[1], vp, at_ends[2], wp)
    dense = np.zeros(0)
    if bvp.n_integral:
        (of_densities,) = densities(colloc.gauss, x.stage * su, p, v.stage * su, vp, w.stage * su, wp)
        dense = (colloc.step[:, None] * colloc.scheme.weights).reshape(-1) @ of_densities[:, : bvp.n_integral]
    return Blocks(stage, np.zeros((n_int, len(su))), of_ends[0, : bvp.n_boundary].copy(), dense)
