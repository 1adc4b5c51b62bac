"""From guesses by hand that Newton alone does not bring home; the values come from elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, bratu, constant
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from rodatlas.continuation import BVP, NotConverged, Solution, solve


def hanging() -> BVP:
    """theta'' = -20 cos(theta), theta(0) = theta'(1) = 0: a heavy cantilever, clamped level."""
    return BVP(
        lambda s, u, p: [u.k, -p.q * np.cos(u.theta)], lambda left, right, p: [left.theta, right.k],
        unknowns=("theta", "k"), parameters={"q": 20.0},
    )  # fmt: skip


def troesch(n: float) -> BVP:
    """y'' = n sinh(n y), y(0) = 0, y(1) = 1."""
    return BVP(
        lambda s, u, p: [u.v, p.n * np.sinh(p.n * u.y)], lambda left, right, p: [left.y, right.y - 1],
        unknowns=("y", "v"), parameters={"n": n},
    )  # fmt: skip


def electrodes(voltage: float) -> BVP:
    """u'' = 0 between two electrodes with Butler-Volmer ends: the current is 2 sinh of each overpotential."""
    return BVP(
        lambda s, u, p: [u.j, 0 * u.u],
        lambda left, right, p: [
            left.j + np.exp(p.V - left.u) - np.exp(left.u - p.V), right.j + np.exp(right.u) - np.exp(-right.u),
        ],
        unknowns=("u", "j"), parameters={"V": voltage},
    )  # fmt: skip


def test_a_heavy_cantilever_from_the_straight_one() -> None:
    places = np.linspace(0, 1, 50)
    other = solve_bvp(
        lambda s, y: np.vstack([y[1], -20 * np.cos(y[0])]), lambda a, b: np.array([a[0], b[1]]), places,
        np.zeros((2, 50)), tol=1e-10,
    )  # fmt: skip
    found = solve(hanging(), constant(hanging()))
    assert found.error <= 1e-8
    assert found["theta"][-1] == pytest.approx(other.y[0, -1], abs=1e-8)


@pytest.mark.parametrize(("n", "slope"), [(5.0, 0.0457504614), (8.0, 0.00258716942), (10.0, 0.000358337787)])
def test_troesch(n: float, slope: float) -> None:
    """Slopes at 0 as published; the first integral ties both ends exactly."""
    bvp = troesch(n)
    line = Solution.from_function(lambda s: np.column_stack([s, 1 + 0 * s]), bvp.unknowns, {"n": n})
    for guess in (constant(bvp), line):
        found = solve(bvp, guess)
        assert found.error <= 1e-8
        size = found["v"][-1]
        assert found["v"][0] == pytest.approx(slope, abs=2e-9 * size)
        assert size**2 - found["v"][0] ** 2 == pytest.approx(2 * (np.cosh(n) - 1), rel=1e-8)  # first integral


@pytest.mark.parametrize("voltage", [5.0, 20.0, 40.0])
def test_butler_volmer_ends_from_no_current(voltage: float) -> None:
    bvp = electrodes(voltage)
    current = brentq(lambda i: voltage - i - 2 * np.arcsinh(i / 2), 0.0, voltage)
    found = solve(bvp, constant(bvp))
    assert -found["j"][0] == pytest.approx(current, rel=1e-10)


def test_where_nothing_is_nothing_is_found() -> None:
    with pytest.raises(NotConverged):
        solve(bratu(), constant(bratu(), lam=BRATU_FOLD + 0.1))


def test_from_a_computed_solution_a_step_that_is_too_long_fails() -> None:
    """Whoever carries a state along wants the one near by or none."""
    bvp = hanging()
    light = solve(bvp, constant(bvp, q=1.0))
    with pytest.raises(NotConverged):
        solve(bvp, light.with_parameters(q=1000.0))
