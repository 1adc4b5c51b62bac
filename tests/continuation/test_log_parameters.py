"""Parameters that are followed in their logarithm: users see values, steps see decades."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rodatlas.continuation import (
    BVP,
    Branch,
    EndReason,
    Solution,
    StepControl,
    Symmetry,
    TraceOptions,
    end_value,
    follow_locus,
    integral_of,
    other_solutions,
    solve,
    switch,
    trace,
)

pytestmark = pytest.mark.slow

LONG = StepControl(initial=0.5, maximum=3.0, target=0.05)


def zero(bvp: BVP, **parameters: float) -> Solution:
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}
    )


def layer(log: tuple[str, ...] = ("e",)) -> BVP:
    """e y'' = y, y'(0) = 0, y(1) = 1 with v = sqrt(e) y': sinh and cosh of s/sqrt(e), v(1) = tanh(1/sqrt(e))."""
    return BVP(
        lambda s, u, p: [u.v / np.sqrt(p.e), u.y / np.sqrt(p.e)], lambda left, right, p: [left.v, right.y - 1],
        unknowns=("y", "v"), parameters={"e": 1.0}, log=log,
        observables={"mean": integral_of(lambda s, u, p: u.y / np.sqrt(p.e)), "low": end_value(lambda a, b, p: a.y)},
    )  # fmt: skip


def test_six_decades_in_few_steps() -> None:
    bvp = layer()
    options = TraceOptions(step=LONG, bounds={"e": (1e-6, 1.0)}, zeros={"e": 1e-3})
    branch = trace(bvp, zero(bvp), ("e",), options)
    e = branch.column("e")
    assert len(branch) < 100  # 20 steps would do; singular values that grow fast make steps look crowded here
    assert sorted((e[0], e[-1])) == pytest.approx([1e-6, 1.0], rel=1e-12)
    np.testing.assert_allclose([p.solution["v"][-1] for p in branch], np.tanh(e**-0.5), rtol=2e-8)
    np.testing.assert_allclose(branch.column("mean"), np.tanh(e**-0.5), rtol=2e-8)
    (at,) = branch.special
    assert at.kind == "zero of e"
    assert at.solution["e"] == pytest.approx(1e-3, rel=1e-12)
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)


def test_a_bound_far_below_one_is_met_in_relative_terms() -> None:
    bvp = layer()
    branch = trace(bvp, zero(bvp, e=3e-5), ("e",), TraceOptions(step=LONG, bounds={"e": (1e-5, 1e-4)}))
    assert sorted(p.solution["e"] for p in (branch.points[0], branch.points[-1])) == pytest.approx(
        [1e-5, 1e-4], rel=1e-12
    )
    seen = trace(bvp, zero(bvp, e=3e-5), ("e",), TraceOptions(bounds={"low": (1e-80, 1.0), "e": (2e-5, 0.1)}))
    assert seen.ends == (EndReason.RANGE, EndReason.RANGE)
    with pytest.raises(ValueError, match=r"bounds: expected 0\.1 <= e <= 1 at the start or on the way, got e = 3e-05"):
        trace(bvp, zero(bvp, e=3e-5), ("e",), TraceOptions(bounds={"e": (0.1, 1.0)}), both=False, direction=-1.0)


def gelfand(log: tuple[str, ...]) -> BVP:
    """u'' + lam exp(u / (1 + eps u)) = 0, u(0) = u(1) = 0."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u / (1 + p.eps * u.u))], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.1, "eps": 0.2}, log=log,
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )  # fmt: skip


@pytest.mark.parametrize("log", [("lam",), ("eps",), ("lam", "eps")])
def test_folds_and_cusps_are_where_they_are_without(log: tuple[str, ...]) -> None:
    bvp = gelfand(log)
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (1e-3, 10.0), "mean": (0.0, 60.0)}))
    folds = [x.solution["lam"] for x in branch.of_kind("fold")]
    assert folds == pytest.approx([4.647918, 3.509929], abs=1e-6)
    options = TraceOptions(bounds={"lam": (1.0, 20.0), "eps": (0.05, 0.3)}, zeros={"eps": 0.1})
    locus = follow_locus(bvp, branch.of_kind("fold")[0], ("lam", "eps"), options)
    kinds = [e.kind for e in locus.events]
    assert kinds.count("cusp") == 1
    cusp = locus.events[kinds.index("cusp")].solution
    assert cusp["eps"] == pytest.approx(0.2457803, abs=5e-7)
    at = [e.solution["eps"] for e in locus.events if e.kind == "zero of eps"]
    assert at == pytest.approx([0.1] * len(at), rel=1e-8)
    assert at
    assert locus.ends == (EndReason.RANGE, EndReason.RANGE)
    assert min(p.solution["eps"] for p in locus.points) == pytest.approx(0.05, rel=1e-9)


def test_the_exact_branch_of_bratu_over_eight_decades() -> None:
    """lam = t^2 / (2 cosh(t/4)^2), u'(0) = t tanh(t/4): far out on both branches."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.1}, log=("lam",), scales={"v": 10.0},
        observables={"slope": end_value(lambda left, right, p: left.v)},
    )  # fmt: skip
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (1e-8, 10.0)}))
    assert branch.of_kind("fold")[0].solution["lam"] == pytest.approx(3.513830719125161, rel=1e-8)
    last = max(branch.points, key=lambda p: p.solution["slope"]).solution
    t = last["slope"]
    assert last["lam"] == pytest.approx(1e-8, rel=1e-12)
    assert t**2 / (2 * np.cosh(t / 4) ** 2) == pytest.approx(1e-8, rel=1e-6)


def test_branch_points_switching_deflation_and_the_store(tmp_path: Path) -> None:
    mirror = Symmetry("mirror", {"y": -1, "t": -1})
    bvp = BVP(
        lambda s, u, p: [u.t, -p.P * np.sin(u.y)], lambda left, right, p: [left.y, right.y], unknowns=("y", "t"),
        parameters={"P": 5.0}, log=("P",), symmetries=[mirror],
    )  # fmt: skip
    options = TraceOptions(bounds={"P": (5.0, 45.0)})
    branch = trace(bvp, zero(bvp), ("P",), options, both=False)
    assert [x.solution["P"] for x in branch.special] == pytest.approx([np.pi**2, 4 * np.pi**2], rel=1e-8)
    assert [x.breaks for x in branch.special] == [("mirror",), ("mirror",)]
    bent = switch(bvp, branch.special[0], ("P",), options)
    assert bent.points[-1].solution["P"] == pytest.approx(45.0, rel=1e-12)
    assert len(other_solutions(bvp, [solve(bvp, zero(bvp, P=15.0))])) == 2
    bent.save(tmp_path / "bent.h5")
    assert Branch.load(tmp_path / "bent.h5").points[-1].solution["P"] == bent.points[-1].solution["P"]


def test_a_start_or_a_symmetry_without_a_logarithm_is_refused() -> None:
    bvp = layer()
    with pytest.raises(ValueError, match="log: expected a positive value of 'e', got -1"):
        solve(bvp, zero(bvp, e=-1.0))
    turned = Symmetry("turned", {"y": -1, "v": -1}, parameters={"e": -1})
    with pytest.raises(
        ValueError, match="symmetries: 'turned': expected a map without 'e', which is followed in its log"
    ):
        BVP(lambda s, u, p: [u.v, u.y / p.e], lambda left, right, p: [left.v, right.y], unknowns=("y", "v"),
            parameters={"e": 1.0}, log=("e",), symmetries=[turned])  # fmt: skip
