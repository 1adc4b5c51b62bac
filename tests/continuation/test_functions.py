"""Tables and the error function in a problem: exact integrals, known folds, one line of refusal."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import scipy.special
from scipy.interpolate import CubicSpline

from rodatlas.continuation import (
    BVP,
    EndReason,
    MeshControl,
    NewtonCode,
    Solution,
    TraceOptions,
    erf,
    solve,
    tabulated,
    trace,
)

PLACES = np.array([0.0, 0.13, 0.31, 0.5, 0.62, 0.85, 1.0])
VALUES = np.array([1.0, 1.7, 0.4, 2.2, -0.3, 0.9, 1.1])


def zero(bvp: BVP) -> Solution:
    return Solution.from_function(lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, bvp.parameters)


@pytest.mark.parametrize("kind", ["cubic", "linear"])
def test_a_table_is_the_same_on_symbols_and_on_numbers(kind: str) -> None:
    table = tabulated(PLACES, VALUES, kind)
    s = ca.SX.sym("s")
    value = table(s)
    traced = ca.Function("f", [s], [value, ca.jacobian(value, s), ca.hessian(value, s)[0]])
    spline = CubicSpline(PLACES, VALUES)
    for x in (0.0, 0.07, 0.13, 0.4, 0.999, 1.0):
        exact = spline(x) if kind == "cubic" else np.interp(x, PLACES, VALUES)
        assert table(x) == pytest.approx(exact, abs=1e-13)
        assert float(traced(x)[0]) == pytest.approx(exact, abs=1e-13)
        if kind == "cubic":
            assert float(traced(x)[1]) == pytest.approx(spline(x, 1), abs=1e-11)
            assert float(traced(x)[2]) == pytest.approx(spline(x, 2), abs=1e-10)
    np.testing.assert_allclose(table(PLACES), VALUES, atol=1e-13)
    assert "7 points from 0 to 1" in repr(table)


def test_outside_a_table_there_is_nothing_unless_it_is_extended() -> None:
    table, extended = (tabulated(PLACES, PLACES**2, extend=extend) for extend in (False, True))
    s = ca.SX.sym("s")
    assert table(1.0 + 1e-12) == pytest.approx(1.0)
    for x in (-0.1, 1.2):
        assert np.isinf(table(x))
        assert np.isinf(float(ca.Function("f", [s], [table(s)])(x)))
        assert extended(x) == pytest.approx(x**2)
        assert float(ca.Function("f", [s], [extended(s)])(x)) == pytest.approx(x**2)


def test_knots_as_breakpoints_make_a_spline_exact() -> None:
    """u' = table(s): four Gauss points integrate each cubic exactly; without breakpoints the mesh has to grow."""
    table, spline = tabulated(PLACES, VALUES), CubicSpline(PLACES, VALUES)

    def problem(**more) -> BVP:
        return BVP(lambda s, u, p: [table(s)], lambda left, right, p: [left.u], unknowns=("u",), **more)

    found = solve(problem(breakpoints=table.knots[1:-1]), zero(problem()))
    assert found["u"][-1] == pytest.approx(spline.integrate(0, 1), abs=1e-14)
    assert found(0.31, "u")[0] == pytest.approx(spline.integrate(0, 0.31), abs=1e-14)
    assert found.intervals <= 20
    assert solve(problem(), zero(problem()))["u"][-1] == pytest.approx(spline.integrate(0, 1), abs=1e-8)


def test_a_tabulated_law_of_the_unknown() -> None:
    """Bratu's problem with exp(u) from a table; a branch that leaves the table ends there and says why."""
    x = np.linspace(-0.5, 3.0, 141)
    law = tabulated(x, np.exp(x))
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * law(u.u)], lambda left, right, p: [left.u, right.u], unknowns=("u", "v"),
        parameters={"lam": 0.0},
    )  # fmt: skip
    branch = trace(bvp, zero(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 5.0)}, mesh=MeshControl(tolerance=1e-7)),
                   both=False)  # fmt: skip
    (fold,) = branch.special
    assert fold.solution["lam"] == pytest.approx(3.513830719125161, abs=1e-6)
    assert branch.ends[1] is EndReason.MIN_STEP
    assert branch.failures[1] is NewtonCode.NOT_FINITE
    highest = branch.points[-1].solution(0.5, "u")[0]
    assert 2.9 < highest < 3.01  # all Gauss points lie in the table


def test_the_error_function() -> None:
    """u' = erf(s): erf(1) + (1/e - 1)/sqrt(pi); with numbers it is SciPy's."""
    bvp = BVP(lambda s, u, p: [erf(s)], lambda left, right, p: [left.u], unknowns=("u",))
    exact = scipy.special.erf(1.0) + (np.exp(-1.0) - 1) / np.sqrt(np.pi)
    assert solve(bvp, zero(bvp))["u"][-1] == pytest.approx(exact, abs=1e-12)
    np.testing.assert_array_equal(erf(PLACES), scipy.special.erf(PLACES))
    assert erf(0.5) == scipy.special.erf(0.5)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (scipy.special.erf, "got SciPy's erf: `erf` and `tabulated` of this package take symbols"),
        (lambda u: scipy.special.jv(0, u), "got SciPy's jv: `erf` and `tabulated`"),
        (CubicSpline(PLACES, VALUES), "got the constant NaN.* `erf` and `tabulated` of this package take symbols"),
    ],
    ids=["erf", "jv", "spline"],
)
def test_functions_of_scipy_are_refused_with_what_to_use(function, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BVP(lambda s, u, p: [function(u.u)], lambda left, right, p: [left.u], unknowns=("u",))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, 1, 1, 2], [1, 2, 3, 4]), "x: expected at least 4 strictly increasing numbers, got 4"),
        (([0, 1, 2], [1, 2, 3]), "x: expected at least 4 strictly increasing numbers, got 3"),
        (([0, 1, 2, 3], [1, 2, 3]), "y: expected 4 values, one for each x, got 3"),
        (([0, 1, 2, 3], [1, 2, np.nan, 3]), "y: expected finite numbers in one sequence"),
        ((["a", "b"], [1, 2]), "x: expected a sequence of numbers"),
        (([0, 1], [1, 2], "quintic"), "kind: expected one of .'cubic', 'linear'., got 'quintic'"),
    ],
)
def test_wrong_tables_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tabulated(*arguments)
