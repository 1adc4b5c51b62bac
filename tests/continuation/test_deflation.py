"""Deflation finds the solutions that are known to exist, no others, and none twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, bratu, bratu_exact, constant, elastica, phase_separation
from scipy.optimize import brentq
from scipy.special import ellipk

from rodatlas.continuation import (
    BVP,
    MeshControl,
    NotConverged,
    Solution,
    TraceOptions,
    deflated_solve,
    end_value,
    integral_of,
    other_solutions,
    solve,
    trace,
)
from rodatlas.continuation.curve.deflation import Deflation, deflated_newton
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.newton import NewtonCode, fixed
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns

LOAD = ("P", "V")


def gelfand() -> BVP:
    """u'' + (lam + mu^2) exp(u / (1 + eps u)) = 0, u(0) = u(1) = 0: S-shaped in lam, an isola in mu."""
    return BVP(
        lambda s, u, p: [u.v, -(p.lam + p.mu**2) * np.exp(u.u / (1 + p.eps * u.u))],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0, "mu": 0.0, "eps": 0.2},
        observables={"mean": integral_of(lambda s, u, p: u.u)}, name="gelfand",
    )  # fmt: skip


def guided_elastica() -> BVP:
    """theta'' + P sin(theta) = 0, theta(0) = theta(1) = 0: clamped, and free to slide sideways."""
    return BVP(
        lambda s, u, p: [u.k, -p.P * np.sin(u.theta)],
        lambda left, right, p: [left.theta, right.theta],
        unknowns=("theta", "k"), parameters={"P": 0.0}, scales={"k": 10.0},
        observables={"k0": end_value(lambda left, right, p: left.k)}, name="guided elastica",
    )  # fmt: skip


def end_curvature(load: float, quarters: int) -> float:
    """|k(0)| of an inflectional elastica of some quarter periods: quarters K(m) = sqrt(P), k(0) = 2 sqrt(m P)."""
    m = brentq(lambda m: quarters * ellipk(m) - np.sqrt(load), 0.0, 1 - 1e-12)
    return float(2 * np.sqrt(m * load))


def upside_down(solution: Solution) -> Solution:
    """The other state of a pair in problems that are odd in the unknowns (and in V)."""
    turned = replace(solution, values=-solution.values, stages=-solution.stages)
    return turned.with_parameters(V=-turned["V"]) if "V" in turned.parameter_names else turned


# -- the factor -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("power", "shift"), [(1.0, 0.0), (2.0, 1.0), (3.0, 0.5)])
def test_the_slope_is_that_of_the_factor(power: float, shift: float) -> None:
    bvp = bratu()
    states = [Solution.from_function(lambda s, k=k: np.column_stack([np.sin(k * s), np.cos(s + k)]),
                                     bvp.unknowns, {"lam": 1.0}, 8) for k in (1, 2, 3, 4)]  # fmt: skip
    colloc = Collocation(bvp, states[0].mesh, 4, states[0].parameters, [0], Scale.of(bvp, states[0]))
    x, d, *known = [colloc.state(s) for s in states]
    deflation = Deflation(colloc, tuple(known), power, shift)

    def log_factor(y: Columns) -> float:
        return sum(np.log(colloc.norm(add(y, (-1.0, k))) ** -power + shift) for k in known)

    h = 1e-5
    numeric = (log_factor(add(x, (h, d))) - log_factor(add(x, (-h, d)))) / (2 * h)
    assert deflation.slope(x, d) == pytest.approx(numeric, rel=1e-8)


def test_the_step_is_newtons_on_the_deflated_problem() -> None:
    """x^2 = 4 without x = 2: Newton on (1/(x-2)^2 + 1) (x^2 - 4), done by hand."""
    bvp = BVP(lambda s, u, p: [0.0], lambda left, right, p: [left.x**2 - p.lam], unknowns=("x",),
              parameters={"lam": 4.0}, scales={"x": 1.0})  # fmt: skip
    known = constant(bvp, [2.0])
    colloc = Collocation(bvp, known.mesh, 4, known.parameters, [0], Scale.of(bvp, known))
    deflation = Deflation(colloc, (colloc.state(known),))
    x = 2.5
    for count in range(1, 5):
        g, slope = x * x - 4, 2 * x
        eta, rate = 1 / (x - 2) ** 2 + 1, -2 / (x - 2) ** 3
        x -= eta * g / (rate * g + eta * slope)
        start = colloc.state(constant(bvp, [2.5]))
        code, state = deflated_newton(deflation, start, fixed("lam", 4.0)(colloc), 100.0, count)
        if code is NewtonCode.CONVERGED:
            break
        assert state.mesh[0, 0] == pytest.approx(x, rel=1e-12)
    assert deflated_solve(bvp, constant(bvp, [2.5]), [known])["x"][0] == pytest.approx(-2.0, abs=1e-9)


# -- known counts -----------------------------------------------------------------------------------------------------


def test_bratu_has_two_solutions_below_its_fold() -> None:
    low = solve(bratu(), constant(bratu(), lam=1.0))
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10))
    (high,) = other_solutions(bratu(), [low], options=options)
    theta = brentq(lambda t: bratu_exact(t, np.array([0.5]))[0] - 1.0, 6.0, 20.0)
    assert np.abs(high.values - bratu_exact(theta, high.mesh)[1]).max() < 1e-7
    assert high.error < 1e-10


def test_two_solutions_close_to_the_fold_are_told_apart() -> None:
    lam = BRATU_FOLD - 1e-6
    theta = brentq(lambda t: bratu_exact(t, np.array([0.5]))[0] - lam, 3.0, 4.798)
    low = solve(bratu(), Solution.from_function(lambda s: bratu_exact(theta, s)[1], ("u", "v"), {"lam": lam}))
    (high,) = other_solutions(bratu(), [low])
    assert 1e-4 < high["mean"] - low["mean"] < 1e-2


def test_nothing_is_found_where_nothing_is() -> None:
    low = constant(bratu(), lam=BRATU_FOLD + 0.1)
    with pytest.raises(NotConverged, match="deflated Newton from"):
        deflated_solve(bratu(), low, [])
    only = solve(gelfand(), constant(gelfand(), lam=1.0))
    assert other_solutions(gelfand(), [only]) == []


@pytest.mark.slow
def test_the_guided_elastica_has_two_states_per_buckled_mode() -> None:
    """Between the Euler loads (n pi)^2 and ((n + 1) pi)^2 there are the straight state and n pairs."""
    bvp, load = guided_elastica(), 60.0
    straight = solve(bvp, constant(bvp, P=load))
    found = other_solutions(bvp, [straight])
    one, two = (end_curvature(load, quarters) for quarters in (2, 4))
    np.testing.assert_allclose(sorted(s["k0"] for s in found), [-one, -two, two, one], rtol=1e-8)
    pairs = other_solutions(bvp, [straight], images=[upside_down])
    np.testing.assert_allclose(sorted(abs(s["k0"]) for s in pairs), [two, one], rtol=1e-8)
    assert len(other_solutions(bvp, [straight], limit=1)) == 1


def test_the_clamped_elastica_above_its_second_euler_load() -> None:
    """Both pairs, the inner parameter V solved for; the first mode in closed form, P = (4 K(m))^2."""
    bvp, load = elastica(), 84.0
    straight = solve(bvp, constant(bvp, P=load), LOAD)
    known = [straight]
    modes = ({2: 2.2}, {1: -0.25, 3: 0.75})  # amplitudes of sin(n pi s) in the angle, by n
    for mode in modes:
        for side in (1.0, -1.0):

            def shape(s: np.ndarray, mode: dict[int, float] = mode, side: float = side) -> np.ndarray:
                angle = sum(a * np.sin(n * np.pi * s) for n, a in mode.items())
                curvature = sum(a * n * np.pi * np.cos(n * np.pi * s) for n, a in mode.items())
                return side * np.column_stack([0 * s, angle, curvature])

            guess = Solution.from_function(shape, bvp.unknowns, {"P": load, "V": 0.0})
            known.append(deflated_solve(bvp, guess, known, LOAD))
    assert all(s["P"] == pytest.approx(load, abs=1e-12) for s in known)
    curvatures = [s["k0"] for s in known]
    assert len(set(np.round(curvatures, 6))) == 5
    first = [s for s in known[1:] if abs(s["V"]) < 1e-6]
    np.testing.assert_allclose([abs(s["k0"]) for s in first], end_curvature(load, 4), rtol=1e-8)
    assert sum(s["k0"] for s in known) == pytest.approx(0.0, abs=1e-6)  # two pairs


@pytest.mark.slow
def test_phase_separation_has_a_pair_for_each_wave_that_fits() -> None:
    """Mean zero: waves n = 1, 2, 3 with eps pi n < 1, each up and down; mu, solved for, vanishes by symmetry."""
    bvp = phase_separation()
    uniform = solve(bvp, constant(bvp), ("m", "mu"))
    found = other_solutions(bvp, [uniform], ("m", "mu"))
    waves = [int((np.diff(np.sign(s(np.linspace(0, 1, 400), "u"))) != 0).sum()) for s in found]
    assert sorted(waves) == [1, 1, 2, 2, 3, 3]
    np.testing.assert_allclose([s["mu"] for s in found], 0.0, atol=1e-7)
    for s in found:
        assert s.mean(s.stages[..., 0]) == pytest.approx(0.0, abs=1e-9)
        assert s.error < 1e-8


def test_perturbed_gelfand_has_three_solutions_between_its_folds() -> None:
    bvp = gelfand()
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 6.0)}))
    low, high = sorted(x.solution["lam"] for x in branch.of_kind("fold"))
    lam = (low + high) / 2
    first = solve(bvp, constant(bvp, lam=lam))
    found = [first, *other_solutions(bvp, [first])]
    crossed = np.flatnonzero(np.diff(np.sign(branch.column("lam") - lam)))
    expected = [solve(bvp, branch.points[i].solution.with_parameters(lam=lam))["mean"] for i in crossed]
    np.testing.assert_allclose(sorted(s["mean"] for s in found), sorted(expected), rtol=1e-7)
    assert len(found) == 3


@pytest.mark.slow
def test_an_isola_that_tracing_misses() -> None:
    """lam + mu^2 = fold: the lower and middle solution exist between two values of mu and form a closed branch."""
    bvp = gelfand()
    fold = max(
        x.solution["lam"]
        for x in trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (0.0, 6.0)})).of_kind("fold")
    )
    options = TraceOptions(bounds={"mu": (-1.5, 1.5)})
    arch = Solution.from_function(
        lambda s: np.column_stack([200 * s * (1 - s), 200 * (1 - 2 * s)]), bvp.unknowns,
        {"lam": 4.0, "mu": 1.5, "eps": 0.2},
    )  # fmt: skip
    burning = solve(bvp, arch, ("mu",))
    main = trace(bvp, burning, ("mu",), options)
    assert main.special == ()
    assert main.column("mu").min() == pytest.approx(-1.5)
    start = solve(bvp, main.points[int(np.abs(main.column("mu")).argmin())].solution.with_parameters(mu=0.0), ("mu",))
    found = other_solutions(bvp, [start], ("mu",))
    assert len(found) == 2
    isola = trace(bvp, found[0], ("mu",), options)
    assert isola.closed
    assert [x.kind for x in isola.special] == ["fold", "fold"]
    np.testing.assert_allclose(
        sorted(x.solution["mu"] for x in isola.special), np.sqrt(fold - 4.0) * np.array([-1.0, 1.0]), atol=1e-8
    )
    nearest = min(isola, key=lambda p: abs(p.solution["mean"] - found[1]["mean"]) + abs(p.solution["mu"])).solution
    assert solve(bvp, nearest.with_parameters(mu=0.0), ("mu",))["mean"] == pytest.approx(found[1]["mean"], rel=1e-7)


# -- wrong input ------------------------------------------------------------------------------------------------------


def test_what_is_asked_for_is_checked() -> None:
    low = solve(bratu(), constant(bratu(), lam=1.0))
    with pytest.raises(ValueError, match=r"known: expected solutions at lam = 2, got one at 1"):
        deflated_solve(bratu(), constant(bratu(), lam=2.0), [low])
    with pytest.raises(ValueError, match="known: expected at least one solution, got none"):
        other_solutions(bratu(), [])
    with pytest.raises(ValueError, match=r"power, shift: expected .* got 0\.5, 1\.0"):
        deflated_solve(bratu(), low, [], power=0.5)
    with pytest.raises(ValueError, match=r"free: expected 2 parameter name\(s\)"):
        other_solutions(elastica(), [constant(elastica())])
