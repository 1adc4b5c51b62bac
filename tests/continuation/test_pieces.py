"""Any interval, breakpoints, and what jumps, holds or is measured inside: closed forms and published values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import iv, kv

from rodatlas.continuation import (
    BVP,
    EndReason,
    Inner,
    MeshControl,
    NewtonCode,
    Solution,
    Status,
    Symmetry,
    TraceOptions,
    end_value,
    follow_locus,
    image,
    integral_of,
    isotropy,
    other_solutions,
    solve,
    switch,
    trace,
    value_at,
)
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.mesh import halved

STEP = 0.3137


def zero(bvp: BVP, intervals: int = 20, **parameters: float) -> Solution:
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}, intervals
    )


# -- intervals --------------------------------------------------------------------------------------------------------


def fin(**more) -> BVP:
    """An annular fin, (r T')' = m^2 r T on (1, b), T(1) = 1, T'(b) = 0: modified Bessel functions."""
    return BVP(
        lambda r, u, p: [u.q, p.m**2 * u.T - u.q / r], lambda left, right, p: [left.T - 1, right.q],
        unknowns=("T", "q"), parameters={"m": 1.5, "b": 3.0}, interval=(1.0, "b"),
        observables={
            "mean": integral_of(lambda r, u, p: r * u.T), "tip": end_value(lambda left, right, p: right.T),
            "middle": value_at(2.0, lambda u, p: u.T),
        },
        **more,
    )  # fmt: skip


def fin_exact(r: float | np.ndarray, b: float, m: float = 1.5) -> np.ndarray:
    return (iv(0, m * r) * kv(1, m * b) + kv(0, m * r) * iv(1, m * b)) / (
        iv(0, m) * kv(1, m * b) + kv(0, m) * iv(1, m * b)
    )


def test_a_fin_on_an_interval_whose_end_is_a_parameter() -> None:
    bvp = fin()
    found = solve(bvp, zero(bvp), ("m",))
    assert found.interval == (1.0, 3.0)
    assert found.error < 1e-8
    np.testing.assert_allclose(found["T"], fin_exact(found.s, 3.0), atol=1e-9)
    places = np.linspace(1.0, 3.0, 41)
    np.testing.assert_allclose(found(places, "T"), fin_exact(places, 3.0), atol=1e-6)
    assert found["middle"] == pytest.approx(fin_exact(2.0, 3.0), abs=1e-9)
    assert found["mean"] == pytest.approx(-found["q"][0] / 1.5**2, abs=1e-9)  # heat in is heat out
    assert list(found.to_frame().columns) == ["s", "T", "q"]
    with pytest.raises(ValueError, match=r"s: expected places from 1 to 3, got 0\.5"):
        found(0.5)


def test_a_branch_in_the_length_and_a_zero_of_an_inner_value() -> None:
    bvp = fin()
    options = TraceOptions(bounds={"b": (2.2, 5.0)}, zeros={"middle": 0.18})
    branch = trace(bvp, zero(bvp), ("b",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    lengths = branch.column("b")
    np.testing.assert_allclose(branch.column("tip"), fin_exact(lengths, lengths), atol=1e-8)
    (zero_of,) = branch.special
    wanted = brentq(lambda b: fin_exact(2.0, b) - 0.18, 2.2, 5.0)
    assert zero_of.solution["b"] == pytest.approx(wanted, abs=1e-7)
    assert zero_of.solution.interval == (1.0, pytest.approx(wanted, abs=1e-7))
    ends = trace(bvp, zero(bvp), ("b",), TraceOptions(bounds={"middle": (0.17, 0.2)}))
    assert sorted(p.solution["middle"] for p in (ends.points[0], ends.points[-1])) == pytest.approx(
        [0.17, 0.2], abs=1e-10
    )


def test_the_interval_does_not_matter() -> None:
    """Bratu's problem on (-3, 5): lengths scale the parameter by 64; the arclength norm is the same."""

    def bratu(a: float, b: float) -> BVP:
        width = b - a
        return BVP(
            lambda s, u, p: [u.v / width, -p.lam * np.exp(u.u) / width], lambda left, right, p: [left.u, right.u],
            unknowns=("u", "v"), parameters={"lam": 0.0}, interval=(a, b),
            observables={"mean": integral_of(lambda s, u, p: u.u / width)},
        )  # fmt: skip

    options = TraceOptions(bounds={"lam": (0.0, 4.0), "mean": (-1, 3)})
    one, two = (trace(bvp, zero(bvp), ("lam",), options, both=False) for bvp in (bratu(0.0, 1.0), bratu(-3.0, 5.0)))
    assert one.special[0].solution["lam"] == pytest.approx(3.513830719125161, abs=1e-8)
    assert two.special[0].solution["lam"] == pytest.approx(3.513830719125161, abs=1e-8)
    np.testing.assert_allclose(one.column("arclength"), two.column("arclength"), rtol=1e-9)


def test_a_guess_in_relative_or_in_physical_places() -> None:
    bvp = fin()
    line = Solution.from_function(lambda s: np.column_stack([4 - s, -1 + 0 * s]), bvp.unknowns, bvp.parameters,
                                  interval=(1.0, 3.0))  # fmt: skip
    assert line(3.0, "T") == pytest.approx([1.0])
    table = Solution.from_values([1.0, 2.0, 3.0], [[1.0, 0], [0.2, 0], [0.1, 0]], bvp.unknowns, bvp.parameters)
    for guess in (line, table):
        assert solve(bvp, guess, ("m",))["tip"] == pytest.approx(fin_exact(3.0, 3.0), abs=1e-9)
    with pytest.raises(ValueError, match="interval: expected two numbers a < b"):
        Solution.from_function(lambda s: np.zeros((len(s), 2)), ("u", "v"), {}, interval=(2.0, 1.0))


# -- breakpoints ------------------------------------------------------------------------------------------------------


def column(breakpoint="step", pieces: bool = True, **more) -> BVP:
    """A pinned column y'' = -P sin(y)/EI whose stiffness jumps from 1 to 4."""
    soft, stiff = lambda s, u, p: [u.t, -p.P * np.sin(u.y)], lambda s, u, p: [u.t, -p.P * np.sin(u.y) / 4]
    return BVP(
        [soft, stiff] if pieces else lambda s, u, p: [u.t, -p.P * np.sin(u.y) / np.where(s < p.step, 1.0, 4.0)],
        lambda left, right, p: [left.y, right.y], unknowns=("y", "t"), parameters={"P": 15.0, "step": STEP},
        scales={"P": 20.0}, breakpoints=(breakpoint,), **more,
    )  # fmt: skip


def load(step: float, between: tuple[float, float] = (9.0, 40.0)) -> float:
    """tan(k a) + 2 tan(k (1 - a)/2) = 0 with k = sqrt(P): the two parts joined."""

    def mismatch(p: float) -> float:
        k = np.sqrt(p)
        left, right = k * step, k * (1 - step) / 2
        return float(np.sin(left) * np.cos(right) + 2 * np.sin(right) * np.cos(left))

    return float(brentq(mismatch, *between, xtol=1e-13))


@pytest.mark.parametrize("pieces", [True, False])
@pytest.mark.parametrize("at", [STEP, "step", lambda p: p.step], ids=["number", "name", "function"])
def test_a_jump_of_a_coefficient_on_the_mesh(at, pieces: bool) -> None:
    bvp = column(at, pieces)
    options = TraceOptions(bounds={"P": (15.0, 30.0)}, mesh=MeshControl(tolerance=1e-11))
    branch = trace(bvp, zero(bvp), ("P",), options, both=False)
    (point,) = branch.special
    assert point.status is Status.CONVERGED
    assert point.solution["P"] == pytest.approx(23.5725477, abs=5e-8)
    assert point.solution["P"] == pytest.approx(load(STEP), abs=1e-9)
    assert point.solution.intervals <= 40
    bent = switch(bvp, point, ("P",), options)
    for item in bent:
        assert np.abs(item.solution.s - STEP).min() == 0.0
        assert item.solution.intervals <= 60


def test_the_locus_of_a_buckling_load_as_the_step_moves() -> None:
    bvp = column("step")
    branch = trace(bvp, zero(bvp), ("P",), TraceOptions(bounds={"P": (15.0, 30.0)}), both=False)
    bounds = {"P": (9.0, 40.0), "step": (0.1, 0.9)}
    locus = follow_locus(bvp, branch.special[0], ("P", "step"), TraceOptions(bounds=bounds))
    assert locus.ends == (EndReason.RANGE, EndReason.RANGE)
    steps = [p.solution["step"] for p in locus.points]
    assert min(steps) == pytest.approx(0.1, abs=1e-9)
    assert max(steps) == pytest.approx(0.9, abs=1e-9)
    np.testing.assert_allclose([p.solution["P"] for p in locus.points], [load(s) for s in steps], rtol=1e-7)


def test_laws_that_are_defined_on_their_own_piece_only() -> None:
    """Elsewhere they give NaN, and so do their derivatives."""
    laws = [lambda s, u, p: [p.k * np.sqrt(0.5 - s) * u.y], lambda s, u, p: [p.k * np.sqrt(s - 0.5) * u.y]]
    bvp = BVP(laws, lambda left, right, p: [left.y - 1], unknowns=("y",), parameters={"k": 1.0}, breakpoints=(0.5,))
    branch = trace(bvp, zero(bvp), ("k",), TraceOptions(bounds={"k": (-1.0, 3.0)}))
    exact = np.exp(branch.column("k") * 4 / 3 * 0.5**1.5)
    np.testing.assert_allclose([p.solution["y"][-1] for p in branch], exact, rtol=1e-7)


def test_what_is_declared_and_changes_nothing() -> None:
    """A breakpoint and an inner value where all is smooth: the same points, lengths and normal form."""

    def pinned(**more) -> BVP:
        return BVP(
            lambda s, u, p: [u.t, -p.P * np.sin(u.y)], lambda left, right, p: [left.y, right.y],
            unknowns=("y", "t"), parameters={"P": 5.0}, scales={"P": 10.0}, **more,
        )  # fmt: skip

    options = TraceOptions(bounds={"P": (5.0, 45.0)}, mesh=MeshControl(tolerance=1e-10))
    plain, cut = (
        trace(bvp, zero(bvp), ("P",), options, both=False)
        for bvp in (pinned(), pinned(breakpoints=(0.3,), observables={"middle": value_at(0.5, lambda u, p: u.y)}))
    )
    for one, two, exact in zip(plain.special, cut.special, (np.pi**2, 4 * np.pi**2), strict=True):
        assert two.solution["P"] == pytest.approx(exact, rel=1e-9)
        assert two.normal_form.kind == one.normal_form.kind == "pitchfork"
        assert two.normal_form.bend == pytest.approx(one.normal_form.bend, rel=1e-6)
        assert two.arclength == pytest.approx(one.arclength, rel=1e-8)


def test_pieces_of_very_different_length() -> None:
    """u'' = -1 but for 1000 between 0.5 and 0.5001: slopes change by 0.1 there."""
    laws = [lambda s, u, p, f=f: [u.v, -f] for f in (1.0, 1000.0, 1.0)]
    bvp = BVP(laws, lambda left, right, p: [left.u, right.u], unknowns=("u", "v"), breakpoints=(0.5, 0.5001))
    found = solve(bvp, zero(bvp))
    change = found(0.5001, "v")[0] - found(0.5, "v")[0]
    assert change == pytest.approx(-0.1, rel=1e-9)
    assert found.intervals <= 20


@pytest.mark.parametrize("intervals", [10, 20, 40])
def test_breakpoints_stay_on_every_mesh(intervals: int) -> None:
    bvp = column("step", observables={"there": value_at(0.7, lambda u, p: u.y)})
    colloc = Collocation.at(bvp, zero(bvp, intervals), [0])
    knots = bvp.layout.knots
    assert len(knots) == 5  # 0, the step, both sides of 0.7, 1
    for mesh in (colloc.mesh, halved(colloc.mesh), np.linspace(0, 1, 8) ** 2, np.linspace(0, 1, 3)):
        assert np.isin(knots, colloc.on(mesh).mesh).all()
    assert colloc.on(np.linspace(0, 1, 8) ** 2).part.tolist().count(2) == 1  # one interval for an inner point
    assert abs(len(colloc.step) - intervals) <= 1  # three pieces that are equally wide share 20 - 1 evenly
    again = colloc.on(halved(colloc.mesh))
    np.testing.assert_array_equal(again.mesh[::2], colloc.mesh)


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


# -- inner points -----------------------------------------------------------------------------------------------------


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


def spring(at: float = 0.5, **more) -> BVP:
    """A pinned column w'''' + P w'' + w^3 = 0 with a spring of stiffness k: the shear force jumps by -k w."""
    return BVP(
        lambda s, u, p: [u.t, u.m, u.q, -p.P * u.m - 50 * u.w**3],
        lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"), parameters={"P": 5.0, "k": 100.0},
        scales={"P": 20.0, "k": 50.0, "t": 3.0, "m": 10.0, "q": 30.0},
        inner=[Inner(at, jumps=lambda u, p: {"q": -p.k * u.w})], **more,
    )  # fmt: skip


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


def lifted() -> BVP:
    """A heavy beam (EI = q = 1) on the floor, its end lifted by h: the length above the floor is (24 h)^(1/4)."""
    return BVP(
        lambda s, u, p: [u.t, u.m, u.q, -1.0 + 0 * u.w],
        lambda left, right, p: [left.w - p.h, left.m, right.w, right.t, right.m],
        unknowns=("w", "t", "m", "q"), parameters={"h": 0.01, "l": 1.0}, interval=(0.0, "l"),
    )  # fmt: skip


def test_an_unknown_length() -> None:
    bvp = lifted()
    branch = trace(bvp, zero(bvp), ("h", "l"), TraceOptions(bounds={"h": (0.01, 2.0)}), both=False)
    np.testing.assert_allclose(branch.column("l"), (24 * branch.column("h")) ** 0.25, rtol=1e-9)
    assert branch.points[-1].solution.interval[1] == pytest.approx(48**0.25, rel=1e-9)
    with pytest.raises(ValueError, match=r"5 boundary .* - 4 unknowns \+ 1"):
        trace(bvp, zero(bvp), ("h",))


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


@pytest.mark.parametrize(("kappa", "osmolarity"), [(2, 1.462), (3, 1.172), (4, 1.078), (5, 1.039)])
def test_a_three_point_problem(kappa: int, osmolarity: float) -> None:
    """Flow in a long membrane (Lin and Segel 1988, chapter 8), the multipoint example of bvp4c (Kierzenka 2001)."""
    n, length = 0.05, 2.0
    eta = length**2 / (n * kappa**2)
    bvp = BVP(
        lambda s, u, p: [(u.C - 1) / n, (u.v * u.C - np.minimum(s, 1.0)) / eta],
        lambda left, right, p: [left.v, right.C - 1], unknowns=("v", "C"), interval=(0.0, length), breakpoints=(1.0,),
    )  # fmt: skip
    guess = Solution.from_function(lambda s: np.ones((len(s), 2)), bvp.unknowns, {})
    assert 1 / solve(bvp, guess)["v"][-1] == pytest.approx(osmolarity, abs=5e-4)


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


def test_places_are_saved(tmp_path: Path) -> None:
    bvp = fin()
    branch = trace(bvp, zero(bvp), ("b",), TraceOptions(max_points=3), both=False)
    branch.save(tmp_path / "fin.h5")
    again = type(branch).load(tmp_path / "fin.h5")
    for old, new in zip(branch, again, strict=True):
        np.testing.assert_array_equal(new.solution.places, old.solution.places)
        assert new.solution(2.0, "T") == old.solution(2.0, "T")


# -- wrong input ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"interval": (0.0,)}, r"interval: expected the two ends \(a, b\), got \(0.0,\)"),
        ({"interval": "ab"}, "interval: expected a sequence of places, got 'ab'"),
        ({"interval": (1.0, 0.0)}, "interval, breakpoints, inner: expected distinct places between the ends"),
        ({"interval": (0.0, "length")}, "interval: expected a number or one of lam, c, got 'length'"),
        ({"breakpoints": (0.5, np.nan)}, "breakpoints: expected numbers, names of parameters or functions"),
        ({"breakpoints": (1.5,)}, "expected distinct places between the ends .* got 0, 1.5, 1"),
        ({"breakpoints": (0.3, "c")}, "expected distinct places"),
        ({"breakpoints": 0.5}, "breakpoints: expected a sequence of places, got 0.5"),
        ({"inner": [0.5]}, r"inner: expected a sequence of Inner\(at, jumps, conditions\)"),
        ({"inner": [Inner(0.5, jumps=lambda u, p: {"w": 1.0})]}, "jumps: expected a mapping with some of u, v"),
        ({"inner": [Inner(0.5, jumps=lambda u, p: [1.0])]}, "jumps: expected a mapping with some of u, v"),
        ({"inner": [Inner(0.5, jumps=lambda u, p: {"v": u.v})]}, "jumps: expected .* make the jump a free parameter"),
        ({"inner": [Inner(0.5, jumps=lambda u, p: {"v": 1.0})] * 2}, "inner: expected one Inner for each place"),
        (
            {"inner": [Inner(at, jumps=lambda u, p: {"v": 1.0}) for at in ("c", lambda p: p.c)]},
            "inner: expected one Inner for each place",
        ),
        ({"inner": [Inner(0.5, conditions=lambda left, right, p: [left.u] * 3)]}, "2 unknowns and 3 inner conditions"),
        ({"observables": {"x": value_at(0.0, lambda u, p: u.u)}}, "expected distinct places"),
        ({"rhs": [lambda s, u, p: [u.v, u.u]] * 2}, "rhs: expected one function or 1, one per piece, got 2"),
        ({"log": ("mu",)}, "log: expected some of lam, c, got 'mu'"),
        ({"log": ("lam",), "parameters": {"lam": 0.0, "c": 0.3}}, "log: expected a positive value of 'lam', got 0"),
    ],
)  # fmt: skip
def test_wrong_places_are_refused(more: dict, message: str) -> None:
    given = {"rhs": lambda s, u, p: [u.v, -p.lam * u.u], "parameters": {"lam": 1.0, "c": 0.3}} | more
    with pytest.raises(ValueError, match=message) as caught:
        BVP(given.pop("rhs"), lambda left, right, p: [left.u, right.u], unknowns=("u", "v"), **given)
    assert "\n" not in str(caught.value)


def test_wrong_inner_points_are_refused() -> None:
    with pytest.raises(ValueError, match="inner: expected jumps or conditions, got neither"):
        Inner(0.5)
    with pytest.raises(ValueError, match=r"jumps: expected a function, got 1\.0"):
        Inner(0.5, jumps=1.0)
    with pytest.raises(ValueError, match="side: expected 'left' or 'right', got 'middle'"):
        value_at(0.5, lambda u, p: u.u, side="middle")
    with pytest.raises(ValueError, match="side: expected 'left' or 'right', got 'up'"):
        solve(fin(), zero(fin()), ("m",))(2.0, "T", side="up")
