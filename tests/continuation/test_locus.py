"""Loci of folds and branch points in two parameters, and the points at which they meet, end or turn."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rodatlas.continuation import (
    BVP,
    EndReason,
    Solution,
    Status,
    TraceOptions,
    follow_locus,
    integral_of,
    trace,
)


def gelfand():
    """Perturbed Gelfand (Bratu) problem, u'' + lam exp(u/(1 + eps u)) = 0: an explosive reaction."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u / (1 + p.eps * u.u))],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 0.0, "eps": 0.2},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )


def zero(bvp, **values):
    parameters = {**bvp.parameters, **values}
    return Solution.from_function(lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, parameters)


@pytest.fixture(scope="module")
def gelfand_locus():
    bvp = gelfand()
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 6.0), "mean": (0.0, 20.0)}), both=False)
    folds = branch.of_kind("fold")
    assert len(folds) == 2
    bounds = {"eps": (0.0, 0.3), "lam": (1.0, 6.0)}
    return bvp, folds, follow_locus(bvp, folds[0], ("lam", "eps"), TraceOptions(bounds=bounds))


def test_fold_locus_joins_both_folds_through_the_cusp(gelfand_locus):
    """The ignition and extinction folds meet in a cusp at eps = 0.2457803 (the 1D slab's transition value)."""
    _, folds, locus = gelfand_locus
    assert [e.kind for e in locus.events] == ["cusp"]
    cusp = locus.events[0]
    assert cusp.status is Status.CONVERGED
    assert abs(cusp.solution["eps"] - 0.2457803) < 5e-7
    # both folds of the branch at eps = 0.2 lie on it: same lam where the curve passes eps = 0.2
    crossings = []
    for a, b in zip(locus.points[:-1], locus.points[1:], strict=True):
        ea, eb = a.solution["eps"] - 0.2, b.solution["eps"] - 0.2
        if ea * eb <= 0 and ea != eb:
            low, high = (a, b) if ea < eb else (b, a)
            crossings.append(np.interp(0.0, sorted([ea, eb]), [low.solution["lam"], high.solution["lam"]]))
    expected = sorted(f.solution["lam"] for f in folds)
    assert len(crossings) == 2
    assert np.allclose(sorted(crossings), expected, atol=0.02)


def test_every_point_of_the_locus_is_a_fold(gelfand_locus):
    """Shooting from the computed slope: u(1) = 0, and the linearised solution vanishes at both ends too."""
    _, _, locus = gelfand_locus

    def rhs(s, y, lam, eps):
        u, v, du, dv = y
        f = np.exp(u / (1 + eps * u))
        return [v, -lam * f, dv, -lam * f / (1 + eps * u) ** 2 * du]

    for point in locus.points[::6]:
        sol = point.solution
        shot = solve_ivp(rhs, (0, 1), [0, sol["v"][0], 0, 1], "DOP853", rtol=1e-11, atol=1e-12,
                         args=(sol["lam"], sol["eps"]))  # fmt: skip
        assert abs(shot.y[0, -1]) < 1e-6 * max(1.0, sol["v"][0])
        assert abs(shot.y[2, -1]) < 1e-6
    assert EndReason.RANGE in locus.ends


def test_bratu_end_of_the_locus():
    """At eps = 0 the fold is Bratu's."""
    bvp = gelfand()
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 6.0), "mean": (0.0, 2.5)}), both=False)
    locus = follow_locus(bvp, branch.of_kind("fold")[0], ("lam", "eps"), TraceOptions(bounds={"eps": (0.0, 0.22)}))
    end = min((locus.points[0], locus.points[-1]), key=lambda p: p.solution["eps"]).solution
    assert abs(end["eps"]) < 1e-12
    assert abs(end["lam"] - 3.513830719125161) < 1e-9


def column():
    """A column on an elastic foundation with a cubic spring: u'''' + P u'' + k u + c u^3 = 0, pinned ends."""
    return BVP(
        lambda s, u, p: [u.u1, u.u2, u.u3, -p.P * u.u2 - p.k * u.u - p.c * u.u**3],
        lambda left, right, p: [left.u, left.u2, right.u, right.u2],
        unknowns=("u", "u1", "u2", "u3"),
        parameters={"P": 5.0, "k": 10.0, "c": 1.0},
    )


def test_buckling_load_on_an_elastic_foundation():
    """Mode 1 buckles at P = pi^2 + k/pi^2, for every k."""
    bvp = column()
    branch = trace(bvp, zero(bvp), ("P",), TraceOptions(bounds={"P": (5.0, 20.0)}), both=False)
    first = branch.of_kind("branch point")[0]
    locus = follow_locus(bvp, first, ("P", "k"), TraceOptions(bounds={"k": (0.0, 100.0), "P": (0.0, 100.0)}))
    assert locus.kind == "branch point"
    for p in locus.points:
        assert abs(p.solution["P"] - np.pi**2 - p.solution["k"] / np.pi**2) < 1e-6
    assert {round(locus.points[i].solution["k"], 9) for i in (0, -1)} == {0.0, 100.0}


def pair(lam0=-1.0):
    """u = 0 is singular where mu = (lam - 1)^2: two branch points that meet and vanish at mu = 0."""
    return BVP(
        lambda s, u, p: [u.v, -(np.pi**2 + p.mu - (p.lam - 1) ** 2) * u.u - p.c * u.u**3],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": lam0, "mu": 0.25, "c": 1.0},
    )


def test_two_branch_points_meet_and_vanish():
    bvp = pair()
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (-1.0, 3.0)}), both=False)
    locus = follow_locus(bvp, branch.special[0], ("lam", "mu"), TraceOptions(bounds={"mu": (-1.0, 1.0)}))
    found = [e for e in locus.events if e.kind == "extremum"]
    assert [(e.parameter, e.status) for e in found] == [("mu", Status.CONVERGED)]
    assert abs(found[0].solution["mu"]) < 1e-8
    assert abs(found[0].solution["lam"] - 1.0) < 1e-5
    lam, mu = locus.column("lam"), locus.column("mu")
    assert np.allclose(mu, (lam - 1) ** 2, atol=1e-7)


def test_a_pitchfork_changes_between_super_and_subcritical():
    """u'' + (pi^2 + lam) u + (lam + mu) u^3 = 0: the cubic coefficient at lam = 0 vanishes with mu."""
    bvp = BVP(
        lambda s, u, p: [u.v, -(np.pi**2 + p.lam - p.nu) * u.u - (p.mu + p.nu) * u.u**3],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": -1.0, "nu": 0.3, "mu": -0.5},
    )
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (-1.0, 2.0)}), both=False)
    # along the locus lam = nu the cubic coefficient is mu + nu: zero at nu = 0.5
    locus = follow_locus(bvp, branch.special[0], ("lam", "nu"), TraceOptions(bounds={"nu": (-1.0, 1.0)}))
    assert np.allclose(locus.column("lam"), locus.column("nu"), atol=1e-8)
    found = [e for e in locus.events if e.kind == "criticality"]
    assert len(found) == 1
    assert found[0].status is Status.CONVERGED
    assert abs(found[0].solution["nu"] - 0.5) < 1e-6


def test_wrong_arguments_are_named():
    bvp = gelfand()
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 5.0)}), both=False)
    fold = branch.of_kind("fold")[0]
    with pytest.raises(ValueError, match="free: expected 2 parameter names for a locus"):
        follow_locus(bvp, fold, ("lam",))
    with pytest.raises(ValueError, match="start: expected a fold, a branch point, an extremum or a zero, got a cusp"):
        follow_locus(bvp, replace(fold, kind="cusp"), ("lam", "eps"))
    with pytest.raises(ValueError, match=r"bounds: expected the start inside those of 'eps', 0\.3 to 1\.0, got 0\.2"):
        follow_locus(bvp, fold, ("lam", "eps"), TraceOptions(bounds={"eps": (0.3, 1.0)}))
