"""Runs that start exactly at a zero or an extremum: it is one of their special points, once, whichever way they go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, bratu, circle, constant, pitchfork

from rodatlas.continuation import (
    BVP,
    Branch,
    EndReason,
    Locus,
    SpecialPoint,
    Status,
    StepControl,
    TraceOptions,
    end_value,
    follow_locus,
    solve,
    switch,
    switch_all,
    trace,
)

WAYS = [(True, 1.0), (False, 1.0), (False, -1.0)]


def names(run: Branch | Locus) -> list[str]:
    """What lies at the start of a run."""
    found = run.special if isinstance(run, Branch) else run.events
    at_start = [x for x in found if abs(x.arclength) < 1e-6]
    assert all(x.status is Status.CONVERGED for x in at_start)
    return sorted(x.kind if isinstance(x, SpecialPoint) else f"{x.kind} {x.parameter}".strip() for x in at_start)


@pytest.mark.parametrize(("both", "direction"), WAYS)
@pytest.mark.parametrize("low", [-0.9, -2.0])
def test_a_zero_and_an_extremum_at_the_start_of_a_branch(both: bool, direction: float, low: float) -> None:
    """At lam = 0 of the circle x is largest; the whole circle meets both again, at the other side."""
    bvp = circle()
    options = TraceOptions(zeros={"lam": 0.0, "x0": 1.0}, extrema=("x0",), bounds={"x0": (low, 2.0)})
    branch = trace(bvp, constant(bvp, [1.0]), ("lam",), options, both=both, direction=direction)
    assert names(branch) == ["extremum of x0", "zero of lam", "zero of x0"]
    assert branch.of_kind("extremum of x0")[0].normal_form.kind == "maximum"
    assert branch.closed == (low == -2.0)
    for kind in ("zero of lam", "extremum of x0"):
        assert len(branch.of_kind(kind)) == 1 + branch.closed
    assert len(branch.of_kind("zero of x0")) == 1
    assert branch.verification.complete


@pytest.mark.parametrize(("both", "direction"), WAYS)
def test_a_start_that_was_solved_for(both: bool, direction: float) -> None:
    """The value is met up to round-off of either sign."""
    start = solve(bratu(), constant(bratu(), lam=2.0))
    zeros = {"mean": start["mean"], "slope": start["slope"], "lam": 2.0}
    options = TraceOptions(zeros=zeros, bounds={"lam": (0.0, 3.6), "mean": (-1.0, 0.7)})
    branch = trace(bratu(), start, ("lam",), options, both=both, direction=direction)
    assert names(branch) == ["zero of lam", "zero of mean", "zero of slope"]
    assert len(branch.special) == 3


@pytest.mark.parametrize(("both", "direction"), WAYS)
def test_an_inflection_and_a_constant_at_the_start_are_no_extrema(both: bool, direction: float) -> None:
    observables = {"x0": end_value(lambda left, right, p: left.x), "none": end_value(lambda left, right, p: 0 * left.x)}
    bvp = algebraic(lambda u, p: [u.x - p.lam**3], observables=observables)
    options = TraceOptions(zeros={"x0": 0.0, "none": 0.0}, extrema=("x0", "none"), bounds={"lam": (-1.0, 1.0)})
    branch = trace(bvp, constant(bvp), ("lam",), options, both=both, direction=direction)
    assert [x.kind for x in branch.special] == ["zero of x0"]


@pytest.mark.parametrize(("both", "direction"), WAYS)
@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-9, 1e-7])
def test_a_branch_point_at_the_start(both: bool, direction: float, off: float) -> None:
    """Euler's first load, given by its formula: the determinant vanishes there and changes sign on no step."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.sin(u.u)], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 1.0}, scales={"lam": 10.0},
    )  # fmt: skip
    options = TraceOptions(bounds={"lam": (1.0, 20.0)}, stop_at=lambda special, last: True)
    start = constant(bvp, lam=np.pi**2 * (1 + off))
    branch = trace(bvp, start, ("lam",), options, both=both, direction=direction)
    assert names(branch) == ["branch point"]
    (point,) = branch.special
    assert point.solution["lam"] == pytest.approx(np.pi**2, abs=1e-7)
    assert point.normal_form.kind == "pitchfork"
    assert branch.ends[1] is EndReason.RANGE
    assert len(switch_all(bvp, point, ("lam",), options)) == 2


@pytest.mark.parametrize(("both", "direction"), WAYS)
def test_a_double_branch_point_at_the_start(both: bool, direction: float) -> None:
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2), u.y * (p.lam - 2 * u.y**2)], unknowns=("x", "y"))
    options = TraceOptions(bounds={"lam": (-0.5, 0.5)})
    branch = trace(bvp, constant(bvp), ("lam",), options, both=both, direction=direction)
    assert [x.multiplicity for x in branch.special] == [2]
    assert len(branch.special[0].rays) == 2 + 8


@pytest.mark.parametrize(("both", "direction"), WAYS)
@pytest.mark.parametrize("steepness", [1.0, 1e-3])
def test_folds_at_the_start(both: bool, direction: float, steepness: float) -> None:
    """lam = c x^2 + x^3 has folds at x = 0, where no round-off gives the slope a sign, and at x = -2c/3."""
    bvp = algebraic(lambda u, p: [p.lam - steepness * u.x**2 - u.x**3])
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, max_folds=1)
    branch = trace(bvp, constant(bvp), ("lam",), options, both=both, direction=direction)
    folds = sorted(float(x.solution["x"][0]) for x in branch.of_kind("fold"))
    assert folds == pytest.approx([-2 * steepness / 3, 0.0] if len(folds) == 2 else [0.0], abs=1e-9)
    assert len(folds) == 2 or not both
    assert branch.verification.complete


@pytest.mark.parametrize(("both", "direction"), WAYS)
def test_an_index_at_a_singular_start_is_not_compared(both: bool, direction: float) -> None:
    """At the pitchfork itself the index is that of neither side."""
    bvp = pitchfork()
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, index=lambda x: int(x["lam"] > 3 * x["x"][0] ** 2))
    branch = trace(bvp, constant(bvp), ("lam",), options, both=both, direction=direction)
    assert branch.discrepancies == ()
    sides = (0, 1) if direction > 0 else (1, 0)
    assert [x.index for x in branch.special] == [sides if both else (None, sides[1])]


@pytest.mark.parametrize(("both", "direction"), WAYS)
@pytest.mark.parametrize("power", [3, 5])
def test_an_inflection_at_the_start_is_no_fold(both: bool, direction: float, power: int) -> None:
    bvp = algebraic(lambda u, p: [p.lam - u.x**power])
    branch = trace(
        bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=both, direction=direction
    )
    assert branch.special == ()


def test_a_closed_branch_that_starts_at_a_fold() -> None:
    bvp = circle()
    branch = trace(bvp, constant(bvp, lam=1.0), ("lam",))
    assert branch.closed
    assert [x.solution["lam"] for x in branch.special] == pytest.approx([1.0, -1.0], abs=1e-12)


def test_a_run_does_not_stop_where_it_starts() -> None:
    bvp = circle()
    options = TraceOptions(zeros={"lam": 0.0}, stop_at=lambda special, last: special.is_zero)
    branch = trace(bvp, constant(bvp, [1.0]), ("lam",), options, both=False)
    assert branch.ends[1] is EndReason.STOPPED
    np.testing.assert_allclose([x.solution["x0"] for x in branch.of_kind("zero of lam")], [1.0, -1.0], atol=1e-10)


def parabola() -> BVP:
    """lam = mu^2 + x^2, with what is even, odd, and flat in mu on its folds x = 0, lam = mu^2."""
    return algebraic(
        lambda u, p: [p.lam - p.mu**2 - u.x**2], parameters=("lam", "mu"),
        observables={name: end_value(lambda left, right, p, power=power: p.mu**power + 0 * left.x)
                     for name, power in (("odd", 1), ("even", 2), ("flat", 3))},
    )  # fmt: skip


@pytest.mark.parametrize("both", [True, False])
def test_zeros_and_extrema_at_the_start_of_a_locus(both: bool) -> None:
    bvp = parabola()
    box = TraceOptions(bounds={"lam": (-1.0, 2.0)})
    fold = trace(bvp, constant(bvp, [1.0], lam=1.0), ("lam",), box).of_kind("fold")[0]
    zeros = {"mu": 0.0, "odd": 0.0, "flat": 0.0}
    options = TraceOptions(bounds={"mu": (-1.0, 1.0)}, zeros=zeros, extrema=("even", "odd", "flat"))
    locus = follow_locus(bvp, fold, ("lam", "mu"), options, both=both)
    assert names(locus) == ["extremum even", "extremum lam", "zero of flat", "zero of mu", "zero of odd"]
    assert len(locus.events) == 5
    assert {e.what for e in locus.of_kind("extremum") if e.parameter == "even"} == {"a minimum of even along the locus"}


@pytest.mark.parametrize("both", [True, False])
def test_a_closed_locus_meets_its_start_once(both: bool) -> None:
    bvp = algebraic(lambda u, p: [p.lam**2 + p.mu**2 - 1 - u.x**2], parameters=("lam", "mu"))
    box = TraceOptions(bounds={"lam": (0.5, 2.0)})
    fold = trace(bvp, constant(bvp, [1.0], lam=np.sqrt(2)), ("lam",), box).of_kind("fold")[0]
    locus = follow_locus(bvp, fold, ("lam", "mu"), TraceOptions(zeros={"mu": 0.0}), both=both)
    assert locus.closed
    np.testing.assert_allclose([e.solution["lam"] for e in locus.of_kind("zero of mu")], [1.0, -1.0], atol=1e-8)
    assert len(locus.of_kind("extremum")) == 4


@pytest.mark.parametrize("side", [1, -1])
def test_the_first_step_from_a_branch_point_is_searched(side: int) -> None:
    """Before the first state beyond it, at a distance of 0.02, and the branch point itself."""
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2)],
        observables={"x0": end_value(lambda left, right, p: left.x),
                     "bump": end_value(lambda left, right, p: (left.x - side * 0.01) ** 2)},
    )  # fmt: skip
    (point,) = trace(bvp, constant(bvp, lam=-0.5), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)})).special
    levels = [0.0, *(side * level for level in (0.005, 0.01, 0.03))]
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, zeros={"x0": levels}, extrema=("bump",))
    branch = switch(bvp, point, ("lam",), options, side=side)
    assert branch is not None
    np.testing.assert_allclose([x.solution["x0"] for x in branch.of_kind("zero of x0")], levels, atol=1e-12)
    (least,) = branch.of_kind("extremum of bump")
    assert abs(least.solution["x0"]) == pytest.approx(0.01, abs=1e-9)
    places = [x.arclength for x in branch.special]
    assert places == sorted(places)
    assert places[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_a_fold_close_to_the_branch_point_is_found(side: int) -> None:
    """x (lam - a x - x^2) = 0: the other branch turns at x = -a/2, closer than the first step is long."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam + 0.01 * u.x - u.x**2)])
    (point,) = trace(bvp, constant(bvp, lam=-0.5), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)})).special
    box = TraceOptions(bounds={"lam": (-1.0, 0.5)}, step=StepControl(initial=0.02))
    branches = [switch(bvp, point, ("lam",), box, side=sign) for sign in (side, -side)]
    folds = [x for branch in branches for x in branch.of_kind("fold")]
    assert [x.solution["lam"] for x in folds] == pytest.approx([-2.5e-5], abs=1e-12)
    assert folds[0].solution["x"][0] == pytest.approx(0.005, abs=1e-9)


def test_a_branch_may_end_on_its_first_step() -> None:
    bvp = algebraic(lambda u, p: [u.x * (p.lam + 0.01 * u.x - u.x**2)])
    box = TraceOptions(bounds={"lam": (-1.0, 0.5)})
    (point,) = trace(bvp, constant(bvp, lam=-0.5), ("lam",), box).special
    sides = [switch(bvp, point, ("lam",), replace(box, max_folds=0), side=side) for side in (1, -1)]
    (short,) = [side for side in sides if side.of_kind("fold")]
    assert short.ends == (EndReason.BRANCH_POINT, EndReason.FOLD_LIMIT)
    assert short.points[-1].solution["lam"] == pytest.approx(-2.5e-5, abs=1e-12)
    stopping = replace(box, zeros={"lam": 1e-6}, stop_at=lambda special, last: special.is_zero)
    stopped = [switch(bvp, point, ("lam",), stopping, side=side) for side in (1, -1)]
    assert {side.ends for side in stopped} == {(EndReason.BRANCH_POINT, EndReason.STOPPED)}
    assert [side.points[-1].solution["lam"] for side in stopped] == pytest.approx([1e-6, 1e-6], rel=1e-9)


def test_a_side_branch_of_a_pitchfork_has_no_fold_at_its_start() -> None:
    bvp = pitchfork()
    box = TraceOptions(bounds={"lam": (-1.0, 1.0)})
    (point,) = trace(bvp, constant(bvp, lam=-0.5), ("lam",), box).special
    for side in (1, -1):
        assert switch(bvp, point, ("lam",), box, side=side).special == ()
