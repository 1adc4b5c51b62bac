"""Units that follow from bounds, places outside the interval, and problems without a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import bratu, constant

from rodatlas.continuation import (
    BVP,
    EndReason,
    MeshControl,
    NotConverged,
    Solution,
    StepControl,
    TraceOptions,
    end_value,
    solve,
    trace,
)


def loaded(scales=None) -> BVP:
    """u'' = -lam with u(0) = u(1) = 0: u'(0) = lam/2."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam], lambda left, right, p: [left.u, right.u], unknowns=("u", "v"),
        parameters={"lam": 0.0}, observables={"slope": end_value(lambda left, right, p: left.v)}, scales=scales,
    )  # fmt: skip


@pytest.mark.parametrize("reach", [1e-4, 1e-2, 1.0, 1e3])
def test_bounds_set_the_unit_of_a_parameter(reach: float) -> None:
    bvp = loaded()
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, reach)}))
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert branch.column("lam").max() == pytest.approx(reach, rel=1e-12)
    np.testing.assert_allclose(branch.column("slope"), branch.column("lam") / 2, rtol=1e-9, atol=1e-9)
    assert 2 < len(branch) < 700


def test_a_declared_scale_wins_and_the_limit_names_it() -> None:
    bvp = loaded({"lam": 1.0, "u": 1.0, "v": 1.0})
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 1e5)}, max_points=50), both=False)
    assert branch.ends[1] is EndReason.POINT_LIMIT
    assert "`scales`" in branch.ends[1].value


@pytest.mark.parametrize("s", [1.5, -0.1, float("nan"), [0.5, 2.0]])
def test_a_solution_ends_at_its_ends(s) -> None:
    with pytest.raises(ValueError, match=r"s: expected places from 0 to 1, got "):
        constant(bratu())(s)
    assert constant(bratu())([0.0, 1.0 + 1e-12]).shape == (2, 2)


def exponential(**options) -> BVP:
    """u' = u, u(0) = 1."""
    return BVP(lambda s, u, p: [u.u], lambda left, right, p: [left.u - 1], unknowns=("u",), **options)


def test_a_problem_without_a_parameter() -> None:
    bvp = exponential(observables={"end": end_value(lambda left, right, p: right.u)})
    assert repr(bvp).startswith("BVP(bvp: 1 unknowns, 1 boundary")
    found = solve(bvp, Solution.from_function(lambda s: np.ones(len(s)), ("u",), {}))
    assert (found.parameter_names, found.parameters.shape) == ((), (0,))
    assert found["end"] == pytest.approx(np.e, rel=1e-9)
    assert solve(bvp, found)["end"] == pytest.approx(np.e, rel=1e-9)
    with pytest.raises(ValueError, match="parameters: expected at least one to follow a branch"):
        trace(bvp, found, ())


def test_a_problem_without_a_parameter_may_have_no_solution() -> None:
    def rhs(s, u, p):
        return [u.v, -4.0 * np.exp(u.u)]

    bvp = BVP(rhs, lambda left, right, p: [left.u, right.u], unknowns=("u", "v"), parameters={})
    guess = Solution.from_function(lambda s: np.zeros((len(s), 2)), ("u", "v"), {})
    with pytest.raises(NotConverged) as caught:
        solve(bvp, guess)
    assert "held" not in str(caught.value)
    with pytest.raises(ValueError, match="at most 2 conditions"):
        BVP(rhs, lambda left, right, p: [left.u, right.u, left.v], unknowns=("u", "v"))


@pytest.mark.parametrize("step", [0.3, 1.0])
def test_a_bound_that_an_observable_passes_twice_on_one_step(step: float) -> None:
    """g = 1/(1 + 4 lam^2) is above 0.99 for |lam| < 0.0503 only; the branch ends there, not beyond."""
    bvp = BVP(
        lambda s, u, p: [0.0 * u.x],
        lambda left, right, p: [left.x - p.lam],
        unknowns=("x",),
        parameters={"lam": -2.0},
        observables={"g": end_value(lambda left, right, p: 1 / (1 + 4 * left.x**2))},
    )
    start = Solution.from_function(lambda s: np.full((len(s), 1), -2.0), bvp.unknowns, bvp.parameters)
    control = StepControl(initial=0.02 * step, maximum=0.5 * step)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-2.0, 2.0), "g": (0.0, 0.99)}, step=control))
    assert branch.column("lam")[-1] == pytest.approx(-np.sqrt((1 / 0.99 - 1) / 4), abs=1e-9)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: MeshControl(intervals=(10,)), "intervals"),
        (lambda: MeshControl(intervals=(10, 20, 30)), "intervals"),
        (lambda: MeshControl(points=4.5), "points"),
        (lambda: TraceOptions(index=3), "index"),
        (lambda: TraceOptions(on_point=3), "on_point"),
        (lambda: TraceOptions(max_folds=-1), "max_folds"),
        (lambda: TraceOptions(max_points=2.5), "max_points"),
        (lambda: TraceOptions(zeros={"g": float("nan")}), "zeros"),
    ],
)
def test_settings_of_the_wrong_kind_are_named(make, field: str) -> None:
    with pytest.raises(ValueError, match=f"^{field}: expected"):
        make()
