"""Random vectors that do not depend on the mesh."""

import numpy as np
import pytest
from bvp_problems import bratu

from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.random_fields import displacement, smooth_load, smooth_vectors
from rodatlas.continuation.discrete.vectors import add


def on_intervals(count: int) -> Collocation:
    scale = Scale(np.array([1.0, 2.0]), np.ones(len(bratu().parameters)))
    return Collocation(bratu(), np.linspace(0, 1, count + 1), 4, bratu().parameter_vector(), [0], scale)


@pytest.mark.parametrize("make", [
    lambda colloc: smooth_vectors(colloc, np.random.default_rng(1), 3, 4, 1)[2],
    lambda colloc: displacement(colloc, np.random.default_rng(1), 1, terms=2),
], ids=["cosines", "linear"])  # fmt: skip
def test_a_vector_is_the_same_function_on_any_mesh(make) -> None:
    coarse, fine = on_intervals(20), on_intervals(40)
    v, w = make(coarse), make(fine)
    assert coarse.norm(v) == pytest.approx(fine.norm(w), rel=1e-9)
    if v.mesh.any():  # a state, with values at mesh points: linear, so that interpolation is exact
        assert fine.norm(add(coarse.interpolate(v, fine), (-1.0, w))) < 1e-13
        np.testing.assert_allclose(w.mesh[::2], v.mesh, atol=1e-14)


def test_a_load_is_per_length() -> None:
    total = [smooth_load(on_intervals(n), np.random.default_rng(1), 3) for n in (10, 20)]
    for load in total:
        assert load.stage.sum(axis=(0, 1)) == pytest.approx(total[0].stage.sum(axis=(0, 1)), rel=1e-2)
        np.testing.assert_array_equal(load.ends, total[0].ends)
    assert not total[0].chain.any()
