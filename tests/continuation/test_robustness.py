"""What users do wrong, and what goes wrong: a sentence that says what to change, and nothing computed is lost."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pandas as pd
import pytest
from bvp_problems import algebraic, bratu, circle, constant, pitchfork

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

SHORT = TraceOptions(max_points=6)


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
        (lambda s, u, p: [u.v, u.u if 0 < u.u and u.v < 1 else 0], r"rhs: expected expressions without `if`"),
        (lambda s, u, p: [u.v, math.sin(u.u)], r"rhs: .*NaN.* write np\.sin"),
        (lambda s, u, p: [u.v, p.lam * float(u.u)], r"rhs: .*NaN.* leave out float\(\)"),
        (lambda s, u, p: None, "rhs: expected 2 values, one per unknown, got None: does the function return"),
        (lambda s, u, p: [[u.v, u.u]], r"rhs: .* in one flat sequence, got the list \[SX\(u_1\), SX\(u_0\)\] as value 1"),
        (lambda s, u, p: [u.v, 1j], "rhs: expected real numbers .* got the complex 1j as value 2"),
        (lambda s, u, p: [u.v, 1j * u.u], "rhs: expected arithmetic and NumPy functions of the arguments, got TypeError"),
        (lambda s, u, p: [u.v, "u"], "rhs: expected real numbers .* got the str 'u' as value 2"),
        (lambda s, u, p: [u.v, None], "rhs: expected real numbers .* got the NoneType None as value 2"),
        (lambda s, u, p: [u.v, u.u, 0.0], "rhs: expected 2 values, one per unknown, got 3"),
        (lambda s, u, p: np.array([[u.v, 1], [u.u, 1]]), "rhs: expected 2 values, one per unknown, got 4"),
        (lambda s, u, p: {"u": u.v, "w": u.u}, r"rhs: expected the names \('u', 'v'\), got \['u', 'w'\]"),
        (lambda s, u, p: [u.v, u.u * FOREIGN], "rhs: expected functions of the given symbols only, got foreign too"),
        (lambda u, p: [u.v, u.u], "rhs: expected arithmetic .* takes 2 positional arguments but 3 were given"),
        (3.0, r"rhs: expected a function, got 3\.0"),
    ],
)
def test_a_right_hand_side_that_cannot_be_traced(rhs, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        oscillator(rhs)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"boundary": lambda left, right, p: [left.u]}, "boundary: expected at least 2 conditions for 2 unknowns, got 1"),
        ({"boundary": lambda left, right, p: []}, "boundary: expected at least 2 conditions for 2 unknowns, got 0"),
        ({"boundary": lambda left, right, p: [left.u, right.u, left.v, right.v]},
         r"at most 2 conditions .* got 4: a branch would need 3 free parameters and there are only 1 \(lam\)"),
        ({"integrals": lambda s, u, p: u.u}, r"at most 1 conditions for 2 unknowns and 1 integral conditions, got 2"),
        ({"boundary": lambda left, right, p: {"u": left.u}}, r"boundary: expected a sequence, got \['u'\]"),
        ({"boundary": lambda left, right, p: None}, "boundary: expected numbers and expressions, got None"),
        ({"boundary": lambda left, right, p: [left.u, math.cos(right.u)]}, r"boundary: .* write np\.sin"),
        ({"integrals": [lambda s, u, p: u.u if u.u > 0 else 0]}, "integrals: expected expressions without `if`"),
        ({"integrals": [3]}, "integrals: expected a function, got 3"),
        ({"observables": {"o": lambda s, u, p: u.u}}, r"observables: expected integral_of\(function\) or end_value"),
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
    with pytest.raises(ValueError, match=r"free: expected a sequence of names, got the string 'lam': write \('lam',\)"):
        trace(bratu(), constant(bratu()), "lam")


# -- guesses by hand and by file --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda s: np.zeros(len(s)), r"function\(21 values of s\): expected shape \(21, 2\), a column for each of u, v"),
        (lambda s: np.zeros((2, len(s))), r"expected shape \(21, 2\), .* got \(2, 21\)"),
        (lambda s: np.column_stack([s, np.log(s - 0.5 + 0j).real + np.nan]), "finite values of 'v', got nan in row 1"),
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
        ([0, 5e-324, 1], np.zeros((3, 2)), "s: expected places that can be told apart|function"),
        ([0, 1], np.zeros((3, 2)), r"values: expected shape \(2, 2\), a column for each of u, v, got \(3, 2\)"),
        ([0, 1], [[0, 1], [np.inf, 1]], "values: expected finite values of 'u', got inf in row 2"),
    ],
)
def test_a_table_that_is_no_guess(s, values, message: str) -> None:
    if "told apart" in message:
        s = [-1e300, 0.0, 1.0]
    with pytest.raises(ValueError, match=message):
        Solution.from_values(s, values, ("u", "v"), {"lam": 0.0})


def test_names_and_numbers_of_a_guess() -> None:
    def guess(unknowns=("u",), parameters=None, **more):
        return Solution.from_values([0, 1], [0, 0], unknowns, {"lam": 0.0} if parameters is None else parameters, **more)

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
    fork = trace(pitchfork(), constant(pitchfork(), lam=-0.5), ("lam",), TraceOptions(bounds={"lam": (-1, 1)})).special[0]
    with pytest.raises(ValueError, match="at: expected the unknowns u, v, got x"):
        switch(bratu(), fork, ("lam",))
    with pytest.raises(ValueError, match="side: expected 1 or -1, got 0"):
        switch(pitchfork(), fork, ("lam",), side=0)


def test_names_count_and_not_their_order() -> None:
    bvp = oscillator(lambda s, u, p: [u.v, -p.lam * u.u + p.load], lambda left, right, p: [left.u, right.u],
                     parameters={"lam": 1.0, "load": 0.5})  # fmt: skip
    start = solve(bvp, constant(bvp, lam=2.0), ("lam",))
    turned = Solution(
        ("v", "u"), ("load", "lam"), start.mesh, start.values[:, ::-1], start.stages[..., ::-1], start.parameters[::-1]
    )  # fmt: skip
    again = solve(bvp, turned, ("lam",))
    assert (again.unknowns, again.parameter_names) == (bvp.unknowns, bvp.parameter_names)
    np.testing.assert_allclose(again.values, start.values, atol=1e-9)
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
    root = algebraic(lambda u, p: [u.x - p.lam], observables={"root": end_value(lambda left, right, p: np.sqrt(left.x))})
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
    """u' = K u grows by 1e26: badly conditioned as a boundary value problem, but not undetermined."""
    bvp = BVP(lambda s, u, p: [p.K * u.u], lambda left, right, p: [left.u - 1], unknowns=("u",), parameters={"K": 60.0})
    start = Solution.from_function(lambda s: np.exp(60 * s), ("u",), {"K": 60.0}, 60)
    found = solve(bvp, start, options=TraceOptions(mesh=MeshControl(tolerance=1e-6)))
    assert found.values[-1, 0] == pytest.approx(np.exp(60.0), rel=1e-4)


# -- the way --------------------------------------------------------------------------------------------------------

LEAVES = {
    "root": (lambda u, p: [u.x - np.sqrt(1 - p.lam)], [1.0], 1.0),
    "logarithm": (lambda u, p: [u.x - np.log(1.5 - p.lam) * p.lam], [0.0], 1.5),
    "overflow": (lambda u, p: [u.x - p.lam - 1e-3 * np.exp(np.exp(10 * p.lam))], [1e-3 * math.e], None),
}


@pytest.mark.parametrize("backend", ["numba", "scipy"])
@pytest.mark.parametrize("name", [*LEAVES])
def test_a_branch_that_leaves_the_domain_keeps_its_points(name: str, backend: str) -> None:
    residual, start, edge = LEAVES[name]
    bvp = algebraic(residual)
    options = TraceOptions(
        bounds={"lam": (-1.0, 3.0), "x": (-50.0, 1e300)}, max_points=400, backend=backend,
        step=StepControl(maximum=1e290, growth=10.0, target=1e300, max_correction=1e300, min_cosine=1e-3),
    ) if name == "overflow" else TraceOptions(bounds={"lam": (-1.0, 3.0)}, max_points=400, backend=backend)  # fmt: skip
    if name == "overflow":
        bvp = algebraic(residual, observables={"x0": end_value(lambda left, right, p: left.x)})
        options = replace(options, bounds={"lam": (-1.0, 3.0)})
    branch = trace(bvp, constant(bvp, start), ("lam",), options)
    assert branch.ends[0] is EndReason.RANGE
    assert len(branch) > 5
    if edge is not None:
        assert branch.ends[1] is EndReason.MIN_STEP
        assert branch.failures == (None, NewtonCode.NOT_FINITE)
        assert edge - 1e-3 < branch.points[-1].solution["lam"] < edge
    for point in branch:
        x, lam = point.solution.values[0, 0], point.solution["lam"]
        assert np.isfinite(x)
        assert abs(float(residual_at(residual, x, lam))) < 1e-6 * max(1.0, abs(x))


def residual_at(residual, x: float, lam: float) -> float:
    """The residual as plain numbers (NaN outside its domain)."""
    from types import SimpleNamespace

    with np.errstate(all="ignore"):
        return residual(SimpleNamespace(x=np.float64(x)), SimpleNamespace(lam=np.float64(lam)))[0]
