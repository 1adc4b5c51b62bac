"""Between two looks at the mesh its density tells when the error has grown."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import bratu, constant

from rodatlas.continuation import BVP, MeshControl, Solution, TraceOptions, integral_of, trace
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.growth import LastLook, power


def on_intervals(count: int) -> Collocation:
    scale = Scale(np.ones(2), np.ones(len(bratu().parameters)))
    return Collocation(bratu(), np.linspace(0, 1, count + 1), 4, bratu().parameter_vector(), [0], scale)


def test_the_error_is_of_order_2m_and_grows_with_the_density() -> None:
    coarse, fine = on_intervals(10), on_intervals(20)
    assert power(coarse, np.ones(10)) == pytest.approx(2.0**8 * power(fine, np.ones(20)), rel=1e-12)
    control = MeshControl()
    look = LastLook.at(coarse, 1e-9, np.ones(10))
    assert not look.is_over(coarse, np.full(10, 50.0 ** (1 / 8) - 1e-6), control)
    assert look.is_over(coarse, np.full(10, 50.0 ** (1 / 8) + 1e-6), control)
    assert not look.is_over(coarse, np.full(10, 10.0), MeshControl(intervals=(10, 10)))
    assert not LastLook.at(coarse, float("nan"), np.ones(10)).is_over(coarse, np.full(10, 10.0), control)


def test_a_branch_into_a_boundary_layer_looks_at_its_mesh_in_time() -> None:
    """e y'' = y, y'(0) = 0, y(1) = 1 with e = exp(q): mean y = sqrt(e) tanh(1/sqrt(e))."""
    bvp = BVP(
        lambda s, u, p: [u.v * np.exp(-p.q / 2), u.y * np.exp(-p.q / 2)],
        lambda left, right, p: [left.v, right.y - 1], unknowns=("y", "v"), parameters={"q": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.y)}, name="layer",
    )  # fmt: skip
    start: Solution = constant(bvp)
    options = TraceOptions(bounds={"q": (-18.0, 0.0)}, mesh=MeshControl(every=40))
    branch = trace(bvp, start, ("q",), options)
    root = np.exp(branch.column("q") / 2)
    assert min(root) == pytest.approx(np.exp(-9), rel=1e-9)
    assert branch.verification.unresolved == 0
    np.testing.assert_allclose(branch.column("mean"), root * np.tanh(1 / root), atol=1e-8)
