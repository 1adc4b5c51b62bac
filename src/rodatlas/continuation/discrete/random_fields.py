r"""Random smooth vectors on a mesh, where a linear problem needs a start or a border that is parallel to nothing.

All are sums of few terms with random weights, so that they do not depend on the mesh: results repeat, and are the same
on a finer one. The caller's generator is drawn from in a fixed order.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.linear.matrix import Blocks, Columns


def smooth_vectors(
    colloc: Collocation, rng: np.random.Generator, count: int, waves: int, scalars: int
) -> list[Columns]:
    r"""Vectors :math:`\sum_j w_j \cos(j \pi s)` of `waves` terms, with random scalars (values at mesh points are zero).

    They serve as directions of the mesh-independent inner product, which looks at the Gauss points only.
    """
    n = len(colloc.scale.unknowns)
    weights = rng.normal(size=(count, waves, n))
    zero = np.zeros((len(colloc.mesh), n))
    return [Columns(_sum(colloc, w), zero, rng.normal(size=scalars)) for w in weights]


def smooth_load(colloc: Collocation, rng: np.random.Generator, waves: int) -> Blocks:
    """A load of the same form on the differential equations, and random ones on the problem's conditions."""
    n = len(colloc.scale.unknowns)
    stage = load_on_equations(colloc, rng, waves)
    ends, dense = rng.normal(size=colloc.bvp.n_boundary), rng.normal(size=colloc.bvp.n_integral)
    return Blocks(stage, np.zeros((len(colloc.step), n)), ends, dense)


def load_on_equations(colloc: Collocation, rng: np.random.Generator, waves: int) -> np.ndarray:
    """The part of :func:`smooth_load` on the differential equations (N, m, n)."""
    return _sum(colloc, rng.normal(size=(waves, len(colloc.scale.unknowns)))) * colloc.step[:, None, None]


def displacement(colloc: Collocation, rng: np.random.Generator, scalars: int, terms: int = 1) -> Columns:
    """A change of state, with values at mesh points too: constant or, with two terms, linear in s; random scalars."""
    weights = rng.normal(size=(terms, len(colloc.scale.unknowns)))
    stage, mesh = (sum(s[..., None] ** j * w for j, w in enumerate(weights)) for s in _places(colloc))
    return Columns(np.asarray(stage), np.asarray(mesh), rng.normal(size=scalars))


def _sum(colloc: Collocation, weights: np.ndarray) -> np.ndarray:
    """Sum of the cosines at the Gauss points (N, m, n), from weights (waves, n)."""
    waves = np.cos(np.pi * np.arange(len(weights))[:, None, None] * _places(colloc)[0])
    return np.einsum("wji,wa->jia", waves, weights)


def _places(colloc: Collocation) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points (N, m) and mesh points (N+1,) as shares of the interval."""
    start, length = colloc.mesh[0], colloc.mesh[-1] - colloc.mesh[0]
    return (colloc.gauss - start) / length, (colloc.mesh - start) / length
