"""Special points of loci in problems whose loci are curves on paper."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import algebraic, constant

from rodatlas.continuation import (
    EndReason,
    Locus,
    Status,
    StepControl,
    TraceOptions,
    end_value,
    fold_locus_at,
    follow_locus,
    trace,
)

PLANE = ("lam", "mu")


def first_special(bvp, kind, low, high, start=None, **values):
    """The first special point of a kind on the branch in lam."""
    options = TraceOptions(bounds={"lam": (low, high)}, zeros=values.pop("zeros", {}))
    branch = trace(bvp, constant(bvp, start, **values), ("lam",), options, both=False)
    return branch.of_kind(kind)[0]


def in_plane(bvp, special, bound=1.0, **options):
    bounds = {"lam": (-5.0, 5.0), "mu": (-bound, bound)}
    return follow_locus(bvp, special, PLANE, TraceOptions(bounds=bounds, **options))


def summary(locus):
    return [(e.kind, e.parameter) for e in locus.events]


def place(event):
    return np.array([event.solution["lam"], event.solution["mu"]])


def conic(sign):
    """x^2 + sign lam^2 = sign mu: circles around an isola center, or hyperbolas that merge and split."""
    return algebraic(lambda u, p: [sign * (u.x**2) + p.lam**2 - p.mu], parameters=PLANE)


@pytest.mark.parametrize(("sign", "what"), [
    (1.0, "isola center: a closed branch appears as the parameter grows"),
    (-1.0, "two branches touch: they merge and split"),
])  # fmt: skip
def test_extremum_of_a_fold_locus_is_told_apart(sign, what):
    bvp = conic(sign)
    if sign > 0:
        fold = first_special(bvp, "fold", -2.0, 2.0, [1.0], lam=0.0, mu=1.0)
    else:
        fold = trace(bvp, constant(bvp, [1.0], lam=2**0.5, mu=1.0), ("lam",),
                     TraceOptions(bounds={"lam": (-5.0, 5.0)})).of_kind("fold")[0]  # fmt: skip
    locus = in_plane(bvp, fold, bound=4.0)
    np.testing.assert_allclose(locus.column("lam") ** 2, locus.column("mu"), atol=1e-9)
    assert summary(locus) == [("extremum", "mu")]
    event = locus.events[0]
    assert event.status is Status.CONVERGED
    assert event.what == what
    np.testing.assert_allclose(place(event), 0.0, atol=1e-6)
    assert abs(event.solution["mu"]) < 1e-11


def test_isola_that_vanishes():
    """x^2 + lam^2 = -mu: the circle shrinks as mu grows to zero."""
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [1.0], lam=0.0, mu=-1.0)
    (event,) = in_plane(bvp, fold, bound=2.0).events
    assert event.what == "isola center: a closed branch vanishes as the parameter grows"


def test_closed_locus():
    """x^2 + lam^2 + mu^2 = 1: its folds in lam are a circle with four extrema."""
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu**2 - 1], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [0.8], lam=0.0, mu=0.6)
    locus = in_plane(bvp, fold, bound=3.0)
    assert locus.closed
    np.testing.assert_allclose(locus.column("lam") ** 2 + locus.column("mu") ** 2, 1.0, atol=1e-9)
    assert sorted(summary(locus)) == [("extremum", "lam")] * 2 + [("extremum", "mu")] * 2
    found = sorted(tuple(np.round(place(e), 6) + 0.0) for e in locus.events)
    assert found == [(-1.0, 0.0), (0.0, -1.0), (0.0, 1.0), (1.0, 0.0)]


def test_swallowtail_of_folds_has_two_cusps():
    """lam + x^4/4 + mu x^2/2 with x -> two cusps: folds at lam = -(x^4 ...); cusp where 3 x^2 + mu = 0."""
    bvp = algebraic(lambda u, p: [p.lam + u.x**5 / 5 + p.mu * u.x**3 / 3 + 0.1 * u.x], parameters=PLANE)
    # F_x = x^4 + mu x^2 + 0.1 = 0 and F_xx = 4 x^3 + 2 mu x = 0: x^2 = -mu/2, mu^2/4 = 0.1
    start = trace(bvp, constant(bvp, [1.0], lam=0.0, mu=-1.0), ("lam",), TraceOptions(bounds={"lam": (-2.0, 2.0)}))
    locus = in_plane(bvp, start.of_kind("fold")[0], bound=3.0)
    cusps = locus.of_kind("cusp")
    assert summary(locus) == [("cusp", "")]
    mu = -2 * 0.1**0.5
    assert cusps[0].solution["mu"] == pytest.approx(mu, abs=1e-10)
    x = (-mu / 2) ** 0.5
    lam = x**5 / 5 + mu * x**3 / 3 + 0.1 * x
    assert abs(cusps[0].solution["lam"]) == pytest.approx(lam, abs=1e-10)


def test_branch_point_that_does_not_persist():
    """x (lam - x^2) = mu: an imperfection breaks the pitchfork up."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2) - p.mu], parameters=PLANE)
    point = first_special(bvp, "branch point", -1.0, 1.0, lam=-1.0)
    locus = in_plane(bvp, point)
    assert locus.ends == (EndReason.UNFOLDED, EndReason.UNFOLDED)
    assert len(locus) == 1


def transcritical():
    """x (lam - x^2 - mu x): a transcritical point at lam = 0 and a fold at lam = -mu^2/4 meet at mu = 0."""
    return algebraic(lambda u, p: [u.x * (p.lam - u.x**2 - p.mu * u.x)], parameters=PLANE)


def test_fold_passes_a_branch_point_seen_from_both_loci():
    bvp = transcritical()
    point = first_special(bvp, "branch point", -2.0, 1.0, lam=-2.0, mu=0.5)
    from_points = in_plane(bvp, point)
    assert summary(from_points) == [("coalescence", "")]
    np.testing.assert_allclose(place(from_points.events[0]), 0.0, atol=1e-8)
    side = trace(bvp, constant(bvp, [0.5], lam=0.5, mu=0.5), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}))
    from_folds = in_plane(bvp, side.of_kind("fold")[0])
    np.testing.assert_allclose(from_folds.column("lam"), -(from_folds.column("mu") ** 2) / 4, atol=1e-9)
    assert summary(from_folds) == [("coalescence", "")]
    np.testing.assert_allclose(place(from_folds.events[0]), 0.0, atol=1e-8)


def independent():
    """lam - mu - x^2 - y^2, y (x - mu - y^2): the fold and the pitchfork on it pass each other at mu = 0."""
    return algebraic(
        lambda u, p: [p.lam - p.mu - u.x**2 - u.y**2, u.y * (u.x - p.mu - u.y**2)],
        unknowns=("x", "y"), parameters=PLANE,
    )  # fmt: skip


def test_fold_of_the_trunk_passes_a_pitchfork_seen_from_both_loci():
    bvp = independent()
    start = constant(bvp, [1.0, 0.0], lam=1.5, mu=0.5)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 2.0)}))
    for kind in ("fold", "branch point"):
        locus = in_plane(bvp, branch.of_kind(kind)[0], bound=0.8)
        found = [e for e in locus.events if e.kind == "coalescence"]
        assert len(found) == 1, (kind, summary(locus))
        np.testing.assert_allclose(place(found[0]), 0.0, atol=1e-8)
        assert len(locus.of_kind("cusp")) == 0
        # the side branch of the pitchfork is lam = mu + mu^2 + (1 + 2 mu) y^2 + y^4
        criticality = [e.solution["mu"] for e in locus.of_kind("criticality")]
        assert criticality == pytest.approx([-0.5] if kind == "branch point" else [], abs=1e-8)


def test_two_pitchforks_of_one_solution_cross():
    """x (lam - mu - x^2), y (lam + mu - y^2) on the trivial branch: the loci lam = +-mu cross at zero."""
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - p.mu - u.x**2 - u.y**2), u.y * (p.lam + p.mu - u.y**2 - 3 * u.x**2)],
        unknowns=("x", "y"), parameters=PLANE,
    )  # fmt: skip
    point = first_special(bvp, "branch point", -2.0, 2.0, lam=-2.0, mu=0.5)
    locus = in_plane(bvp, point)
    np.testing.assert_allclose(np.abs(locus.column("lam")), np.abs(locus.column("mu")), atol=1e-9)
    assert summary(locus) == [("crossing", "")]
    np.testing.assert_allclose(place(locus.events[0]), 0.0, atol=1e-8)


def test_criticality_starts_a_fold_locus():
    """x (lam - mu x^2 + x^4): folds lam = mu^2/4 of the side branch end on the pitchfork at mu = 0."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - p.mu * u.x**2 + u.x**4)], parameters=PLANE)
    side = trace(bvp, constant(bvp, [0.6], lam=0.36 - 0.36**2, mu=1.0), ("lam",),
                 TraceOptions(bounds={"lam": (0.05, 1.0)}))  # fmt: skip
    locus = in_plane(bvp, side.of_kind("fold")[0])
    np.testing.assert_allclose(locus.column("lam"), locus.column("mu") ** 2 / 4, atol=1e-9)
    assert EndReason.CRITICALITY in locus.ends
    (event,) = locus.of_kind("criticality")
    np.testing.assert_allclose(place(event), 0.0, atol=1e-6)


def test_fold_locus_is_found_from_the_criticality():
    """x (lam - mu x^2 + x^4): from the pitchfork's locus to that of the folds, which ends on it."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - p.mu * u.x**2 + u.x**4)], parameters=PLANE)
    pitchforks = in_plane(bvp, first_special(bvp, "branch point", -1.0, 1.0, lam=-1.0, mu=-0.5))
    (event,) = pitchforks.events
    assert event.kind == "criticality"
    np.testing.assert_allclose(place(event), 0.0, atol=1e-9)
    folds = fold_locus_at(bvp, pitchforks, event, TraceOptions(bounds={"mu": (-1.0, 1.0)}))
    np.testing.assert_allclose(folds.column("lam"), folds.column("mu") ** 2 / 4, atol=1e-9)
    assert set(folds.ends) == {EndReason.CRITICALITY, EndReason.RANGE}
    with pytest.raises(ValueError, match="event: expected a criticality on a locus of branch points, got a"):
        fold_locus_at(bvp, folds, folds.events[0])


def test_locus_of_a_value():
    """exp(lam) mu + x = 0 with x = -0.5 kept: mu = exp(-lam)/2; and a circle in the plane."""
    bvp = algebraic(
        lambda u, p: [p.mu * np.exp(p.lam) - u.x], parameters=PLANE,
        observables={"first": end_value(lambda left, right, p: left.x)},
    )  # fmt: skip
    start = first_special(bvp, "zero of first", -1.0, 1.0, [0.2], lam=-1.0, mu=0.5, zeros={"first": 0.5})
    locus = follow_locus(bvp, start, PLANE, TraceOptions(bounds={"lam": (-2.0, 2.0)}))
    assert locus.kind == "zero of first"
    np.testing.assert_allclose(locus.column("first"), 0.5, atol=1e-12)
    np.testing.assert_allclose(locus.column("mu"), 0.5 * np.exp(-locus.column("lam")), atol=1e-9)
    assert sorted(locus.column("lam")[[0, -1]]) == pytest.approx([-2.0, 2.0], abs=1e-12)
    assert locus.events == ()


def test_locus_of_a_value_turns():
    bvp = algebraic(
        lambda u, p: [p.lam**2 + p.mu**2 - u.x], parameters=PLANE,
        observables={"first": end_value(lambda left, right, p: left.x)},
    )  # fmt: skip
    start = first_special(bvp, "zero of first", -2.0, 2.0, [4.1], lam=-2.0, mu=0.3, zeros={"first": 1.0})
    locus = follow_locus(bvp, start, PLANE, TraceOptions(bounds={"lam": (-3.0, 3.0)}))
    assert locus.closed
    assert len(locus.of_kind("extremum")) == 4


def test_lists_do_not_depend_on_the_step():
    from dataclasses import replace

    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu**2 - 1], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [0.8], lam=0.0, mu=0.6)
    base = TraceOptions().step
    lists = []
    for factor in (0.3, 1.0, 3.0):
        step = replace(base, initial=base.initial * factor, maximum=base.maximum * factor, target=base.target * factor)
        lists.append(sorted(summary(in_plane(bvp, fold, bound=3.0, step=step))))
    assert lists[0] == lists[1] == lists[2]


def test_a_locus_is_saved_and_read(tmp_path):
    locus = in_plane(transcritical(), first_special(transcritical(), "branch point", -2.0, 1.0, lam=-2.0, mu=0.5))
    locus.save(tmp_path / "locus.h5")
    again = Locus.load(tmp_path / "locus.h5")
    assert repr(again) == repr(locus)
    assert (again.free, again.ends, again.settings) == (locus.free, locus.ends, dict(locus.settings))
    for a, b in zip(again.points, locus.points, strict=True):
        np.testing.assert_array_equal(a.solution.stages, b.solution.stages)
        np.testing.assert_array_equal(a.tangent, b.tangent)
        assert (a.arclength, a.tests, a.unfolding) == (b.arclength, dict(b.tests), b.unfolding)
    assert [(e.kind, e.what, e.status, e.bracket) for e in again.events] == [
        (e.kind, e.what, e.status, e.bracket) for e in locus.events
    ]
    frame = again.to_frame()
    assert len(frame) == len(locus) + len(locus.events)
    assert frame["event"].value_counts()["coalescence"] == 1


def test_an_interrupted_locus_is_kept():
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu**2 - 1], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [0.8], lam=0.0, mu=0.6)
    seen = []

    def stop(point):
        seen.append(point)
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        in_plane(bvp, fold, on_point=stop)
    assert len(caught.value.locus) == 6
    assert caught.value.locus.ends[1] is EndReason.INTERRUPTED


@pytest.mark.parametrize("mu", [0.02, -0.02, 0.6])
def test_a_closed_locus_counts_each_event_once(mu):
    """Also when it starts right beside one: the last step passes that event a second time."""
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu**2 - 1], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [(1 - mu**2) ** 0.5], lam=0.0, mu=mu)
    locus = in_plane(bvp, fold, bound=3.0)
    assert locus.closed
    assert sorted(summary(locus)) == [("extremum", "lam")] * 2 + [("extremum", "mu")] * 2
    assert locus.points[-1].solution is locus.points[0].solution
    assert locus.points[-1].arclength == pytest.approx(2 * np.pi, rel=1e-2)


@pytest.mark.parametrize("mu", [0.0, 1e-16, -1e-16, 1e-9, -1e-9, 1e-6, -1e-6])
def test_an_event_at_the_start_counts_once(mu):
    """Of a closed locus, and of one that is followed both ways."""
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 + p.mu**2 - 1], parameters=PLANE)
    fold = first_special(bvp, "fold", -2.0, 2.0, [(1 - mu**2) ** 0.5], lam=0.0, mu=mu)
    assert sorted(summary(in_plane(bvp, fold, bound=3.0))) == [("extremum", "lam")] * 2 + [("extremum", "mu")] * 2
    assert summary(in_plane(bvp, fold, bound=0.5)) == [("extremum", "lam")]


def swallowtail(d):
    """Folds lam + x^4/12 - d^2 x^2/2 + mu x = 0, mu = d^2 x - x^3/3, with cusps at x = +-d."""
    return algebraic(lambda u, p: [p.lam + u.x**4 / 12 - d**2 * u.x**2 / 2 + p.mu * u.x], parameters=PLANE)


def trunk_with_a_fold(d):
    """The fold x = 0, lam = mu of lam = mu + x^2 passes the pitchfork at x = d^2 - mu^2 twice."""
    return algebraic(
        lambda u, p: [p.lam - p.mu - u.x**2 - u.y**2, u.y * (u.x + p.mu**2 - d**2 - u.y**2)],
        unknowns=("x", "y"), parameters=PLANE,
    )  # fmt: skip


def two_pitchforks(d):
    """Pitchforks lam = 0 and lam = d^2 - mu^2 of the trivial branch."""
    return algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2 - u.y**2), u.y * (p.lam + p.mu**2 - d**2 - u.y**2 - 3 * u.x**2)],
        unknowns=("x", "y"), parameters=PLANE,
    )  # fmt: skip


def three_pitchforks(d):
    """Pitchforks lam = 0, lam = mu - d and lam = -mu - d: one mode after the other becomes singular."""
    return algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2), u.y * (p.lam - p.mu + d - u.y**2), u.z * (p.lam + p.mu + d - u.z**2)],
        unknowns=("x", "y", "z"), parameters=PLANE,
    )  # fmt: skip


CLOSE_PAIRS = {  # problem, kind of the locus, start, event
    "cusps": (swallowtail, "fold", lambda d: ([-1.2], {"lam": 0.187 + 0.72 * d**2, "mu": 0.3}), "cusp"),
    "folds and pitchfork": (trunk_with_a_fold, "fold", lambda d: ([1.0, 0.0], {"lam": 1.7, "mu": 0.7}), "coalescence"),
    "pitchforks and fold": (
        trunk_with_a_fold, "branch point", lambda d: ([1.0, 0.0], {"lam": 1.7, "mu": 0.7}), "coalescence",
    ),
    "criticality": (
        lambda d: algebraic(lambda u, p: [u.x * (p.lam - (p.mu**2 - d**2) * u.x**2 + u.x**4)], parameters=PLANE),
        "branch point", lambda d: (None, {"lam": -1.0, "mu": 0.7}), "criticality",
    ),
    "transcritical": (
        lambda d: algebraic(lambda u, p: [u.x * (p.lam - (p.mu**2 - d**2) * u.x - u.x**2)], parameters=PLANE),
        "branch point", lambda d: (None, {"lam": -1.0, "mu": 0.7}), "coalescence",
    ),
    "crossings": (two_pitchforks, "branch point", lambda d: (None, {"lam": 2.0, "mu": 0.7}), "crossing"),
    "crossings in turn": (three_pitchforks, "branch point", lambda d: (None, {"lam": 2.0, "mu": 0.7}), "crossing"),
}  # fmt: skip


@pytest.mark.parametrize("d", [0.03, 0.002])
@pytest.mark.parametrize("name", CLOSE_PAIRS)
def test_two_events_on_one_step(name, d):
    """No test function has another sign at the end of the step on which both lie."""
    make, kind, start, event = CLOSE_PAIRS[name]
    bvp, (values, parameters) = make(d), start(d)
    branch = trace(bvp, constant(bvp, values, **parameters), ("lam",), TraceOptions(bounds={"lam": (-3.0, 3.0)}))
    special = min(branch.of_kind(kind), key=lambda x: abs(x.solution["lam"]) + np.abs(x.solution.values[0]).sum())
    locus = in_plane(bvp, special)
    found = sorted(e.solution["mu"] for e in locus.of_kind(event))
    at = 2 * d**3 / 3 if event == "cusp" else d
    assert found == pytest.approx([-at, at], abs=1e-6)
    assert all(e.status is Status.CONVERGED for e in locus.events)


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("slant", [0.0, 0.01, 0.1])
def test_an_extremum_beside_a_cusp(slant, factor):
    """Folds mu = -x^2, lam = 2 x^3/3 - slant x^2: a cusp at x = 0; lam is extreme at x = slant, if not there."""
    bvp = algebraic(lambda u, p: [p.lam - slant * p.mu + p.mu * u.x + u.x**3 / 3], parameters=PLANE)
    start = constant(bvp, [-0.9], lam=0.9 * -0.64 + 0.243 - 0.64 * slant, mu=-0.64)
    fold = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)})).of_kind("fold")[0]
    step = StepControl(initial=0.02 * factor, maximum=0.5 * factor, target=2e-3 * factor**3)
    locus = in_plane(bvp, fold, step=step)
    assert sorted(summary(locus)) == [("cusp", "")] + [("extremum", "lam")] * (slant > 0)
    np.testing.assert_allclose(place(locus.of_kind("cusp")[0]), 0.0, atol=1e-9)
    for event in locus.of_kind("extremum"):
        assert event.solution["mu"] == pytest.approx(-(slant**2), abs=1e-7)
        assert event.solution["lam"] == pytest.approx(-(slant**3) / 3, abs=1e-11)
