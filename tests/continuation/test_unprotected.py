"""Branch points that no symmetry protects, in three parameters."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import algebraic, constant

from rodatlas.continuation import (
    BVP,
    EndReason,
    Locus,
    MeshControl,
    NotConverged,
    Solution,
    Status,
    TraceOptions,
    follow_locus,
    trace,
)

SPACE = ("lam", "mu", "nu")
BOX = TraceOptions(bounds={"lam": (-4.0, 4.0), "mu": (-2.0, 2.0), "nu": (-1.0, 1.0)})


def at_zero(bvp: BVP, low: float = -1.0, high: float = 2.0):
    (point,) = trace(bvp, constant(bvp, lam=low), ("lam",), TraceOptions(bounds={"lam": (low, high)})).special
    return point


def test_the_unfolded_pitchfork(tmp_path) -> None:
    """x^3 - lam x + mu + nu lam (Golubitsky & Schaeffer 1985): branch points at x = nu, lam = 3 nu^2, mu = -nu^3."""
    bvp = algebraic(lambda u, p: [u.x**3 - p.lam * u.x + p.mu + p.nu * p.lam], parameters=SPACE)
    locus = follow_locus(bvp, at_zero(bvp), SPACE, BOX)
    nu = locus.column("nu")
    np.testing.assert_allclose(locus.column("lam"), 3 * nu**2, atol=1e-9)
    np.testing.assert_allclose(locus.column("mu"), -(nu**3), atol=1e-9)
    np.testing.assert_allclose([p.solution["x"][0] for p in locus.points], nu, atol=1e-9)
    assert locus.ends == (EndReason.RANGE, EndReason.RANGE)
    assert sorted(locus.column("nu")[[0, -1]]) == pytest.approx([-1.0, 1.0])
    (pitchfork,) = locus.of_kind("pitchfork")
    (turn,) = locus.of_kind("extremum")
    assert (turn.parameter, turn.what) == ("lam", "the locus turns back in lam")
    for event in locus.events:
        assert event.status is Status.CONVERGED
        assert [event.solution[name] for name in SPACE] == pytest.approx([0.0] * 3, abs=1e-9)
    locus.save(tmp_path / "locus.h5")
    again = Locus.load(tmp_path / "locus.h5")
    assert (again.kind, again.free) == ("unprotected branch point", SPACE)
    assert {e.kind for e in again.events} == {"pitchfork", "extremum"}
    assert pitchfork.what == "the branch point is a pitchfork"


def test_where_an_isola_center_meets_a_crossing() -> None:
    """x^2 + lam^3/3 - nu lam + mu: on the folds both are met at lam^2 = nu, mu = 2/3 lam^3, and join at nu = 0."""
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**3 / 3 - p.nu * p.lam + p.mu], parameters=SPACE)
    start = constant(bvp, [1.0], lam=0.0, mu=-1.0, nu=0.5)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-4.0, 4.0)}))
    folds = follow_locus(bvp, branch.of_kind("fold")[0], ("lam", "mu"), TraceOptions(bounds={"mu": (-2.0, 2.0)}))
    assert sorted(e.what[:5] for e in folds.events) == ["isola", "two b"]
    for event in folds.events:
        locus = follow_locus(bvp, event, SPACE, BOX)
        lam = locus.column("lam")
        np.testing.assert_allclose(locus.column("nu"), lam**2, atol=1e-9)
        np.testing.assert_allclose(locus.column("mu"), 2 / 3 * lam**3, atol=1e-9)
        (meet,) = locus.events
        assert (meet.kind, meet.parameter, meet.status) == ("extremum", "nu", Status.CONVERGED)
        assert meet.what == "an isola center and a crossing of two branches meet and vanish"
        assert abs(meet.solution["nu"]) < 1e-12


def column(bias) -> BVP:
    """A column whose imperfections cancel along a curve: u'' + (lam + nu) sin u + (mu - nu^2) bias = 0."""
    return BVP(
        lambda s, u, p: [u.v, -(p.lam + p.nu) * np.sin(u.u) - (p.mu - p.nu**2) * bias(s)],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters=dict.fromkeys(SPACE, 0.0), scales={"v": 3.0, "lam": 3.0},
    )  # fmt: skip


def test_imperfections_that_cancel() -> None:
    """The column is straight where mu = nu^2, and buckles at lam = pi^2 - nu there; a pitchfork all along."""
    bvp, options = column(lambda s: 1 + s), TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"nu": (-1.0, 1.0)})
    point = at_zero(bvp, 5.0, 20.0)
    locus = follow_locus(bvp, point, SPACE, options)
    nu = locus.column("nu")
    np.testing.assert_allclose(locus.column("lam"), np.pi**2 - nu, atol=1e-9)
    np.testing.assert_allclose(locus.column("mu"), nu**2, atol=1e-9)
    assert [(e.kind, e.parameter) for e in locus.events] == [("extremum", "mu")]
    in_two = follow_locus(bvp, point, ("lam", "mu"), options=TraceOptions())
    assert in_two.ends == (EndReason.UNFOLDED, EndReason.UNFOLDED)
    assert "follow it in three parameters" in in_two.ends[0].value


def test_a_bent_column_against_extrema_of_its_locus_of_folds() -> None:
    """Nothing is zero there: the place where the folds of fixed nu are extreme in mu is on the curve."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.sin(u.u) - p.nu * (u.u**2 + p.lam / 10) - p.mu * np.cos(s)],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters=dict.fromkeys(SPACE, 0.0), scales={"v": 3.0, "lam": 3.0},
    )  # fmt: skip
    mesh = MeshControl(tolerance=1e-10)
    options = TraceOptions(mesh=mesh, bounds={"nu": (-0.5, 0.5)}, zeros={"nu": (0.2, 0.4)})
    locus = follow_locus(bvp, at_zero(bvp, 5.0, 20.0), SPACE, options)
    assert len(locus.of_kind("pitchfork")) == 1
    for event in locus.of_kind("zero of nu"):
        lam, mu, nu = (event.solution[name] for name in SPACE)
        assert abs(event.solution["u"]).max() > 0.01
        folds = []
        for size in (1.3, -1.3):  # both sides of the buckled states at the same nu
            start = Solution.from_function(
                lambda s, size=size: size * np.column_stack([np.sin(np.pi * s), np.pi * np.cos(np.pi * s)]),
                bvp.unknowns, {"lam": 12.0, "mu": mu, "nu": nu},
            )  # fmt: skip
            branch = trace(bvp, start, ("lam",), TraceOptions(mesh=mesh, bounds={"lam": (2.0, 15.0)}))
            folds += branch.of_kind("fold")
        plane = TraceOptions(mesh=mesh, bounds={"mu": (mu - 0.2, mu + 0.2), "lam": (2.0, 20.0)})
        locus_of_folds = follow_locus(bvp, folds[0], ("lam", "mu"), plane)
        touches = [e for e in locus_of_folds.of_kind("extremum") if e.parameter == "mu"]
        assert min(abs(e.solution["lam"] - lam) + abs(e.solution["mu"] - mu) for e in touches) < 1e-7


def test_what_is_no_such_branch_point_is_refused() -> None:
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**3 / 3 - p.nu * p.lam + p.mu], parameters=SPACE)
    start = constant(bvp, [1.0], lam=0.0, mu=-1.0, nu=0.5)
    fold = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-4.0, 4.0)})).of_kind("fold")[0]
    with pytest.raises(ValueError, match="free: expected 2 parameter names for a locus"):
        follow_locus(bvp, fold, SPACE)
    folds = follow_locus(bvp, fold, ("lam", "mu"), TraceOptions(bounds={"mu": (-2.0, 2.0)}))
    with pytest.raises(ValueError, match="start: expected extremum, coalescence, cusp and three parameters"):
        follow_locus(bvp, folds.events[0], ("lam", "mu"))
    cubic = algebraic(lambda u, p: [u.x**3 / 3 - p.mu * u.x + p.lam + (p.lam - 1) ** 2 * p.nu], parameters=SPACE)
    start = constant(cubic, [2.0], lam=2 - 8 / 3, mu=1.0)
    fold = trace(cubic, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}, max_points=50)).of_kind("fold")[0]
    (cusp,) = follow_locus(cubic, fold, ("lam", "mu"), TraceOptions(bounds={"mu": (-1.0, 2.0)})).of_kind("cusp")
    with pytest.raises(NotConverged):  # no branch point
        follow_locus(cubic, cusp, SPACE)
    protected = algebraic(lambda u, p: [u.x * (p.lam - p.mu - p.nu - u.x**2)], parameters=SPACE)
    with pytest.raises(NotConverged):  # it exists for all mu and nu: two parameters will do
        follow_locus(protected, at_zero(protected), SPACE)
