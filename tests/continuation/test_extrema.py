"""Extrema of observables along branches and loci, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, algebraic, bratu, circle, constant, kinds

from rodatlas.continuation import (
    BVP,
    Branch,
    EndReason,
    Locus,
    Status,
    StepControl,
    TraceOptions,
    end_value,
    follow_locus,
    integral_of,
    sensitivity,
    switch,
    trace,
)

PLANE = ("lam", "mu")
BOX = TraceOptions(bounds={"lam": (-1.0, 1.0)}, step=StepControl(maximum=0.1))


def graph(function, **options) -> BVP:
    """x = function(lam, mu), a branch without folds, with x as observable."""
    return algebraic(
        lambda u, p: [u.x - function(p.lam, p.mu)], parameters=PLANE,
        observables={"x0": end_value(lambda left, right, p: left.x)}, **options,
    )  # fmt: skip


def on_graph(function, low: float, high: float, mu: float = 0.0, **options) -> Branch:
    bvp = graph(function)
    start = constant(bvp, [function(low, mu)], lam=low, mu=mu)
    return trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (low, high)}, extrema=("x0",), **options))


# -- along a branch -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("start", [1.0, 0.8])
def test_a_circle_has_a_maximum_and_a_minimum(start: float) -> None:
    """The first start is a maximum itself; it is found once."""
    bvp = circle()
    branch = trace(bvp, constant(bvp, [start], lam=(1 - start**2) ** 0.5), ("lam",), TraceOptions(extrema=("x0",)))
    assert branch.closed
    found = sorted(branch.of_kind("extremum of x0"), key=lambda x: x.solution["x0"])
    assert [x.normal_form.kind for x in found] == ["minimum", "maximum"]
    assert [x.normal_form.bend for x in found] == pytest.approx([1.0, -1.0], abs=1e-12)
    assert [x.solution["x0"] for x in found] == pytest.approx([-1.0, 1.0], abs=1e-14)
    for x in found:
        assert (x.status, x.label, x.name, x.free) == (Status.CONVERGED, "EX", "x0", ("lam",))
        assert abs(x.solution["lam"]) < 1e-12
        assert x.solution.parameter_names == ("lam",)
        assert x.bracket[0] <= x.arclength <= x.bracket[1]
    assert branch.verification.converged == 4


def test_the_fold_is_the_extremum_of_the_parameter() -> None:
    """Two observables that are the parameter, the energy (extreme where the load is), and the fold itself."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
        observables={
            "mean": integral_of(lambda s, u, p: u.u), "at_end": end_value(lambda left, right, p: p.lam),
            "inside": integral_of(lambda s, u, p: p.lam),
            "energy": integral_of(lambda s, u, p: u.v**2 / 2 - p.lam * np.exp(u.u)),
        },
    )  # fmt: skip
    names = ("mean", "at_end", "inside", "energy")
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"mean": (-1.0, 4.0)}, extrema=names))
    (fold,) = branch.of_kind("fold")
    assert fold.solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-9)
    assert sorted(kinds(branch)) == ["extremum of at_end", "extremum of energy", "extremum of inside", "fold"]
    for x in branch.special:
        assert x.status is Status.CONVERGED
        assert x.solution["lam"] == pytest.approx(fold.solution["lam"], abs=1e-12)
        assert x.solution["mean"] == pytest.approx(fold.solution["mean"], abs=1e-9)
        if x.name in ("at_end", "inside"):
            assert x.normal_form.kind == "maximum"
            assert x.normal_form.bend == pytest.approx(fold.normal_form.bend, rel=1e-9)


@pytest.mark.parametrize("apart", [0.3, 0.1, 0.03])
def test_two_extrema_on_one_step_are_told_apart(apart: float) -> None:
    branch = on_graph(lambda lam, mu: lam**3 / 3 - apart**2 * lam, -1.0, 1.0, step=StepControl(initial=0.5))
    assert [x.solution["lam"] for x in branch.special] == pytest.approx([-apart, apart], abs=1e-8)
    assert [x.normal_form.kind for x in branch.special] == ["maximum", "minimum"]


def test_an_inflection_and_a_constant_are_no_extrema() -> None:
    assert on_graph(lambda lam, mu: lam**3 + 1e-3 * lam, -1.0, 1.0).special == ()
    assert on_graph(lambda lam, mu: 0.7 + 0.0 * lam, -1.0, 1.0).special == ()
    bvp = BVP(  # a quantity that is constant because the conditions say so
        lambda s, u, p: [u.v, -p.lam * np.sin(u.u)], lambda left, right, p: [left.u - 0.1, right.u],
        lambda s, u, p: u.v**2 - p.mu, unknowns=("u", "v"), parameters={"lam": 1.0, "mu": 0.0},
        observables={"same": integral_of(lambda s, u, p: u.v**2 - p.mu), "left": end_value(lambda l, r, p: l.u)},
    )  # fmt: skip
    options = TraceOptions(bounds={"lam": (1.0, 8.0)}, extrema=("same", "left"))
    assert trace(bvp, constant(bvp), ("lam", "mu"), options).special == ()


def test_an_inner_parameter_can_be_extreme() -> None:
    """mu = 1 - lam^2 as free parameter that a second condition determines."""
    bvp = algebraic(lambda u, p: [u.x - p.lam, p.mu - 1 + u.x**2], parameters=PLANE)
    options = TraceOptions(bounds={"lam": (-1.0, 2.0)}, extrema=("mu",))
    branch = trace(bvp, constant(bvp, [-0.5], lam=-0.5, mu=0.75), PLANE, options)
    (x,) = branch.of_kind("extremum of mu")
    assert (x.solution["lam"], x.solution["mu"]) == pytest.approx((0.0, 1.0), abs=1e-12)
    assert x.normal_form.kind == "maximum"


def test_what_is_even_is_extreme_where_a_side_branch_passes_its_pitchfork() -> None:
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - p.mu - u.x**2)],
        parameters=PLANE,
        observables={"even": end_value(lambda left, right, p: left.x**2 + p.lam)},
    )
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, extrema=("even",), step=StepControl(maximum=0.1))
    side = trace(bvp, constant(bvp, [0.8], lam=0.64), ("lam",), options)
    assert sorted(kinds(side)) == ["branch point", "extremum of even"]
    (x,) = side.of_kind("extremum of even")
    assert (x.status, x.normal_form.kind) == (Status.CONVERGED, "minimum")
    assert x.solution["lam"] == pytest.approx(0.0, abs=1e-9)
    assert x.is_branch_point
    assert sensitivity(bvp, x) == pytest.approx({"mu": 1.0}, abs=1e-9)
    with pytest.raises(ValueError, match="start: expected the branch point itself, of which this extremum of even"):
        follow_locus(bvp, x, PLANE)
    trunk = trace(bvp, constant(bvp, lam=-0.8), ("lam",), options)
    assert kinds(trunk) == ["branch point"]
    assert kinds(switch(bvp, trunk.special[0], ("lam",), options)) == []  # it starts there


def test_several_values_of_one_name() -> None:
    bvp = circle()
    branch = trace(bvp, constant(bvp, [1.0]), ("lam",), TraceOptions(zeros={"x0": (0.6, -0.3, 0.6), "lam": 0.5}))
    assert sorted(round(x.solution["x0"], 9) for x in branch.of_kind("zero of x0")) == [-0.3, -0.3, 0.6, 0.6]
    assert len(branch.of_kind("zero of lam")) == 2
    assert branch.settings["zeros"] == {"x0": [0.6, -0.3], "lam": [0.5]}
    levels = np.linspace(0.1, 0.9, 9)
    branch = trace(bvp, constant(bvp, [1.0]), ("lam",), TraceOptions(zeros={"lam": levels}, bounds={"x0": (0.0, 2.0)}))
    found = [x.solution["lam"] for x in branch.of_kind("zero of lam")]
    np.testing.assert_allclose(found, levels, atol=1e-12)


@pytest.mark.parametrize("value", [0.99, 0.9999, 0.999999])
def test_a_value_that_is_passed_twice_on_one_step(value: float) -> None:
    """The maximum of a circle lies barely above it."""
    bvp = circle()
    options = TraceOptions(zeros={"x0": (value, 1 + 1e-9)}, step=StepControl(initial=0.4))
    branch = trace(bvp, constant(bvp, [0.8], lam=-0.6), ("lam",), options)
    found = sorted(x.solution["lam"] for x in branch.of_kind("zero of x0"))
    assert found == pytest.approx([-((1 - value**2) ** 0.5), (1 - value**2) ** 0.5], abs=1e-9)


def test_wrong_names_and_values_are_told() -> None:
    bvp = circle()
    with pytest.raises(ValueError, match="extrema: expected one of x0, got 'lam': extrema of 'lam' are the folds"):
        trace(bvp, constant(bvp, [1.0]), ("lam",), TraceOptions(extrema=("lam",)))
    with pytest.raises(ValueError, match="extrema: expected a tuple of names"):
        TraceOptions(extrema="x0")
    for wrong in (None, (), (1.0, "2"), "12"):
        with pytest.raises(ValueError, match="zeros: expected a number, or a sequence of them, for 'x0', got"):
            TraceOptions(zeros={"x0": wrong})


# -- in two parameters ------------------------------------------------------------------------------------------------


def test_a_maximum_and_a_minimum_meet() -> None:
    """x = lam^3/3 - mu lam + 0.3 mu: extreme on the parabola mu = lam^2; stationary in both at lam = 0.3."""
    branch = on_graph(lambda lam, mu: lam**3 / 3 - mu * lam + 0.3 * mu, -2.0, 2.0, mu=1.0)
    bvp, seen = graph(lambda lam, mu: lam**3 / 3 - mu * lam + 0.3 * mu), []
    options = TraceOptions(bounds={"mu": (-1.0, 2.0)}, on_point=seen.append, zeros={"lam": (0.5, -0.5)})
    locus = follow_locus(bvp, branch.special[0], PLANE, options)
    assert (locus.kind, locus.free, locus.ends) == ("extremum of x0", PLANE, (EndReason.RANGE, EndReason.RANGE))
    np.testing.assert_allclose(locus.column("lam") ** 2, locus.column("mu"), atol=1e-9)
    found = {(e.kind, e.parameter): e for e in locus.events}
    assert set(found) == {("extremum", "mu"), ("extremum", "x0"), ("zero of lam", "")}
    meet = found["extremum", "mu"]
    assert meet.what == "a maximum and a minimum of x0 meet and vanish"
    assert (meet.solution["lam"], meet.solution["mu"]) == pytest.approx((0.0, 0.0), abs=1e-9)
    saddle = found["extremum", "x0"]
    assert saddle.what == "x0 is stationary in lam and mu: a saddle"
    assert (saddle.solution["lam"], saddle.solution["mu"]) == pytest.approx((0.3, 0.09), abs=1e-8)
    assert all(e.status is Status.CONVERGED for e in locus.events)
    assert sorted(e.solution["lam"] for e in locus.of_kind("zero of lam")) == pytest.approx([-0.5, 0.5])
    for p in (*locus.points, *seen):
        assert p.solution.parameter_names == PLANE
        assert len(p.tangent) == 2


def test_a_summit_and_a_turn_in_the_first_parameter() -> None:
    branch = on_graph(lambda lam, mu: np.exp(-(lam**2) - (mu - 0.2 * lam) ** 2), -2.0, 2.0, mu=-1.0)
    bvp = graph(lambda lam, mu: np.exp(-(lam**2) - (mu - 0.2 * lam) ** 2))
    (summit,) = follow_locus(bvp, branch.special[0], PLANE, TraceOptions(bounds={"mu": (-1.0, 1.0)})).events
    assert summit.what == "x0 is stationary in lam and mu: a maximum or minimum"
    assert summit.solution["x0"] == pytest.approx(1.0, abs=1e-12)
    # x = (lam - mu^2)^2 + mu: the minimum runs along lam = mu^2, which turns in lam
    branch = on_graph(lambda lam, mu: (lam - mu**2) ** 2 + mu, -2.0, 2.0, mu=-1.0)
    bvp = graph(lambda lam, mu: (lam - mu**2) ** 2 + mu)
    (turn,) = follow_locus(bvp, branch.special[0], PLANE, TraceOptions(bounds={"mu": (-1.0, 1.0)})).events
    assert (turn.kind, turn.parameter, turn.what) == ("extremum", "lam", "the locus turns back in lam")
    assert (turn.solution["lam"], turn.solution["mu"]) == pytest.approx((0.0, 0.0), abs=1e-8)


def test_the_locus_of_a_fold_told_as_an_extremum_is_the_locus_of_the_fold() -> None:
    """Gelfand's ignition: an observable that is the parameter is extreme on the locus of folds, cusp included."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u / (1 + p.eps * u.u))], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0, "eps": 0.2},
        observables={"mean": integral_of(lambda s, u, p: u.u), "same": integral_of(lambda s, u, p: p.lam)},
    )  # fmt: skip
    options = TraceOptions(bounds={"lam": (-1.0, 8.0), "mean": (-1.0, 5.0)}, extrema=("same",))
    branch = trace(bvp, constant(bvp), ("lam",), options)
    in_plane = TraceOptions(bounds={"eps": (0.1, 0.3), "mean": (-1.0, 12.0)})
    fold, extremum = (
        follow_locus(bvp, branch.of_kind(kind)[0], ("lam", "eps"), in_plane) for kind in ("fold", "extremum of same")
    )
    (cusp,) = fold.of_kind("cusp")
    (meet,) = (e for e in extremum.events if e.parameter == "eps")
    assert cusp.solution["eps"] == pytest.approx(0.2457803, abs=2e-7)
    assert meet.solution["eps"] == pytest.approx(cusp.solution["eps"], abs=1e-8)
    assert meet.solution["lam"] == pytest.approx(cusp.solution["lam"], abs=1e-7)


def test_extrema_are_stored(tmp_path) -> None:
    branch = on_graph(lambda lam, mu: -(lam**2) + mu, -1.0, 2.0)
    branch.save(tmp_path / "branch.h5")
    again = Branch.load(tmp_path / "branch.h5")
    (one,), (two,) = branch.special, again.special
    assert (two.kind, two.normal_form, two.status, two.arclength) == (
        one.kind,
        one.normal_form,
        one.status,
        one.arclength,
    )
    locus = follow_locus(graph(lambda lam, mu: -(lam**2) + mu), two, PLANE, TraceOptions(bounds={"mu": (-1.0, 1.0)}))
    locus.save(tmp_path / "locus.h5")
    assert Locus.load(tmp_path / "locus.h5").kind == "extremum of x0"
    assert "EX" in set(again.to_frame()["label"])


def test_an_extremum_that_is_one_of_the_two_parameters_is_refused() -> None:
    bvp = algebraic(lambda u, p: [u.x - p.lam, p.mu - 1 + u.x**2 + p.nu], parameters=("lam", "mu", "nu"))
    options = TraceOptions(bounds={"lam": (-1.0, 2.0)}, extrema=("mu",))
    branch = trace(bvp, constant(bvp, [-0.5], lam=-0.5, mu=0.75), PLANE, options)
    with pytest.raises(ValueError, match="free: expected 'mu', which is extreme, after the two parameters"):
        follow_locus(bvp, branch.special[0], ("lam", "mu", "nu"))
    locus = follow_locus(bvp, branch.special[0], ("lam", "nu", "mu"), TraceOptions(bounds={"nu": (-1.0, 1.0)}))
    np.testing.assert_allclose(locus.column("mu"), 1 - locus.column("nu"), atol=1e-10)
    np.testing.assert_allclose(locus.column("lam"), 0.0, atol=1e-10)


def test_an_interrupted_locus_of_extrema_keeps_what_it_has() -> None:
    branch = on_graph(lambda lam, mu: -((lam - mu) ** 2), -1.0, 2.0)

    def stop(point) -> None:
        if point.arclength > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        follow_locus(graph(lambda lam, mu: -((lam - mu) ** 2)), branch.special[0], PLANE, TraceOptions(on_point=stop))
    assert stopped.value.locus.kind == "extremum of x0"
    assert stopped.value.locus.points[-1].solution.parameter_names == PLANE


def test_an_extremum_of_bratu_with_its_mean_as_parameter() -> None:
    """(mean - lam + 1/2)^2 is least where the mean is lam - 1/2; between these two it is largest once."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u],
        lambda s, u, p: u.u - p.mean, unknowns=("u", "v"), parameters={"lam": 0.0, "mean": 0.0},
        observables={"gap": integral_of(lambda s, u, p: (p.mean - p.lam + 0.5) ** 2)},
    )  # fmt: skip
    options = TraceOptions(bounds={"mean": (-1.0, 4.0)}, extrema=("gap", "mean"))
    found = trace(bvp, constant(bvp), ("lam", "mean"), options).of_kind("extremum of gap")
    assert [x.normal_form.kind for x in found] == ["minimum", "maximum", "minimum"]
    assert all(x.status is Status.CONVERGED for x in found)
    for x in (found[0], found[2]):
        assert x.solution["mean"] == pytest.approx(x.solution["lam"] - 0.5, abs=1e-9)
    plain = bratu()
    options = TraceOptions(bounds={"mean": (-1.0, 4.0)}, zeros={"lam": [x.solution["lam"] for x in found]})
    means = [x.solution["mean"] for x in trace(plain, constant(plain), ("lam",), options).special if x.is_zero]
    assert all(min(abs(m - x.solution["mean"]) for m in means) < 1e-7 for x in found)
