"""Any interval and breakpoints: closed forms and published values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from place_problems import fin, fin_exact, zero
from scipy.optimize import brentq

from rodatlas.continuation import (
    BVP,
    EndReason,
    Inner,
    MeshControl,
    Solution,
    Status,
    TraceOptions,
    follow_locus,
    integral_of,
    solve,
    switch,
    trace,
    value_at,
)
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import halved

STEP = 0.3137


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
