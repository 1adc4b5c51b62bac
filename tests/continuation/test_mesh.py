"""Mesh moves: what must hold for every mesh, density and polynomial."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bvp_problems import algebraic
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rodatlas.continuation import MeshControl, Solution
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.mesh import (
    ErrorEstimate,
    equidistribute,
    error_estimate,
    halved,
    monitor,
    relative_change,
    wanted_intervals,
)
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.linear.gauss import gauss_scheme
from rodatlas.continuation.linear.matrix import Columns

PROPERTY = settings(max_examples=60, deadline=None, derandomize=True)


@st.composite
def meshes(draw: st.DrawFn, fewest: int = 1, ratio: float = 1e3) -> np.ndarray:
    """From 0 to 1, neighbouring widths up to `ratio` apart."""
    exponents = draw(st.lists(st.floats(0.0, 1.0), min_size=fewest, max_size=14))
    mesh = np.concatenate([[0.0], np.cumsum(ratio ** np.array(exponents))])
    return mesh / mesh[-1]


def densities(mesh: np.ndarray, spread: float) -> st.SearchStrategy[np.ndarray]:
    """A positive number for each interval, over `spread` decades."""
    exponent = st.floats(-spread / 2, spread / 2)
    return st.lists(exponent, min_size=len(mesh) - 1, max_size=len(mesh) - 1).map(lambda e: 10.0 ** np.array(e))


def integrals(mesh: np.ndarray, density: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Integral of a piecewise constant density over each interval of another mesh, by overlaps."""
    low, high = np.maximum(mesh[:-1], at[:-1, None]), np.minimum(mesh[1:], at[1:, None])
    return np.maximum(high - low, 0.0) @ density


def polynomials(mesh: np.ndarray, m: int, coefficients: np.ndarray) -> Solution:
    """Columns of coefficients (degree + 1, n) as a solution on a mesh."""

    def values(s: np.ndarray) -> np.ndarray:
        return np.polynomial.polynomial.polyval(s, coefficients).T

    names = tuple(f"u{i}" for i in range(coefficients.shape[1]))
    gauss = mesh[:-1, None] + np.diff(mesh)[:, None] * gauss_scheme(m).nodes
    stages = values(gauss.ravel()).reshape(*gauss.shape, len(names))
    return Solution(names, ("lam",), mesh, values(mesh), stages, np.zeros(1))


def piecewise(mesh: np.ndarray, m: int, n: int, seed: int) -> Solution:
    """Random polynomials of degree m on each interval, continuous at mesh points."""
    rng, scheme = np.random.default_rng(seed), gauss_scheme(m)
    stages, values = rng.normal(size=(len(mesh) - 1, m, n)), [rng.normal(size=n)]
    for j in range(len(mesh) - 1):
        values.append(scheme.c_left * values[-1] + scheme.c_stage @ stages[j])
    return Solution(tuple(f"u{i}" for i in range(n)), ("lam",), mesh, np.array(values), stages, np.zeros(1))


def discretised(solution: Solution) -> tuple[Collocation, Columns]:
    n = len(solution.unknowns)
    bvp = algebraic(lambda u, p: [x - p.lam for x in u], unknowns=solution.unknowns)
    colloc = Collocation(bvp, solution.mesh, solution.points, np.zeros(1), [0], Scale(np.ones(n), np.ones(1)))
    return colloc, colloc.state(solution)


# -- places -----------------------------------------------------------------------------------------------------------


@PROPERTY
@given(data=st.data(), mesh=meshes(), intervals=st.integers(1, 40))
def test_every_new_interval_holds_the_same(data: st.DataObject, mesh: np.ndarray, intervals: int) -> None:
    density = data.draw(densities(mesh, 6.0))
    new = equidistribute(mesh, density, intervals)
    assert (new[0], new[-1], len(new)) == (0.0, 1.0, intervals + 1)
    assert (np.diff(new) > 0).all()
    held = integrals(mesh, density, new)
    np.testing.assert_allclose(held, held.sum() / intervals, rtol=1e-6)


@PROPERTY
@given(data=st.data(), mesh=meshes(ratio=1e12), intervals=st.integers(1, 400))
def test_mesh_points_never_coincide(data: st.DataObject, mesh: np.ndarray, intervals: int) -> None:
    new = equidistribute(mesh, data.draw(densities(mesh, 60.0)), intervals)
    assert (new[0], new[-1], len(new)) == (0.0, 1.0, intervals + 1)
    assert (np.diff(new) > 0).all()
    assert (np.diff(halved(new)) > 0).all()


@pytest.mark.parametrize("at", [0.0, 0.37, 1.0])
@pytest.mark.parametrize("intervals", [20, 50, 400])
def test_mesh_points_do_not_coincide_at_a_singularity(at: float, intervals: int) -> None:
    """The density stays in whatever interval holds one place, until floating-point numbers are too coarse for more."""
    mesh, narrowest = np.linspace(0, 1, intervals + 1), 1.0
    for _ in range(25):
        spike = np.clip(np.searchsorted(mesh, at) - 1, 0, intervals - 1)
        mesh = equidistribute(mesh, np.where(np.arange(intervals) == spike, 1e30, 1.0), intervals)
        assert (np.diff(halved(mesh)) > 0).all()
        narrowest = min(narrowest, np.diff(mesh).min())
    assert narrowest < 1e-9 / intervals


@PROPERTY
@given(data=st.data(), mesh=meshes(), intervals=st.integers(1, 40), factor=st.floats(1e-6, 1e6))
def test_the_new_mesh_depends_on_the_density_only(
    data: st.DataObject, mesh: np.ndarray, intervals: int, factor: float
) -> None:
    """Not on its unit, nor on the mesh that carries it; and it is reflected with it."""
    density = data.draw(densities(mesh, 4.0))
    new = equidistribute(mesh, density, intervals)
    same = {"atol": 1e-12, "rtol": 0}
    np.testing.assert_allclose(equidistribute(mesh, factor * density, intervals), new, **same)
    np.testing.assert_allclose(equidistribute(halved(mesh), np.repeat(density, 2), intervals), new, **same)
    np.testing.assert_allclose(equidistribute(1 - mesh[::-1], density[::-1], intervals), 1 - new[::-1], **same)


@PROPERTY
@given(mesh=meshes())
def test_an_equidistributed_mesh_stays(mesh: np.ndarray) -> None:
    new = equidistribute(mesh, 1.0 / np.diff(mesh), len(mesh) - 1)
    np.testing.assert_allclose(new, mesh, rtol=0, atol=1e-13)


@PROPERTY
@given(mesh=meshes())
def test_halving_keeps_all_points_and_adds_the_middles(mesh: np.ndarray) -> None:
    fine = halved(mesh)
    np.testing.assert_array_equal(fine[::2], mesh)
    np.testing.assert_allclose(np.diff(fine), np.repeat(np.diff(mesh) / 2, 2), rtol=0, atol=1e-15)
    assert (np.diff(fine) > 0).all()


# -- interpolation ----------------------------------------------------------------------------------------------------


@PROPERTY
@given(data=st.data(), mesh=meshes(ratio=30.0), other=meshes(ratio=30.0), m=st.integers(1, 9))
def test_polynomials_up_to_degree_m_are_carried_exactly(
    data: st.DataObject, mesh: np.ndarray, other: np.ndarray, m: int
) -> None:
    degree = data.draw(st.integers(0, m))
    coefficients = np.random.default_rng(data.draw(st.integers(0, 10**6))).uniform(-1, 1, (degree + 1, 2))
    start, expected = polynomials(mesh, m, coefficients), polynomials(other, m, coefficients)
    moved = start.remesh(other)
    np.testing.assert_allclose(moved.values, expected.values, rtol=0, atol=1e-11)
    np.testing.assert_allclose(moved.stages, expected.stages, rtol=0, atol=1e-11)
    points = data.draw(st.integers(degree or 1, 9))
    np.testing.assert_allclose(start.remesh(other, points).stages,
                               polynomials(other, points, coefficients).stages, rtol=0, atol=1e-11)  # fmt: skip
    (colloc, x), (target, _) = discretised(start), discretised(expected)
    np.testing.assert_allclose(colloc.interpolate(x, target).stage, expected.stages, rtol=0, atol=1e-11)


def test_degree_m_plus_one_is_not_carried_exactly() -> None:
    """Else the test above would prove nothing."""
    for m in range(1, 6):
        start = polynomials(np.array([0.0, 0.4, 1.0]), m, np.eye(m + 2)[:, -1:])
        s = np.linspace(0, 1, 20)
        assert np.abs(start(s)[:, 0] - s ** (m + 1)).max() > 1e-5


@PROPERTY
@given(mesh=meshes(ratio=30.0), m=st.integers(1, 6), seed=st.integers(0, 10**6))
def test_a_finer_mesh_holds_the_same_functions(mesh: np.ndarray, m: int, seed: int) -> None:
    """Piecewise polynomials are not changed by halved intervals: values, integrals, and the way back."""
    start = piecewise(mesh, m, 2, seed)
    fine = start.remesh(halved(mesh))
    size = np.abs(start.stages).max() + np.abs(start.values).max()
    at = np.sort(np.random.default_rng(seed + 1).random(40))
    np.testing.assert_allclose(fine(at), start(at), rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(fine.values[::2], start.values, rtol=0, atol=1e-9 * size)
    back = fine.remesh(mesh)
    np.testing.assert_allclose(back.stages, start.stages, rtol=0, atol=1e-9 * size)
    assert fine.mean(fine.stages[..., 0]) == pytest.approx(start.mean(start.stages[..., 0]), abs=1e-9 * size)


@PROPERTY
@given(mesh=meshes(), seed=st.integers(0, 10**6))
def test_values_at_mesh_points_are_returned_as_they_are(mesh: np.ndarray, seed: int) -> None:
    start = piecewise(mesh, 3, 1, seed)
    size = np.abs(start.stages).max() + np.abs(start.values).max()
    np.testing.assert_allclose(start(mesh), start.values, rtol=0, atol=1e-12 * size)
    np.testing.assert_array_equal(start.remesh(mesh).values[[0, -1]], start.values[[0, -1]])


# -- monitor and size -------------------------------------------------------------------------------------------------


@PROPERTY
@given(intervals=st.integers(2, 30), m=st.integers(1, 6), size=st.floats(1e-2, 1e3))
def test_the_monitor_knows_the_next_derivative(intervals: int, m: int, size: float) -> None:
    """It is 1.1 |c (m+1)!|^(1/(m+1)) all along for u = c s^(m+1) on a uniform mesh."""
    assume(intervals**m < 1e5)  # round-off in the m-th derivative
    coefficients = np.zeros((m + 2, 2))
    coefficients[-1] = 0.6 * size, 0.8 * size
    density = monitor(*discretised(polynomials(np.linspace(0, 1, intervals + 1), m, coefficients)))
    expected = 1.1 * (size * math.factorial(m + 1)) ** (1 / (m + 1))
    np.testing.assert_allclose(density, expected, rtol=1e-5)


@PROPERTY
@given(mesh=meshes(), m=st.integers(1, 6), seed=st.integers(0, 10**6), factor=st.floats(1e-3, 1e3))
def test_the_monitor_is_positive_and_homogeneous(mesh: np.ndarray, m: int, seed: int, factor: float) -> None:
    colloc, x = discretised(piecewise(mesh, m, 2, seed))
    density = monitor(colloc, x)
    assert density.shape == (len(mesh) - 1,)
    assert (density > 0).all()
    assert np.isfinite(density).all()
    assert density.max() <= 11.001 * (density @ colloc.step) / np.diff(mesh).min()
    if len(mesh) > 2:
        np.testing.assert_allclose(monitor(colloc, scaled(x, factor)), factor ** (1 / (m + 1)) * density, rtol=1e-9)
    new = equidistribute(mesh, density, len(mesh) - 1)
    assert (np.diff(new) > 0).all()
    assert np.diff(new).max() <= 11.001 / (len(mesh) - 1)  # a tenth of the mean keeps intervals from growing


@pytest.mark.parametrize("m", [1, 4])
def test_a_constant_solution_wants_a_uniform_mesh(m: int) -> None:
    mesh = np.array([0.0, 0.1, 0.15, 0.9, 1.0])
    colloc, x = discretised(polynomials(mesh, m, np.zeros((1, 2))))
    np.testing.assert_allclose(equidistribute(mesh, monitor(colloc, x), 4), np.linspace(0, 1, 5), atol=1e-15)


@PROPERTY
@given(
    limits=st.tuples(st.integers(4, 50), st.integers(0, 300)), intervals=st.integers(4, 400),
    errors=st.tuples(st.floats(-16, 3), st.floats(-16, 3)), m=st.integers(1, 9),
)  # fmt: skip
def test_the_wanted_size_stays_within_limits_and_grows_with_the_error(
    limits: tuple[int, int], intervals: int, errors: tuple[float, float], m: int
) -> None:
    control = MeshControl(points=m, intervals=(limits[0], limits[0] + limits[1]))
    small, large = (wanted_intervals(control, intervals, ErrorEstimate(10.0**e, 0.0)) for e in sorted(errors))
    assert control.intervals[0] <= small <= large <= control.intervals[1]
    assert large <= max(2 * intervals, control.intervals[0])
    kept = int(np.clip(intervals, *control.intervals))
    assert wanted_intervals(control, intervals, ErrorEstimate(float("nan"), float("nan"))) == kept
    assert wanted_intervals(control, intervals, ErrorEstimate(float("inf"), 0.0)) == kept
    noise = ErrorEstimate(*[min(10.0 ** max(errors), 9e-6)] * 2)  # what is left of a larger error is nonlinearity
    assert wanted_intervals(control, intervals, noise) <= max(kept, small)


@PROPERTY
@given(mesh=meshes(fewest=2, ratio=30.0), m=st.integers(1, 5), value=st.floats(-5, 5))
def test_the_error_of_a_polynomial_solution_is_round_off(mesh: np.ndarray, m: int, value: float) -> None:
    colloc, x = discretised(polynomials(mesh, m, np.array([[value, value]])))
    x = Columns(x.stage, x.mesh, np.array([value]))
    assert error_estimate(colloc, x).error < 1e-12
    assert relative_change(colloc, x, scaled(x, 1e-3)) == pytest.approx(1e-3 * min(1.0, abs(value)))
