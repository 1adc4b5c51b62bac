"""The discrete problem: Jacobian columns, second derivatives, order of convergence, error estimate, norm."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import bratu, bratu_exact, tangled
from test_linear import assembled, flat

from rodatlas.continuation import BVP, Solution
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.mesh import (
    ErrorEstimate,
    equidistribute,
    error_estimate,
    halved,
    monitor,
    wanted_intervals,
)
from rodatlas.continuation.discrete.newton import fixed, newton
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns

FREE = ("b", "a", "d", "c", "f")  # in another order than declared


def discretised(seed: int = 0, n_int: int = 3, m: int = 2) -> tuple[Collocation, Columns]:
    """`tangled` on an uneven mesh at a random state."""
    bvp, rng = tangled(), np.random.default_rng(seed)
    mesh = np.concatenate([[0.0], np.sort(rng.random(n_int - 1)), [1.0]])
    base = bvp.parameter_vector()
    scale = Scale(np.array([2.0, 1.0, 0.5, 1.5]), np.array([1.0, 3.0, 0.2, 1.0, 1.0, 1.0]))
    colloc = Collocation(bvp, mesh, m, base, free_indices(bvp, FREE), scale)
    x = Columns(rng.normal(size=(n_int, m, 4)), rng.normal(size=(n_int + 1, 4)), rng.normal(size=5))
    return colloc, x


def unit_columns(x: Columns) -> list[Columns]:
    """Every unit vector in the space of states."""
    sizes = [x.stage.size, x.mesh.size, x.scalars.size]
    units = []
    for i in range(sum(sizes)):
        e = np.zeros(sum(sizes))
        e[i] = 1.0
        stage, mesh, scalars = np.split(e, np.cumsum(sizes)[:-1])
        units.append(Columns(stage.reshape(x.stage.shape), mesh.reshape(x.mesh.shape), scalars))
    return units


def random_left(colloc: Collocation, x: Columns) -> Blocks:
    rng = np.random.default_rng(9)
    return Blocks(rng.normal(size=x.stage.shape), rng.normal(size=(len(colloc.step), 4)), rng.normal(size=5),
                  rng.normal(size=3))  # fmt: skip


def jacobian(colloc: Collocation, x: Columns) -> np.ndarray:
    """The derivative of the residual as a dense matrix."""
    lin = colloc.linearize(x)
    return assembled(BorderedMatrix(
        colloc.scheme, colloc.bvp.sparsity, colloc.step, lin.jac, lin.stage_scal, lin.b_left, lin.b_right, lin.b_scal,
        lin.dense, lin.dense_scal,
    ))  # fmt: skip


def test_every_column_of_the_jacobian_equals_differences() -> None:
    colloc, x = discretised()
    exact = np.zeros((len(flat(colloc.linearize(x).residual)), len(flat(x))))
    h = 1e-5
    for i, e in enumerate(unit_columns(x)):
        up, down = (flat(colloc.linearize(add(x, (sign * h, e))).residual) for sign in (1.0, -1.0))
        exact[:, i] = (up - down) / (2 * h)
    np.testing.assert_allclose(jacobian(colloc, x), exact, rtol=0, atol=2e-8 * np.abs(exact).max())
    assert (np.abs(exact).max(axis=0) > 0).all()


def test_gradients_of_observables_equal_differences() -> None:
    colloc, x = discretised(1)
    for name in (*tangled().observables, *FREE):
        _, row = colloc.observable_row(name, x)
        for e in unit_columns(x):
            h = 1e-6
            up, down = (colloc.observable_row(name, add(x, (sign * h, e)))[0] for sign in (1.0, -1.0))
            assert row.dot(e) == pytest.approx((up - down) / (2 * h), abs=1e-8), name
        if name not in FREE:
            assert colloc.observables(x)[name] == pytest.approx(colloc.observable_row(name, x)[0], rel=1e-14)


def test_second_derivatives_equal_differences_of_the_first() -> None:
    colloc, x = discretised(2)
    _, v = discretised(3)
    w = random_left(colloc, x)
    gradient = flat(colloc.second(x, v, w))

    def first(y: Columns) -> float:
        """w^T F'(y) v by differences of the residual along v."""
        h = 1e-4
        up, down, up2, down2 = (
            flat(w) @ flat(colloc.linearize(add(y, (s * h, v))).residual) for s in (1.0, -1.0, 2.0, -2.0)
        )
        return (8 * (up - down) - (up2 - down2)) / (12 * h)

    h = 1e-3
    for i, e in enumerate(unit_columns(x)):
        difference = (8 * (first(add(x, (h, e))) - first(add(x, (-h, e))))
                      - (first(add(x, (2 * h, e))) - first(add(x, (-2 * h, e))))) / (12 * h)  # fmt: skip
        assert gradient[i] == pytest.approx(difference, abs=1e-6 * np.abs(gradient).max())


def solved(theta: float, m: int, mesh: np.ndarray) -> tuple[Collocation, Columns]:
    """Bratu's solution for one theta of the closed form on a mesh, the parameter held."""
    lam, _ = bratu_exact(theta, np.array([0.0]))
    bvp = bratu()
    guess = Solution.from_function(lambda s: bratu_exact(theta, s)[1], bvp.unknowns, {"lam": lam}, len(mesh) - 1, m)
    guess = guess.remesh(mesh)
    colloc = Collocation(bvp, mesh, m, guess.parameters, [0], Scale.of(bvp, guess))
    result = newton(colloc, colloc.state(guess), [fixed("lam", lam)(colloc)])
    assert result.converged
    return colloc, result.state


def errors(theta: float, m: int, n_int: int) -> tuple[float, float]:
    """Largest error at mesh points and anywhere."""
    colloc, x = solved(theta, m, np.linspace(0, 1, n_int + 1))
    solution = colloc.solution(x)
    s = np.linspace(0, 1, 1001)
    at_mesh = np.abs(solution.values - bratu_exact(theta, solution.mesh)[1]).max()
    return float(at_mesh), float(np.abs(solution(s) - bratu_exact(theta, s)[1]).max())


@pytest.mark.parametrize(("m", "theta", "intervals"), [(1, 6.0, (40, 80)), (2, 6.0, (30, 60)), (3, 8.0, (24, 48)),
                                                       (4, 10.0, (24, 48))])  # fmt: skip
def test_order_of_convergence(m: int, theta: float, intervals: tuple[int, int]) -> None:
    """Order 2m at mesh points, m + 1 in between (2m where that is less), on the upper branch of Bratu's problem."""
    coarse, fine = (errors(theta, m, n) for n in intervals)
    at_mesh, anywhere = np.log2(np.array(coarse) / np.array(fine))
    assert at_mesh == pytest.approx(2 * m, abs=0.35)
    assert anywhere == pytest.approx(min(m + 1, 2 * m), abs=0.35)


@pytest.mark.parametrize(("m", "n_int"), [(1, 60), (2, 20), (3, 16), (4, 12), (4, 24)])
def test_the_error_estimate_is_the_error(m: int, n_int: int) -> None:
    theta = 8.0
    colloc, x = solved(theta, m, np.linspace(0, 1, n_int + 1))
    exact = bratu_exact(theta, colloc.mesh)[1]
    true = (np.abs(colloc.solution(x).values - exact).max(axis=0) / np.maximum(1.0, np.abs(exact).max(axis=0))).max()
    assert true > 1e-12
    assert true / 3 < error_estimate(colloc, x).error < 3 * true


def test_the_norm_does_not_depend_on_the_mesh() -> None:
    bvp, rng = bratu(), np.random.default_rng(4)
    norms = []
    for n_int in (8, 20, 57):
        mesh = np.concatenate([[0.0], np.sort(rng.random(n_int - 1)), [1.0]])
        s = Solution.from_function(lambda s: np.column_stack([s**3, 1 - s]), bvp.unknowns, {"lam": 0.5}).remesh(mesh)
        colloc = Collocation(bvp, mesh, 4, s.parameters, [0], Scale(np.array([1.0, 2.0]), np.array([1.0])))
        norms.append(colloc.norm(colloc.state(s)))
    np.testing.assert_allclose(norms, np.sqrt(1 / 7 + 1 / 12 + 0.25), rtol=1e-12)


def test_the_mesh_gathers_where_the_solution_is_steep() -> None:
    colloc, x = solved(10.0, 3, np.linspace(0, 1, 21))
    mesh = equidistribute(colloc.mesh, monitor(colloc, x), 21)
    assert (mesh[0], mesh[-1], len(mesh)) == (0.0, 1.0, 22)
    assert (np.diff(mesh) > 0).all()
    assert np.diff(mesh)[10] < 0.7 * np.diff(mesh)[0]  # the peak is in the middle
    np.testing.assert_allclose(mesh, 1 - mesh[::-1], atol=1e-9)
    moved, again = solved(10.0, 3, equidistribute(colloc.mesh, monitor(colloc, x), 20))
    exact = bratu_exact(10.0, moved.mesh)[1]
    before = np.abs(colloc.solution(x).values - bratu_exact(10.0, colloc.mesh)[1]).max()
    assert np.abs(moved.solution(again).values - exact).max() < before / 3


def test_the_wanted_number_of_intervals_follows_the_error() -> None:
    from rodatlas.continuation import MeshControl

    control = MeshControl(tolerance=1e-8, points=4, intervals=(10, 100))

    def wanted(intervals: int, error: float, round_off: float = 0.0) -> int:
        return wanted_intervals(control, intervals, ErrorEstimate(error, round_off))

    assert wanted(40, 1e-3) == 80  # at most doubled
    assert wanted(40, 1e-15) == 28  # shrinks slowly
    assert wanted(40, 2.5e-9) == 40
    assert wanted(40, 1e-6, 9e-7) == 40  # round-off
    assert wanted(80, 1.0) == 100
    assert wanted(40, float("nan")) == 40
    assert wanted_intervals(MeshControl(intervals=(30, 30)), 30, ErrorEstimate(1.0, 0.0)) == 30
    np.testing.assert_array_equal(halved(np.array([0.0, 0.5, 1.0])), [0, 0.25, 0.5, 0.75, 1])


def test_interpolation_reproduces_polynomials_and_mesh_values() -> None:
    rng = np.random.default_rng(5)
    mesh = np.concatenate([[0.0], np.sort(rng.random(6)), [1.0]])
    s = Solution.from_function(lambda s: np.column_stack([s**4 - s]), ("u",), {"p": 0.0}).remesh(mesh)
    at = np.sort(rng.random(50))
    np.testing.assert_allclose(s(at, "u"), at**4 - at, atol=1e-14)
    np.testing.assert_array_equal(s(mesh), s.values)
    assert s.mean(s.stages[..., 0]) == pytest.approx(0.2 - 0.5, abs=1e-14)
    assert s["u"].shape == (8,)
    assert s["p"] == 0.0
    assert list(s.to_frame().columns) == ["s", "u"]


def test_wrong_problems_are_refused_by_name() -> None:
    def good(left, right, p):
        return [left.u, right.u]

    def make(rhs=lambda s, u, p: [u.v, -u.u], boundary=good, unknowns=("u", "v"), parameters=None, **more):
        parameters = {"lam": 1.0} if parameters is None else parameters
        return BVP(rhs, boundary, unknowns=unknowns, parameters=parameters, **more)

    assert repr(make()) == "BVP(bvp: 2 unknowns, 2 boundary and 0 integral conditions, 1 free parameter)"
    with pytest.raises(ValueError, match="rhs: expected 2 values, one per unknown, got 1"):
        make(rhs=lambda s, u, p: [u.v])
    with pytest.raises(ValueError, match=r"rhs: expected the names \('u', 'v'\), got \['u'\]"):
        make(rhs=lambda s, u, p: {"u": u.v})
    with pytest.raises(ValueError, match=r"rhs: expected .*no name 'w': expected one of u, v"):
        make(rhs=lambda s, u, p: [u.w, u.v])
    with pytest.raises(ValueError, match="expected distinct identifiers, got 'u'"):
        make(unknowns=("u", "u"))
    with pytest.raises(ValueError, match="scales: expected one of u, v, lam, got 'x'"):
        make(scales={"x": 1.0})
    with pytest.raises(ValueError, match="scales: expected a positive number for 'u', got 0"):
        make(scales={"u": 0.0})
    with pytest.raises(ValueError, match="boundary: expected at least 2 conditions for 2 unknowns, got 1"):
        make(boundary=lambda left, right, p: [left.u])
    with pytest.raises(ValueError, match="unknowns: expected at least one name"):
        make(unknowns=())
    with pytest.raises(ValueError, match="parameter: expected one of lam, got 'mu'"):
        make().parameter_vector({"mu": 1.0})
    with pytest.raises(ValueError, match=r"free: expected 1 parameter name\(s\)"):
        free_indices(make(), ("lam", "mu"))


def test_right_hand_sides_may_be_mappings_and_arrays() -> None:
    by_name = BVP(
        lambda s, u, p: {"v": -p.lam * u.u, "u": u.v}, lambda left, right, p: np.array([left.u, right.u - 1]),
        unknowns=("u", "v"), parameters={"lam": 1.0},
    )  # fmt: skip
    assert by_name.sparsity.components == [[0, 1]]
    assert by_name.n_boundary == 2
