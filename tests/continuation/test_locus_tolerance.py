"""No point or event of a locus misses its tolerance, unless the locus says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import constant
from scipy.integrate import solve_ivp

from rodatlas.continuation import (
    BVP,
    EndReason,
    Locus,
    MeshControl,
    NotConverged,
    SpecialPoint,
    Status,
    StepControl,
    TraceOptions,
    follow_locus,
    integral_of,
    trace,
)
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.locus.events import locate, watched
from rodatlas.continuation.locus.point import Sought, correct, error_of, frame_at, on_mesh
from rodatlas.continuation.locus.segment import Stretch
from rodatlas.continuation.locus.settle import resolved, resolved_event


def layer() -> BVP:
    """e y'' = y, y'(0) = 0, y(1) = exp(a) with e = exp(q): mean y = exp(a) sqrt(e) tanh(1/sqrt(e))."""
    return BVP(
        lambda s, u, p: [u.v * np.exp(-p.q / 2), u.y * np.exp(-p.q / 2)],
        lambda left, right, p: [left.v, right.y - np.exp(p.a)], unknowns=("y", "v"), parameters={"a": 0.0, "q": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.y)}, name="layer",
    )  # fmt: skip


def wind() -> BVP:
    """u'' + P u' + lam exp(u) = 0, u(0) = u(1) = 0: Bratu's problem in a wind, with a layer of width 1/P at 0."""
    return BVP(
        lambda s, u, p: [u.v, -p.P * u.v - p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0, "P": 1.0}, scales={"lam": 20.0, "P": 20.0},
        observables={"mean": integral_of(lambda s, u, p: u.u)}, name="wind",
    )  # fmt: skip


def gelfand() -> BVP:
    """u'' + lam exp(u/(1 + eps u)) = 0, u(0) = u(1) = 0."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u / (1 + p.eps * u.u))], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0, "eps": 0.2},
        observables={"mean": integral_of(lambda s, u, p: u.u)}, name="gelfand",
    )  # fmt: skip


def fold_of(bvp: BVP, mean: float) -> SpecialPoint:
    options = TraceOptions(bounds={"lam": (0.0, 30.0), "mean": (0.0, mean)})
    return trace(bvp, constant(bvp), ("lam",), options, both=False).of_kind("fold")[0]


@pytest.fixture(scope="module")
def ignition() -> SpecialPoint:
    return fold_of(gelfand(), 20.0)


@pytest.fixture(scope="module")
def windy() -> SpecialPoint:
    return fold_of(wind(), 3.0)


def own_errors(bvp: BVP, locus: Locus) -> np.ndarray:
    """The error of each point, estimated anew on halved intervals of its own mesh."""
    sought, free = Sought(locus.kind), [bvp.parameter_index(name) for name in locus.free]
    errors = []
    for point in locus.points:
        colloc = Collocation.at(bvp, point.solution, free, locus.scale)
        frame = frame_at(sought, colloc, colloc.state(point.solution), TraceOptions())
        errors.append(error_of(sought, frame, 0.0).error)
    return np.array(errors)


@pytest.mark.parametrize("every", [3, 40])
@pytest.mark.parametrize("most", [40, 400])
def test_a_locus_of_a_value_into_a_boundary_layer(every: int, most: int) -> None:
    """With the mesh looked at every forty steps, errors of one and more were passed without a word."""
    bvp = layer()
    branch = trace(bvp, constant(bvp), ("a",), TraceOptions(zeros={"mean": 0.5}, bounds={"a": (-3.0, 3.0)}))
    (start,) = branch.of_kind("zero of mean")
    options = TraceOptions(bounds={"q": (-20.0, 0.0)}, mesh=MeshControl(intervals=(10, most), every=every))
    locus = follow_locus(bvp, start, ("a", "q"), options)
    assert set(locus.ends) == {EndReason.RANGE}
    assert locus.unresolved == 0
    root = np.exp(locus.column("q") / 2)
    np.testing.assert_allclose(locus.column("a"), np.log(0.5 / (root * np.tanh(1 / root))), atol=1e-9)
    deep = min(locus.points, key=lambda p: p.solution["q"]).solution
    e = np.exp(deep["q"] / 2)
    expected = np.exp(deep["a"] + (deep.mesh - 1) / e) * (1 + np.exp(-2 * deep.mesh / e)) / (1 + np.exp(-2 / e))
    assert np.abs(deep.values[:, 0] - expected).max() < 1e-7 * np.exp(deep["a"])


@pytest.mark.slow
@pytest.mark.parametrize("every", [3, 12])
def test_a_locus_of_folds_into_a_boundary_layer(windy: SpecialPoint, every: int) -> None:
    """Shooting at the computed slope: u(1) = 0 and the linearized solution too. Between two looks every twelve steps
    the error was 8e-7."""
    bvp = wind()
    options = TraceOptions(bounds={"P": (1.0, 1500.0)}, mesh=MeshControl(every=every), step=StepControl(maximum=5.0))
    locus = follow_locus(bvp, windy, ("lam", "P"), options)
    assert locus.unresolved == 0
    assert own_errors(bvp, locus).max() < 1e-7
    for point in locus.points[::12]:
        p, lam = point.solution["P"], point.solution["lam"]

        def rhs(s: float, y: np.ndarray, p: float = p, lam: float = lam) -> list[float]:
            u, v, du, dv = y
            return [v, -p * v - lam * np.exp(u), dv, -p * dv - lam * np.exp(u) * du]

        shot = solve_ivp(rhs, (0, 1), [0, point.solution["v"][0], 0, 1], "Radau", rtol=1e-10, atol=1e-12).y[:, -1]
        assert abs(shot[0]) < 1e-6
        assert abs(shot[2]) < 1e-5 / p


def test_points_that_no_allowed_mesh_resolves_are_counted(windy: SpecialPoint) -> None:
    bvp = wind()
    options = TraceOptions(
        bounds={"P": (1.0, 1500.0)}, mesh=MeshControl(intervals=(10, 20)), step=StepControl(maximum=5.0)
    )
    locus = follow_locus(bvp, windy, ("lam", "P"), options)
    assert EndReason.MESH_LIMIT in locus.ends
    errors = own_errors(bvp, locus)
    assert 0 < locus.unresolved == (errors > 1e-7).sum()
    assert f"{locus.unresolved} points miss the tolerance" in repr(locus)
    recorded = np.array([p.solution.error for p in locus.points])
    np.testing.assert_array_equal(recorded > 1e-7, errors > 1e-7)


@pytest.mark.slow
def test_events_are_located_on_a_mesh_that_resolves_them(ignition: SpecialPoint) -> None:
    """The cusp at eps = 0.2457803, where the mesh of the walk stays what it was at the start."""
    bvp, bounds = gelfand(), {"eps": (0.0, 0.3), "lam": (1.0, 6.0)}
    fine = TraceOptions(bounds=bounds, mesh=MeshControl(tolerance=1e-11))
    (sharp,) = follow_locus(bvp, ignition, ("lam", "eps"), fine).of_kind("cusp")
    assert abs(sharp.solution["eps"] - 0.2457803) < 2e-7
    for points, every in ((4, 3), (4, 1000), (2, 1000)):
        options = TraceOptions(bounds=bounds, mesh=MeshControl(points=points, every=every))
        locus = follow_locus(bvp, ignition, ("lam", "eps"), options)
        (cusp,) = locus.of_kind("cusp")
        assert cusp.status is Status.CONVERGED
        assert cusp.solution.error < 1e-7
        for name in ("eps", "lam", "mean"):
            assert abs(cusp.solution[name] - sharp.solution[name]) < 1e-6


def test_an_event_that_no_allowed_mesh_resolves_says_so(ignition: SpecialPoint) -> None:
    """A step across the cusp on eight intervals; with sixteen allowed the event moves to the finer mesh, in vain."""
    bvp, sought, free, names = gelfand(), Sought("fold"), [0, 1], ("lam", "eps")
    bounds = {"eps": (0.0, 0.3), "lam": (1.0, 6.0)}
    (cusp,) = follow_locus(bvp, ignition, names, TraceOptions(bounds=bounds)).of_kind("cusp")
    for tolerance, status in ((1e-14, Status.UNRESOLVED), (1e-6, Status.CONVERGED)):
        options = TraceOptions(mesh=MeshControl(tolerance=tolerance, intervals=(4, 16)))
        colloc = Collocation.at(bvp, cusp.solution.remesh(np.linspace(0, 1, 9)), free)
        here = frame_at(sought, colloc, colloc.state(cusp.solution), TraceOptions())
        left, right = (
            correct(sought, here, here.predict(d), here.tangent, TraceOptions(), exact=True)[0] for d in (-0.04, 0.06)
        )
        step = Stretch(sought, left, right, 0.1, 0.0, options)
        (what,) = [w for w in watched(step, names) if w.kind == "cusp"]
        found = resolved_event(step, what, locate(step, what, names), names)
        assert found.status is status
        assert abs(found.solution["eps"] - cusp.solution["eps"]) < 1e-7
    assert found.solution.error < 1e-6


def test_a_start_that_no_allowed_mesh_resolves_is_refused(ignition: SpecialPoint) -> None:
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10, intervals=(4, 5)))
    with pytest.raises(NotConverged, match=r"start of the locus .*: the tolerance needs more intervals") as refused:
        follow_locus(gelfand(), ignition, ("lam", "eps"), options)
    assert refused.value.code is EndReason.MESH_LIMIT
    assert refused.value.solution.error > 1e-9
    assert refused.value.solution.intervals == 5


def test_doubtful_points_are_settled_by_themselves(ignition: SpecialPoint) -> None:
    """As if the walk had gone on with a mesh of five intervals."""
    bvp, options = gelfand(), TraceOptions(max_points=6)
    locus = follow_locus(bvp, ignition, ("lam", "eps"), options, both=False)
    sought = Sought("fold")

    def at(point):
        colloc = Collocation.at(bvp, point.solution, [0, 1], locus.scale)
        return colloc, colloc.state(point.solution)

    def coarse(point):
        frame = on_mesh(frame_at(sought, *at(point), options), np.linspace(0, 1, 6))
        found, _ = correct(sought, frame, frame.x, frame.tangent, options, exact=True)
        assert frame.colloc.norm(add(found.x, (-1.0, frame.x))) > 1e-7
        return replace(point, solution=found.colloc.solution(found.x, 1e-3))

    first = frame_at(sought, *at(locus.points[0]), options)
    again = resolved(replace(locus, points=tuple(map(coarse, locus.points))), first, sought, options)
    assert again.unresolved == 0
    for name in ("lam", "eps", "mean"):
        np.testing.assert_allclose(again.column(name), locus.column(name), atol=1e-6)
    assert own_errors(bvp, again).max() < 1e-8
