"""What users do wrong, and what goes wrong: a sentence that says what to change, and nothing computed is lost."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import casadi
import numpy as np
import pandas as pd
import pytest
from bvp_problems import algebraic, bratu, bratu_exact, circle, constant, pitchfork

from rodatlas.continuation import (
    BVP,
    Branch,
    EndReason,
    MeshControl,
    NewtonCode,
    NotConverged,
    Solution,
    StepControl,
    TraceOptions,
    end_value,
    integral_of,
    solve,
    switch,
    trace,
)
from rodatlas.continuation.curve.settle import Settled
from rodatlas.continuation.discrete.vectors import scaled

SHORT = TraceOptions(max_points=6)
BOX = TraceOptions(bounds={"lam": (-1.0, 1.0)}, step=StepControl(maximum=0.1))


def oscillator(rhs=None, boundary=None, integrals=(), **changes) -> BVP:
    """u'' = -lam u with parts replaced."""
    given = {"unknowns": ("u", "v"), "parameters": {"lam": 1.0}, **changes}
    rhs = rhs or (lambda s, u, p: [u.v, -p.lam * u.u])
    return BVP(rhs, boundary or (lambda left, right, p: [left.u, right.u]), integrals, **given)


# -- the functions of a problem ---------------------------------------------------------------------------------------

FOREIGN = casadi.SX.sym("foreign")


@pytest.mark.parametrize(
    ("rhs", "message"),
    [
        (lambda s, u, p: [u.v, u.u if u.u > 0 else -u.u], r"rhs: expected expressions without `if`.*np\.where"),
        (lambda s, u, p: [u.v, max(u.u, 0.0)], r"rhs: expected expressions without `if`.*np\.maximum"),
        (lambda s, u, p: [u.v, u.u if u.u > 0 and u.v < 1 else 0], r"rhs: expected expressions without `if`"),
        (lambda s, u, p: [u.v, math.sin(u.u)], r"rhs: .*NaN.* write np\.sin"),
        (lambda s, u, p: [u.v, p.lam * float(u.u)], r"rhs: .*NaN.* leave out float\(\)"),
        (lambda s, u, p: None, "rhs: expected 2 values, one per unknown, got None: does the function return"),
        (lambda s, u, p: [[u.v, u.u]], r"rhs: .* in one flat sequence, got the list \[.*\] as value 1"),
        (lambda s, u, p: [u.v, 1j], "rhs: expected real numbers .* got the complex 1j as value 2"),
        (lambda s, u, p: [u.v, 1j * u.u], "rhs: expected arithmetic and NumPy functions .* got TypeError"),
        (lambda s, u, p: [u.v, "u"], "rhs: expected real numbers .* got the str 'u' as value 2"),
        (lambda s, u, p: [u.v, None], "rhs: expected real numbers .* got the NoneType None as value 2"),
        (lambda s, u, p: [u.v, u.u, 0.0], "rhs: expected 2 values, one per unknown, got 3"),
        (lambda s, u, p: np.array([[u.v, 1], [u.u, 1]]), "rhs: expected 2 values, one per unknown, got 4"),
        (lambda s, u, p: {"u": u.v, "w": u.u}, r"rhs: expected the names \('u', 'v'\), got \['u', 'w'\]"),
        (lambda s, u, p: [u.v, u.u * FOREIGN], "rhs: expected functions of the given symbols only, got foreign too"),
        (lambda u, p: [u.v, u.u], "rhs: expected arithmetic .* takes 2 positional arguments but 3 were given"),
        (3.0, r"rhs: expected a function or a sequence of functions, got 3\.0"),
    ],
)
def test_a_right_hand_side_that_cannot_be_traced(rhs, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        oscillator(rhs)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"boundary": lambda left, right, p: [left.u]}, "boundary: expected at least 2 conditions .* got 1"),
        ({"boundary": lambda left, right, p: []}, "boundary: expected at least 2 conditions for 2 unknowns, got 0"),
        (
            {"boundary": lambda left, right, p: [left.u, right.u, left.v, right.v]},
            r"at most 2 conditions .* got 4: a branch would need 3 free parameters and there are only 1 \(lam\)",
        ),
        ({"integrals": lambda s, u, p: u.u}, r"at most 1 conditions for 2 unknowns and 1 integral conditions, got 2"),
        ({"boundary": lambda left, right, p: {"u": left.u}}, r"boundary: expected a sequence, got \['u'\]"),
        ({"boundary": lambda left, right, p: None}, "boundary: expected numbers and expressions, got None"),
        ({"boundary": lambda left, right, p: [left.u, math.cos(right.u)]}, r"boundary: .* write np\.sin"),
        ({"integrals": [lambda s, u, p: u.u if u.u > 0 else 0]}, "integrals: expected expressions without `if`"),
        ({"integrals": [3]}, "integrals: expected a function, got 3"),
        ({"observables": {"o": lambda s, u, p: u.u}}, r"observables: expected integral_of"),
        ({"observables": {"o": integral_of(lambda s, u, p: [u.u, u.v])}}, "observable o: expected one value, got 2"),
        ({"observables": {"o": end_value(lambda left, right, p: math.exp(left.u))}}, "observable o: .*NaN"),
        ({"unknowns": "uv"}, r"unknowns: expected a sequence of names such as \('u', 'v'\), got 'uv'"),
        ({"unknowns": (1, 2)}, "unknowns: expected a sequence of names"),
        ({"parameters": {"lam": "1"}}, "parameters: expected a finite number for 'lam', got '1'"),
        ({"parameters": {"lam": None}}, "parameters: expected a finite number for 'lam', got None"),
        ({"parameters": {"lam": 1j}}, "parameters: expected a finite number for 'lam', got 1j"),
        ({"parameters": {"lam": float("nan")}}, "parameters: expected a finite number for 'lam', got nan"),
        ({"parameters": {"lam": -np.inf}}, "parameters: expected a finite number for 'lam', got -inf"),
        ({"parameters": ["lam"]}, r"parameters: expected a mapping of names to numbers, got \['lam'\]"),
        ({"scales": {"u": "x"}}, "scales: expected a finite number for 'u', got 'x'"),
    ],
)
def test_a_problem_that_is_not_one(changes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        oscillator(**changes)
    assert "\n" not in str(caught.value)


def test_what_the_messages_recommend_works() -> None:
    """np.where, np.minimum and np.maximum, and u' = u from the whole of u."""
    bvp = oscillator(lambda s, u, p: [np.where(u.u > 0, -p.lam, p.lam), np.maximum(u.v, 2.0) + np.minimum(s, 0.25)])
    value = np.array(bvp.traced.field(0.5, [3.0, 1.0], [7.0])[0]).ravel()
    np.testing.assert_array_equal(value, [-7.0, 2.25])
    np.testing.assert_array_equal(np.array(bvp.traced.field(0.0, [-3.0, 5.0], [7.0])[0]).ravel(), [7.0, 5.0])
    assert oscillator(lambda s, u, p: u).size == 2
    assert oscillator(lambda s, u, p: casadi.vertcat(u.v, u.u)).size == 2
    assert oscillator(lambda s, u, p: [np.array(u.v), np.float64(1)]).size == 2


def test_numbers_given_later_are_checked_too() -> None:
    with pytest.raises(ValueError, match="parameters: expected a finite number for 'lam', got nan"):
        oscillator().parameter_vector({"lam": float("nan")})
    with pytest.raises(ValueError, match=r"free: expected names of parameters such as \('lam',\), got 'lam'"):
        trace(bratu(), constant(bratu()), "lam")


# -- guesses by hand and by file --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda s: np.zeros(len(s)), r"function\(21 values of s\): expected shape \(21, 2\), a column for each of"),
        (lambda s: np.zeros((2, len(s))), r"expected shape \(21, 2\), .* got \(2, 21\)"),
        (lambda s: np.column_stack([s, np.where(s > 0.04, s, np.nan)]), "finite values of 'v', got nan in row 1"),
        (lambda s: np.column_stack([s, 1j * s]), "expected real numbers, got array"),
        (lambda s: [["a", "b"]] * len(s), "expected real numbers, got"),
    ],
)
def test_a_function_that_is_no_guess(function, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Solution.from_function(function, ("u", "v"), {"lam": 0.0})


@pytest.mark.parametrize(
    ("s", "values", "message"),
    [
        ([0, 0.5, 0.5, 1], np.zeros((4, 2)), "s: expected at least two finite, strictly increasing numbers"),
        ([0, 0.7, 0.5, 1], np.zeros((4, 2)), "s: expected at least two finite, strictly increasing numbers"),
        ([0, np.nan, 0.5, 1], np.zeros((4, 2)), "s: expected at least two finite, strictly increasing numbers"),
        ([0], np.zeros((1, 2)), "s: expected at least two finite, strictly increasing numbers"),
        ([-1e300, 0.0, 1.0], np.zeros((3, 2)), "s: expected places that can be told apart"),
        ([0, 1], np.zeros((3, 2)), r"values: expected shape \(2, 2\), a column for each of u, v, got \(3, 2\)"),
        ([0, 1], [[0, 1], [np.inf, 1]], "values: expected finite values of 'u', got inf in row 2"),
    ],
)
def test_a_table_that_is_no_guess(s, values, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Solution.from_values(s, values, ("u", "v"), {"lam": 0.0})


def test_names_and_numbers_of_a_guess() -> None:
    def guess(unknowns=("u",), parameters=None, **more):
        parameters = {"lam": 0.0} if parameters is None else parameters
        return Solution.from_values([0, 1], [0, 0], unknowns, parameters, **more)

    assert guess().values.shape == (2, 1)
    with pytest.raises(ValueError, match="unknowns: expected a sequence of names"):
        guess(unknowns="u")
    with pytest.raises(ValueError, match="parameters: expected a mapping of names to numbers"):
        guess(parameters=[1.0])
    with pytest.raises(ValueError, match="parameters: expected a finite number for 'lam', got nan"):
        guess(parameters={"lam": float("nan")})
    with pytest.raises(ValueError, match="intervals: expected at least 1, got 0"):
        Solution.from_function(lambda s: s, ("u",), {"lam": 0.0}, intervals=0)


def test_a_table_is_joined_by_a_cubic_spline() -> None:
    s = np.array([2.0, 2.5, 3.5, 3.6, 4.0])  # any interval is carried to [0, 1]
    t = (s - 2) / 2
    cubic = Solution.from_values(s, np.column_stack([t**3 - t, 2 * t]), ("u", "v"), {"lam": 0.0})
    at = np.linspace(0, 1, 30)
    np.testing.assert_allclose(cubic(at), np.column_stack([at**3 - at, 2 * at]), atol=1e-13)
    np.testing.assert_array_equal(cubic.mesh, t)
    line = Solution.from_values([0, 0.5, 1], [0.0, 1.0, 0.0], ("u",), {"lam": 0.0})
    np.testing.assert_allclose(line(at, "u"), 1 - np.abs(2 * at - 1), atol=1e-13)


def test_a_branch_starts_from_a_table(tmp_path: Path) -> None:
    """From CSV, DataFrame and mapping, with columns in any order and others besides; and it is the same branch."""
    known = solve(bratu(), constant(bratu(), lam=2.0))
    table = known.to_frame()
    path = tmp_path / "start.csv"
    table.assign(note="x")[["v", "note", "s", "u"]].to_csv(path, index=False)
    expected = trace(bratu(), known, ("lam",), SHORT)
    for source in (path, str(path), table, {name: list(table[name]) for name in table}):
        start = Solution.from_table(source, bratu().unknowns, {"lam": 2.0})
        np.testing.assert_allclose(start.stages, known.stages, atol=2e-4)
        branch = trace(bratu(), start, ("lam",), SHORT)
        np.testing.assert_allclose(branch.column("mean"), expected.column("mean"), rtol=2e-2)
        middle = branch.points[len(branch) // 2].solution
        assert middle["mean"] == pytest.approx(known["mean"], abs=1e-8)


def test_a_table_that_lacks_something(tmp_path: Path) -> None:
    path = tmp_path / "start.csv"
    path.write_text("x, u\n0, 1\n1, 2\n")
    with pytest.raises(ValueError, match=r"start\.csv: expected the columns s, u, v, got x, u \(missing: s, v\)"):
        Solution.from_table(path, ("u", "v"), {"lam": 0.0})
    assert Solution.from_table(path, ("u",), {"lam": 0.0}, s="x")["u"].tolist() == [1.0, 2.0]
    path.write_text("s,u\n0,1\n1,two\n")
    with pytest.raises(ValueError, match=r"start\.csv: expected numbers in the columns s, u"):
        Solution.from_table(path, ("u",), {"lam": 0.0})
    path.write_text("s,u\n0,1\n1,\n")
    with pytest.raises(ValueError, match="expected finite values of 'u', got nan in row 2"):
        Solution.from_table(path, ("u",), {"lam": 0.0})
    path.write_text("")
    with pytest.raises(ValueError, match=r"start\.csv: expected a CSV file with named columns"):
        Solution.from_table(path, ("u",), {"lam": 0.0})
    with pytest.raises(FileNotFoundError):
        Solution.from_table(tmp_path / "none.csv", ("u",), {"lam": 0.0})
    with pytest.raises(ValueError, match="table: expected the columns s, u, got s"):
        Solution.from_table(pd.DataFrame({"s": [0, 1]}), ("u",), {"lam": 0.0})


# -- starts -----------------------------------------------------------------------------------------------------------


def test_a_start_of_another_problem_is_refused() -> None:
    with pytest.raises(ValueError, match="start: expected the unknowns u, v, got x"):
        trace(bratu(), constant(circle()), ("lam",))
    other = Solution.from_function(lambda s: np.zeros((len(s), 2)), ("u", "v"), {"mu": 0.0})
    with pytest.raises(ValueError, match="start: expected the parameters lam, got mu"):
        solve(bratu(), other)
    with pytest.raises(ValueError, match="start: expected a Solution, got None"):
        trace(bratu(), None, ("lam",))
    with pytest.raises(ValueError, match="at: expected a special point of a branch, got None"):
        switch(bratu(), None, ("lam",))
    fork = trace(pitchfork(), constant(pitchfork(), lam=-0.5), ("lam",), BOX).special[0]
    with pytest.raises(ValueError, match="at: expected the unknowns u, v, got x"):
        switch(bratu(), fork, ("lam",))
    with pytest.raises(ValueError, match="side: expected 1 or -1, got 0"):
        switch(pitchfork(), fork, ("lam",), side=0)


def test_unknowns_of_a_start_are_taken_by_name() -> None:
    """On the upper branch of Bratu's problem a guess with unknowns mistaken for one another leads nowhere."""
    lam, _ = bratu_exact(8.0, np.zeros(1))
    start = Solution.from_function(lambda s: bratu_exact(8.0, s)[1][:, ::-1], ("v", "u"), {"lam": lam})
    assert solve(bratu(), start)["u"].max() == pytest.approx(2 * np.log(np.cosh(2.0)), rel=1e-6)


def test_parameters_of_a_start_are_taken_by_name() -> None:
    bvp = oscillator(lambda s, u, p: [u.v, -p.lam * u.u + p.load], lambda left, right, p: [left.u, right.u],
                     parameters={"lam": 1.0, "load": 0.5})  # fmt: skip
    start = solve(bvp, constant(bvp, lam=2.0), ("lam",))
    turned = Solution(
        ("v", "u"), ("load", "lam"), start.mesh, start.values[:, ::-1], start.stages[..., ::-1], start.parameters[::-1]
    )  # fmt: skip
    again = solve(bvp, turned, ("lam",))
    assert (again.unknowns, again.parameter_names) == (bvp.unknowns, bvp.parameter_names)
    np.testing.assert_allclose(again.values[[0, -1]], start.values[[0, -1]], atol=1e-7)
    assert (again["lam"], again["load"]) == (2.0, 0.5)


@pytest.mark.parametrize("field", ["values", "stages", "parameters"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_in_the_start_is_refused(field: str, bad: float) -> None:
    start = constant(bratu())
    array = getattr(start, field).copy()
    array.flat[-1] = bad
    name = "lam" if field == "parameters" else "v"
    for verb in (lambda s: trace(bratu(), s, ("lam",)), lambda s: solve(bratu(), s)):
        with pytest.raises(ValueError, match=f"start: expected finite numbers, got NaN or infinity in '{name}'"):
            verb(replace(start, **{field: array}))


def test_a_start_outside_the_bounds() -> None:
    """The run may lead inside; when it leads away there is nothing to return."""
    bvp, outside = algebraic(lambda u, p: [u.x - p.lam]), TraceOptions(bounds={"lam": (1.0, 2.0)})
    branch = trace(bvp, constant(bvp), ("lam",), outside)
    assert branch.points[-1].solution["lam"] == 2.0
    with pytest.raises(ValueError, match="bounds: expected 1 <= lam <= 2 at the start or on the way, got lam = 0"):
        trace(bvp, constant(bvp), ("lam",), outside, both=False, direction=-1)
    on_it = trace(bvp, constant(bvp, [2.0], lam=2.0), ("lam",), outside, both=False)
    assert len(on_it) == 1
    assert on_it.ends[1] is EndReason.RANGE
    observables = {"root": end_value(lambda left, right, p: np.sqrt(left.x))}
    root = algebraic(lambda u, p: [u.x - p.lam], observables=observables)
    for options in (TraceOptions(bounds={"root": (0.0, 1.0)}), TraceOptions(zeros={"root": 0.5})):
        with pytest.raises(ValueError, match="expected a finite value of 'root' at the start, got nan"):
            trace(root, constant(root, [-1.0], lam=-1.0), ("lam",), options)


def test_bounds_may_be_infinite() -> None:
    open_ended = TraceOptions(bounds={"lam": (-np.inf, np.inf)}, max_points=5)
    assert trace(bratu(), constant(bratu()), ("lam",), open_ended).ends == (EndReason.POINT_LIMIT,) * 2
    above = replace(open_ended, bounds={"lam": (-np.inf, 0.05)})
    branch = trace(bratu(), constant(bratu()), ("lam",), above)
    assert branch.ends == (EndReason.POINT_LIMIT, EndReason.RANGE)
    assert branch.points[-1].solution["lam"] == pytest.approx(0.05, abs=1e-14)


# -- singular problems ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", ["numba", "scipy"])
@pytest.mark.parametrize(
    "boundary",
    [
        lambda left, right, p: [left.u, left.u],
        lambda left, right, p: [left.u, 0.0 * right.u],
        lambda left, right, p: [left.u + 0.1 * left.v - 1, 3 * left.u + 0.3 * left.v - 3],  # consistent, to round-off
        lambda left, right, p: [left.u + 0.1 * left.v - 1, 3 * left.u + 0.3 * left.v - 4],  # contradictory
        lambda left, right, p: [left.u - right.u, (left.u - right.u) / 3],
    ],
)
@pytest.mark.parametrize("rhs", [lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda s, u, p: [u.v, p.lam - u.u]])
def test_conditions_that_repeat_one_another(rhs, boundary, backend: str) -> None:
    bvp = oscillator(rhs, boundary)
    with pytest.raises(NotConverged, match="check that boundary conditions are independent") as caught:
        trace(bvp, constant(bvp), ("lam",), replace(SHORT, backend=backend))
    assert caught.value.code is NewtonCode.SINGULAR


@pytest.mark.parametrize("backend", ["numba", "scipy"])
def test_conditions_that_leave_something_undetermined(backend: str) -> None:
    """u'' = 0 with both slopes given: u is known up to a constant, although the conditions differ."""
    neumann = oscillator(lambda s, u, p: [u.v, 0.0 * u.u], lambda left, right, p: [left.v - p.lam, right.v - p.lam])
    with pytest.raises(NotConverged) as caught:
        solve(neumann, constant(neumann, [0.0, 1.0]), options=replace(SHORT, backend=backend))
    assert caught.value.code is NewtonCode.SINGULAR


def test_large_growth_is_not_taken_for_a_singular_problem() -> None:
    """u' = K u grows by 1e26: an ill-conditioned boundary value problem, but not an undetermined one."""
    bvp = BVP(lambda s, u, p: [p.K * u.u], lambda left, right, p: [left.u], unknowns=("u",), parameters={"K": 60.0})
    assert np.abs(solve(bvp, constant(bvp)).values).max() == 0.0


@pytest.mark.parametrize("backend", ["numba", "scipy"])
def test_a_start_at_a_branch_point_is_not_taken_for_a_singular_problem(backend: str) -> None:
    """y (lam - y^2) = 0 and z = 0, mixed so that round-off makes the zero pivot a small number."""

    def residual(u, p):
        y, z = u.a + 0.3 * u.b, u.a - 0.7 * u.b
        fork = y * (p.lam - 0.1 - y**2)
        return [fork + z / 3, 0.7 * fork - 3 * z]

    bvp = algebraic(residual, unknowns=("a", "b"))
    options = replace(BOX, backend=backend)
    branch = trace(bvp, constant(bvp, lam=0.1), ("lam",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert abs(branch.column("lam")[[0, -1]]).min() == pytest.approx(1.0)


def test_a_settled_start_outside_the_domain_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Should moving the mesh lead there, the run does not begin."""
    module = import_module("rodatlas.continuation.curve.start")

    def astray(frame, options, holds, anywhere):
        return Settled(replace(frame, x=scaled(frame.x, float("nan"))), 0, None)

    monkeypatch.setattr(module, "settled", astray)
    with pytest.raises(NotConverged) as caught:
        trace(bratu(), constant(bratu()), ("lam",), SHORT)
    assert caught.value.code is NewtonCode.NOT_FINITE


# -- the way ----------------------------------------------------------------------------------------------------------

LEAVES = {  # residual, solution at lam = 0, largest lam of the domain
    "root": (lambda u, p: [u.x - np.sqrt(1 - p.lam)], 1.0, 1.0),
    "logarithm": (lambda u, p: [u.x - p.lam * np.log(1.5 - p.lam)], 0.0, 1.5),
    "overflow": (lambda u, p: [u.x - p.lam + 1e-320 * np.exp(1000 * p.lam)], 0.0, 0.7097827),
}


@pytest.mark.parametrize("backend", ["numba", "scipy"])
@pytest.mark.parametrize("name", [*LEAVES])
def test_a_branch_that_leaves_the_domain_keeps_its_points(name: str, backend: str) -> None:
    residual, x, edge = LEAVES[name]
    bvp = algebraic(residual)
    options = TraceOptions(bounds={"lam": (-1.0, 3.0)}, max_points=400, backend=backend)
    branch = trace(bvp, constant(bvp, [x]), ("lam",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.MIN_STEP)
    assert branch.failures == (None, NewtonCode.NOT_FINITE)
    assert "keep the unknowns in its domain" in branch.failures[1].value
    lam = branch.column("lam")
    assert edge - 1e-3 < lam[-1] <= edge
    assert lam.max() <= edge  # no point outside, where Newton's last correction may lead
    assert np.isfinite([p.solution.values for p in branch.points[-3:]]).all()


@pytest.mark.parametrize("backend", ["numba", "scipy"])
def test_newtons_last_correction_may_not_leave_the_domain(backend: str) -> None:
    """It leads from x = 1 - 3e-5 to 1 + 5e-6, where the equation cannot be evaluated: no solution, though converged."""
    bvp = algebraic(lambda u, p: [u.x - p.lam - 0.35 * (u.x - 1) ** 2 + 1e-13 * np.sqrt(1 - u.x)])
    with pytest.raises(NotConverged) as caught:
        solve(bvp, constant(bvp, [0.99], lam=1 + 5e-6), options=TraceOptions(backend=backend))
    assert caught.value.code is NewtonCode.NOT_FINITE


def layer() -> tuple[BVP, Solution]:
    """u'' = exp(2 lam) u, u(0) = 1, u(1) = 0: a boundary layer of width exp(-lam)."""
    bvp = oscillator(lambda s, u, p: [u.v, np.exp(2 * p.lam) * u.u], lambda left, right, p: [left.u - 1, right.u],
                     parameters={"lam": 0.0})  # fmt: skip
    return bvp, Solution.from_function(lambda s: np.column_stack([1 - s, 0 * s - 1]), ("u", "v"), {"lam": 0.0})


def test_a_mesh_at_its_limit() -> None:
    bvp, start = layer()
    options = TraceOptions(bounds={"lam": (-0.5, 8)}, mesh=MeshControl(tolerance=1e-10, intervals=(8, 12)), locate=())
    branch = trace(bvp, start, ("lam",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.MESH_LIMIT)
    assert "raise intervals or loosen the tolerance" in branch.ends[1].value
    assert len(branch) > 5
    with pytest.raises(NotConverged, match="raise intervals or loosen the tolerance") as caught:
        solve(bvp, start.with_parameters(lam=6.0), options=options)
    assert caught.value.code is EndReason.MESH_LIMIT
    assert caught.value.solution is not None
    assert caught.value.solution.intervals == 12
    assert caught.value.solution.error > 1e-9
    fixed_size = replace(options, mesh=MeshControl(tolerance=1e-10, intervals=(12, 12)))
    assert solve(bvp, start.with_parameters(lam=6.0), options=fixed_size).intervals == 12  # asked for


def test_a_guess_from_which_newton_fails_and_its_exception_survives_a_process() -> None:
    for guess, code in ((constant(bratu(), [1000.0, 0.0], lam=1.0), NewtonCode.NOT_FINITE),
                        (constant(bratu(), [10.0, 0.0], lam=3.0), NewtonCode.DIVERGED),
                        (constant(bratu(), lam=10.0), NewtonCode.SLOW)):  # fmt: skip
        with pytest.raises(NotConverged, match="start of the run at Solution") as caught:
            trace(bratu(), guess, ("lam",))
        assert caught.value.code is code
        again = pickle.loads(pickle.dumps(caught.value))
        assert (str(again), again.code, again.solution) == (str(caught.value), code, None)


# -- interruption -----------------------------------------------------------------------------------------------------


class Fuse:
    """A function that raises at its n-th call."""

    def __init__(self, calls: int, error: type[BaseException], result=None):
        self.left, self.error, self.result = calls, error, result

    def __call__(self, *_):
        self.left -= 1
        if self.left < 0:
            raise self.error("enough")
        return self.result


def interrupted(options: TraceOptions, error: type[BaseException], both: bool = True) -> Branch:
    """What is left of a trace of the circle."""
    with pytest.raises(error, match="enough") as caught:
        trace(circle(), constant(circle(), [1.0]), ("lam",), options, both=both)
    return caught.value.branch


def assert_part(branch: Branch, whole: Branch) -> None:
    """The points and special points of the branch are those of the whole one, none left out in between."""
    arclength = whole.column("arclength").tolist()
    first = arclength.index(branch.points[0].arclength)
    assert branch.column("arclength").tolist() == arclength[first : first + len(branch)]
    for a, b in zip(branch, whole.points[first:], strict=False):
        np.testing.assert_array_equal(a.solution.values, b.solution.values)
    low, high = branch.points[0].arclength, branch.points[-1].arclength
    assert [x.arclength for x in branch.special] == [x.arclength for x in whole.special if low < x.arclength <= high]


WIDE = TraceOptions(bounds={"x0": (-0.5, 2.0)}, step=StepControl(maximum=0.2))


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
@pytest.mark.parametrize("calls", [0, 3, 14, 22])
def test_an_exception_of_on_point_loses_nothing(calls: int, error: type[BaseException], tmp_path: Path) -> None:
    whole = trace(circle(), constant(circle(), [1.0]), ("lam",), WIDE)
    branch = interrupted(replace(WIDE, on_point=Fuse(calls, error)), error)
    assert len(branch) == calls + 2  # the start, those that were announced, and the one that was not
    assert_part(branch, whole)
    forward = whole.column("arclength") > 0
    done = calls >= forward.sum()
    assert branch.ends == (EndReason.INTERRUPTED, EndReason.RANGE if done else EndReason.INTERRUPTED)
    assert "interrupted: the part computed so far is kept" in repr(branch)
    branch.save(tmp_path / "part.h5")
    assert Branch.load(tmp_path / "part.h5").ends == branch.ends


def test_one_direction_keeps_its_start() -> None:
    branch = interrupted(replace(WIDE, on_point=Fuse(2, KeyboardInterrupt)), KeyboardInterrupt, both=False)
    assert branch.ends == (EndReason.START, EndReason.INTERRUPTED)
    assert len(branch) == 4


@pytest.mark.parametrize("calls", [0, 1, 5, 20])
def test_an_exception_of_index_loses_nothing(calls: int) -> None:
    whole = trace(circle(), constant(circle(), [1.0]), ("lam",), WIDE)
    branch = interrupted(replace(WIDE, index=Fuse(calls, ValueError, result=None)), ValueError)
    assert_part(branch, whole)
    assert len(branch) == max(1, calls + (calls < 15))
    with pytest.raises(ValueError, match="index: expected an integer or None, got 'stable'") as caught:
        trace(circle(), constant(circle(), [1.0]), ("lam",), replace(WIDE, index=lambda solution: "stable"))
    assert len(caught.value.branch) == 1


def test_an_exception_of_stop_at_keeps_the_special_point() -> None:
    branch = interrupted(replace(WIDE, stop_at=Fuse(0, ZeroDivisionError, result=False)), ZeroDivisionError)
    assert branch.ends == (EndReason.INTERRUPTED, EndReason.INTERRUPTED)
    assert [x.kind for x in branch.special] == ["fold"]
    assert branch.points[-1].solution["lam"] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("calls", [5, 20])
def test_an_interrupt_inside_newton_loses_the_step_under_way_only(calls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    import rodatlas.continuation.curve.walker as walker

    whole = trace(circle(), constant(circle(), [1.0]), ("lam",), WIDE)
    corrector, fuse = walker.newton, Fuse(calls, KeyboardInterrupt)

    def newton(*arguments):
        fuse()
        return corrector(*arguments)

    monkeypatch.setattr(walker, "newton", newton)
    branch = interrupted(WIDE, KeyboardInterrupt)
    assert 1 < len(branch) < len(whole)
    assert_part(branch, whole)


def test_a_side_branch_is_kept_from_its_branch_point_on() -> None:
    fork = trace(pitchfork(), constant(pitchfork(), lam=-0.5), ("lam",), BOX).special[0]
    with pytest.raises(KeyboardInterrupt) as caught:
        switch(pitchfork(), fork, ("lam",), replace(BOX, on_point=Fuse(2, KeyboardInterrupt)))
    branch = caught.value.branch
    assert branch.ends == (EndReason.BRANCH_POINT, EndReason.INTERRUPTED)
    assert branch.points[0].arclength == 0.0
    assert len(branch) == 5
    assert (np.diff(branch.column("arclength")) > 0).all()


@pytest.mark.parametrize(("bounds", "got"), [
    ({"lam": 1.0}, r"1\.0"), ({"lam": ("a", 1.0)}, r"\('a', 1\.0\)"), ({"lam": (2.0, 1.0)}, r"\(2\.0, 1\.0\)"),
    ({"lam": (0.0, 1.0, 2.0)}, r"\(0\.0, 1\.0, 2\.0\)"), ({"lam": (0.0, float("nan"))}, r"\(0\.0, nan\)"),
])  # fmt: skip
def test_bounds_are_pairs_of_numbers(bounds, got) -> None:
    with pytest.raises(ValueError, match=f"bounds: expected numbers low < high for 'lam', got {got}"):
        TraceOptions(bounds=bounds)


def test_zeros_are_numbers() -> None:
    with pytest.raises(ValueError, match="zeros: expected a number, or a sequence of them, for 'lam', got None"):
        TraceOptions(zeros={"lam": None})


def test_a_bounded_observable_that_ends_on_the_way() -> None:
    """sqrt(1 - lam) is bounded and ends at lam = 1: so does the branch, and it says why."""
    bvp = algebraic(
        lambda u, p: [u.x - p.lam], observables={"root": end_value(lambda left, right, p: np.sqrt(1 - left.x))}
    )
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"root": (-1.0, 2.0)}), both=False)
    assert branch.ends[1] is EndReason.MIN_STEP
    assert branch.failures[1] is NewtonCode.NOT_FINITE
    assert branch.points[-1].solution["lam"] == pytest.approx(1.0, abs=1e-4)
