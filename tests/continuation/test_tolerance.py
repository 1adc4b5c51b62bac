"""No state comes back that misses its tolerance, unless it says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import bratu, constant
from scipy.integrate import quad
from scipy.optimize import brentq

from rodatlas.continuation import (
    BVP,
    EndReason,
    MeshControl,
    NotConverged,
    Solution,
    Status,
    TraceOptions,
    other_solutions,
    solve,
    switch,
    trace,
)
from rodatlas.continuation.curve.doubt import Doubt
from rodatlas.continuation.curve.point import first_frame
from rodatlas.continuation.curve.resolve import doubted, resolved
from rodatlas.continuation.curve.settle import across, at_own_parameter, refined_within, settled
from rodatlas.continuation.discrete.mesh import monitor

WIDE = TraceOptions(mesh=MeshControl(intervals=(10, 800)))
STEP = 0.3137  # place at which the column gets four times as stiff


def layer() -> BVP:
    """e y'' = y, y'(0) = 0, y(1) = 1: cosh(s / sqrt(e)) / cosh(1 / sqrt(e))."""
    return BVP(
        lambda s, u, p: [u.v, u.y / p.e], lambda left, right, p: [left.v, right.y - 1], unknowns=("y", "v"),
        parameters={"e": 1.0}, name="layer",
    )  # fmt: skip


def spike() -> BVP:
    """e y'' = y - y^2 on (-1, 1), y(+-1) = 0: zero and one spike of height close to 3/2, nothing else."""
    return BVP(
        lambda s, u, p: [2 * u.v, 2 * (u.y - u.y**2) / p.e], lambda left, right, p: [left.y, right.y],
        unknowns=("y", "v"), parameters={"e": 1 / 36}, name="spike",
    )  # fmt: skip


def spike_height(e: float) -> float:
    """Half the interval is the time from 0 to the height A on e y'^2 = y^2 - A^2 - 2 (y^3 - A^3)/3; y = A - z^2."""

    def rest(height: float) -> float:
        def slowness(z: float) -> float:
            y = height - z * z
            return 2 / np.sqrt(2 * (y * y + y * height + height**2) / 3 - y - height)

        return np.sqrt(e) * quad(slowness, 0, np.sqrt(height), epsabs=1e-10, epsrel=1e-10)[0] - 1

    return float(brentq(rest, 1.5001, 2.0, xtol=1e-12))


def stepped(step: float = STEP) -> BVP:
    """A pinned column y'' = -P sin(y)/EI whose stiffness jumps from 1 to 4 inside an interval."""
    return BVP(
        lambda s, u, p: [u.t, -p.P * np.sin(u.y) / np.where(s < step, 1.0, 4.0)],
        lambda left, right, p: [left.y, right.y], unknowns=("y", "t"), parameters={"P": 15.0}, scales={"P": 20.0},
        name="stepped",
    )  # fmt: skip


def buckling_load(step: float = STEP, between: tuple[float, float] = (15.0, 30.0)) -> float:
    """tan(k a) + 2 tan(k (1 - a)/2) = 0 with k = sqrt(P): the two parts joined."""

    def mismatch(load: float) -> float:
        k = np.sqrt(load)
        left, right = k * step, k * (1 - step) / 2
        return float(np.sin(left) * np.cos(right) + 2 * np.sin(right) * np.cos(left))

    return float(brentq(mismatch, *between, xtol=1e-13))


@pytest.mark.parametrize("e", [1e-4, 1e-5, 1e-6, 1e-8])
@pytest.mark.parametrize("intervals", [10, 20, 400])
def test_a_boundary_layer_from_any_start_size(e: float, intervals: int) -> None:
    bvp = layer()
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, {"e": e}, intervals)
    found = solve(bvp, start, options=TraceOptions() if intervals < 400 else WIDE)
    assert found.error <= 1e-8
    assert found["v"][-1] == pytest.approx(np.tanh(e**-0.5) / np.sqrt(e), rel=1e-8)


def test_a_trace_starts_from_a_resolved_state_and_stays_resolved() -> None:
    bvp = layer()
    branch = trace(bvp, constant(bvp, e=1e-5), ("e",), TraceOptions(bounds={"e": (1e-5, 1e-4)}))
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert branch.verification.unresolved == 0
    exact = np.tanh(branch.column("e") ** -0.5) / np.sqrt(branch.column("e"))
    np.testing.assert_allclose([p.solution["v"][-1] for p in branch], exact, rtol=1e-7)


def test_a_state_that_no_allowed_mesh_resolves_is_no_result() -> None:
    bvp, tight = layer(), TraceOptions(mesh=MeshControl(intervals=(6, 8)))
    for verb in (solve, trace):
        with pytest.raises(NotConverged, match="raise intervals or loosen the tolerance") as caught:
            verb(bvp, constant(bvp, e=1e-5), ("e",), tight)
        assert caught.value.code is EndReason.MESH_LIMIT
        assert caught.value.solution.error > 1e-7
    fixed_size = TraceOptions(mesh=MeshControl(intervals=(8, 8)))  # asked for: no error is estimated
    assert np.isnan(solve(bvp, constant(bvp, e=1e-5), ("e",), fixed_size).error)


def test_deflation_does_not_count_states_of_the_mesh() -> None:
    bvp = spike()
    zero = solve(bvp, constant(bvp))
    arch = Solution.from_function(
        lambda s: np.column_stack([1.5 / np.cosh((2 * s - 1) * 3) ** 2, 0 * s]), bvp.unknowns, bvp.parameters, 40
    )  # fmt: skip
    high = solve(bvp, arch)
    assert high(0.5, "y")[0] == pytest.approx(spike_height(1 / 36), abs=1e-7)
    (alone,) = other_solutions(bvp, [zero])
    assert alone(0.5, "y")[0] == pytest.approx(high(0.5, "y")[0], abs=1e-7)
    assert other_solutions(bvp, [zero, high], limit=3) == []


def test_a_jump_inside_an_interval_is_closed_in_on() -> None:
    load = buckling_load()
    assert load == pytest.approx(23.5725477, abs=1e-6)
    bvp, options = stepped(), TraceOptions(bounds={"P": (15.0, 30.0)})
    straight = trace(bvp, constant(bvp), ("P",), options, both=False)
    (point,) = straight.special
    assert point.status is Status.CONVERGED
    assert point.solution["P"] == pytest.approx(load, rel=3e-8)
    bent = switch(bvp, point, ("P",), options)
    assert bent.verification.unresolved == 0
    assert all(p.solution.error <= 1e-7 for p in bent)


def test_a_jump_on_too_few_intervals_is_reported() -> None:
    mesh = MeshControl(intervals=(10, 12))
    bvp = stepped()
    options = TraceOptions(mesh=mesh, bounds={"P": (15.0, 30.0)})
    straight = trace(bvp, constant(bvp), ("P",), options, both=False)
    (point,) = straight.special
    assert point.status is Status.UNRESOLVED
    assert point.solution.error > 1e-7
    assert straight.verification.unresolved == 1
    assert not straight.verification.complete
    assert "1 points miss the tolerance" in str(straight.verification)


@pytest.mark.parametrize("step", [0.3137, 0.35, 0.5392624923188806, 0.8915651814089913, 0.55])
def test_a_jump_in_the_state_itself(step: float) -> None:
    """EI w' = c - s, w(0) = 0, w(1) = 1, in closed form; at some places Gauss points on halves agree by accident."""
    bvp = BVP(
        lambda s, u, p: [u.q / np.where(s < step, 1.0, 4.0), -p.f], lambda left, right, p: [left.w, right.w - 1],
        unknowns=("w", "q"), parameters={"f": 1.0},
    )  # fmt: skip
    mean, first = step + (1 - step) / 4, step**2 / 2 + (1 - step**2) / 8
    found = solve(bvp, constant(bvp))
    assert found.error <= 1e-8
    assert found["q"][0] == pytest.approx((1 + first) / mean, rel=1e-7)


@pytest.mark.parametrize("step", [0.40245710047534505, 0.48725182894861014, 0.3396824519683479])
def test_a_jump_that_the_gauss_points_of_the_halves_do_not_see(step: float) -> None:
    """Their weights left and right of it are those on the whole interval, so that the correction there vanishes."""
    bvp, bounds = stepped(step), (10.0, 30.0)
    straight = trace(bvp, constant(bvp, P=10.0), ("P",), TraceOptions(bounds={"P": bounds}), both=False)
    (point,) = straight.special
    assert point.status is Status.CONVERGED
    assert point.solution["P"] == pytest.approx(buckling_load(step, bounds), rel=1e-7)


@pytest.mark.parametrize("n", [0, 1, 5])
def test_a_singular_coefficient_at_an_end_is_no_jump(n: int) -> None:
    """Lane and Emden: u'' + 2 u'/s + k^2 u^n = 0, u'(0) = 0, u(0) = 1, with the closed forms for n = 0, 1, 5."""
    bvp = BVP(
        lambda s, u, p: [u.v, -2 * u.v / s - 4 * u.u**n], lambda left, right, p: [left.v, left.u - 1],
        unknowns=("u", "v"),
    )  # fmt: skip
    guess = Solution.from_function(lambda s: np.column_stack([1 + 0 * s, 0 * s]), bvp.unknowns, {})
    x = 2.0
    exact = {0: 1 - x**2 / 6, 1: np.sin(x) / x, 5: (1 + x**2 / 3) ** -0.5}[n]
    assert solve(bvp, guess)["u"][-1] == pytest.approx(exact, abs=1e-8)


def frame_of(bvp: BVP, **parameters: float):
    start = constant(bvp, **parameters)
    return first_frame(bvp, start, [0], TraceOptions())[0]


def test_settling_holds_the_parameter_and_refines_where_it_cannot_move() -> None:
    bvp = layer()
    frame = frame_of(bvp, e=1e-5)
    held = settled(frame, TraceOptions(), (at_own_parameter(frame), across))
    assert held.missed is None
    assert held.frame.parameter == pytest.approx(1e-5, rel=1e-12)
    places, density = frame.colloc.mesh, monitor(frame.colloc, frame.x)
    mesh = refined_within(places, density, 23)
    assert len(mesh) == 24
    assert set(places) < set(mesh)
    assert len(refined_within(places, density, 40)) == 41
    assert len(refined_within(places, density, 20)) == 21


def test_points_in_doubt_get_the_error_found_after_them() -> None:
    branch = trace(bratu(), constant(bratu()), ("lam",), TraceOptions(max_points=5), both=False)
    at = branch.column("arclength")
    points, _ = doubted(branch.points, (), [Doubt(at[1], at[3], 1e-3)])
    assert [p.solution.error > 1e-4 for p in points] == [False, True, True, True, False, False]
    assert doubted(branch.points, (), []) == (list(branch.points), [])


def test_doubtful_points_are_settled_by_themselves() -> None:
    """As if the walk had gone on with a mesh of four intervals; the points are exact again, zeros too."""
    options = TraceOptions(max_points=6, zeros={"slope": 0.05})
    branch = trace(bratu(), constant(bratu()), ("lam",), options, both=False)
    assert len(branch.special) == 1

    def coarse(solution: Solution) -> Solution:
        return replace(solution.remesh(np.linspace(0, 1, 5)), error=1e-3)

    points = tuple(replace(p, solution=coarse(p.solution)) for p in branch.points)
    special = tuple(replace(x, solution=coarse(x.solution)) for x in branch.special)
    frame = frame_of(bratu())
    again = resolved(replace(branch, points=points, special=special), frame, options)
    assert again.verification.unresolved == 0
    np.testing.assert_allclose(again.column("slope"), branch.column("slope"), atol=1e-8)
    assert [x.solution["slope"] for x in again.special] == pytest.approx([0.05], abs=1e-9)
    strict = replace(options, mesh=MeshControl(tolerance=1e-17, intervals=(4, 5)))
    none = resolved(replace(branch, points=points), frame, strict)
    assert none.verification.unresolved > 0
    assert not none.verification.complete
