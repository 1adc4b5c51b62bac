r"""Second and third derivatives of the discrete equations along one direction, exact.

Normal forms need :math:`F''[v,v]` and :math:`F'''[v,v,v]` as vectors; CasADi differentiates
:math:`t \mapsto F(X + t v)` twice and three times at t = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.problem.evaluator import Evaluator, evaluator
from rodatlas.continuation.problem.traced import Choice


@lru_cache(maxsize=32)
def _functions(bvp: BVP) -> tuple[Any, Any, Any]:
    """CasADi functions (argument, p, v, vp) -> second and third derivative, for field, ends and densities."""
    import casadi as ca

    fields, densities = zip(*bvp.traced.parts, strict=True)
    return (
        _along(ca, fields, bvp.traced.choice),
        _along(ca, [bvp.traced.ends], None),
        _along(ca, densities, bvp.traced.choice),
    )


def _along(ca: Any, functions: Sequence[Any], choice: Choice | None) -> Any:
    """One CasADi function from those of all laws and inner points, or from one of both ends."""
    sizes = [functions[0].numel_in(i) for i in range(functions[0].n_in())]
    place = [] if choice is None else [ca.SX.sym("x")]
    u, p = ca.SX.sym("u", sizes[-2]), ca.SX.sym("p", sizes[-1])
    v, vp, t = ca.SX.sym("v", sizes[-2]), ca.SX.sym("vp", sizes[-1]), ca.SX.sym("t")
    found = []
    for function in functions:
        moved = function(*place, u + t * v, p + t * vp)
        moved = moved[0] if isinstance(moved, tuple) else moved
        derivatives = []
        for _ in range(3):
            moved = ca.jtimes(moved, t, ca.SX(1)) if moved.numel() else moved
            derivatives.append(ca.densify(ca.substitute(moved, t, ca.SX(0))) if moved.numel() else ca.SX(0, 1))
        found.append(derivatives[1:])
    parts = [list(each) for each in zip(*found, strict=True)]
    outputs = [each[0] if choice is None else choice(ca, place[0], each) for each in parts]
    return ca.Function("along", [*place, u, p, v, vp], outputs)


def _evaluators(colloc: Collocation) -> tuple[Evaluator, Evaluator, Evaluator]:
    field, ends, densities = _functions(colloc.bvp)
    return evaluator(field, colloc.count), evaluator(ends, 1), evaluator(densities, colloc.count)


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
    """F''[v, w] in the rows of the discrete problem, by polarization."""
    plus, minus = (derivatives_along(colloc, x, add(v, (sign, w)))[0] for sign in (1.0, -1.0))
    with np.errstate(all="ignore"):  # second derivatives may overflow before the equations do
        stage, ends, dense = ((getattr(plus, k) - getattr(minus, k)) / 4 for k in ("stage", "ends", "dense"))
    return Blocks(stage, plus.chain, ends, dense)
