"""The bordered linear algebra: both backends against a dense matrix assembled entry by entry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rodatlas.continuation.gauss import gauss_scheme
from rodatlas.continuation.linear import Blocks, BorderedMatrix, Columns, backend_name, factor
from rodatlas.continuation.sparsity import strong_components

BACKENDS = ("numba", "scipy")


def random_matrix(
    n_int: int, m: int, n: int, k: int, r: int, density: float, seed: int, zero_rows: bool = False
) -> BorderedMatrix:
    """Random blocks; r dense rows and n + k - r rows at the ends."""
    rng = np.random.default_rng(seed)
    rows, cols = np.nonzero(rng.random((n, n)) < density)
    q = n + k - r
    dense, dense_scal = rng.normal(size=(r, n_int, m, n)), rng.normal(size=(r, k))
    b_left, b_right = rng.normal(size=(q, n)), rng.normal(size=(q, n))
    if zero_rows:  # rows that act at one end only, and a dense row on the scalars alone
        b_left[: q // 2], b_right[q // 2 :] = 0.0, 0.0
        dense[:1] = 0.0
    return BorderedMatrix(
        gauss_scheme(m), strong_components(n, rows.astype(np.int64), cols.astype(np.int64)),
        rng.dirichlet(np.ones(n_int)), 2 * rng.normal(size=(n_int * m, len(rows))), rng.normal(size=(n_int * m, n, k)),
        b_left, b_right, rng.normal(size=(q, k)), dense, dense_scal,
    )  # fmt: skip


def assembled(a: BorderedMatrix) -> np.ndarray:
    """The matrix of `linear.py` as a dense array, rows and columns in the order printed there."""
    n_int, m, n, k = a.sizes
    q, r = len(a.b_left), len(a.dense)
    stages, size = n_int * m * n, n_int * m * n + (n_int + 1) * n + k
    full = np.zeros((stages + n_int * n + q + r, size))
    for j in range(n_int):
        left, right = (slice(stages + i * n, stages + (i + 1) * n) for i in (j, j + 1))
        chain = slice(stages + j * n, stages + (j + 1) * n)
        for i in range(m):
            row = slice((j * m + i) * n, (j * m + i + 1) * n)
            f_u = np.zeros((n, n))
            f_u[a.sparsity.rows, a.sparsity.cols] = a.jac[j * m + i]
            for l in range(m):
                full[row, (j * m + l) * n : (j * m + l + 1) * n] = a.scheme.d[i, l] * np.eye(n)
            full[row, row] -= a.step[j] * f_u
            full[row, left] = a.scheme.d0[i] * np.eye(n)
            full[row, size - k :] = a.stage_scal[j * m + i]
            full[chain, row] = -a.scheme.c_stage[i] * np.eye(n)
        full[chain, left] = -a.scheme.c_left * np.eye(n)
        full[chain, right] = np.eye(n)
    ends = slice(stages + n_int * n, stages + n_int * n + q)
    full[ends, stages : stages + n] += a.b_left
    full[ends, size - k - n : size - k] += a.b_right
    full[ends, size - k :] = a.b_scal
    full[ends.stop :, :stages] = a.dense.reshape(r, stages)
    full[ends.stop :, size - k :] = a.dense_scal
    return full


def determinant(a: BorderedMatrix) -> tuple[float, float]:
    """Sign and log|det| as both backends count them: u_0 behind the interior mesh points, relative to u' = 0."""
    n_int, m, n, k = a.sizes
    stages = n_int * m * n
    mesh = stages + np.arange((n_int + 1) * n).reshape(n_int + 1, n)
    scalars = range(stages + mesh.size, stages + mesh.size + k)
    order = [*range(stages), *mesh[1:-1].ravel(), *mesh[0], *mesh[-1], *scalars]
    sign, log_det = np.linalg.slogdet(assembled(a)[:, order])
    return sign * a.scheme.d_sign ** (n_int * n), log_det - n_int * n * a.scheme.d_log


def flat(x: Blocks | Columns) -> np.ndarray:
    parts = (x.stage, x.chain, x.ends, x.dense) if isinstance(x, Blocks) else (x.stage, x.mesh, x.scalars)
    return np.concatenate([p.ravel() for p in parts])


def random_sides(a: BorderedMatrix, seed: int) -> tuple[Blocks, Columns]:
    n_int, m, n, k = a.sizes
    rng = np.random.default_rng(seed)
    rhs = Blocks(rng.normal(size=(n_int, m, n)), rng.normal(size=(n_int, n)), rng.normal(size=len(a.b_left)),
                 rng.normal(size=len(a.dense)))  # fmt: skip
    return rhs, Columns(rng.normal(size=(n_int, m, n)), rng.normal(size=(n_int + 1, n)), rng.normal(size=k))


sizes = st.tuples(
    st.integers(1, 7), st.integers(1, 5), st.integers(1, 6), st.integers(0, 4), st.integers(0, 4),
    st.floats(0.0, 1.0), st.integers(0, 10**6), st.booleans(),
)  # fmt: skip


@pytest.mark.parametrize("backend", BACKENDS)
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much])
@given(drawn=sizes)
def test_solves_and_determinant_agree_with_a_dense_matrix(backend: str, drawn: tuple) -> None:
    n_int, m, n, k, r, density, seed, zero_rows = drawn
    assume(r <= n + k)
    a = random_matrix(n_int, m, n, k, r, density, seed, zero_rows)
    full = assembled(a)
    condition = np.linalg.cond(full)
    assume(condition < 1e7)
    rhs, functional = random_sides(a, seed + 1)
    fac = factor(a, backend)
    x, y = np.linalg.solve(full, flat(rhs)), np.linalg.solve(full.T, flat(functional))
    np.testing.assert_allclose(flat(fac.solve(rhs)), x, rtol=0, atol=1e-13 * condition * np.abs(x).max())
    np.testing.assert_allclose(
        flat(fac.solve_transposed(functional)), y, rtol=0, atol=1e-13 * condition * np.abs(y).max()
    )
    sign, log_det = determinant(a)
    assert fac.sign == sign
    assert fac.log_det == pytest.approx(log_det, abs=1e-13 * condition)


@pytest.mark.parametrize("backend", BACKENDS)
def test_right_hand_sides_are_not_overwritten(backend: str) -> None:
    a = random_matrix(5, 3, 4, 2, 1, 0.5, 3)
    rhs, functional = random_sides(a, 4)
    before = flat(rhs).copy(), flat(functional).copy()
    fac = factor(a, backend)
    first = flat(fac.solve(rhs)), flat(fac.solve_transposed(functional))
    np.testing.assert_array_equal(flat(rhs), before[0])
    np.testing.assert_array_equal(flat(functional), before[1])
    np.testing.assert_array_equal(flat(fac.solve(rhs)), first[0])
    np.testing.assert_array_equal(flat(fac.solve_transposed(functional)), first[1])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_singular_matrix_has_sign_zero(backend: str) -> None:
    a = random_matrix(4, 2, 3, 1, 1, 0.5, 5)
    a.b_left[1], a.b_right[1], a.b_scal[1] = 0.0, 0.0, 0.0
    fac = factor(a, backend)
    assert fac.sign == 0.0
    assert fac.log_det == -np.inf


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_long_stiff_chain_stays_accurate(backend: str) -> None:
    """u'' = K^2 u with K = 300 on 60 intervals: modes exp(+-K s) grow and decay by 1e130 in all."""
    n_int, m, stiffness = 60, 4, 300.0
    rows, cols = np.array([0, 1]), np.array([1, 0])
    a = BorderedMatrix(
        gauss_scheme(m), strong_components(2, rows, cols), np.full(n_int, 1 / n_int),
        np.full((n_int * m, 2), stiffness), np.zeros((n_int * m, 2, 0)), np.array([[1.0, 0.0], [0.0, 0.0]]),
        np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros((2, 0)), np.zeros((0, n_int, m, 2)), np.zeros((0, 0)),
    )  # fmt: skip
    rhs, functional = random_sides(a, 1)
    full = assembled(a)
    fac = factor(a, backend)
    for matrix, side, x in ((full, rhs, fac.solve(rhs)), (full.T, functional, fac.solve_transposed(functional))):
        residual = matrix @ flat(x) - flat(side)
        assert np.abs(residual).max() < 1e-12 * np.abs(matrix).max() * np.abs(flat(x)).max()


def test_backends_agree_on_a_rod_sized_matrix() -> None:
    a = random_matrix(50, 4, 13, 1, 1, 0.15, 11)
    rhs, functional = random_sides(a, 12)
    one, two = (factor(a, name) for name in BACKENDS)
    assert (one.sign, one.log_det) == (two.sign, pytest.approx(two.log_det, rel=1e-12))
    np.testing.assert_allclose(flat(one.solve(rhs)), flat(two.solve(rhs)), rtol=0, atol=1e-8 * np.abs(flat(rhs)).max())
    np.testing.assert_allclose(
        flat(one.solve_transposed(functional)), flat(two.solve_transposed(functional)), rtol=0, atol=1e-7
    )


def test_the_backend_is_chosen_by_environment_or_argument(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RODATLAS_BACKEND", "scipy")
    assert backend_name() == "scipy"
    assert type(factor(random_matrix(2, 2, 2, 1, 1, 0.5, 1))).__name__ == "ScipyFactorization"
    monkeypatch.setenv("RODATLAS_BACKEND", "fortran")
    with pytest.raises(ValueError, match=r"RODATLAS_BACKEND: expected 'numba' or 'scipy', got 'fortran'"):
        backend_name()
    monkeypatch.delenv("RODATLAS_BACKEND")
    assert backend_name() == "numba"


def test_strong_components_are_in_order_of_dependence() -> None:
    # 0 <-> 1, 2 on 0, 3 on 2 and itself, 4 alone
    rows, cols = np.array([0, 1, 2, 3, 3]), np.array([1, 0, 0, 2, 3])
    sp = strong_components(5, rows, cols)
    assert sorted(map(tuple, sp.components)) == [(0, 1), (2,), (3,), (4,)]
    order = {tuple(c): i for i, c in enumerate(sp.components)}
    assert order[(0, 1)] < order[(2,)] < order[(3,)]
    assert sp.coupled[order[(0, 1)]]
    assert sp.coupled[order[(3,)]]
    assert not sp.coupled[order[(2,)]]
    assert not sp.coupled[order[(4,)]]
