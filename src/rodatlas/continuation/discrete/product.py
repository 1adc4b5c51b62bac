"""Gradient of a bilinear form of the discrete equations, exact: the second derivatives of augmented systems."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.problem.evaluator import evaluator

if TYPE_CHECKING:
    from rodatlas.continuation.discrete.collocation import Collocation


def gradient_of_product(colloc: Collocation, x: Columns, v: Columns, w: Blocks) -> Columns:
    """Gradient of w^T F'(x) v with respect to the state x, in scaled variables."""
    bvp, su, sp = colloc.bvp, colloc.scale.unknowns, colloc.scale.parameters[colloc.free]
    t = bvp.traced
    field, ends, densities = colloc.kept(
        "second",
        lambda: (
            evaluator(t.field_second, colloc.count),
            evaluator(t.ends_second, 1),
            evaluator(t.densities_second, colloc.count),
        ),
    )
    n_int, m, n = x.stage.shape
    p = colloc.parameters(x)
    vp = np.zeros(len(p))
    vp[colloc.free] = v.scalars[: len(colloc.free)] * sp
    u, vu = x.stage * su, v.stage * su
    weight = -colloc.step[:, None, None] * w.stage / su
    g_u, g_p = field(colloc.gauss, u, p, vu, vp, weight)
    stage, scal = g_u.reshape(n_int, m, n) * su, g_p.sum(axis=0)
    ends_weight = np.zeros(t.ends.numel_out(0))
    ends_weight[: bvp.n_boundary] = w.ends[: bvp.n_boundary]
    e_u, e_p = ends(x.mesh[[0, -1]] * su, p, v.mesh[[0, -1]] * su, vp, ends_weight)
    mesh = np.zeros_like(x.mesh)
    mesh[[0, -1]] = e_u.reshape(2, n) * su
    scal = scal + e_p[0]
    if bvp.n_integral:
        weight = np.zeros((colloc.count, t.densities.numel_out(0)))
        weight[:, : bvp.n_integral] = colloc.quadrature.reshape(-1, 1) * w.dense[: bvp.n_integral]
        d_u, d_p = densities(colloc.gauss, u, p, vu, vp, weight)
        stage = stage + d_u.reshape(n_int, m, n) * su
        scal = scal + d_p.sum(axis=0)
    return Columns(stage, mesh, scal[colloc.free] * sp)
