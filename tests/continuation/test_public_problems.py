"""Problems of public test sets, from zero or a straight line; the values are closed forms or another program's."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import constant
from scipy.special import erf

from rodatlas.continuation import BVP, Solution, solve


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
