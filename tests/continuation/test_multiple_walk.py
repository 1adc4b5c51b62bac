"""Branches that pass multiple branch points: located on the way, and everything that leaves them followed."""

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, constant
from test_multiple import circular, column, cube, curved, oscillators, rest, spatial_column, square, triangle

from rodatlas.continuation import (
    Branch,
    EndReason,
    Solution,
    Status,
    StepControl,
    TraceOptions,
    switch,
    switch_all,
    trace,
)

pytestmark = pytest.mark.slow

BOX = TraceOptions(bounds={"lam": (-0.5, 0.5)})


def paced(factor, options=BOX):
    """Longer or shorter steps."""
    return replace(options, step=StepControl(initial=0.02 * factor, maximum=0.5 * factor))


def found(branch):
    return [(x.kind, x.multiplicity, len(x.rays), bool(x.turns), x.unverified) for x in branch.special]


def ends(branches):
    """Unknowns at s = 0 and parameter of the last point of each branch."""
    last = [b.points[-1].solution for b in branches]
    return np.array([[*s.values[0], s["lam"]] for s in last])


def same_set(one, two, tolerance):
    distance = np.linalg.norm(np.array(one)[:, None] - np.array(two)[None], axis=2)
    return (
        len(one) == len(two)
        and sorted(distance.argmin(axis=1)) == list(range(len(two)))
        and (distance.min(axis=1).max() < tolerance)
    )


def unstable(jacobian):
    """Index function of an algebraic problem: the number of positive eigenvalues."""
    return lambda s: int((np.linalg.eigvals(jacobian(*s.values[0], s["lam"])).real > 0).sum())


def square_jacobian(b):
    return lambda x, y, m: np.array(
        [[m - 3 * x**2 - b * y**2, -2 * b * x * y], [-2 * b * x * y, m - 3 * y**2 - b * x**2]]
    )


@pytest.mark.parametrize("factor", [0.3, 1, 3])
@pytest.mark.parametrize("lam", [-0.4, -0.02, 0.013])
@pytest.mark.parametrize("b", [2.0, 0.5])
def test_square_symmetry_along_the_trunk(b, lam, factor):
    bvp = square(b)
    options = replace(paced(factor), index=unstable(square_jacobian(b)))
    branch = trace(bvp, constant(bvp, lam=lam), ("lam",), options)
    assert found(branch) == [("branch point", 2, 10, False, 0)]
    (point,) = branch.special
    assert point.status is Status.CONVERGED
    assert point.arclength == pytest.approx(-lam, abs=1e-8)
    assert point.index == (0, 2)
    assert point.normal_form is None
    assert (branch.discrepancies, branch.ends) == ((), (EndReason.RANGE, EndReason.RANGE))
    assert "multiplicity 2 with 10 rays" in repr(point)
    ahead, behind = point.rays[:2]
    assert (round(ahead.scalars[0], 6), round(behind.scalars[0], 6)) == (1, -1)


@pytest.mark.parametrize("factor", [0.1, 1, 3, 10])
@pytest.mark.parametrize("start", [(0.6, 0.0), (0.1, 0.0), (0.3, 0.3), (-0.05, -0.05)])
def test_square_symmetry_along_a_side_branch(start, factor):
    """The parameter turns there, and the index stays; no fold or second branch point is invented nearby."""
    bvp, (x, y) = square(2.0), start
    options = replace(paced(factor), index=unstable(square_jacobian(2.0)))
    branch = trace(bvp, constant(bvp, start, lam=x**2 + 2 * y**2), ("lam",), options)
    assert found(branch) == [("branch point", 2, 10, True, 0)]
    assert branch.discrepancies == ()
    assert abs(branch.special[0].solution["lam"]) < 1e-9
    before, after = branch.special[0].index
    assert before == after == (1 if y else 0)
    other = ends(switch_all(bvp, branch.special[0], ("lam",), BOX))
    assert len(other) == 8
    assert sorted(other[:, 2])[0] == pytest.approx(-0.5)  # the trunk, stable side
    assert (np.abs(other[:, :2]).max(axis=1) < 1e-6).sum() == 2


@pytest.mark.parametrize("b", [2.0, 0.5])
def test_all_branches_of_the_square(b):
    bvp = square(b)
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    branches = switch_all(bvp, point, ("lam",), BOX)
    axis, diagonal = np.sqrt(0.5), np.sqrt(0.5 / (1 + b))
    expected = [(axis * x, axis * y, 0.5) for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    expected += [(diagonal * x, diagonal * y, 0.5) for x in (1, -1) for y in (1, -1)]
    assert same_set(ends(branches), expected, 1e-8)
    for i, branch in enumerate(branches):
        assert branch.ends == (EndReason.BRANCH_POINT, EndReason.RANGE)
        assert branch.special == ()
        assert (np.diff(branch.column("arclength")) > 0).all()
        again = switch(bvp, point, ("lam",), BOX, ray=i + 2)
        assert np.array_equal(again.column("lam"), branch.column("lam"))
    # the two sides of a curve follow one another
    assert np.allclose(ends(branches)[::2, :2], -ends(branches)[1::2, :2], atol=1e-8)
    both = ends([switch(bvp, point, ("lam",), BOX, side=side) for side in (1, -1)])
    assert np.allclose(both, ends(branches)[:2])


@pytest.mark.parametrize("factor", [0.3, 1, 3])
def test_triangle_symmetry(factor):
    """Three straight lines and the trunk: the index goes from 0 to 2 along it, and stays 1 along a line."""
    bvp = triangle()
    index = unstable(lambda x, y, m: np.array([[m + 2 * x, -2 * y], [-2 * y, m - 2 * x]]))
    options = replace(paced(factor), index=index)
    trunk = trace(bvp, constant(bvp, lam=-0.3), ("lam",), options)
    assert found(trunk) == [("branch point", 2, 8, False, 0)]
    assert trunk.special[0].index == (0, 2)
    angles = np.arange(3) * 2 * np.pi / 3
    expected = [(s * np.cos(a), s * np.sin(a), -s) for a in angles for s in (0.5, -0.5)]
    assert same_set(ends(switch_all(bvp, trunk.special[0], ("lam",), BOX)), expected, 1e-8)
    for lam in (-0.3, -0.01, 0.1):
        line = trace(bvp, constant(bvp, [-lam, 0.0], lam=lam), ("lam",), options)
        assert found(line) == [("branch point", 2, 8, False, 0)]
        assert line.special[0].index == (1, 1)
        assert line.discrepancies == ()


def test_three_modes_at_once():
    """Before, the determinant changed sign and one simple branch point was reported."""
    bvp = cube(0.5)
    for factor in (0.3, 1, 3):
        trunk = trace(bvp, constant(bvp, lam=-0.3), ("lam",), paced(factor))
        assert found(trunk) == [("branch point", 3, 28, False, 0)]
    signs = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]
    sizes = [np.sqrt(0.5 / (0.5 + 0.5 * np.count_nonzero(s))) for s in signs]
    expected = [(*(r * np.array(s)), 0.5) for r, s in zip(sizes, signs, strict=True)]
    branches = switch_all(bvp, trunk.special[0], ("lam",), BOX)
    assert same_set(ends(branches), expected, 1e-8)
    side = trace(bvp, constant(bvp, [0.3, 0.3, 0.0], lam=0.09 * 1.5), ("lam",), BOX)
    assert found(side) == [("branch point", 3, 28, True, 0)]


def test_both_directions_give_the_same_list():
    bvp = square(2.0)
    up = trace(bvp, constant(bvp, lam=-0.4), ("lam",), BOX)
    down = trace(bvp, constant(bvp, lam=0.4), ("lam",), BOX)
    (one,), (two,) = up.special, down.special  # `down` met the point on its way back
    assert one.solution["lam"] == pytest.approx(two.solution["lam"], abs=1e-10)
    assert one.rays[0].scalars[0] == pytest.approx(two.rays[0].scalars[0])
    assert one.rays[1].scalars[0] == pytest.approx(two.rays[1].scalars[0])
    for point in (one, two):
        for v, x in zip(point.rays, point.nearby, strict=True):  # states and directions stay together
            off = np.array([*x.mesh[0], *x.scalars])
            assert np.array([*v.mesh[0], *v.scalars]) @ off / np.linalg.norm(off) > 0.99
    assert same_set(
        ends(switch_all(bvp, one, ("lam",), BOX)), ends(switch_all(bvp, two, ("lam",), BOX)), 1e-8
    )  # fmt: skip


def test_branches_that_share_their_tangent():
    """x = 0 with y = -lam, and x^2 = lam with y = x^2 or y = -3 x^2: two parabolas that touch one another."""
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2), (u.y - u.x**2) * (p.lam + u.y + 2 * u.x**2)], ("x", "y")
    )  # fmt: skip
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    assert (point.multiplicity, point.unverified) == (2, 0)
    expected = [(s * np.sqrt(0.5), y, 0.5) for s in (1, -1) for y in (0.5, -1.5)]
    branches = ends(switch_all(bvp, point, ("lam",), BOX))
    assert same_set(branches, [*expected, (0.0, -0.5, 0.5), (0.0, 0.5, -0.5)], 1e-7)


def test_rays_that_cannot_be_confirmed_are_counted():
    """On the axis y = 0 the first equation is x^5 small: round-off hides one of the two parabolas there."""
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2 - 3 * u.y**2) * (p.lam - 2 * u.x**2 - 3 * u.y**2),
                      u.y * (p.lam - u.y**2 + 5 * u.x**2)], ("x", "y"),
    )  # fmt: skip
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    assert len(point.rays) + point.unverified >= 8
    branches = ends(switch_all(bvp, point, ("lam",), BOX))
    assert len(branches) == len(point.rays) - 2
    exact = np.array([(s * x, 0, 0.5) for x in (np.sqrt(0.5), 0.5) for s in (1, -1)]
                     + [(0, s * np.sqrt(0.5), 0.5) for s in (1, -1)])  # fmt: skip
    assert np.linalg.norm(branches[:, None] - exact[None], axis=2).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("apart", [0.0, 1e-3, 1e-5])
def test_two_oscillators(apart):
    """One double point, or two simple ones, which are told apart without the shortest of steps."""
    bvp = oscillators(0.5, apart)
    for factor in (0.3, 1, 3):
        branch = trace(bvp, rest(bvp, lam=-0.4), ("lam",), paced(factor))
        assert branch.discrepancies == ()
        if apart == 0.0:
            assert found(branch) == [("branch point", 2, 10, False, 0)]
        else:
            assert found(branch) == [("branch point", 1, 4, False, 0)] * 2
            assert np.allclose([x.solution["lam"] for x in branch.special], [-apart, 0.0], atol=1e-9)
        assert len(branch) < 60
    sides = [b for x in branch.special for b in switch_all(bvp, x, ("lam",), BOX)]
    assert len(sides) == (8 if apart == 0.0 else 4)
    last = np.array([b.points[-1].solution.values[0, [1, 3]] for b in sides]) / np.pi  # amplitudes
    assert all(np.linalg.norm(u - v) > 0.1 for i, u in enumerate(last) for v in last[:i])
    for b, (u, w) in zip(sides, np.abs(last), strict=True):
        mixed = 1.0 + 0.5 * (min(u, w) > 1e-3)
        assert b.ends[1] is EndReason.RANGE
        assert 0.75 * max(u, w) ** 2 * mixed == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize(("apart", "lam", "step"), [(0.1, -0.2, 0.2), (0.01, 0.02, 0.02)])
def test_a_step_that_ends_at_a_branch_point(apart, lam, step):
    """Both are reported, and each once."""
    bvp = oscillators(0.5, apart)
    branch = trace(bvp, rest(bvp, lam=lam), ("lam",), replace(BOX, step=StepControl(initial=step, maximum=25 * step)))
    assert np.allclose([x.solution["lam"] for x in branch.special], [-apart, 0.0], atol=1e-8)


def test_a_start_close_to_a_multiple_point():
    for lam in (-1e-9, 1e-9, -1e-6, 1e-4):
        branch = trace(triangle(), constant(triangle(), lam=lam), ("lam",), BOX)
        assert found(branch) == [("branch point", 2, 8, False, 0)]


@pytest.mark.parametrize("backend", ["numba", "scipy"])
@pytest.mark.parametrize(("bvp", "multiplicity", "rays", "trunk"), [
    *[(bvp, d, rays, lambda lam: 0.0)
      for bvp, d, rays in ((square(2.0), 2, 10), (triangle(), 2, 8), (cube(2.0), 3, 28), (circular(), 2, 3))],
    (curved(), 2, 10, lambda lam: np.stack([np.sin(lam), lam - np.sin(lam) ** 2], axis=1)),
])  # fmt: skip
def test_a_start_exactly_at_a_multiple_point(bvp, multiplicity, rays, trunk, backend):
    """The branch along which the parameter changes most is followed: here the trunk; the point is listed, once."""
    branch = trace(bvp, constant(bvp, lam=0.0), ("lam",), replace(BOX, backend=backend))
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert found(branch) == [("branch point", multiplicity, rays, False, 0)]
    lam, values = branch.column("lam"), np.array([p.solution.values[0] for p in branch])
    assert sorted(lam[[0, -1]]) == [-0.5, 0.5]
    assert np.allclose(values, trunk(lam), atol=1e-8)


def test_three_close_branch_points():
    """The determinant changes sign once, and yet there are three."""
    bvp = algebraic(
        lambda u, p: [v * (p.lam - c - v**2) for v, c in ((u.x, 0.0), (u.y, 1e-3), (u.z, 3e-3))], ("x", "y", "z")
    )
    for factor in (0.3, 1, 3):
        branch = trace(bvp, constant(bvp, lam=-0.4), ("lam",), paced(factor))
        assert found(branch) == [("branch point", 1, 4, False, 0)] * 3
        assert np.allclose([x.solution["lam"] for x in branch.special], [0.0, 1e-3, 3e-3], atol=1e-9)


@pytest.mark.parametrize("factor", [0.3, 1, 3])
def test_column_on_an_elastic_foundation(factor):
    """k = 4 pi^4: one and two half-waves at the same load."""
    bvp = column(1000.0)
    options = paced(factor, TraceOptions(bounds={"P": (40.0, 60.0)}))
    branch = trace(bvp, rest(bvp, P=45.0), ("P",), options)
    assert found(branch) == [("branch point", 2, 6, False, 0)]
    assert branch.special[0].solution["P"] == pytest.approx(5 * np.pi**2, abs=1e-8)
    waves = []
    for side in switch_all(bvp, branch.special[0], ("P",), options):
        assert side.ends[1] is EndReason.RANGE
        w = side.points[-1].solution.values[1:-1, 0]
        waves.append(1 + int((np.diff(np.sign(w[np.abs(w) > 1e-6 * np.abs(w).max()])) != 0).sum()))
    assert sorted(waves) == [1, 1, 2, 2]


def test_a_continuum_needs_a_phase_condition():
    bvp = circular()
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    assert (point.multiplicity, point.continuum, len(point.rays)) == (2, True, 3)
    assert "a continuum of branches" in repr(point)
    with pytest.raises(ValueError, match="declare it"):
        switch(bvp, point, ("lam",), BOX)
    with pytest.raises(ValueError, match="declare it"):
        switch_all(bvp, point, ("lam",), BOX)


def test_a_column_that_buckles_in_every_plane():
    bvp = spatial_column()
    start = Solution.from_function(
        lambda s: np.tile([1.0, 0, 0, 0, 0, 0, 0, 0], (len(s), 1)), bvp.unknowns, {**bvp.parameters, "P": 9.0}
    )
    branch = trace(bvp, start, ("P", "ny", "nz"), TraceOptions(bounds={"P": (8.0, 11.0)}))
    (point,) = branch.special
    assert (point.multiplicity, point.continuum, branch.discrepancies) == (2, True, ())
    assert point.solution["P"] == pytest.approx(np.pi**2, abs=1e-8)


def test_switching_checks_what_it_is_given():
    bvp = square(2.0)
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    with pytest.raises(ValueError, match="ray: expected 0 to 9, got 10"):
        switch(bvp, point, ("lam",), BOX, ray=10)
    back = switch(bvp, point, ("lam",), BOX, ray=1)  # the trunk itself, backward
    assert np.allclose(ends([back]), [(0, 0, -0.5)])


def test_a_simple_branch_point_has_four_rays():
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2)])
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    assert (point.multiplicity, len(point.rays)) == (1, 4)
    all_four = [switch(bvp, point, ("lam",), BOX, ray=i) for i in range(4)]
    expected = [(0, 0.5), (0, -0.5), (np.sqrt(0.5), 0.5), (-np.sqrt(0.5), 0.5)]
    assert same_set(ends(all_four), expected, 1e-8)
    assert np.array_equal(ends(switch_all(bvp, point, ("lam",), BOX)), ends(all_four[2:]))


def test_no_other_branch():
    """An isolated point in the section of a branch carries no ray of another one."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2)])
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX).special
    assert switch_all(bvp, replace(point, directions=point.directions[:1]), ("lam",), BOX) == ()


def test_files_keep_multiple_points(tmp_path):
    bvp = square(2.0)
    branch = trace(bvp, constant(bvp, lam=-0.3), ("lam",), BOX)
    branch.save(tmp_path / "b.h5")
    (one,), (two,) = branch.special, Branch.load(tmp_path / "b.h5").special
    assert repr(one) == repr(two)
    for name in ("multiplicity", "continuum", "unverified", "turns"):
        assert getattr(one, name) == getattr(two, name)
    for a, b in zip((*one.rays, *one.nearby), (*two.rays, *two.nearby), strict=True):
        for name in ("stage", "mesh", "scalars"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    here, there = (ends(switch_all(bvp, x, ("lam",), BOX)) for x in (one, two))
    np.testing.assert_array_equal(here, there)
