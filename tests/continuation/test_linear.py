"""The bordered linear algebra: both backends against a dense matrix assembled entry by entry."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import tangled
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Row, Scale, free_indices
from rodatlas.continuation.linear.gauss import gauss_scheme
from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns, backend_name, factor
from rodatlas.continuation.linear.sparsity import strong_components

BACKENDS = ("numba", "scipy", "lapack")


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


def test_a_matrix_is_applied_as_it_is_assembled() -> None:
    a = random_matrix(5, 3, 6, 2, 3, 0.4, 8)
    _, x = random_sides(a, 9)
    np.testing.assert_allclose(flat(a.times(x)), assembled(a) @ flat(x), atol=1e-12)


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


# -- borders ----------------------------------------------------------------------------------------------------------

PROPERTY = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much]
)


def random_problem(n_int: int, m: int, backend: str, rng: np.random.Generator) -> tuple[Collocation, Linearization]:
    """`tangled` (4 unknowns, 5 boundary and 3 integral conditions, 5 free parameters) linearised somewhere."""
    mesh = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, n_int))])
    scale = Scale(rng.uniform(0.5, 2, 4), rng.uniform(0.5, 2, 6))
    free = free_indices(tangled(), ("b", "a", "d", "c", "f"))
    colloc = Collocation(tangled(), mesh / mesh[-1], m, tangled().parameter_vector(), free, scale, backend)
    state = Columns(rng.normal(size=(n_int, m, 4)), rng.normal(size=(n_int + 1, 4)), rng.normal(size=5))
    return colloc, colloc.linearize(state)


def bordered(colloc: Collocation, lin: Linearization, rows: list[Row], columns: list[Blocks]) -> np.ndarray:
    """The dense matrix that `Collocation.factor` stands for: rows on the ends behind the 5 boundary conditions, dense
    rows last, columns behind the free parameters and zero in the new rows."""
    inner = assembled(BorderedMatrix(
        colloc.scheme, colloc.bvp.sparsity, colloc.step, lin.jac, lin.stage_scal, lin.b_left, lin.b_right, lin.b_scal,
        lin.dense, lin.dense_scal,
    ))  # fmt: skip
    inner = np.hstack([inner, *[flat(c)[:, None] for c in columns]])
    at_ends, dense = [], []
    for row in rows:
        weights = Columns(np.zeros((*colloc.gauss.shape, 4)), np.zeros((len(colloc.mesh), 4)), row.scalars)
        if row.stage is not None:
            weights.stage[:] = row.stage
        if row.ends is not None:
            weights.mesh[0], weights.mesh[-1] = row.ends
        (at_ends if row.stage is None else dense).append([*flat(weights), *np.zeros(len(columns))])
    both = [np.array(part).reshape(-1, inner.shape[1]) for part in (at_ends, dense)]
    return np.vstack([inner[:-3], both[0], inner[-3:], both[1]])


@pytest.mark.parametrize("backend", BACKENDS)
@settings(PROPERTY, max_examples=25)
@given(n_int=st.integers(1, 4), m=st.integers(1, 4), kinds=st.lists(st.booleans(), min_size=1, max_size=4),
       seed=st.integers(0, 10**6))  # fmt: skip
def test_rows_and_artificial_columns_border_a_problem(
    backend: str, n_int: int, m: int, kinds: list[bool], seed: int
) -> None:
    """One row on the ends for each True, one dense row for each False; all but the first bring a column."""
    rng = np.random.default_rng(seed)
    colloc, lin = random_problem(n_int, m, backend, rng)
    rows = [Row(rng.normal(size=5), ends=tuple(rng.normal(size=(2, 4)))) if at_ends
            else Row(rng.normal(size=5), stage=rng.normal(size=(n_int, m, 4))) for at_ends in kinds]  # fmt: skip
    columns = [Blocks(rng.normal(size=(n_int, m, 4)), np.zeros((n_int, 4)), rng.normal(size=5), rng.normal(size=3))
               for _ in rows[1:]]  # fmt: skip
    full = bordered(colloc, lin, rows, columns)
    condition = np.linalg.cond(full)
    assume(condition < 1e8)
    fac = colloc.factor(lin, rows, columns)
    load = Blocks(rng.normal(size=(n_int, m, 4)), rng.normal(size=(n_int, 4)), rng.normal(size=5 + sum(kinds)),
                  rng.normal(size=3 + len(kinds) - sum(kinds)))  # fmt: skip
    functional = Columns(rng.normal(size=(n_int, m, 4)), rng.normal(size=(n_int + 1, 4)),
                         rng.normal(size=4 + len(rows)))  # fmt: skip
    x, y = np.linalg.solve(full, flat(load)), np.linalg.solve(full.T, flat(functional))
    np.testing.assert_allclose(flat(fac.solve(load)), x, rtol=0, atol=1e-13 * condition * np.abs(x).max())
    left = flat(fac.solve_transposed(functional))
    np.testing.assert_allclose(left, y, rtol=0, atol=1e-13 * condition * np.abs(y).max())
    log_det = np.linalg.slogdet(full)[1] - n_int * 4 * colloc.scheme.d_log
    assert fac.log_det == pytest.approx(log_det, abs=1e-12 * condition)


# -- invariances, on sizes that no dense matrix is needed for ---------------------------------------------------------

large = st.tuples(
    st.integers(1, 60), st.integers(1, 9), st.integers(1, 12), st.integers(0, 4), st.integers(0, 4),
    st.floats(0.0, 0.6), st.integers(0, 10**6), st.booleans(),
)  # fmt: skip


def reordered(a: BorderedMatrix, order: np.ndarray, factors: np.ndarray) -> BorderedMatrix:
    """The same with the rows at the ends permuted and multiplied."""
    left, right, scal = (factors[:, None] * block[order] for block in (a.b_left, a.b_right, a.b_scal))
    return replace(a, b_left=left, b_right=right, b_scal=scal)


@pytest.mark.parametrize("backend", BACKENDS)
@PROPERTY
@given(drawn=large)
def test_both_solves_belong_to_one_matrix(backend: str, drawn: tuple) -> None:
    """<c, A^-1 b> = <A^-T c, b>, and a solution is linear in the right-hand side."""
    assume(drawn[4] <= drawn[2] + drawn[3])
    a = random_matrix(*drawn)
    fac = factor(a, backend)
    assume(fac.sign != 0.0)
    (b, c), (b2, _) = random_sides(a, 1), random_sides(a, 2)
    x, y = flat(fac.solve(b)), flat(fac.solve_transposed(c))
    assume(np.abs(x).max() < 1e6 and np.abs(y).max() < 1e6)
    size = np.abs(flat(c)) @ np.abs(x) + np.abs(y) @ np.abs(flat(b))
    assert flat(c) @ x == pytest.approx(y @ flat(b), abs=1e-8 * size)
    both = Blocks(b.stage - 2 * b2.stage, b.chain - 2 * b2.chain, b.ends - 2 * b2.ends, b.dense - 2 * b2.dense)
    x2 = flat(fac.solve(b2))
    np.testing.assert_allclose(flat(fac.solve(both)), x - 2 * x2, rtol=0, atol=1e-8 * (np.abs(x) + np.abs(x2)).max())


@pytest.mark.parametrize("backend", BACKENDS)
@PROPERTY
@given(drawn=large, shuffle=st.randoms(use_true_random=False))
def test_rows_at_the_ends_change_the_determinant_as_they_must(backend: str, drawn: tuple, shuffle) -> None:
    """A permutation changes its sign by its parity, a factor multiplies it."""
    assume(drawn[4] < drawn[2] + drawn[3])
    a = random_matrix(*drawn)
    before = factor(a, backend)
    assume(before.sign != 0.0)
    x = flat(before.solve(random_sides(a, 1)[0]))
    assume(np.abs(x).max() < 1e6)
    order = list(range(len(a.b_left)))
    shuffle.shuffle(order)
    factors = np.array([shuffle.choice((-3.0, 0.5, 2.0)) for _ in order])
    after = factor(reordered(a, np.array(order), factors), backend)
    assert after.sign == before.sign * np.linalg.det(np.eye(len(order))[order]).round() * np.prod(np.sign(factors))
    assert after.log_det == pytest.approx(before.log_det + np.log(np.abs(factors)).sum(), abs=1e-7)


@pytest.mark.parametrize("backend", BACKENDS)
@PROPERTY
@given(drawn=sizes, which=st.integers(0, 100))
def test_a_condition_given_twice_makes_the_matrix_singular(backend: str, drawn: tuple, which: int) -> None:
    """To round-off: the determinant is zero, or smaller by eight orders of magnitude."""
    assume(drawn[2] + drawn[3] - drawn[4] >= 2)
    a = random_matrix(*drawn)
    before = factor(a, backend)
    assume(before.sign != 0.0 and np.abs(flat(before.solve(random_sides(a, 1)[0]))).max() < 1e4)
    order = np.arange(len(a.b_left))
    order[which % len(order)] = order[which % len(order) - 1]
    after = factor(reordered(a, order, np.ones(len(order))), backend)
    assert after.sign == 0.0 or after.log_det < before.log_det - 18


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("block", ["jac", "stage_scal", "b_left", "b_right", "b_scal", "dense", "dense_scal"])
def test_nan_makes_a_matrix_singular_and_raises_nothing(backend: str, value: float, block: str) -> None:
    a = random_matrix(5, 3, 4, 2, 1, 0.6, 7)
    assert factor(a, backend).sign != 0.0
    getattr(a, block).flat[0] = value
    fac = factor(a, backend)
    assert (fac.sign, fac.log_det) == (0.0, -np.inf)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("value", [1e200, 1e308, 1e-320])
@pytest.mark.parametrize("block", ["jac", "stage_scal", "b_left", "b_scal", "dense"])
def test_huge_and_tiny_entries_raise_nothing(backend: str, value: float, block: str) -> None:
    a = random_matrix(5, 3, 4, 2, 1, 0.6, 7)
    getattr(a, block).flat[0] = value
    fac = factor(a, backend)
    assert not np.isnan(fac.log_det)
    assert (fac.sign == 0.0) == (fac.log_det == -np.inf)


def test_backends_agree_on_a_rod_sized_matrix() -> None:
    a = random_matrix(50, 4, 13, 1, 1, 0.15, 11)
    rhs, functional = random_sides(a, 12)
    one, *others = (factor(a, name) for name in BACKENDS)
    x, y, size = flat(one.solve(rhs)), flat(one.solve_transposed(functional)), np.abs(flat(rhs)).max()
    for two in others:
        assert (one.sign, one.log_det) == (two.sign, pytest.approx(two.log_det, rel=1e-12))
        np.testing.assert_allclose(x, flat(two.solve(rhs)), rtol=0, atol=1e-8 * size)
        np.testing.assert_allclose(y, flat(two.solve_transposed(functional)), rtol=0, atol=1e-7)


def test_the_backend_is_chosen_by_environment_or_argument(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RODATLAS_BACKEND", "scipy")
    assert backend_name() == "scipy"
    assert type(factor(random_matrix(2, 2, 2, 1, 1, 0.5, 1))).__name__ == "ScipyFactorization"
    assert type(factor(random_matrix(2, 4, 52, 1, 1, 1.0, 1))).__name__ == "LapackFactorization"
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


@PROPERTY
@given(size=st.integers(1, 12), density=st.floats(0.0, 0.5), seed=st.integers(0, 10**6))
def test_components_are_those_of_the_graph(size: int, density: float, seed: int) -> None:
    rows, cols = np.nonzero(np.random.default_rng(seed).random((size, size)) < density)
    sp = strong_components(size, rows.astype(np.int64), cols.astype(np.int64))
    graph = coo_matrix((np.ones(len(rows)), (rows, cols)), shape=(size, size))
    count, label = connected_components(graph, connection="strong")
    assert sorted(u for c in sp.components for u in c) == list(range(size))
    known = {frozenset(np.flatnonzero(label == i).tolist()) for i in range(count)}
    assert {frozenset(c) for c in sp.components} == known
    home = {u: i for i, c in enumerate(sp.components) for u in c}
    assert all(home[c] <= home[r] for r, c in zip(rows.tolist(), cols.tolist(), strict=True))
    paths = np.linalg.matrix_power(np.eye(size, dtype=int) + (graph.toarray() > 0), size) > 0
    for i, c in enumerate(sp.components):
        assert sp.reach[sp.reach_ptr[i] : sp.reach_ptr[i + 1]].tolist() == np.flatnonzero(paths[c[0]]).tolist()


@pytest.mark.parametrize(("misses", "told"), [({}, False), ({"signature": 1}, True)])
def test_only_a_compilation_is_called_one(misses, told, monkeypatch, capsys):
    """A busy machine that takes long to load compiled kernels says nothing."""
    from types import SimpleNamespace

    from rodatlas.continuation.linear import numba_backend

    kernel = SimpleNamespace(stats=SimpleNamespace(cache_misses=misses))
    monkeypatch.setattr(numba_backend, "kernels", lambda: (SimpleNamespace(factor=kernel, constant=3),))
    with numba_backend.FirstCompile(patience=0.0) as _:
        time.sleep(0.2)
    assert ("compiling the solver" in capsys.readouterr().err) is told
