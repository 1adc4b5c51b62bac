"""Test functions and location of events on problems small enough to be solved on paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, bratu, circle, constant, elastica, kinds, pitchfork

from rodatlas.continuation import (
    BVP,
    EndReason,
    MeshControl,
    NewtonCode,
    NewtonOptions,
    NotConverged,
    Solution,
    Status,
    StepControl,
    TraceOptions,
    solve,
    switch,
    trace,
)
from rodatlas.continuation.curve.point import first_frame
from rodatlas.continuation.curve.walker import Walker

BOX = TraceOptions(bounds={"lam": (-1.0, 1.0)}, step=StepControl(maximum=0.1))


def test_a_circle_is_closed_and_has_two_folds() -> None:
    branch = trace(circle(), constant(circle(), [1.0]), ("lam",), TraceOptions(zeros={"x0": 0.6}))
    assert branch.closed
    assert branch.ends == (EndReason.CLOSED, EndReason.CLOSED)
    assert sorted(kinds(branch)) == ["fold", "fold", "zero of x0", "zero of x0"]
    np.testing.assert_allclose(sorted(x.solution["lam"] for x in branch.of_kind("fold")), [-1, 1], atol=1e-12)
    np.testing.assert_allclose(sorted(x.solution["lam"] for x in branch.of_kind("zero of x0")), [-0.8, 0.8], atol=1e-9)
    np.testing.assert_allclose(branch.points[-1].solution.values, branch.points[0].solution.values)
    assert branch.points[-1].arclength == pytest.approx(2 * np.pi, rel=1e-3)


def test_the_fold_knows_its_curvature_and_precision() -> None:
    branch = trace(circle(), constant(circle(), [1.0]), ("lam",), TraceOptions(bounds={"x0": (-0.5, 1.5)}))
    assert len(branch.of_kind("fold")) == 2
    for fold in branch.of_kind("fold"):
        assert fold.status is Status.CONVERGED
        assert fold.residual < 1e-9
        assert fold.curvature == pytest.approx(-np.sign(fold.solution["lam"]), abs=1e-9)  # lam = 1 - x^2/2
        assert fold.bracket[0] < fold.arclength < fold.bracket[1]
        assert fold.tests[0] * fold.tests[1] < 0
        assert np.sign(fold.tests[0]) == np.sign(fold.solution["lam"])  # rises before a maximum, along the branch
        assert fold.label == "LP"


def test_a_helix_that_passes_close_to_its_start_is_not_closed() -> None:
    pitch = 0.01
    helix = algebraic(
        lambda u, p: [u.x - np.cos(2 * np.pi * p.lam / pitch), u.y - np.sin(2 * np.pi * p.lam / pitch)],
        unknowns=("x", "y"), scales={"x": 1.0, "y": 1.0, "lam": 1.0},
    )  # fmt: skip
    branch = trace(helix, constant(helix, [1.0, 0.0]), ("lam",), TraceOptions(bounds={"lam": (-0.035, 0.035)}))
    assert not branch.closed
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert kinds(branch) == []


def test_a_pitchfork_is_found_along_the_trivial_branch_and_switched_to_both_sides() -> None:
    bvp = pitchfork()
    trivial = trace(bvp, constant(bvp, [0.0], lam=-0.5), ("lam",), BOX)
    (point,) = trivial.special
    assert (point.kind, point.status, point.turns, point.label) == ("branch point", Status.CONVERGED, False, "BP")
    assert point.solution["lam"] == pytest.approx(0, abs=1e-9)
    assert len(point.directions) == 2
    sides = [switch(bvp, point, ("lam",), BOX, side=side) for side in (1, -1)]
    ends = []
    for side in sides:
        assert side is not None
        assert side.ends == (EndReason.BRANCH_POINT, EndReason.RANGE)
        assert side.special == ()
        assert side.points[0].solution["lam"] == pytest.approx(0, abs=1e-9)
        assert side.points[0].arclength == 0.0
        assert (np.diff(side.column("arclength")) > 0).all()
        ends.append(side.points[-1].solution["x"][0])
    np.testing.assert_allclose(sorted(ends), [-1, 1], atol=1e-12)


def test_a_pitchfork_met_along_its_side_branch_is_no_fold() -> None:
    bvp = pitchfork()
    branch = trace(bvp, constant(bvp, [0.8], lam=0.64), ("lam",), BOX)
    assert kinds(branch) == ["branch point"]
    assert branch.special[0].turns
    assert branch.special[0].solution["lam"] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(sorted([branch.points[0].solution["x"][0], branch.points[-1].solution["x"][0]]), [-1, 1])
    other = switch(bvp, branch.special[0], ("lam",), BOX)
    assert other is not None
    assert np.abs(np.concatenate([p.solution["x"] for p in other])).max() < 1e-9


@pytest.mark.parametrize("size", [1e-3, 1e-4, 1e-5])
def test_an_imperfect_pitchfork_is_two_curves_without_a_branch_point(size: float) -> None:
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2) + size])
    branch = trace(bvp, constant(bvp, [-size / -0.8], lam=-0.8), ("lam",), replace(BOX, step=StepControl(maximum=0.5)))
    assert kinds(branch) == []
    assert branch.points[-1].solution["x"][0] == pytest.approx(1.0, abs=size)
    other = trace(bvp, constant(bvp, [-0.9], lam=0.81 + size / 0.9), ("lam",), BOX)
    assert kinds(other) == ["fold"]
    assert other.special[0].solution["lam"] == pytest.approx(3 * (size / 2) ** (2 / 3), abs=1e-9)


def test_a_transcritical_point_is_found_on_both_branches() -> None:
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x)])
    for start in ([0.0], [-0.5]):
        branch = trace(bvp, constant(bvp, start, lam=-0.5), ("lam",), BOX)
        assert kinds(branch) == ["branch point"]
        (point,) = branch.special
        assert point.solution["lam"] == pytest.approx(0, abs=1e-9)
        other = switch(bvp, point, ("lam",), BOX)
        assert other is not None
        slope = other.points[-1].solution["x"][0] / other.points[-1].solution["lam"]
        assert slope == pytest.approx(1.0 if start == [0.0] else 0.0, abs=1e-9)


def test_an_isolated_point_has_no_second_direction() -> None:
    bvp = algebraic(lambda u, p: [u.x * (u.x**2 + p.lam**2)])
    assert kinds(trace(bvp, constant(bvp, [0.0], lam=-0.5), ("lam",), BOX)) == []


def test_two_folds_close_together_are_told_apart() -> None:
    bvp = algebraic(lambda u, p: [u.x**3 - 3 * 0.05**2 * u.x - p.lam])  # folds at x = +-0.05
    options = replace(BOX, step=StepControl(maximum=0.5))
    branch = trace(bvp, constant(bvp, [-1.0], lam=-1 + 3 * 0.05**2), ("lam",), options)
    assert kinds(branch) == ["fold", "fold"]
    np.testing.assert_allclose([x.solution["lam"] for x in branch.special], [2 * 0.05**3, -2 * 0.05**3], atol=1e-12)


def test_a_zero_exactly_at_a_point_is_reported_once() -> None:
    bvp = circle()
    branch = trace(bvp, constant(bvp, [0.8], lam=0.6), ("lam",), TraceOptions(zeros={"lam": 0.0}))
    np.testing.assert_allclose([x.solution["x"][0] for x in branch.of_kind("zero of lam")], [-1, 1], atol=1e-12)


# -- bounds -----------------------------------------------------------------------------------------------------------


def test_newton_says_why_it_failed() -> None:
    bvp = algebraic(lambda u, p: [np.log(u.x) - p.lam])
    with pytest.raises(NotConverged, match="returned NaN or infinity") as caught:
        solve(bvp, constant(bvp, [-1.0]))
    assert caught.value.code is NewtonCode.NOT_FINITE
    twice = BVP(
        lambda s, u, p: [u.v, p.lam], lambda left, right, p: [left.u, 2 * left.u], unknowns=("u", "v"),
        parameters={"lam": 1.0},
    )  # fmt: skip
    with pytest.raises(NotConverged, match="linearised problem is singular") as caught:
        solve(twice, constant(twice))
    assert caught.value.code is NewtonCode.SINGULAR
    beyond = constant(bratu(), lam=8.0)
    with pytest.raises(NotConverged, match="start closer to a solution") as caught:
        solve(bratu(), beyond)
    assert caught.value.code in (NewtonCode.DIVERGED, NewtonCode.SLOW)


@pytest.mark.parametrize("where", ["rhs", "boundary", "integral", "jacobian"])
def test_nan_anywhere_is_noticed(where: str) -> None:
    def bad(value):
        return np.sqrt(value - 5)

    def integral(s, u, p):
        return bad(u.u) if where == "integral" else u.u - p.mu * (np.sqrt(p.nu) if where == "jacobian" else 1.0)

    bvp = BVP(
        lambda s, u, p: [u.v, bad(u.u) if where == "rhs" else -u.u],
        lambda left, right, p: [left.u - p.lam, bad(right.u) if where == "boundary" else right.u],
        integral,
        unknowns=("u", "v"), parameters={"lam": 0.0, "mu": 0.0, "nu": 0.0},
    )  # fmt: skip
    with pytest.raises(NotConverged) as caught:
        solve(bvp, constant(bvp), ("nu" if where == "jacobian" else "lam", "mu"))
    assert caught.value.code is NewtonCode.NOT_FINITE


def test_settings_are_checked() -> None:
    for bad in ({"initial": 1e-9}, {"maximum": 0.01}, {"min_cosine": 1.0}, {"growth": 1.0}, {"target": 0.0}):
        with pytest.raises(ValueError, match="step: expected"):
            StepControl(**bad)
    with pytest.raises(ValueError, match="tolerance: expected a number between 0 and 1, got 2"):
        MeshControl(tolerance=2)
    with pytest.raises(ValueError, match="intervals: expected 4 <= fewest <= most"):
        MeshControl(intervals=(20, 10))
    with pytest.raises(ValueError, match="points: expected 1 to 9"):
        MeshControl(points=10)
    with pytest.raises(ValueError, match="every: expected at least 1"):
        MeshControl(every=0)
    with pytest.raises(ValueError, match="newton: expected tolerance > 0"):
        NewtonOptions(tolerance=0)
    with pytest.raises(ValueError, match=r"locate: expected some of .*, got 'hopf'"):
        TraceOptions(locate=("hopf",))
    with pytest.raises(ValueError, match=r"bounds: expected numbers low < high for 'lam', got \(1, 0\)"):
        TraceOptions(bounds={"lam": (1, 0)})
    with pytest.raises(ValueError, match="backend: expected 'numba', 'scipy' or None, got 'cuda'"):
        TraceOptions(backend="cuda")
    with pytest.raises(ValueError, match="max_points: expected at least 1"):
        TraceOptions(max_points=0)
    with pytest.raises(ValueError, match="at: expected a branch point, got a fold"):
        switch(circle(), trace(circle(), constant(circle(), [1.0]), ("lam",)).special[0], ("lam",))


def test_steps_grow_and_shrink_as_told() -> None:
    control = StepControl(initial=0.1, minimum=1e-3, maximum=1.0)
    assert control.next_step(0.1, control.target, 2) == pytest.approx(0.1)
    assert control.next_step(0.1, 1e-9, 2) == pytest.approx(0.16)
    assert control.next_step(0.1, 8 * control.target, 2) == pytest.approx(0.05)
    assert control.next_step(0.1, 1e-9, 5) == pytest.approx(0.07)
    assert control.next_step(0.9, 0.0, 1) == 1.0
    assert control.next_step(1.5e-3, 1.0, 2) == 1e-3


# -- driving the walker by hand, index bookkeeping --------------------------------------------------------------------


def test_a_walker_is_an_iterator_that_can_be_interrupted() -> None:
    bvp, seen = circle(), []
    frame, _ = first_frame(bvp, constant(bvp, [1.0]), [0], TraceOptions())
    assert frame is not None
    walker = Walker(frame, TraceOptions(on_point=seen.append))
    for step in walker:
        if step.point.arclength > 1.0:
            break
    assert walker.end is None
    assert walker.last is step.point
    at, count = walker.last.arclength, len(seen)
    rest = list(walker)
    assert rest[0].point.arclength > at
    assert walker.end is EndReason.CLOSED
    assert len(seen) == count + len(rest)
    assert walker.last is rest[-1].point
    assert list(walker) == []


def test_the_index_is_compared_with_the_events() -> None:
    def true(solution: Solution) -> int:
        return int(solution["lam"] > 0) if abs(solution["x"][0]) < 1e-6 else 0

    bvp = pitchfork()
    branch = trace(bvp, constant(bvp, lam=-0.5), ("lam",), replace(BOX, index=true))
    assert branch.discrepancies == ()
    assert branch.special[0].index == (0, 1)
    assert set(branch.column("index")) == {0.0, 1.0}
    side = trace(bvp, constant(bvp, [0.8], lam=0.64), ("lam",), replace(BOX, index=true))
    assert side.discrepancies == ()  # through the pitchfork along its side: no change expected
    wrong = trace(bvp, constant(bvp, lam=-0.5), ("lam",), replace(BOX, index=lambda s: int(s["lam"] > 0.3)))
    assert len(wrong.discrepancies) == 2
    texts = sorted(map(str, wrong.discrepancies))
    assert "index changes from 0 to 0" in texts[0]
    assert "branch point was located" in texts[0]
    assert "index changes from 0 to 1" in texts[1]
    assert "no event was located" in texts[1]
    for discrepancy in wrong.discrepancies:  # narrowed down, in order along the branch
        assert 0 < discrepancy.bracket[1] - discrepancy.bracket[0] < 2e-3


def test_no_index_means_no_bookkeeping() -> None:
    bvp = pitchfork()
    branch = trace(bvp, constant(bvp, lam=-0.5), ("lam",), replace(BOX, index=lambda s: None))
    assert branch.discrepancies == ()


def test_switching_with_other_free_parameters_finds_the_directions_anew() -> None:
    bvp = algebraic(lambda u, p: [u.x * (p.lam + p.mu - u.x**2)], parameters=("lam", "mu"))
    point = trace(bvp, constant(bvp, lam=-0.5), ("lam",), BOX).special[0]
    options = replace(BOX, bounds={"mu": (-1.0, 1.0)})
    assert point.free == ("lam",)
    for at in (point, replace(point, directions=())):
        side = switch(bvp, at, ("mu",), options)
        assert side is not None
        assert abs(side.points[-1].solution["x"][0]) == pytest.approx(1, abs=1e-9)
        assert side.points[-1].solution["mu"] == pytest.approx(1, abs=1e-12)
    assert switch(bvp, replace(point, directions=point.directions[:1]), ("lam",), BOX) is None


def test_switching_does_not_depend_on_the_units_of_the_run() -> None:
    from rodatlas.continuation.discrete.collocation import Scale

    bvp = pitchfork()
    odd = Scale(np.array([7.0]), np.array([0.2]))
    point = trace(bvp, constant(bvp, lam=-0.5), ("lam",), BOX, scale=odd).special[0]
    for scale in (None, Scale(np.array([1.0]), np.array([1.0]))):
        side = switch(bvp, point, ("lam",), BOX, scale=scale)
        assert side is not None
        assert abs(side.points[-1].solution["x"][0]) == pytest.approx(1, abs=1e-9)


def test_a_side_branch_that_leaves_the_bounds_at_once_is_a_point() -> None:
    bvp = pitchfork()
    point = trace(bvp, constant(bvp, lam=-0.5), ("lam",), BOX).special[0]
    branch = switch(bvp, point, ("lam",), replace(BOX, bounds={"lam": (-1.0, 0.0)}))
    assert branch is not None
    assert (len(branch), branch.ends) == (1, (EndReason.BRANCH_POINT, EndReason.RANGE))


def test_representations_are_short_and_say_what_matters() -> None:
    branch = trace(circle(), constant(circle(), [1.0]), ("lam",))
    assert "2 x fold; ends: closed" in repr(branch)
    assert repr(branch.special[0]).startswith("SpecialPoint(fold, converged, Solution(lam=")
    frame = branch.to_frame()
    assert list(frame.columns) == ["label", "arclength", "lam", "x0", "error", "intervals", "index"]
    assert frame["label"].tolist().count("LP") == 2
    assert (np.diff(frame["arclength"]) >= 0).all()
    assert "elastica" in repr(elastica())
