"""Known branches: Bratu, the clamped elastica, phase separation, van der Pol's orbit; both backends, any step size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import (
    BRATU_FOLD,
    EULER_LOADS,
    algebraic,
    bratu,
    bratu_exact,
    constant,
    elastica,
    phase_separation,
    van_der_pol,
)
from scipy.optimize import brentq

from rodatlas.continuation import (
    Branch,
    EndReason,
    MeshControl,
    Solution,
    Status,
    StepControl,
    TraceOptions,
    solve,
    switch,
    trace,
)

BRATU = TraceOptions(bounds={"lam": (0.0, 4.0), "mean": (-1.0, 4.0)})
FINE = MeshControl(tolerance=1e-11)
COLUMN = TraceOptions(bounds={"P": (1.0, 260.0)}, mesh=FINE)
LOAD = ("P", "V")


def straight(options: TraceOptions = COLUMN) -> Branch:
    return trace(elastica(), constant(elastica(), P=10.0), LOAD, options)


# -- Bratu ------------------------------------------------------------------------------------------------------------


def test_bratu_has_one_fold_and_an_upper_branch() -> None:
    branch = trace(bratu(), constant(bratu()), ("lam",), BRATU)
    assert [x.kind for x in branch.special] == ["fold"]
    (fold,) = branch.special
    assert fold.status is Status.CONVERGED
    assert fold.solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-10)
    assert fold.curvature < 0
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert branch.points[-1].solution["mean"] == pytest.approx(4.0, abs=1e-9)
    for point in branch.points[1:]:
        solution = point.solution
        theta = brentq(lambda t, v=solution["v"][0]: t * np.tanh(t / 4) - v, 1e-9, 40.0, xtol=1e-14)
        lam, exact = bratu_exact(theta, solution.mesh)
        assert solution["lam"] == pytest.approx(lam, abs=1e-7)
        assert np.abs(solution.values - exact).max() < 1e-6
        assert solution["slope"] == pytest.approx(solution["v"][0])
        assert solution.error < 1e-7


def test_a_branch_is_a_table() -> None:
    branch = trace(bratu(), constant(bratu()), ("lam",), BRATU)
    table = branch.to_frame()
    assert len(table) == len(branch) + 1
    row = table[table["label"] == "LP"].iloc[0]
    assert row["lam"] == pytest.approx(BRATU_FOLD, abs=1e-10)
    assert row["mean"] == branch.special[0].solution["mean"]
    assert table["lam"].idxmax() == row.name
    np.testing.assert_array_equal(table[table["label"] == ""]["lam"], branch.column("lam"))


def test_the_branch_and_its_arclength_do_not_depend_on_the_mesh() -> None:
    lengths, folds = [], []
    for n_int in (20, 60):
        step = StepControl(initial=0.05, maximum=0.05)
        options = replace(BRATU, mesh=MeshControl(intervals=(n_int, n_int)), step=step)
        branch = trace(bratu(), constant(bratu()), ("lam",), options)
        lengths.append(branch.points[-1].arclength)
        folds.append(branch.special[0].arclength)
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-5)
    assert folds[0] == pytest.approx(folds[1], rel=1e-5)


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_nothing_is_missed_when_steps_change(factor: float) -> None:
    step = StepControl()
    step = replace(step, initial=step.initial * factor, maximum=step.maximum * factor, target=step.target * factor**3)
    branch = trace(bratu(), constant(bratu()), ("lam",), replace(BRATU, step=step))
    assert [x.kind for x in branch.special] == ["fold"]
    assert branch.special[0].solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-9)
    column = straight(replace(COLUMN, step=step))
    np.testing.assert_allclose([x.solution["P"] for x in column.special], EULER_LOADS, rtol=1e-9)


def test_the_fallback_gives_the_same_branch_and_events() -> None:
    runs = {}
    for backend in ("numba", "scipy"):
        runs[backend] = (
            trace(bratu(), constant(bratu()), ("lam",), replace(BRATU, backend=backend)),
            straight(replace(COLUMN, backend=backend)),
        )
    for one, two in zip(runs["numba"], runs["scipy"], strict=True):
        assert len(one) == len(two)
        assert one.ends == two.ends
        np.testing.assert_allclose(one.column(one.free[0]), two.column(two.free[0]), atol=1e-9)
        np.testing.assert_array_equal(one.column("branch_test"), two.column("branch_test"))
        assert [x.kind for x in one.special] == [x.kind for x in two.special]
        for a, b in zip(one.special, two.special, strict=True):
            np.testing.assert_allclose(a.solution.parameters, b.solution.parameters, rtol=1e-10, atol=1e-10)


def test_runs_are_repeatable_to_the_last_digit() -> None:
    one, two = (trace(bratu(), constant(bratu()), ("lam",), BRATU) for _ in range(2))
    np.testing.assert_array_equal(one.column("lam"), two.column("lam"))
    np.testing.assert_array_equal(one.special[0].solution.values, two.special[0].solution.values)


def test_a_run_restarts_from_any_of_its_points() -> None:
    branch = trace(bratu(), constant(bratu()), ("lam",), BRATU)
    for point in branch.points[:: len(branch) // 4]:
        again = trace(bratu(), point.solution, ("lam",), BRATU)
        assert [x.kind for x in again.special] == ["fold"]
        assert again.special[0].solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-9)


# -- the planar clamped elastica --------------------------------------------------------------------------------------


def test_the_straight_column_buckles_at_the_euler_loads() -> None:
    branch = straight()
    assert [x.kind for x in branch.special] == ["branch point"] * 4
    for point, load in zip(branch.special, EULER_LOADS, strict=True):
        assert point.status is Status.CONVERGED
        assert point.solution["P"] == pytest.approx(load, abs=1e-8)
        assert point.solution.error < 1e-10
    signs = branch.column("branch_test")
    assert set(signs) == {-1.0, 1.0}


def test_the_error_of_a_buckling_load_is_known_although_the_straight_state_is_exact() -> None:
    """The mesh follows the solution, which here is zero; the buckling modes need a mesh of their own."""
    branch = straight(replace(COLUMN, mesh=MeshControl(tolerance=1e-6)))
    for point, load in zip(branch.special, EULER_LOADS, strict=True):
        true = abs(point.solution["P"] / load - 1)
        assert true < 1e-6
        assert true == pytest.approx(point.solution.error, rel=0.5, abs=1e-12)


def test_every_mode_is_switched_to_on_both_sides_without_duplicates() -> None:
    branch = straight()
    slopes = []
    options = replace(COLUMN, bounds={"P": (1.0, 260.0), "compression": (-0.1, 0.1)})
    for mode, point in enumerate(branch.special, start=1):
        pair = [switch(elastica(), point, LOAD, options, side=side) for side in (1, -1)]
        for side in pair:
            assert side is not None
            assert side.ends == (EndReason.BRANCH_POINT, EndReason.RANGE)
            assert side.points[-1].solution["compression"] == pytest.approx(0.1, abs=1e-9)
            theta = side.points[-1].solution(np.linspace(0.001, 0.999, 400), "theta")
            assert (np.diff(np.sign(theta)) != 0).sum() == mode  # sign changes of the angle
        ends = [side.points[-1].solution for side in pair if side is not None]
        np.testing.assert_allclose(ends[0](0.3), -ends[1](0.3), atol=1e-8)  # one is the other upside down
        slopes.append(abs(ends[0]["k0"]))
    assert len(set(np.round(slopes, 6))) == 4


def test_the_buckled_elastica_has_the_shape_known_in_closed_form() -> None:
    first = straight().special[0]
    options = replace(COLUMN, bounds={"P": (1.0, 260.0), "compression": (-0.1, 0.6)}, zeros={"compression": 0.5})
    branch = switch(elastica(), first, LOAD, options)
    assert branch is not None
    (zero,) = branch.of_kind("zero of compression")
    s = zero.solution
    assert zero.label == "UZ"
    assert s["compression"] == pytest.approx(0.5, abs=1e-12)
    assert s["P"] == pytest.approx(53.274112596, abs=1e-8)
    assert s["V"] == pytest.approx(0.0, abs=1e-9)
    assert abs(s(0.5, "y")[0]) == pytest.approx(0.373306427, abs=1e-9)
    assert abs(s["area"]) == pytest.approx(0.186653214, abs=1e-9)
    assert s["energy"] == pytest.approx(22.802367046, abs=1e-8)
    assert abs(s["k0"]) == pytest.approx(9.943784324, abs=1e-8)
    # the work of the load: dE = P d(compression)
    table = branch.to_frame()
    work = np.trapezoid(table["P"], table["compression"])
    assert table["energy"].iloc[-1] == pytest.approx(work, rel=2e-3)


def test_the_branch_point_at_touching_ends_is_found_on_both_mirror_images() -> None:
    """Where the ends of the first mode meet, the direction of the end force is free: asymmetric states branch off."""
    first = straight().special[0]
    options = replace(COLUMN, bounds={"P": (1.0, 260.0), "compression": (-0.1, 1.2)}, mesh=MeshControl())
    found = []
    for side in (1, -1):
        branch = switch(elastica(), first, LOAD, options, side=side)
        assert branch is not None
        assert [x.kind for x in branch.special] == ["branch point"]
        found.append(branch.special[0].solution)
        assert found[-1]["compression"] == pytest.approx(1.0, abs=1e-7)
    assert found[0]["P"] == pytest.approx(found[1]["P"], rel=1e-8)
    assert found[0]["k0"] == pytest.approx(-found[1]["k0"], rel=1e-7)


# -- an integral condition with a free scalar -------------------------------------------------------------------------


def test_phase_separation_starts_where_linear_theory_says() -> None:
    bvp, eps = phase_separation(), 0.1
    options = TraceOptions(bounds={"m": (-1.0, 1.0)}, mesh=FINE)
    branch = trace(bvp, constant(bvp), ("m", "mu"), options)
    waves = np.arange(1, 4)
    expected = np.sqrt((1 - (eps * np.pi * waves) ** 2) / 3)  # three wave numbers fit
    np.testing.assert_allclose(
        [x.solution["m"] for x in branch.special], [*-expected, *expected[::-1]], rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(branch.column("mu"), branch.column("m") - branch.column("m") ** 3, atol=1e-10)
    half = switch(bvp, branch.special[-1], ("m", "mu"), options)
    assert half is not None
    assert half.closed  # down to the point at -m and back as the mirror image
    for point in half:
        assert point.solution.mean(point.solution.stages[..., 0]) == pytest.approx(point.solution["m"], abs=1e-9)
    assert {x.kind for x in half.special} == {"fold", "branch point"}
    met = [x for x in half.special if x.kind == "branch point"]
    assert all(x.turns for x in met)
    assert min(x.solution["m"] for x in met) == pytest.approx(-expected[0], abs=1e-8)


def test_the_period_of_van_der_pols_orbit() -> None:
    """mu = 1: T = 6.66328685932313 (Andersen and Geer 1982)."""
    bvp = van_der_pol()
    guess = Solution.from_function(
        lambda s: np.column_stack([2 * np.sin(2 * np.pi * s), 2 * np.cos(2 * np.pi * s)]), bvp.unknowns, bvp.parameters
    )
    options = TraceOptions(bounds={"mu": (0.05, 1.0)}, mesh=FINE)
    branch = trace(bvp, guess, ("mu", "T"), options)
    assert branch.special == ()
    assert branch.points[-1].solution["T"] == pytest.approx(6.66328685932313, abs=1e-9)
    assert branch.points[0].solution["T"] == pytest.approx(2 * np.pi * (1 + 0.05**2 / 16), abs=1e-6)


# -- solving at one setting -------------------------------------------------------------------------------------------


def test_solve_meets_the_tolerance_and_holds_the_parameters() -> None:
    lam, _ = bratu_exact(8.0, np.array([0.0]))
    guess = Solution.from_function(
        lambda s: bratu_exact(8.0, s)[1] * (1 + 0.01 * np.sin(7 * s))[:, None], bratu().unknowns, {"lam": lam}, 10
    )
    for tolerance in (1e-6, 1e-10):
        found = solve(bratu(), guess, options=TraceOptions(mesh=MeshControl(tolerance=tolerance)))
        assert found["lam"] == pytest.approx(lam, abs=1e-14)
        assert found.error < tolerance
        exact = bratu_exact(8.0, found.mesh)[1]
        assert np.abs(found.values - exact).max() < 30 * tolerance
    other = solve(bratu(), guess, options=TraceOptions(mesh=MeshControl(points=3, intervals=(50, 50))))
    assert (other.points, other.intervals) == (3, 50)


def test_the_free_parameters_are_counted() -> None:
    with pytest.raises(ValueError, match=r"free: expected 2 parameter name\(s\)"):
        trace(elastica(), constant(elastica()), ("P",))
    with pytest.raises(ValueError, match="parameter: expected one of P, V, got 'Q'"):
        trace(elastica(), constant(elastica()), ("P", "Q"))


def test_a_curve_of_many_parameters_follows_the_first() -> None:
    bvp = algebraic(lambda u, p: [u.x - p.a * p.b, u.x + p.b - 1], parameters=("a", "b"))
    branch = trace(bvp, constant(bvp, [0.0], b=1.0), ("a", "b"), TraceOptions(bounds={"a": (0.0, 3.0)}))
    np.testing.assert_allclose(branch.column("b"), 1 / (1 + branch.column("a")), atol=1e-9)
    assert branch.free == ("a", "b")
