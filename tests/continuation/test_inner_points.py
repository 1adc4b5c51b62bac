"""What jumps, holds or is measured at places inside the interval: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from place_problems import fin, fin_exact, spring, zero
from scipy.linalg import expm
from scipy.optimize import brentq

from rodatlas.continuation import (
    BVP,
    EndReason,
    Inner,
    NewtonCode,
    Solution,
    Symmetry,
    TraceOptions,
    end_value,
    follow_locus,
    image,
    isotropy,
    other_solutions,
    solve,
    switch,
    trace,
    value_at,
)
from rodatlas.continuation.discrete.collocation import Collocation, Scale


@pytest.mark.parametrize("name", ["mean", "tip", "middle"])
def test_the_value_of_an_observable_as_a_parameter(name: str) -> None:
    """Of each kind, on an interval whose length is another free parameter: the same branch, with its value."""
    bvp = fin().with_value_of(name, "value")
    start = solve(bvp, zero(bvp), ("m", "value"))
    assert start["value"] == pytest.approx(start[name], abs=1e-10)
    longer = trace(bvp, start, ("value", "b"), TraceOptions(max_points=8), both=False)
    np.testing.assert_allclose(longer.column("value"), longer.column(name), atol=1e-9)
    assert abs(longer.points[-1].solution["b"] - 3.0) > 0.05
    if name == "middle":
        lengths = longer.column("b")
        np.testing.assert_allclose(longer.column("value"), fin_exact(2.0, lengths), atol=1e-8)


def test_a_beam_with_a_point_load() -> None:
    """EI = 1, length 2, load 1 at a third: w = a^2 b^2/(3 L) under it, shear forces by the lever."""
    length, a = 2.0, 2.0 / 3.0
    bvp = BVP(
        lambda s, u, p: [u.t, u.m, u.q, 0.0 * u.w], lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"), parameters={"P": 1.0}, interval=(0.0, length),
        inner=[Inner(a, jumps=lambda u, p: {"q": p.P})],
        observables={
            "under": value_at(a, lambda u, p: u.w), "before": value_at(a, lambda u, p: u.q, side="left"),
            "behind": value_at(a, lambda u, p: u.q),
        },
    )  # fmt: skip
    found = solve(bvp, zero(bvp))
    b = length - a
    assert found["under"] == pytest.approx(a**2 * b**2 / (3 * length), rel=1e-12)
    assert (found["before"], found["behind"]) == pytest.approx((-b / length, a / length), rel=1e-12)
    assert found(a, "q", side="left") == pytest.approx([-b / length])
    assert found(a, "q") == pytest.approx([a / length])
    at = found.to_frame()
    assert list(at["q"][np.asarray(at["s"]) == a]) == pytest.approx([-b / length, a / length])


@pytest.mark.parametrize("seed", range(6))
def test_random_linear_problems_with_jumps(seed: int) -> None:
    """u' = A u + b on pieces of random length; jumps of two unknowns by c + k u_0. Against matrix exponentials."""
    rng = np.random.default_rng(seed)
    n, cuts = 3, np.sort(rng.uniform(-0.9, 1.9, 3))
    a, b = rng.normal(size=(4, n, n)), rng.normal(size=(4, n))
    c, k = rng.normal(size=(3, 2)), rng.normal(size=(3, 2))
    left, right = rng.normal(size=(2, n)), rng.normal(size=n)
    bvp = BVP(
        [lambda s, u, p, i=i: [a[i, j] @ np.array(list(u)) + b[i, j] for j in range(n)] for i in range(4)],
        lambda one, two, p: [sum(w * x for w, x in zip(row, end, strict=True)) - 1
                             for row, end in ((left[0], one), (left[1], one), (right, two))],
        unknowns=("u", "v", "w"), interval=(-1.0, 2.0),
        inner=[
            Inner(float(at), jumps=lambda u, p, c=c, k=k: {"v": c[0] + k[0] * u.u, "w": c[1] + k[1] * u.u})
            for at, c, k in zip(cuts, c, k, strict=True)
        ],
    )  # fmt: skip
    found = solve(bvp, Solution.from_function(lambda s: np.zeros((len(s), n)), bvp.unknowns, {}))
    through, at = np.eye(n + 1), [-1.0, *cuts, 2.0]
    for i in range(4):
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = a[i], b[i]
        through = expm(whole * (at[i + 1] - at[i])) @ through
        if i < 3:
            jump = np.eye(n + 1)
            jump[1:n, n], jump[1:n, 0] = c[i], k[i]
            through = jump @ through
    rows = np.vstack([left, right @ through[:n, :n]])
    start = np.linalg.solve(rows, [1.0, 1.0, 1.0 - right @ through[:n, n]])
    size = max(1.0, np.abs(found.values).max())
    np.testing.assert_allclose(found.values[0], start, atol=1e-7 * size)
    np.testing.assert_allclose(found.values[-1], through[:n, :n] @ start + through[:n, n], atol=1e-7 * size)
    frame = found.to_frame()
    assert [list(frame["s"]).count(s) for s in cuts] == [2, 2, 2]


def test_an_elastic_support_turns_into_a_rigid_one() -> None:
    """The first mode has one half wave below k = 16 pi^2 and two above, at P = 4 pi^2 (Timoshenko and Gere)."""
    bvp = spring()
    branch = trace(bvp, zero(bvp), ("P",), TraceOptions(bounds={"P": (5.0, 100.0)}), both=False)
    first, second = (x.solution["P"] for x in branch.special[:2])
    assert first == pytest.approx(symmetric_load(100.0), rel=1e-8)
    assert second == pytest.approx(4 * np.pi**2, rel=2e-8)
    bounds = {"P": (5.0, 60.0), "k": (0.0, 300.0)}
    locus = follow_locus(bvp, branch.special[0], ("P", "k"), TraceOptions(bounds=bounds))
    (event,) = locus.events
    assert event.kind == "crossing"
    assert event.solution["k"] == pytest.approx(16 * np.pi**2, rel=1e-7)
    assert event.solution["P"] == pytest.approx(4 * np.pi**2, rel=1e-7)
    low = min(locus.points, key=lambda p: p.solution["k"]).solution
    assert low["P"] == pytest.approx(np.pi**2, rel=1e-7)


def symmetric_load(k: float) -> float:
    """Half the column: w = A sin(cs) + B s with w' = 0 and w''' = k w/2 in the middle."""

    def det(p: float) -> float:
        c = np.sqrt(p)
        return float(
            np.linalg.det([[c * np.cos(c / 2), 1.0], [-(c**3) * np.cos(c / 2) - k / 2 * np.sin(c / 2), -k / 4]])
        )

    return float(brentq(det, 10.0, 39.0, xtol=1e-12))


def test_a_string_over_an_obstacle() -> None:
    """A string from (0, 0) to (4, 0) over the parabola h - (s - 2)^2 touches it from sqrt(4 - h) on.

    Three pieces with two laws: straight, along the obstacle, straight; both ends of the contact are unknown.
    """
    straight, along = lambda s, u, p: [u.v, 0.0 * u.u], lambda s, u, p: [u.v, -2.0 + 0 * u.u]
    bvp = BVP(
        [straight, along, straight], lambda left, right, p: [left.u, right.u], unknowns=("u", "v"),
        parameters={"h": 1.0, "c": 1.5, "d": 2.2}, interval=(0.0, 4.0), breakpoints=("d",),
        inner=[Inner("c", conditions=lambda left, right, p: [left.u - p.h + (p.c - 2) ** 2, right.v + 2 * (p.c - 2)])],
    )  # fmt: skip
    branch = trace(bvp, zero(bvp), ("h", "c", "d"), TraceOptions(bounds={"h": (0.5, 3.0)}))
    h = branch.column("h")
    np.testing.assert_allclose(branch.column("c"), np.sqrt(4 - h), rtol=1e-9)
    np.testing.assert_allclose(branch.column("d"), 4 - np.sqrt(4 - h), rtol=1e-9)
    last = branch.points[-1].solution
    assert last(2.0, "u") == pytest.approx([last["h"]], abs=1e-9)
    with pytest.raises(ValueError, match=r"start: expected parameters at which .* order, got the places 0, 2\.5, 2, 4"):
        solve(bvp, zero(bvp, c=2.5, d=2.0), ("h", "c", "d"))
    gone = trace(bvp, zero(bvp), ("h", "c", "d"), TraceOptions(bounds={"h": (-3.0, 3.0)}))
    assert EndReason.MIN_STEP in gone.ends  # no contact is left at h = 0, c = d = 2
    assert NewtonCode.NOT_FINITE in gone.failures
    assert min(gone.column("h")) == pytest.approx(0.0, abs=1e-4)


def test_a_law_between_both_sides_of_a_jump() -> None:
    """A ball dropped from h = 1 (g = 1) returns e^2 h high: its speed is reversed at an unknown time."""
    bvp = BVP(
        lambda s, u, p: [u.v, -1.0 + 0 * u.x], lambda left, right, p: [left.x - 1, left.v, right.v],
        unknowns=("x", "v"), parameters={"e": 0.5, "T": 1.5, "J": 1.0, "end": 2.5}, interval=(0.0, "end"),
        inner=[Inner("T", jumps=lambda u, p: {"v": p.J},
                     conditions=lambda left, right, p: [left.x, right.v + p.e * left.v])],
        observables={"highest": end_value(lambda left, right, p: right.x)},
    )  # fmt: skip
    branch = trace(bvp, zero(bvp), ("e", "T", "J", "end"), TraceOptions(bounds={"e": (0.2, 0.9)}))
    e, root = branch.column("e"), np.sqrt(2)
    np.testing.assert_allclose(branch.column("highest"), e**2, rtol=1e-8)
    np.testing.assert_allclose(branch.column("T"), root, rtol=1e-8)
    np.testing.assert_allclose(branch.column("J"), root * (1 + e), rtol=1e-8)
    np.testing.assert_allclose(branch.column("end"), root * (1 + e), rtol=1e-8)


def test_a_symmetric_problem_keeps_a_symmetric_mesh() -> None:
    """A column on a spring in its middle, reversed: buckling modes are symmetric and antisymmetric in turn."""
    mirror = Symmetry("mirror", {"w": -1, "t": -1, "m": -1, "q": -1})
    turned = Symmetry("turned around", {"t": -1, "q": -1}, reverse=True)
    bvp = spring(symmetries=[mirror, turned])
    options = TraceOptions(bounds={"P": (5.0, 100.0)}, within=("turned around",))
    branch = trace(bvp, zero(bvp), ("P",), options, both=False)
    assert [x.breaks for x in branch.special][:2] == [("mirror",), ("mirror", "turned around")]
    bent = switch(bvp, branch.special[0], ("P",), TraceOptions(max_points=4, bounds={"P": (5.0, 100.0)}))
    state = bent.points[-1].solution
    assert isotropy(bvp, state) == ("turned around",)
    np.testing.assert_allclose(image(bvp, "turned around", state)(0.2), state(0.2), atol=1e-6)
    with pytest.raises(ValueError, match="'turned around' does not respect the equation for"):
        spring(at=0.4, symmetries=[turned])


def test_both_backends_agree_on_jumps() -> None:
    bvp = spring()
    loads = [
        [x.solution["P"] for x in trace(bvp, zero(bvp), ("P",), TraceOptions(bounds={"P": (5.0, 45.0)}, backend=name),
                                        both=False).special]
        for name in ("numba", "scipy")
    ]  # fmt: skip
    assert len(loads[0]) == 2
    np.testing.assert_allclose(loads[0], loads[1], rtol=1e-9)


def test_derivatives_of_a_problem_with_all_of_it() -> None:
    """Each column of the Jacobian, and the gradient of w F' v, against differences."""
    bvp = BVP(
        [lambda s, u, p: [u.v, -p.P * np.sin(u.y) * s], lambda s, u, p: [u.v * p.R, -p.P * u.y**2 / (1 + s)]],
        lambda left, right, p: [left.y - p.R, right.y * right.v], lambda s, u, p: u.y * s - p.P,
        unknowns=("y", "v"), parameters={"P": 0.7, "R": 0.4, "c": 0.6, "L": 1.7}, interval=(-0.2, "L"), log=("L",),
        inner=[Inner("c", jumps=lambda u, p: {"v": p.R * u.y**2},
                     conditions=lambda left, right, p: [left.v * right.v - p.P, right.y**2])],
        observables={"there": value_at(lambda p: p.c, lambda u, p: u.v**2 * p.R)},
    )  # fmt: skip
    rng = np.random.default_rng(5)
    start = Solution.from_function(lambda s: np.column_stack([np.cos(s), np.sin(s)]), bvp.unknowns, bvp.parameters, 6)
    colloc = Collocation(bvp, start.mesh, 3, start.parameters, [0, 1, 2, 3], Scale(np.array([2.0, 0.5]), np.ones(4)))
    x = colloc.state(start)
    v, h = type(x)(*(rng.normal(size=a.shape) for a in (x.stage, x.mesh, x.scalars))), 1e-6

    def moved(by: float, at=x):
        return type(x)(*(a + by * b for a, b in zip(vars(at).values(), vars(v).values(), strict=True)))

    lin, plus, minus = (colloc.linearize(y) for y in (x, moved(h), moved(-h)))
    numeric = [
        (a - b) / (2 * h) for a, b in zip(vars(plus.residual).values(), vars(minus.residual).values(), strict=True)
    ]
    ends = lin.b_left @ v.mesh[0] + lin.b_right @ v.mesh[-1] + lin.b_scal @ v.scalars
    dense = np.tensordot(lin.dense, v.stage, axes=3) + lin.dense_scal @ v.scalars
    np.testing.assert_allclose(numeric[2], ends, atol=1e-7)
    np.testing.assert_allclose(numeric[3], dense, atol=1e-6)
    weights = type(lin.residual)(*(rng.normal(size=a.shape) for a in vars(lin.residual).values()))
    gradient = colloc.second(x, v, weights)

    def product(y) -> float:
        ahead, behind = (vars(colloc.linearize(moved(by, y)).residual).values() for by in (1e-4, -1e-4))
        parts = zip(vars(weights).values(), ahead, behind, strict=True)
        return sum(float(np.vdot(w, (a - b) / 2e-4)) for w, a, b in parts)

    for i in range(4):
        unit = np.eye(4)[i] * 1e-4
        up, down = (product(type(x)(x.stage, x.mesh, x.scalars + sign * unit)) for sign in (1, -1))
        assert (up - down) / 2e-4 == pytest.approx(gradient.scalars[i], rel=1e-4, abs=1e-4)
    _, row = colloc.observable_row("there", x)
    ahead, behind = (colloc.observable_row("there", moved(by))[0] for by in (h, -h))
    slope = (ahead - behind) / (2 * h)
    assert slope == pytest.approx(row.dot(v), rel=1e-6)


def test_other_solutions_of_a_problem_with_a_jump() -> None:
    bvp = spring()
    options = TraceOptions(bounds={"P": (5.0, 100.0)})
    flat = solve(bvp, zero(bvp, P=33.0), ("P",), options)
    found = other_solutions(bvp, [flat], options=options, limit=2)
    assert len(found) == 2  # beyond 29.3 the column bends to either side
    assert found[0](0.5, "w") == pytest.approx(-found[1](0.5, "w"), abs=1e-7)


def test_wrong_inner_points_are_refused() -> None:
    with pytest.raises(ValueError, match="inner: expected jumps or conditions, got neither"):
        Inner(0.5)
    with pytest.raises(ValueError, match=r"jumps: expected a function, got 1\.0"):
        Inner(0.5, jumps=1.0)
    with pytest.raises(ValueError, match="side: expected 'left' or 'right', got 'middle'"):
        value_at(0.5, lambda u, p: u.u, side="middle")
    with pytest.raises(ValueError, match="side: expected 'left' or 'right', got 'up'"):
        solve(fin(), zero(fin()), ("m",))(2.0, "T", side="up")
