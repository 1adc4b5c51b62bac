"""Problems of public test sets, from zero or a straight line; the values are closed forms or another program's."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import constant
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import erf

from rodatlas.continuation import BVP, Solution, TraceOptions, end_value, solve, trace


@pytest.mark.parametrize("e", [1e-3, 1e-5, 1e-7])
def test_a_turning_point_with_a_shock_layer(e: float) -> None:
    """Mazzia's bvpT6, e y'' + x y' = -e pi^2 cos(pi x) - pi x sin(pi x): y = cos(pi x) + erf(x / sqrt(2 e))."""

    def rhs(s, u, p):
        x = 2 * s - 1
        load = p.e * np.pi**2 * np.cos(np.pi * x) + np.pi * x * np.sin(np.pi * x)
        return [2 * u.v, -2 * (x * u.v + load) / p.e]

    bvp = BVP(rhs, lambda left, right, p: [left.y + 2, right.y], unknowns=("y", "v"), parameters={"e": e})
    found = solve(bvp, constant(bvp))
    assert found.error <= 1e-8
    x = 2 * found.mesh - 1
    exact = np.cos(np.pi * x) + erf(x / np.sqrt(2 * e)) / erf(1 / np.sqrt(2 * e))
    np.testing.assert_allclose(found["y"], exact, atol=2e-8)


@pytest.mark.parametrize("e", [1e-2, 1e-4, 1e-6])
def test_a_nonlinear_layer(e: float) -> None:
    """Mazzia's bvpT21, e y'' = y + y^2 - exp(-2 x / sqrt(e)): y = exp(-x / sqrt(e))."""
    bvp = BVP(
        lambda s, u, p: [u.v, (u.y + u.y**2 - np.exp(-2 * s / np.sqrt(p.e))) / p.e],
        lambda left, right, p: [left.y - 1, right.y - np.exp(-1 / np.sqrt(p.e))], unknowns=("y", "v"),
        parameters={"e": e},
    )  # fmt: skip
    found = solve(bvp, constant(bvp))
    np.testing.assert_allclose(found["y"], np.exp(-found.mesh / np.sqrt(e)), atol=2e-8)
    assert found["v"][0] == pytest.approx(-1 / np.sqrt(e), rel=1e-8)


@pytest.mark.parametrize("e", [1e-2, 1e-3])
def test_an_inner_shock(e: float) -> None:
    """Mazzia's bvpT30, e y'' + y y' = y: slopes of one outside a shock at x = 1/3, where the outer lines meet in -y."""
    bvp = BVP(
        lambda s, u, p: [u.v, (u.y - u.y * u.v) / p.e], lambda left, right, p: [left.y + 7 / 6, right.y - 1.5],
        unknowns=("y", "v"), parameters={"e": e},
    )  # fmt: skip
    line = Solution.from_function(
        lambda s: np.column_stack([-7 / 6 + 8 / 3 * s, 8 / 3 + 0 * s]), bvp.unknowns, bvp.parameters
    )
    found = solve(bvp, line)
    assert found.error <= 1e-8
    np.testing.assert_allclose(found["v"][[0, -1]], 1.0, rtol=1e-7)
    shock = np.interp(0.0, found["y"], found.mesh)
    assert shock == pytest.approx(1 / 3, abs=2 * e)


@pytest.mark.parametrize(("e", "slope"), [(0.1, -3.70634324), (1e-3, -38.5743693)])
def test_carriers_problem(e: float, slope: float) -> None:
    """e y'' + 2 (1 - x^2) y + y^2 = 1, y(+-1) = 0, one of many states; slope at -1 by SciPy's solve_bvp, tol 1e-9."""
    bvp = BVP(
        lambda s, u, p: [2 * u.v, 2 * (1 - u.y**2 - 2 * (1 - (2 * s - 1) ** 2) * u.y) / p.e],
        lambda left, right, p: [left.y, right.y], unknowns=("y", "v"), parameters={"e": e},
    )  # fmt: skip
    found = solve(bvp, constant(bvp))
    assert found.error <= 1e-8
    assert found["v"][0] == pytest.approx(slope, rel=5e-9)


def test_musn() -> None:
    """Ascher, Mattheij & Russell's MUSN with stiff exchange terms; values at 1 by SciPy's solve_bvp, tol 1e-9."""
    bvp = BVP(
        lambda s, q, p: [
            0.5 * q.u * (q.w - q.u) / q.v, -0.5 * (q.w - q.u),
            (0.9 - 1000 * (q.w - q.y) - 0.5 * q.w * (q.w - q.u)) / q.z, 0.5 * (q.w - q.u), -100 * (q.y - q.w),
        ],
        lambda left, right, p: [left.u - 1, left.v - 1, left.w - 1, left.z + 10, right.w - right.y],
        unknowns=("u", "v", "w", "z", "y"),
    )  # fmt: skip
    guess = Solution.from_function(lambda s: np.tile([1, 1, 1, -10, 0.91], (len(s), 1)), bvp.unknowns, {})
    found = solve(bvp, guess)
    expected = [1.40232358, 0.71310218, 2.02032383, -9.71310218, 2.02032383]
    np.testing.assert_allclose(found.values[-1], expected, atol=2e-8)


def test_two_solutions_with_a_kink() -> None:
    """The example of MATLAB's bvp4c: y'' + |y| = 0, y(0) = 0, y(4) = -2; slopes at 0 in closed form."""
    bvp = BVP(
        lambda s, u, p: [u.v, -np.fabs(u.y)], lambda left, right, p: [left.y, right.y + 2], unknowns=("y", "v"),
        interval=(0.0, 4.0),
    )  # fmt: skip
    for guess, slope in ((1.0, 2 / np.sinh(4 - np.pi)), (-1.0, -2 / np.sinh(4.0))):
        found = solve(bvp, Solution.from_function(lambda s, g=guess: np.tile([g, 0.0], (len(s), 1)), bvp.unknowns, {}))
        assert found(0.0, "v") == pytest.approx(slope, abs=1e-8)


def test_hiemenz_flow() -> None:
    """g''' + g g'' + 1 - g'^2 = 0, which other solvers got wrong in public; g''(0) = 1.2325876568 (White 2006)."""
    bvp = BVP(
        lambda s, u, p: [u.h, u.k, u.h**2 - 1 - u.g * u.k],
        lambda left, right, p: [left.g, left.h, right.h - 1],
        unknowns=("g", "h", "k"),
        interval=(0.0, 10.0),
    )
    start = Solution.from_function(lambda s: np.column_stack([s, 1 + 0 * s, 0 * s]), bvp.unknowns, {})
    assert solve(bvp, start)(0.0, "k") == pytest.approx(1.2325876568, abs=1e-8)


def test_folds_of_gelfands_problem_in_a_ball() -> None:
    """u'' + 2 u'/r + lam e^u = 0: lam = x^2 e^-psi along Emden's isothermal sphere, folds at x psi'(x) = 2."""
    bvp = BVP(
        lambda s, u, p: [u.v, -2 * u.v / s - p.lam * np.exp(u.u)],
        lambda left, right, p: [left.v, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 0.0},
        observables={"top": end_value(lambda left, right, p: left.u)},
    )
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"top": (-1.0, 12.0)}), both=False)
    first = 1e-6
    sphere = solve_ivp(
        lambda x, y: [y[1], np.exp(-y[0]) - 2 / x * y[1]], (first, 1e3), [first**2 / 6, first / 3], method="DOP853",
        rtol=1e-12, atol=1e-14, dense_output=True,
    ).sol  # fmt: skip
    places = np.geomspace(0.1, 1e3, 4000)
    excess = np.array([x * sphere(x)[1] - 2 for x in places])
    roots = [
        brentq(lambda x: x * sphere(x)[1] - 2, a, b, xtol=1e-12)
        for a, b, c, d in zip(places[:-1], places[1:], excess[:-1], excess[1:], strict=True)
        if c * d < 0
    ]
    expected = [x**2 * np.exp(-sphere(x)[0]) for x in roots][:3]
    assert [x.kind for x in branch.special] == ["fold"] * 3
    assert np.allclose([x.solution["lam"] for x in branch.special], expected, rtol=1e-7)


def test_shrinking_sheet() -> None:
    """f''' + f f'' = f'^2, f'(0) = -1: f = S - (1 - e^(-b x))/b, b = (S -+ sqrt(S^2 - 4))/2; the two meet at S = 2."""
    length = 30.0
    bvp = BVP(
        lambda s, u, p: [u.g, u.h, u.g**2 - u.f * u.h],
        lambda left, right, p: [left.f - p.S, left.g + 1, right.g],
        unknowns=("f", "g", "h"),
        parameters={"S": 3.0},
        observables={"wall": end_value(lambda left, right, p: left.h)},
        interval=(0.0, length),
    )
    b = (3 + np.sqrt(5)) / 2

    def exact(s: np.ndarray) -> np.ndarray:
        fall = np.exp(-b * length * s)
        return np.column_stack([3 - (1 - fall) / b, -fall, b * fall])

    start = Solution.from_function(exact, bvp.unknowns, bvp.parameters)
    branch = trace(bvp, start, ("S",), TraceOptions(bounds={"S": (1.5, 4.0), "wall": (0.6, 10.0)}))
    (fold,) = branch.special
    assert (fold.kind, fold.solution["S"]) == ("fold", pytest.approx(2.0, abs=1e-8))
    for point in branch.points:
        assert point.solution["S"] == pytest.approx(point.solution["wall"] + 1 / point.solution["wall"], abs=1e-6)


def test_ignition_of_a_catalyst() -> None:
    """y'' = f y exp(g b (1 - y)/(1 + b (1 - y))), y'(0) = 0, y(1) = 1; folds by quadrature of the first integral."""
    g, b = 20.0, 0.4

    def rate(y):
        return y * np.exp(g * b * (1 - y) / (1 + b * (1 - y)))

    bvp = BVP(
        lambda s, u, p: [u.v, p.f * rate(u.y)],
        lambda left, right, p: [left.v, right.y - 1],
        unknowns=("y", "v"),
        parameters={"f": 0.0},
        observables={"center": end_value(lambda left, right, p: left.y)},
    )
    start = Solution.from_function(lambda s: np.tile([1.0, 0.0], (len(s), 1)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, start, ("f",), TraceOptions(bounds={"f": (0.0, 2.0), "center": (1e-3, 2.0)}), both=False)
    assert [x.kind for x in branch.special] == ["fold", "fold"]
    expected = 0.1375574408, 0.0779303111  # extrema of (int_c^1 dy / sqrt(2 (H(y) - H(c))))^2 in c, H' = rate, by SciPy
    assert np.allclose([x.solution["f"] for x in branch.special], expected, atol=1e-9)
