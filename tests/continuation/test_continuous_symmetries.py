"""Continuous symmetries: declared generators, one branch for each orbit, folds and branch points modulo the group."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, constant
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipk

from rodatlas.continuation import (
    BVP,
    Branch,
    ContinuousSymmetry,
    EndReason,
    MeshControl,
    NewtonCode,
    NotConverged,
    Solution,
    Status,
    StepControl,
    Symmetry,
    TraceOptions,
    follow_locus,
    integral_of,
    is_symmetry,
    solve,
    switch,
    switch_all,
    trace,
)

SHIFT = ContinuousSymmetry("shift", shift=True)
TURN = ContinuousSymmetry("turn", lambda s, u, p: {"x": -u.y, "y": u.x, "xs": -u.ys, "ys": u.xs})
TIGHT = TraceOptions(mesh=MeshControl(tolerance=1e-10))


def ring(symmetries=(SHIFT,)) -> BVP:
    """u'' + lam u + mu u^3 - k u^5 = 0 on a circle of length one; mu = -1, k = 0 by default."""
    return BVP(
        lambda s, u, p: [u.v, -(p.lam * u.u + p.mu * u.u**3 - p.k * u.u**5)],
        lambda left, right, p: [left.u - right.u, left.v - right.v],
        unknowns=("u", "v"), parameters={"lam": 30.0, "mu": -1.0, "k": 0.0}, symmetries=symmetries,
        observables={"power": integral_of(lambda s, u, p: u.u**2)}, name="ring",
    )  # fmt: skip


def waves(symmetries=(TURN, SHIFT)) -> BVP:
    """Complex Ginzburg-Landau equation A'' + lam A - |A|^2 A = 0 on a circle, A = x + iy."""
    return BVP(
        lambda s, u, p: [
            u.xs, u.ys, -(p.lam - u.x**2 - u.y**2) * u.x, -(p.lam - u.x**2 - u.y**2) * u.y,
        ],
        lambda left, right, p: [left.x - right.x, left.y - right.y, left.xs - right.xs, left.ys - right.ys],
        unknowns=("x", "y", "xs", "ys"), parameters={"lam": 30.0}, symmetries=symmetries,
        observables={"power": integral_of(lambda s, u, p: u.x**2 + u.y**2),
                     "power_squared": integral_of(lambda s, u, p: (u.x**2 + u.y**2) ** 2)},
        name="waves",
    )  # fmt: skip


def rest(bvp: BVP, **parameters: float) -> Solution:
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}
    )


def plane_wave(bvp: BVP, q: float, lam: float) -> Solution:
    r = np.sqrt(lam - q * q)

    def wave(s: np.ndarray) -> np.ndarray:
        c, d = r * np.cos(q * s), r * np.sin(q * s)
        return np.stack([c, d, -q * d, q * c], axis=1)

    return Solution.from_function(wave, bvp.unknowns, {"lam": lam})


def sn_wave(m: float, k: int) -> tuple[float, float]:
    """lam and largest u of u = A sn(b s | m) with k periods: b = 4 k K(m), lam = (1 + m) b^2 and A^2 = 2 m b^2."""
    b = 4 * k * ellipk(m)
    return float((1 + m) * b * b), float(np.sqrt(2 * m) * b)


def amplitude_at(lam: float, k: int) -> float:
    return sn_wave(brentq(lambda m: sn_wave(m, k)[0] - lam, 0.0, 1 - 1e-9, xtol=1e-15), k)[1]


def parameter_at(top: float, k: int) -> float:
    return sn_wave(brentq(lambda m: sn_wave(m, k)[1] - top, 0.0, 1 - 1e-9, xtol=1e-15), k)[0]


def amplitude(solution: Solution) -> float:
    """Largest u, from the first integral v^2/2 + lam u^2/2 - u^4/4."""
    (u, v), lam = solution.values[0], solution["lam"]
    energy = v * v / 2 + lam * u * u / 2 - u**4 / 4
    return float(np.sqrt(lam - np.sqrt(lam * lam - 4 * energy)))


# -- declarations -----------------------------------------------------------------------------------------------------


def test_generators_are_checked() -> None:
    bvp = waves()
    assert [g.name for g in bvp.generators] == ["turn", "shift"]
    assert bvp.symmetries == {}
    with pytest.raises(ValueError, match="'turn' does not respect the equation for x, y"):
        waves([ContinuousSymmetry("turn", lambda s, u, p: {"x": -u.y, "y": u.x})])
    with pytest.raises(ValueError, match=r"'growth' does not respect the equation for xs, ys"):
        waves([ContinuousSymmetry("growth", lambda s, u, p: list(u))])


def test_boundary_conditions_and_integrals_have_to_keep_it() -> None:
    def pinned(integrals=()) -> BVP:
        return BVP(
            lambda s, u, p: [u.v, -p.lam * u.u + p.c], lambda left, right, p: [left.u - right.u, left.v - right.v],
            integrals, unknowns=("u", "v"), parameters={"lam": 1.0, "c": 0.0},
        )  # fmt: skip

    assert is_symmetry(pinned(), SHIFT)
    assert is_symmetry(pinned(lambda s, u, p: u.u), SHIFT)
    assert not is_symmetry(pinned(lambda s, u, p: u.u * np.cos(2 * np.pi * s)), SHIFT)
    clamped = BVP(lambda s, u, p: [u.v, -p.lam * u.u], lambda left, right, p: [left.u, right.u - right.v],
                  unknowns=("u", "v"), parameters={"lam": 1.0})  # fmt: skip
    assert not is_symmetry(clamped, SHIFT)
    assert not is_symmetry(clamped, Symmetry("mirror", {"v": -1}))
    assert is_symmetry(clamped, Symmetry("mirror", {"u": -1, "v": -1}))


def test_equations_that_depend_on_s_are_not_shifted() -> None:
    forced = BVP(
        lambda s, u, p: [u.v, -p.lam * u.u + np.cos(2 * np.pi * s)],
        lambda left, right, p: [left.u - right.u, left.v - right.v], unknowns=("u", "v"), parameters={"lam": 1.0},
    )  # fmt: skip
    assert not is_symmetry(forced, SHIFT)


@pytest.mark.parametrize(("declared", "message"), [
    (lambda: ContinuousSymmetry("none"), "'none': expected a generator, or shift=True, got neither"),
    (lambda: ContinuousSymmetry("bad", 1.0), "'bad': expected a function as generator, got 1.0"),
    (lambda: ring([ContinuousSymmetry("bad", lambda s, u, p: {"w": u.u})]), "'bad': expected some of u, v, got 'w'"),
    (lambda: ring([ContinuousSymmetry("bad", lambda s, u, p: [u.u])]), "'bad': expected 2 values, one per unknown"),
    (lambda: ring([SHIFT, SHIFT]), "expected distinct names without '\\*', got 'shift'"),
    (lambda: ring([0]), "expected Symmetry and ContinuousSymmetry objects, got 0"),
])  # fmt: skip
def test_wrong_declarations(declared, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        declared()


# -- one branch for each circle ---------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("k", "low", "high"), [(1, 35.0, 60.0), (5, 980.0, 1000.0)])
def test_a_circle_of_branches_is_one_branch(k: int, low: float, high: float) -> None:
    bvp, options = ring(), replace(TIGHT, bounds={"lam": (low, high)})
    (point,) = trace(bvp, rest(bvp, lam=low), ("lam",), options).special
    assert (point.multiplicity, point.continuum, point.status) == (2, True, Status.CONVERGED)
    assert (point.isotropy, point.breaks) == (("shift",), ("shift",))
    assert point.solution["lam"] == pytest.approx((2 * np.pi * k) ** 2, rel=1e-10)
    (branch,) = switch_all(bvp, point, ("lam",), options)
    assert branch.ends == (EndReason.BRANCH_POINT, EndReason.RANGE)
    assert (branch.orbit, branch.special, branch.discrepancies) == (("shift",), (), ())
    assert branch.free == ("lam",)
    assert all(p.solution.parameter_names == tuple(bvp.parameters) for p in branch)
    assert all(p.tangent.shape == (1,) for p in branch)
    assert branch.verification.unfolding < 1e-8
    for p in branch.points[5::7]:
        assert p.solution["lam"] == pytest.approx(parameter_at(amplitude(p.solution), k), rel=1e-9)


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0])
def test_a_moved_branch_meets_the_trunk_in_one_branch_point(factor: float) -> None:
    """It passes the trunk and comes back as another member of its orbit; nothing else is singular."""
    bvp, a, step = ring(), 0.9, StepControl()
    options = TraceOptions(
        bounds={"lam": (35.0, 60.0)},
        step=replace(
            step, initial=factor * step.initial, maximum=factor * step.maximum, target=factor**3 * step.target
        ),
    )
    angles = 2 * np.pi

    def guess(s: np.ndarray) -> np.ndarray:
        return a * np.stack([np.cos(angles * s + 0.3), -angles * np.sin(angles * s + 0.3)], axis=1)

    start = Solution.from_function(guess, bvp.unknowns, {**bvp.parameters, "lam": angles**2 + 0.75 * a * a})
    branch = trace(bvp, start, ("lam",), options)
    (point,) = branch.special
    assert (point.kind, point.multiplicity, point.turns) == ("branch point", 1, True)
    assert point.solution["lam"] == pytest.approx(angles**2, rel=1e-8)
    assert branch.discrepancies == ()
    assert branch.verification.complete
    assert branch.verification.unfolding < 1e-7
    trunk = switch(bvp, point, ("lam",), options)
    assert trunk.orbit == ()
    assert trunk.column("power").max() < 1e-15


def test_solve_and_rotate() -> None:
    """Any member of an orbit is a solution, and solved for as it is."""
    bvp, options = ring(), replace(TIGHT, bounds={"lam": (35.0, 50.0)})
    (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).special
    (branch,) = switch_all(bvp, point, ("lam",), options)
    end = branch.points[-1].solution
    for shift in np.arange(0.0, 1.0, 0.125):
        guess = Solution.from_function(
            lambda s, by=shift: end((s + by) % 1.0), bvp.unknowns, {**bvp.parameters, "lam": 50.0}
        )
        found = solve(bvp, guess, ("lam",), TIGHT)
        assert np.abs(found(np.linspace(0, 1, 7)) - end((np.linspace(0, 1, 7) + shift) % 1.0)).max() < 1e-5
        assert found["power"] == pytest.approx(end["power"], rel=1e-9)


def test_a_guess_of_a_moved_state_that_leads_to_the_trunk() -> None:
    bvp = ring()
    noise = Solution.from_function(
        lambda s: 0.01 * np.stack([np.sin(2 * np.pi * s), np.cos(2 * np.pi * s)], axis=1), bvp.unknowns,
        {**bvp.parameters, "lam": 30.0},
    )  # fmt: skip
    branch = trace(bvp, noise, ("lam",), TraceOptions(bounds={"lam": (30.0, 35.0)}))
    assert branch.orbit == ()
    assert branch.column("power").max() < 1e-15


def test_an_undeclared_symmetry_is_named() -> None:
    bvp, options = ring([]), TraceOptions(bounds={"lam": (35.0, 45.0)})
    (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).special
    assert point.continuum
    for follow in (switch, switch_all):
        with pytest.raises(ValueError, match="The problem has a continuous symmetry: declare it"):
            follow(bvp, point, ("lam",), options)


def test_a_moved_state_without_a_declaration_is_refused() -> None:
    """Its equations are singular, though no state near by is: no mesh would make the error small."""
    bvp, w = ring([]), 2 * np.pi
    start = Solution.from_function(
        lambda s: 0.9 * np.stack([np.cos(w * s), -w * np.sin(w * s)], axis=1), bvp.unknowns,
        {**bvp.parameters, "lam": w * w + 0.6},
    )  # fmt: skip
    with pytest.raises(NotConverged, match="declare the continuous symmetry that may move this state") as caught:
        trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (38.0, 45.0)}))
    assert caught.value.code is NewtonCode.SINGULAR


def test_a_branch_with_an_orbit_is_stored(tmp_path) -> None:
    bvp, options = ring(), TraceOptions(bounds={"lam": (35.0, 45.0)})
    trunk = trace(bvp, rest(bvp, lam=35.0), ("lam",), options)
    trunk.save(tmp_path / "trunk.h5")
    (branch,) = switch_all(bvp, Branch.load(tmp_path / "trunk.h5").special[0], ("lam",), options)
    branch.save(tmp_path / "branch.h5")
    again = Branch.load(tmp_path / "branch.h5")
    assert again.orbit == ("shift",)
    assert again.verification == branch.verification


# -- several generators -----------------------------------------------------------------------------------------------


def test_plane_and_standing_waves_leave_a_fourfold_point() -> None:
    """|A|^2 = lam - q^2 for both plane waves; the standing wave is the real one of the ring."""
    bvp, options = waves(), TraceOptions(bounds={"lam": (35.0, 50.0)})
    (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).special
    assert (point.multiplicity, len(point.rays), point.unverified) == (4, 5, 0)
    assert point.breaks == ("turn", "shift")
    ends = [b.points[-1].solution for b in switch_all(bvp, point, ("lam",), options)]
    power = sorted(end["power"] for end in ends)
    assert power[1:] == pytest.approx([50 - 4 * np.pi**2] * 2, rel=1e-8)
    assert sorted(end["power_squared"] / end["power"] ** 2 for end in ends)[:2] == pytest.approx([1, 1], abs=1e-10)
    top = amplitude_at(50.0, 1)
    mean = quad(lambda u: u * u / np.sqrt((1 - u * u) * (50 - top**2 * (1 + u * u) / 2)), 0, 1)[0] * 4 * top**2
    assert power[0] == pytest.approx(mean, rel=1e-7)


@pytest.mark.slow
def test_eckhaus_points_on_plane_waves() -> None:
    """Waves of wave number q lose stability to modulations k at lam = 3 q^2 - k^2/2, each a circle of branches."""
    bvp, q, k = waves(), 4 * np.pi, 2 * np.pi
    branch = trace(bvp, plane_wave(bvp, q, 470.0), ("lam",), TraceOptions(bounds={"lam": (280.0, 470.0)}), both=False,
                   direction=-1.0)  # fmt: skip
    assert branch.orbit == ("turn", "shift")
    assert np.allclose(branch.column("power"), branch.column("lam") - q * q, rtol=1e-8)
    expected = [3 * q * q - (n * k) ** 2 / 2 for n in (1, 2, 3)]
    assert [x.solution["lam"] for x in branch.special] == pytest.approx(expected, rel=2e-8)
    assert {(x.kind, x.multiplicity, x.continuum, len(x.rays)) for x in branch.special} == {
        ("branch point", 2, True, 3)
    }
    (side,) = switch_all(bvp, branch.special[1], ("lam",), TraceOptions(bounds={"lam": (280.0, 470.0)}))
    assert side.orbit == ("turn", "shift")
    x, y, xs, ys = side.points[-1].solution.values.T
    momentum, modulus = x * ys - y * xs, np.hypot(x, y)
    assert np.ptp(momentum) < 1e-6 * momentum.mean()  # Noether's first integral of the turn
    assert np.ptp(modulus) > 1.0


# -- symmetries that move parameters ----------------------------------------------------------------------------------


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def column() -> BVP:
    """A pinned column that buckles in every plane; the lateral forces ny, nz turn with it."""
    spin = ContinuousSymmetry(
        "spin", lambda s, u, p: {"ty": -u.tz, "tz": u.ty, "my": -u.mz, "mz": u.my, "y": -u.z, "z": u.y},
        parameters=lambda p: {"ny": -p.nz, "nz": p.ny},
    )  # fmt: skip

    def rhs(s, u, p):
        t, m = (u.tx, u.ty, u.tz), (u.mx, u.my, u.mz)
        return [*cross(m, t), *cross((-p.P, p.ny, p.nz), t), u.ty, u.tz]

    def conditions(left, right, p):
        clamped = [left.mx, left.my, left.mz, right.my, right.mz, left.tx**2 + left.ty**2 + left.tz**2 - 1]
        return [left.y, left.z, right.y, right.z, *clamped]

    return BVP(
        rhs, conditions, unknowns=("tx", "ty", "tz", "mx", "my", "mz", "y", "z"),
        parameters={"P": 9.0, "ny": 0.0, "nz": 0.0}, symmetries=[spin],
    )  # fmt: skip


def test_parameters_that_move_along() -> None:
    """The buckled column is the planar elastica: sin(t0/2) = k with 4 K(k)^2 = P."""
    bvp, options = column(), TraceOptions(bounds={"P": (8.0, 20.0)})
    start = Solution.from_function(
        lambda s: np.tile([1.0, 0, 0, 0, 0, 0, 0, 0], (len(s), 1)), bvp.unknowns, bvp.parameters
    )
    free = ("P", "ny", "nz")
    (point,) = trace(bvp, start, free, replace(options, bounds={"P": (9.0, 11.0)})).special
    (buckled,) = switch_all(bvp, point, free, options)
    m = brentq(lambda m: 4 * ellipk(m) ** 2 - 20.0, 0.01, 0.9)
    assert np.arccos(buckled.points[-1].solution["tx"][0]) == pytest.approx(2 * np.arcsin(np.sqrt(m)), rel=1e-7)
    with pytest.raises(
        ValueError, match=r"expected 'ny' among the free parameters behind the first, .* 'spin' changes"
    ):
        trace(bvp, buckled.points[-1].solution.with_parameters(ny=0.1, nz=0.1), ("ny", "P", "nz"), options)


def test_scalar_equations_on_a_circle() -> None:
    spin = ContinuousSymmetry("spin", lambda s, u, p: {"x": -u.y, "y": u.x})
    bvp = algebraic(lambda u, p: [v * (p.lam - u.x**2 - u.y**2) for v in (u.x, u.y)], ("x", "y"), symmetries=[spin])
    options = TraceOptions(bounds={"lam": (-0.5, 0.5)})
    (point,) = trace(bvp, constant(bvp, lam=-0.3), ("lam",), options).special
    (branch,) = switch_all(bvp, point, ("lam",), options)
    for p in branch:
        assert p.solution.values[0] @ p.solution.values[0] == pytest.approx(p.solution["lam"], abs=1e-9)


# -- limit cycles: a phase condition determines the period ------------------------------------------------------------


def hopf(symmetries) -> BVP:
    """r' = r (a - r^2), phi' = 1 + c r^2 in scaled time: a circle of radius sqrt(a), period 2 pi/(1 + c a)."""

    def rhs(s, u, p):
        square = u.x**2 + u.y**2
        speed = 1 + p.c * square
        return [p.T * (p.a * u.x - speed * u.y - u.x * square), p.T * (p.a * u.y + speed * u.x - u.y * square)]

    return BVP(
        rhs, lambda left, right, p: [left.x - right.x, left.y - right.y], unknowns=("x", "y"),
        parameters={"a": 0.25, "T": 6.0, "c": 0.5}, symmetries=symmetries,
    )  # fmt: skip


@pytest.mark.parametrize("symmetries", [[SHIFT], [SHIFT, ContinuousSymmetry("turn", lambda s, u, p: [-u.y, u.x])]])
def test_the_period_of_a_limit_cycle(symmetries) -> None:
    """Turning and shifting move the cycle in one direction, though they do not move the guess so."""
    bvp = hopf(symmetries)
    guess = Solution.from_function(
        lambda s: 0.45 * np.stack([np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)], axis=1), bvp.unknowns, bvp.parameters
    )
    branch = trace(bvp, guess, ("a", "T"), TraceOptions(bounds={"a": (-0.05, 2.0)}))
    assert branch.orbit == tuple(x.name for x in symmetries)
    assert np.allclose(branch.column("T"), 2 * np.pi / (1 + 0.5 * branch.column("a")), atol=2e-8)
    assert [p.tangent.shape for p in branch][:1] == [(2,)]
    (point,) = branch.special  # where the cycle shrinks to the state of rest
    assert point.solution["a"] == pytest.approx(0.0, abs=1e-8)
    assert (point.continuum, len(point.rays)) == (True, 2)
    still = rest(bvp, a=-0.2)
    with pytest.raises(NotConverged, match="nothing determines T") as caught:
        trace(bvp, still, ("a", "T"), TraceOptions(bounds={"a": (-0.3, 0.0)}))
    assert caught.value.undetermined == ("T",)


def test_the_period_of_van_der_pols_oscillation() -> None:
    bvp = BVP(
        lambda s, u, p: [p.T * u.v, p.T * (p.mu * (1 - u.u**2) * u.v - u.u)],
        lambda left, right, p: [left.u - right.u, left.v - right.v], unknowns=("u", "v"),
        parameters={"mu": 0.1, "T": 6.28}, symmetries=[SHIFT],
    )  # fmt: skip
    guess = Solution.from_function(
        lambda s: 2 * np.stack([np.cos(2 * np.pi * s), -np.sin(2 * np.pi * s)], axis=1), bvp.unknowns, bvp.parameters
    )
    branch = trace(bvp, guess, ("mu", "T"), TraceOptions(bounds={"mu": (0.1, 5.0)}, zeros={"mu": 1.0}), both=False)
    assert branch.special[0].solution["T"] == pytest.approx(6.6632868593, rel=5e-8)
    assert branch.points[-1].solution["T"] == pytest.approx(11.6122306677, rel=1e-8)


# -- in two parameters ------------------------------------------------------------------------------------------------


def parameter_of_wave(top: float, mu: float) -> float:
    """lam of the wave with one period, largest u = top, of the ring with k = 1: the period by quadrature."""

    def misfit(lam: float) -> float:
        def speed(t: float) -> float:
            s = np.sin(t) ** 2
            return float(np.sqrt(lam + mu * top**2 * (1 + s) / 2 - top**4 * (1 + s + s * s) / 3))

        return 4 * quad(lambda t: 1 / speed(t), 0, np.pi / 2, epsabs=1e-13, epsrel=1e-13)[0] - 1

    return float(brentq(misfit, 15.0, 60.0, xtol=1e-13))


def test_folds_and_branch_points_modulo_the_group_in_two_parameters() -> None:
    bvp, options = ring(), TraceOptions(bounds={"lam": (10.0, 45.0)})
    (point,) = trace(bvp, rest(bvp, lam=35.0, mu=6.0, k=1.0), ("lam",), options).special
    (branch,) = switch_all(bvp, point, ("lam",), options)
    (fold,) = branch.of_kind("fold")
    bounds = {"mu": (1.0, 7.0), "lam": (0.0, 60.0)}
    folds = follow_locus(bvp, fold, ("lam", "mu"), TraceOptions(bounds=bounds))
    assert folds.ends == (EndReason.RANGE, EndReason.RANGE)
    for p in (folds.points[0], folds.points[-1]):
        mu, near = p.solution["mu"], float(np.abs(p.solution["u"]).max())
        known = minimize_scalar(lambda top, mu=mu: parameter_of_wave(top, mu), bounds=(0.9 * near, 1.1 * near),
                                method="bounded", options={"xatol": 1e-8})  # fmt: skip
        assert p.solution["lam"] == pytest.approx(known.fun, rel=1e-8)
        assert p.tangent.shape == (2,)
        assert p.solution.parameter_names == ("lam", "mu", "k")
    pitchforks = follow_locus(bvp, point, ("lam", "mu"), TraceOptions(bounds={"mu": (-5.0, 7.0)}))
    assert np.allclose([p.solution["lam"] for p in pitchforks.points], 4 * np.pi**2, rtol=1e-8)
    (event,) = pitchforks.events
    assert event.kind == "criticality"
    assert event.solution["mu"] == pytest.approx(0.0, abs=1e-7)
