"""Where and why a branch ends: bounds, limits, the caller, the mesh; and where it may start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, circle, constant, kinds, pitchfork

from rodatlas.continuation import (
    BVP,
    EndReason,
    MeshControl,
    NewtonCode,
    Solution,
    StepControl,
    TraceOptions,
    end_value,
    trace,
)

BOX = TraceOptions(bounds={"lam": (-1.0, 1.0)}, step=StepControl(maximum=0.1))


def test_bounds_are_met_exactly_and_the_nearest_comes_first() -> None:
    bvp = algebraic(lambda u, p: [u.x - 3 * p.lam], observables={"x0": end_value(lambda left, right, p: left.x)})
    options = TraceOptions(bounds={"lam": (-0.5, 0.5), "x0": (-3.0, 0.3)}, step=StepControl(initial=0.4))
    branch = trace(bvp, constant(bvp), ("lam",), options)
    assert branch.points[0].solution["lam"] == pytest.approx(-0.5, abs=1e-14)
    assert branch.points[-1].solution["lam"] == pytest.approx(0.1, abs=1e-14)
    assert branch.points[-1].solution["x0"] == pytest.approx(0.3, abs=1e-14)
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)


def test_infinite_bounds_leave_one_side_open() -> None:
    bvp = algebraic(lambda u, p: [u.x - p.lam])
    options = TraceOptions(bounds={"lam": (-np.inf, 2.0)}, max_points=4)
    branch = trace(bvp, constant(bvp), ("lam",), options)
    assert branch.ends == (EndReason.POINT_LIMIT, EndReason.POINT_LIMIT)
    branch = trace(bvp, constant(bvp), ("lam",), replace(options, max_points=40), both=False)
    assert branch.ends[1] is EndReason.RANGE
    assert branch.points[-1].solution["lam"] == 2.0


def test_a_start_on_or_beyond_a_bound_ends_at_once_outward() -> None:
    bvp = algebraic(lambda u, p: [u.x - p.lam])
    for lam in (1.0, 1.5):
        branch = trace(bvp, constant(bvp, [lam], lam=lam), ("lam",), BOX)
        assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
        assert branch.points[-1].solution["lam"] == lam
        assert branch.points[0].solution["lam"] == -1.0
        assert (np.diff(branch.column("arclength")) > 1e-9).all()


def test_a_bound_just_short_of_a_fold_stops_the_branch() -> None:
    bvp = circle()
    options = TraceOptions(bounds={"lam": (-0.5, 1 - 1e-6)}, step=StepControl(initial=0.5, maximum=0.5))
    branch = trace(bvp, constant(bvp, [1.0]), ("lam",), options, both=False)
    assert kinds(branch) == []
    assert branch.ends[1] is EndReason.RANGE
    assert branch.points[-1].solution["lam"] == pytest.approx(1 - 1e-6, abs=1e-12)
    assert branch.points[-1].solution["x"][0] > 0


def test_an_event_in_the_step_that_lands_on_a_bound_is_kept() -> None:
    options = TraceOptions(bounds={"x0": (-0.02, 2.0)}, step=StepControl(initial=0.3, maximum=0.3))
    branch = trace(circle(), constant(circle(), [1.0]), ("lam",), options)
    assert len(branch.of_kind("fold")) == 2
    assert branch.points[-1].solution["x0"] == pytest.approx(-0.02, abs=1e-9)


def test_names_in_bounds_and_zeros_are_checked() -> None:
    bvp = circle()
    with pytest.raises(ValueError, match="bounds: expected one of lam, x0, got 'y'"):
        trace(bvp, constant(bvp, [1.0]), ("lam",), TraceOptions(bounds={"y": (0, 1)}))
    with pytest.raises(ValueError, match="zeros: expected one of lam, x0, got 'y'"):
        trace(bvp, constant(bvp, [1.0]), ("lam",), TraceOptions(zeros={"y": 0.0}))


# -- ends -------------------------------------------------------------------------------------------------------------


def test_limits_on_points_and_folds() -> None:
    bvp, start = circle(), constant(circle(), [1.0])
    branch = trace(bvp, start, ("lam",), TraceOptions(max_points=5))
    assert branch.ends == (EndReason.POINT_LIMIT, EndReason.POINT_LIMIT)
    assert len(branch) == 11
    one = trace(bvp, start, ("lam",), TraceOptions(max_folds=0), both=False)
    assert one.ends == (EndReason.START, EndReason.FOLD_LIMIT)
    assert one.points[-1].solution["lam"] == pytest.approx(1, abs=1e-12)
    assert one.points[-1].arclength == one.special[-1].arclength
    two = trace(bvp, start, ("lam",), TraceOptions(max_folds=1), both=False)
    assert two.points[-1].solution["lam"] == pytest.approx(-1, abs=1e-12)


def test_the_caller_stops_at_a_special_point() -> None:
    bvp = pitchfork()
    options = replace(BOX, stop_at=lambda special, last: special.kind == "branch point")
    branch = trace(bvp, constant(bvp, [0.9], lam=0.81), ("lam",), options, both=False, direction=-1)
    assert branch.ends == (EndReason.START, EndReason.BRANCH_POINT)
    assert branch.points[-1].solution["lam"] == pytest.approx(0, abs=1e-9)
    assert branch.special[-1].kind == "branch point"
    at_fold = TraceOptions(stop_at=lambda special, last: special.kind == "fold")
    assert trace(circle(), constant(circle(), [1.0]), ("lam",), at_fold).ends == (EndReason.STOPPED,) * 2


def test_a_branch_that_leaves_the_domain_ends_with_what_was_computed_and_why() -> None:
    bvp = algebraic(lambda u, p: [u.x + np.sqrt(0.5 - p.lam) ** 3 - 1])
    branch = trace(bvp, constant(bvp, [1 - 0.5**1.5]), ("lam",), TraceOptions(bounds={"lam": (-1, 1)}))
    assert branch.ends == (EndReason.RANGE, EndReason.MIN_STEP)
    assert branch.failures == (None, NewtonCode.NOT_FINITE)
    assert branch.points[-1].solution["lam"] == pytest.approx(0.5, abs=1e-4)
    assert "smaller minimum step" in branch.ends[1].value


def test_the_mesh_limit_ends_a_branch_with_a_boundary_layer() -> None:
    bvp = BVP(
        lambda s, u, p: [u.v, np.exp(2 * p.lam) * u.u], lambda left, right, p: [left.u - 1, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
    )  # fmt: skip
    start = Solution.from_function(lambda s: np.column_stack([1 - s, -1 + 0 * s]), bvp.unknowns, {"lam": 0.0})
    options = TraceOptions(bounds={"lam": (-0.5, 8)}, mesh=MeshControl(tolerance=1e-10, intervals=(8, 12)), locate=())
    wide = MeshControl(tolerance=1e-10, intervals=(8, 200))
    branch = trace(bvp, start, ("lam",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.MESH_LIMIT)
    assert branch.points[-1].solution.intervals == 12
    assert branch.points[-1].solution.error > 1e-10
    free = trace(bvp, start, ("lam",), replace(options, mesh=wide, bounds={"lam": (-0.5, 5)}))
    assert free.ends == (EndReason.RANGE, EndReason.RANGE)
    sizes = [p.solution.intervals for p in free]
    assert max(sizes) > 1.5 * min(sizes)  # grows with the layer
    exact = -np.exp(5) / np.tanh(np.exp(5))
    assert free.points[-1].solution["v"][0] == pytest.approx(exact, rel=1e-7)
    down = replace(options, mesh=wide, bounds={"lam": (-3.0, 8.0)})
    back = trace(bvp, free.points[-1].solution, ("lam",), down, both=False, direction=-1)
    assert back.points[-1].solution.intervals < max(sizes) / 1.5  # and shrinks with it


def test_a_branch_may_start_at_a_fold_or_a_branch_point() -> None:
    bvp = circle()
    fold = trace(bvp, constant(bvp, [1.0]), ("lam",)).of_kind("fold")[0].solution
    again = trace(bvp, fold, ("lam",))
    assert again.closed
    assert len(again.of_kind("fold")) == 2
    assert any(x.solution["lam"] == pytest.approx(-fold["lam"], abs=1e-12) for x in again.of_kind("fold"))
    fork = pitchfork()
    point = trace(fork, constant(fork, lam=-0.5), ("lam",), BOX).special[0].solution
    through = trace(fork, point, ("lam",), BOX)
    assert through.ends == (EndReason.RANGE, EndReason.RANGE)
    assert [x.kind for x in through.special] == ["branch point"]
    assert np.abs(np.concatenate([p.solution["x"] for p in through])).max() < 1e-9
    np.testing.assert_allclose([through.points[0].solution["lam"], through.points[-1].solution["lam"]], [-1, 1])


# -- failures ---------------------------------------------------------------------------------------------------------
