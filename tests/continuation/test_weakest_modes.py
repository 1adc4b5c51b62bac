"""Branch points on states that any mesh resolves are found on a mesh that resolves their modes too."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import constant

from rodatlas.continuation import BVP, MeshControl, Status, TraceOptions, trace
from rodatlas.continuation.curve.modes import ALIKE, measured_at, with_resolved_mode
from rodatlas.continuation.curve.point import first_frame, with_tests
from rodatlas.continuation.discrete.collocation import free_indices
from rodatlas.continuation.results.verification import UNRESOLVED_MODE


def pinned(scales=None) -> BVP:
    """u'' + lam sin(u) = 0, u(0) = u(1) = 0: buckles at (n pi)^2."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam * np.sin(u.u)], lambda left, right, p: [left.u, right.u], unknowns=("u", "v"),
        parameters={"lam": 3500.0}, scales=scales, name="pinned",
    )  # fmt: skip


def ring() -> BVP:
    """u'' + lam u - u^3 = 0 on a circle: a double branch point at (2 n pi)^2."""
    return BVP(
        lambda s, u, p: [u.v, -(p.lam * u.u - u.u**3)], lambda left, right, p: [left.u - right.u, left.v - right.v],
        unknowns=("u", "v"), parameters={"lam": 980.0}, name="ring",
    )  # fmt: skip


@pytest.mark.parametrize("scales", [None, {"lam": 100.0, "v": 60.0}])
def test_the_nineteenth_mode_of_a_pinned_column(scales) -> None:
    bvp = pinned(scales)
    branch = trace(bvp, constant(bvp, lam=3501.0), ("lam",), TraceOptions(bounds={"lam": (3500.0, 3700.0)}))
    (point,) = branch.special
    assert (point.kind, point.status) == ("branch point", Status.CONVERGED)
    assert point.solution["lam"] == pytest.approx((19 * np.pi) ** 2, rel=1e-7)
    assert branch.discrepancies == ()
    assert branch.verification.retraced == branch.verification.cleared > 0


def test_the_fifth_double_point_of_a_ring() -> None:
    bvp = ring()
    branch = trace(bvp, constant(bvp, lam=980.0), ("lam",), TraceOptions(bounds={"lam": (980.0, 1000.0)}))
    (point,) = branch.special
    assert (point.multiplicity, point.status) == (2, Status.CONVERGED)
    assert point.solution["lam"] == pytest.approx((10 * np.pi) ** 2, rel=1e-7)
    assert branch.discrepancies == ()


def test_what_no_allowed_mesh_tells_is_a_discrepancy() -> None:
    """On ten intervals the branch point lies elsewhere: never nothing."""
    bvp = pinned()
    options = TraceOptions(bounds={"lam": (3540.0, 3580.0)}, mesh=MeshControl(intervals=(8, 10)))
    branch = trace(bvp, constant(bvp, lam=3541.0), ("lam",), options)
    assert branch.special == ()
    assert {d.reason for d in branch.discrepancies} == {UNRESOLVED_MODE}
    assert not branch.verification.complete


def test_a_mesh_that_resolves_the_mode_is_left_alone() -> None:
    bvp = pinned()
    start = constant(bvp, lam=12.0)
    frame = first_frame(bvp, start, free_indices(bvp, ("lam",)), TraceOptions())[0]
    assert measured_at(frame, TraceOptions()) == (pytest.approx(0.0, abs=1e-12), True)
    again, _ = with_resolved_mode(frame, TraceOptions())
    assert again.colloc is frame.colloc
    high = first_frame(bvp, constant(bvp, lam=3600.0).remesh(np.linspace(0, 1, 11)), [0], TraceOptions())[0]
    assert not measured_at(with_tests(high, 20), TraceOptions())[1]
    finer, _ = with_resolved_mode(high, TraceOptions())
    assert len(finer.colloc.step) >= 20
    assert finer.weakness < (1 - ALIKE) * with_tests(high, 20).weakness
