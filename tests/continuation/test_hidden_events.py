"""Bifurcations that a step could hide: close pairs, and two curves that pass each other at a small distance."""

import numpy as np
import pytest

from rodatlas.continuation import BVP, Solution, Status, TraceOptions, integral_of, switch, trace


def zero(bvp, **parameters):
    """The solution u = 0."""
    values = {**bvp.parameters, **parameters}
    return Solution.from_function(lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, values)


@pytest.mark.parametrize("half", [0.3, 0.05, 0.005])
def test_two_branch_points_close_together(half):
    """u'' + (pi^2 + half^2 - (lam - 1)^2) u + u^3 = 0: u = 0 is singular at lam = 1 - half and 1 + half only."""
    bvp = BVP(
        lambda s, u, p: [u.v, -(np.pi**2 + half**2 - (p.lam - 1) ** 2) * u.u - u.u**3],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": -1.03},
    )
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (-2.0, 3.0)}))
    assert [x.kind for x in branch.special] == ["branch point"] * 2
    assert np.allclose([x.solution["lam"] for x in branch.special], (1 - half, 1 + half), atol=1e-7)


def cubic(gap):
    """A constant u with (u - 2 lam)(u + lam) = gap: two lines that cross at zero, a hyperbola otherwise."""
    return BVP(
        lambda s, u, p: [0.0 * u.u],
        lambda left, right, p: [(left.u - 2 * p.lam) * (left.u + p.lam) - gap],
        unknowns=("u",),
        parameters={"lam": -1.0},
    )


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-5])
def test_a_near_miss_is_not_a_branch_point(gap):
    """For gap > 0 the two curves have no singular point but no fold either; for gap < 0 each has a fold."""
    bvp = cubic(gap)
    start = Solution.from_function(lambda s: np.full((len(s), 1), 1.0 + gap / 3), bvp.unknowns, {"lam": -1.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=False)
    assert branch.special == ()
    end = branch.points[-1].solution
    assert end["lam"] == 1.0
    assert abs(end["u"][0] - (2 + gap / 3)) < gap  # it stayed on its own curve, above both lines
    bvp = cubic(-gap)
    start = Solution.from_function(lambda s: np.full((len(s), 1), 1.0 - gap / 3), bvp.unknowns, {"lam": -1.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=False)
    assert [x.kind for x in branch.special] == ["fold"]
    # the discriminant 9 lam^2 - 4 gap vanishes at the fold
    assert abs(branch.special[0].solution["lam"] + 2 * np.sqrt(gap) / 3) < 1e-9
    assert branch.points[-1].solution["lam"] == -1.0


def test_a_real_branch_point_in_the_same_problem():
    bvp = cubic(0.0)
    start = Solution.from_function(lambda s: np.full((len(s), 1), 1.0), bvp.unknowns, {"lam": -1.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=False)
    assert [(x.kind, x.status) for x in branch.special] == [("branch point", Status.CONVERGED)]
    assert abs(branch.special[0].solution["lam"]) < 1e-9


def test_two_folds_close_together():
    """lam = u^3 - e^2 u has folds at u = +/- e/sqrt 3, whose parameters differ by 4 e^3/(3 sqrt 3)."""
    e = 0.05
    bvp = BVP(
        lambda s, u, p: [0.0 * u.u],
        lambda left, right, p: [left.u**3 - e**2 * left.u - p.lam],
        unknowns=("u",),
        parameters={"lam": -1.0},
    )
    start = Solution.from_function(lambda s: np.full((len(s), 1), -1.0), bvp.unknowns, {"lam": -1.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=False)
    assert [x.kind for x in branch.special] == ["fold"] * 2
    expected = 2 * e**3 / (3 * np.sqrt(3))
    assert np.allclose([x.solution["lam"] for x in branch.special], (expected, -expected), atol=1e-12)


@pytest.mark.parametrize("apart", [1e-3, 0.3])
def test_branch_points_of_two_modes_close_together(apart):
    """Two uncoupled Chafee-Infante problems, the second shifted: pairs at (k pi)^2 and (k pi)^2 - apart."""
    bvp = two_modes(apart)
    branch = trace(bvp, zero(bvp, lam=1.0), ("lam",), TraceOptions(bounds={"lam": (1.0, 50.0)}), both=False)
    expected = sorted(x - d for x in (np.pi**2, 4 * np.pi**2) for d in (0.0, apart))
    assert np.allclose([x.solution["lam"] for x in branch.special], expected, atol=1e-6)


def test_two_modes_that_become_singular_together():
    bvp = two_modes(0.0)
    branch = trace(bvp, zero(bvp, lam=1.0), ("lam",), TraceOptions(bounds={"lam": (1.0, 20.0)}), both=False)
    (point,) = branch.special
    assert (point.kind, point.multiplicity, point.status) == ("branch point", 2, Status.CONVERGED)
    assert abs(point.solution["lam"] - np.pi**2) < 1e-8
    assert branch.discrepancies == ()


def two_modes(apart):
    return BVP(
        lambda s, u, p: [u.v, -p.lam * u.u + u.u**3, u.z, -(p.lam + apart) * u.w + u.w**3],
        lambda left, right, p: [left.u, right.u, left.w, right.w],
        unknowns=("u", "v", "w", "z"),
        parameters={"lam": 1.0},
    )


def test_no_folds_are_invented_on_a_vertical_branch():
    """u'' + lam u = 0: at lam = pi^2 the solutions are all multiples of sin(pi s)."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * u.u],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 1.0},
        observables={"size": integral_of(lambda s, u, p: u.u**2)},
    )
    trivial = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (1.0, 15.0)}), both=False)
    options = TraceOptions(bounds={"size": (-1.0, 10.0)}, max_points=300)
    side = switch(bvp, trivial.special[0], ("lam",), options)
    assert side.special == ()
    assert np.abs(side.column("lam") - np.pi**2).max() < 1e-7
