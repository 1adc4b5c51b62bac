"""Units that follow from bounds, places outside the interval, and problems without a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import bratu, constant

from rodatlas.continuation import BVP, EndReason, NotConverged, Solution, TraceOptions, end_value, solve, trace


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
