"""The worked examples print what they promise."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, EULER_LOADS
from scipy.integrate import quad, solve_bvp, solve_ivp
from scipy.optimize import brentq, fsolve, least_squares, minimize_scalar, newton
from scipy.special import airy, ellipe, ellipk, ellipkinc, erf, jv

from rodatlas.continuation import Solution, solve

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str):
    return runpy.run_path(str(EXAMPLES / name))["main"]()


def test_bratu(capsys: pytest.CaptureFixture[str]) -> None:
    branch = run("bratu.py")
    assert "fold at lam = 3.5138307191" in capsys.readouterr().out
    assert branch.special[0].solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-10)


def test_elastica(capsys: pytest.CaptureFixture[str]) -> None:
    column, buckled = run("elastica.py")
    out = capsys.readouterr().out
    np.testing.assert_allclose([x.solution["P"] for x in column.special], EULER_LOADS, rtol=0, atol=1e-8)
    assert "buckling load 39.47841760" in out
    assert len(buckled) == 2
    assert out.count("P = 53.2741126") == 2
    assert out.count("energy = 22.8023670") == 2
    assert "+0.37330643" in out
    assert "-0.37330643" in out


def test_phase_separation(capsys: pytest.CaptureFixture[str]) -> None:
    uniform, front = run("phase_separation.py")
    assert "branch point at m = +0.54811919" in capsys.readouterr().out
    assert len(uniform.special) == 6
    assert front.closed
    folds = [abs(x.solution["m"]) for x in front.of_kind("fold")]
    assert len(folds) == 4
    np.testing.assert_allclose(folds, folds[0], atol=1e-8)  # four mirror images of one fold


def test_stepped_column(capsys: pytest.CaptureFixture[str]) -> None:
    branch, locus = run("stepped_column.py")
    assert "buckling load 23.572548" in capsys.readouterr().out
    assert branch.special[0].solution["P"] == pytest.approx(stepped_load(0.3137), rel=1e-8)
    assert len(locus.points) > 10
    for point in locus.points:
        assert point.solution["P"] == pytest.approx(stepped_load(point.solution["c"]), rel=3e-8)


def stepped_load(c: float) -> float:
    """tan(kc) + 2 tan(k (1 - c)/2) = 0, times both cosines."""

    def mismatch(p: float) -> float:
        one, two = np.sqrt(p) * c, np.sqrt(p) * (1 - c) / 2
        return float(np.sin(one) * np.cos(two) + 2 * np.sin(two) * np.cos(one))

    return float(brentq(mismatch, 9.0, 4 * np.pi**2, xtol=1e-13))


def test_support(capsys: pytest.CaptureFixture[str]) -> None:
    branch, locus = run("support.py")
    assert "together at k = 157.91367, P = 39.478418" in capsys.readouterr().out
    one, two = (x.solution["P"] for x in branch.special)
    assert two == pytest.approx(4 * np.pi**2, rel=2e-8)
    (crossing,) = locus.events
    assert crossing.kind == "crossing"
    assert crossing.solution["k"] == pytest.approx(16 * np.pi**2, rel=1e-7)
    for load, k in [(one, 100.0), *((p.solution["P"], p.solution["k"]) for p in locus.points)]:
        half = np.sqrt(load) / 2
        spring = k / 4 * (half * np.cos(half) - np.sin(half))
        assert load * half * np.cos(half) == pytest.approx(spring, rel=1e-6, abs=1e-6)


def test_contact(capsys: pytest.CaptureFixture[str]) -> None:
    branch = run("contact.py")
    assert "P = 400.0: contact from 0.157080 to 0.842920, force 254.64791" in capsys.readouterr().out
    k = np.sqrt(branch.column("P"))
    np.testing.assert_allclose(branch.column("c"), np.pi / k, rtol=1e-8)
    np.testing.assert_allclose(branch.column("d"), 1 - np.pi / k, rtol=1e-8)
    for name in ("R", "Q"):
        np.testing.assert_allclose(branch.column(name), -0.1 * k**3 / np.pi, rtol=1e-7)
    np.testing.assert_allclose(branch.column("halfway"), 0.1 * (0.5 + 1 / np.pi), rtol=1e-8)
    flat = branch.points[-1].solution(np.linspace(0.2, 0.8, 7), "w")
    np.testing.assert_allclose(flat, 0.1, atol=1e-8)


def test_stefan(capsys: pytest.CaptureFixture[str]) -> None:
    branch = run("stefan.py")
    assert "S = 0.001: l = 0.022356954" in capsys.readouterr().out
    length, number = branch.column("l"), branch.column("S")
    np.testing.assert_allclose(np.sqrt(np.pi) * length * np.exp(length**2) * erf(length), number, rtol=1e-7)
    assert sorted((number[0], number[-1])) == pytest.approx([1e-6, 100.0], rel=1e-12)
    np.testing.assert_allclose(branch.column("half"), 1 - erf(length / 2) / erf(length), atol=1e-8)
    assert len(branch) < 80


def test_gelfand(capsys: pytest.CaptureFixture[str]) -> None:
    """The folds by shooting: the linearized solution vanishes at both ends. The cusp is the published one."""
    branch, locus = run("gelfand.py")
    assert "cusp at eps = 0.24578" in capsys.readouterr().out
    folds = branch.of_kind("fold")
    assert len(folds) == 2
    for fold in folds:
        lam, slope = shoot_gelfand_fold(fold.solution["lam"], fold.solution["v"][0])
        assert fold.solution["lam"] == pytest.approx(lam, rel=1e-8)
        assert fold.solution["v"][0] == pytest.approx(slope, rel=1e-7)
    assert [e.kind for e in locus.events] == ["cusp"]
    assert locus.events[0].solution["eps"] == pytest.approx(0.2457803, abs=5e-7)
    bratu = next(p.solution for p in locus.points if abs(p.solution["eps"]) < 1e-8)
    assert bratu["lam"] == pytest.approx(BRATU_FOLD, abs=1e-8)


def shoot_gelfand_fold(lam: float, slope: float, eps: float = 0.2) -> tuple[float, float]:
    """lam and u'(0) at which u(1) and its derivative with respect to u'(0) vanish."""

    def residual(x: np.ndarray) -> np.ndarray:
        def rhs(s: float, y: np.ndarray) -> list[float]:
            f = x[0] * np.exp(y[0] / (1 + eps * y[0]))
            return [y[1], -f, y[3], -f / (1 + eps * y[0]) ** 2 * y[2]]

        end = solve_ivp(rhs, (0, 1), [0, x[1], 0, 1], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        return end[[0, 2]]

    found = fsolve(residual, [1.001 * lam, 0.999 * slope], xtol=1e-12)
    return float(found[0]), float(found[1])


def test_foundation() -> None:
    """P = (n pi)^2 + k / (n pi)^2; modes m and n change places at k = (m n)^2 pi^4."""
    column, loci = run("foundation.py")
    waves = np.pi * np.arange(1, 5)
    loads = [x.solution["P"] for x in column.special]
    np.testing.assert_allclose(loads, waves**2 + 100 / waves**2, rtol=1e-9)
    for n, locus in zip((1, 2), loci, strict=True):
        wave = (n * np.pi) ** 2
        np.testing.assert_allclose(locus.column("P"), wave + locus.column("k") / wave, rtol=1e-8)
        assert [e.kind for e in locus.events] == ["crossing"]
        assert locus.events[0].solution["k"] == pytest.approx(4 * np.pi**4, rel=1e-7)
        assert locus.events[0].solution["P"] == pytest.approx(5 * np.pi**2, rel=1e-7)


def test_follower() -> None:
    column, buckled, locus = run("follower.py")
    angle = np.arccos(-1 / 3)
    loads = [x.solution["P"] for x in column.of_kind("branch point")]
    np.testing.assert_allclose(loads, [angle**2, (2 * np.pi - angle) ** 2], rtol=1e-9)
    (zero,) = buckled.of_kind("zero of alpha")
    assert zero.solution["P"] == pytest.approx(follower_load(alpha=2.0, eta=0.25), rel=1e-9)
    cosine = np.cos(np.sqrt(locus.column("P")))
    np.testing.assert_allclose(locus.column("eta"), -cosine / (1 - cosine), atol=1e-8)
    (turn,) = locus.of_kind("extremum")
    assert turn.parameter == "eta"
    assert turn.solution["eta"] == pytest.approx(0.5, abs=1e-9)
    assert turn.solution["P"] == pytest.approx(np.pi**2, abs=1e-6)


def follower_load(alpha: float, eta: float) -> float:
    """Load of the cantilever whose tip has turned by alpha; SciPy's elliptic integrals take the squared modulus."""
    m = np.sin((1 - eta) * alpha / 2)
    return float((ellipk(m**2) + ellipkinc(np.arcsin(np.sin(eta * alpha / 2) / m), m**2)) ** 2)


def test_arch() -> None:
    branch, (folds, sideways) = run("arch.py")
    assert [x.kind for x in branch.special] == ["branch point", "fold", "fold", "branch point"]
    a = np.array([np.sqrt(5), np.sqrt(8 / 3), -np.sqrt(8 / 3), -np.sqrt(5)])
    np.testing.assert_allclose([x.solution["a"] for x in branch.special], a, rtol=1e-6)
    loads = [x.solution["q"] / np.pi**4 for x in branch.special]
    np.testing.assert_allclose(loads, 3 - a + a * (9 - a**2), rtol=1e-9)
    for locus, squared in ((folds, (folds.column("h") ** 2 - 1) / 3), (sideways, sideways.column("h") ** 2 - 4)):
        h, a = locus.column("h"), locus.column("a")
        np.testing.assert_allclose(a**2, squared, atol=1e-5)
        np.testing.assert_allclose(locus.column("q") / np.pi**4, h - a + a * (h**2 - a**2), atol=1e-7)
    (cusp,) = folds.of_kind("cusp")
    assert cusp.solution["h"] == pytest.approx(1.0, abs=1e-7)
    assert cusp.solution["q"] == pytest.approx(np.pi**4, rel=1e-7)
    (turn,) = [e for e in sideways.of_kind("extremum") if e.parameter == "h"]
    assert turn.solution["h"] == pytest.approx(2.0, abs=1e-7)
    met = [e.solution["h"] for e in folds.of_kind("coalescence")]
    np.testing.assert_allclose(met, [np.sqrt(5.5), np.sqrt(5.5)], rtol=1e-6)
    met = sorted(e.solution["q"] / np.pi**4 for e in sideways.of_kind("coalescence"))
    np.testing.assert_allclose(met, np.sqrt(5.5) + 2 * 1.5**1.5 * np.array([-1, 1]), rtol=1e-7)


def test_heavy_column() -> None:
    straight, bent, locus = run("heavy_column.py")
    weights = [x.solution["w"] for x in straight.of_kind("branch point")]
    roots = [brentq(lambda w: jv(-1 / 3, 2 / 3 * np.sqrt(w)), *around, xtol=1e-13) for around in HEAVY]
    np.testing.assert_allclose(weights, roots, rtol=1e-9)
    loaded = [p.solution for p in locus.points if p.solution["w"] > 0.1]  # else Airy functions of huge arguments
    assert len(loaded) > 10
    for solution in loaded:
        assert abs(upright_determinant(solution["w"], solution["P"])) < 1e-7
    unloaded = min((locus.points[0], locus.points[-1]), key=lambda p: abs(p.solution["w"])).solution
    assert unloaded["P"] == pytest.approx(np.pi**2 / 4, rel=1e-8)
    (horizontal,) = bent.of_kind("zero of tip")
    weight = horizontal.solution["w"]
    shot = solve_ivp(  # from the tip down: the angle at the clamp is zero
        lambda x, y: [y[1], -weight * x * np.sin(y[0])], (0, 1), [np.pi / 2, 0], "DOP853", rtol=1e-12, atol=1e-13
    )
    assert abs(shot.y[0, -1]) < 1e-8


HEAVY = ((6.0, 9.0), (50.0, 60.0), (140.0, 155.0))


def upright_determinant(w: float, load: float) -> float:
    """Zero where theta'' + (load + w x) theta = 0, theta'(0) = theta(1) = 0 has a solution, x from the tip."""
    tip, clamp = (airy(-(load + w * x) / w ** (2 / 3)) for x in (0.0, 1.0))
    return float((tip[1] * clamp[2] - tip[3] * clamp[0]) / np.hypot(clamp[0], clamp[2]) / np.hypot(tip[1], tip[3]))


def test_auto_lin() -> None:
    trivial, growing, curve = run("auto_lin.py")
    np.testing.assert_allclose([x.solution["lam"] for x in trivial.special], [1, 2, 3, 4], rtol=1e-8)
    unit = growing.of_kind("zero of e")[0].solution
    assert abs(unit["v"][0]) == pytest.approx(np.sqrt(2) * np.pi, rel=1e-8)
    lam, g = np.pi * curve.column("lam"), curve.column("g")
    np.testing.assert_allclose(g**2 * (0.5 - np.sin(2 * lam) / (4 * lam)), np.sin(lam) ** 2, atol=1e-8)
    assert curve.column("lam").min() == pytest.approx(0.6)
    assert curve.column("lam").max() == pytest.approx(1.4)


def test_auto_bvp() -> None:
    """Length and mean of one and two arcs by quadrature, from the first integral."""
    trivial, (first, second) = run("auto_bvp.py")
    forms = [x.normal_form.kind for x in trivial.special]
    assert forms == ["transcritical", "pitchfork", "transcritical", "pitchfork"]
    np.testing.assert_allclose([x.solution["lam"] for x in trivial.special], [1, 2, 3, 4], rtol=1e-8)
    (single,) = [x.solution["lam"] for side in first for x in side.of_kind("zero of mean")]
    assert single == pytest.approx(brentq(lambda lam: mean_of_one_arc(lam) - 3, 1.05, 1.4, xtol=1e-12), rel=1e-8)
    double = [x.solution["lam"] for side in second for x in side.of_kind("zero of mean")]
    expected = brentq(lambda lam: mean_of_two_arcs(lam) - 3, 2.05, 2.3, xtol=1e-10)
    np.testing.assert_allclose(double, [expected, expected], rtol=1e-7)


def arc(peak: float, lam: float) -> tuple[float, float]:
    """Length of an arc from zero over its peak (of either sign) to zero, and its share of the mean."""
    k = (lam * np.pi) ** 2

    def density(x: float) -> float:  # u = peak (1 - x^2) makes the integrand regular
        u = peak * (1 - x**2)
        return 4 / np.sqrt(k * (1 + u / peak) - 2 / 3 * (peak + u + u**2 / peak))

    length = quad(density, 0, 1, epsabs=1e-13, epsrel=1e-13)[0]
    return length, quad(lambda x: density(x) * peak * (1 - x**2), 0, 1, epsabs=1e-13, epsrel=1e-13)[0]


def mean_of_one_arc(lam: float) -> float:
    top = (lam * np.pi) ** 2
    peak = brentq(lambda a: arc(a, lam)[0] - 1, 1e-3, 0.999 * top, xtol=1e-13)
    return arc(peak, lam)[1]


def mean_of_two_arcs(lam: float) -> float:
    k = (lam * np.pi) ** 2

    def lowest(a: float) -> float:
        return brentq(lambda b: k * (b**2 - a**2) / 2 - (b**3 - a**3) / 3, -2 * k, 0.0, xtol=1e-13)

    peak = brentq(lambda a: arc(a, lam)[0] + arc(lowest(a), lam)[0] - 1, 1e-2, 0.9999 * k, xtol=1e-13)
    return arc(peak, lam)[1] + arc(lowest(peak), lam)[1]


def test_auto_int() -> None:
    branch, locus = run("auto_int.py")

    def shifted(t: float) -> float:
        level = 2 * quad(lambda s: -2 * np.log(np.cosh((s - 0.5) * t / 2) / np.cosh(t / 4)), 0, 0.5, epsrel=1e-13)[0]
        return -(t**2) / (2 * np.cosh(t / 4) ** 2) * np.exp(level)

    best = minimize_scalar(shifted, bounds=(5, 15), method="bounded", options={"xatol": 1e-10})
    (fold,) = branch.of_kind("fold")
    assert fold.solution["lam"] == pytest.approx(-best.fun, rel=1e-9)
    assert fold.solution["slope"] == pytest.approx(best.x * np.tanh(best.x / 4), rel=1e-6)
    np.testing.assert_allclose(locus.column("lam") * np.exp(locus.column("b")), -best.fun, rtol=1e-8)


def test_auto_ezp() -> None:
    real, pair = run("auto_ezp.py")
    (point,) = real.special
    assert point.kind == "branch point"
    assert point.turns
    assert point.solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-8)
    t = newton(lambda t: t**2 / (2 * np.cosh(t / 4) ** 2) - 5, 4.4 + 2.3j, tol=1e-13)
    expected = 2 * np.log(np.cosh(t / 4))
    middles = sorted(
        (complex(*at.solution(0.5)[0, :2]) for side in pair for at in side.of_kind("zero of lam")), key=np.imag
    )
    np.testing.assert_allclose(middles, [expected.conjugate(), expected], rtol=1e-8)


def test_auto_nag() -> None:
    branch = run("auto_nag.py")
    np.testing.assert_allclose(branch.column("c"), (1 - 2 * branch.column("a")) / np.sqrt(2), atol=1e-9)
    assert branch.column("a").min() == pytest.approx(0.0, abs=1e-12)
    assert branch.column("a").max() == pytest.approx(1.0)
    for point in branch.points:
        u = point.solution["u"]
        np.testing.assert_allclose(point.solution["v"], u * (1 - u) / np.sqrt(2), atol=1e-7)


@pytest.mark.slow
def test_auto_kar() -> None:
    """von Karman's disk by SciPy's solve_bvp, folds of Zandbergen & Dijkstra 1977."""
    branch = run("auto_kar.py")
    folds = [x.solution["gamma"] for x in branch.of_kind("fold")]
    np.testing.assert_allclose(folds, [-0.16053876, 0.07452563], atol=1e-8)
    disk = branch.of_kind("zero of gamma")[0].solution
    other = von_karman_disk()
    assert disk["ddf0"] == pytest.approx(other[2, 0], abs=2e-8)
    assert disk["dg0"] == pytest.approx(other[4, 0], abs=2e-8)
    assert disk["far"] == pytest.approx(other[0, -1], abs=2e-7)


def von_karman_disk(far: float = 25.0) -> np.ndarray:
    """f, f', f'', g, g' over a fluid at rest, cut off at a distance where exp(-2 f z) is below the tolerance."""
    z = far * np.linspace(0, 1, 401) ** 2
    decay = np.exp(-0.8 * z)
    guess = np.vstack([0.44 * (1 - decay), 0.5 * z * decay, 0.5 * decay, decay, -0.6 * decay])
    found = solve_bvp(
        lambda x, y: np.vstack(
            [y[1], y[2], y[1] ** 2 - 2 * y[0] * y[2] - y[3] ** 2, y[4], 2 * y[1] * y[3] - 2 * y[0] * y[4]]
        ),
        lambda a, b: np.array([a[0], a[1], a[3] - 1, b[1], b[3]]), z, guess, tol=1e-8, max_nodes=50000,
    )  # fmt: skip
    assert found.success
    return found.y


def test_auto_spb() -> None:
    """SciPy's solve_bvp (tolerance 1e-10) for eps = 0.1 here, for eps = 0.001 from 140000 and 170000 nodes."""
    homotopy, thinner, lowered = (branch.points[-1].solution for branch in run("auto_spb.py"))
    assert homotopy["lam"] == pytest.approx(1.0)
    other = solve_bvp(
        lambda x, u: np.vstack([u[1], (u[0] * (u[0] ** 2 - 1) * u[1] + u[0]) / 0.1]),
        lambda a, b: np.array([a[0] - 1.5, b[0] - 1.2]),
        np.linspace(0, 1, 201), np.vstack([np.linspace(1.5, 1.2, 201), np.full(201, -0.3)]), tol=1e-8, max_nodes=20000,
    )  # fmt: skip
    assert other.success
    np.testing.assert_allclose([homotopy["slope"], homotopy["layer"]], other.y[1, [0, -1]], rtol=1e-7)
    assert thinner["eps"] == pytest.approx(1e-3)
    np.testing.assert_allclose([thinner["slope"], thinner["layer"]], [-0.80082343, 67.7490733], rtol=1e-7)
    assert lowered["gamma"] == pytest.approx(-1.0)
    np.testing.assert_allclose([lowered["slope"], lowered["layer"]], [-0.80082343, -256.868646], rtol=1e-7)


def test_strut(capsys: pytest.CaptureFixture[str]) -> None:
    """Elliptic integrals, and how loads and lengths scale."""
    buckled, locus, load, rise = run("strut.py")
    k = brentq(lambda k: 2 * ellipk(k**2) - ellipe(k**2) / (1 - k**2), 0.5, 0.95)
    (largest,) = buckled.of_kind("extremum of rise")
    assert "the rise is largest, 0.40314" in capsys.readouterr().out
    expected, height = (2 * ellipk(k**2)) ** 2, k / ellipk(k**2)
    assert abs(largest.solution["rise"]) == pytest.approx(height, abs=1e-10)
    assert largest.solution["P"] == pytest.approx(expected, rel=1e-9)
    assert load == pytest.approx({"b": expected, "l": -2 * expected}, rel=1e-8)
    assert rise == pytest.approx({"b": 0.0, "l": largest.solution["rise"]}, abs=1e-9)
    np.testing.assert_allclose(locus.column("P"), expected * locus.column("b"), rtol=1e-8)
    np.testing.assert_allclose(np.abs(locus.column("rise")), height, atol=1e-9)
    assert locus.events == ()


def test_twisted_rod(capsys: pytest.CaptureFixture[str]) -> None:
    """The first moment has tan(M/2) = M/2; the buckled rod agrees with shooting, and may be turned about its axis."""
    bvp, trunk, buckled = run("twisted_rod.py")
    assert "one member of the orbit under rotation" in capsys.readouterr().out
    critical = 2 * brentq(lambda x: np.sin(x) - x * np.cos(x), 4.0, 4.6, xtol=1e-14)
    assert trunk.special[0].solution["moment"] == pytest.approx(critical, rel=1e-8)
    assert critical == pytest.approx(8.986818916, abs=1e-9)
    assert (trunk.special[0].breaks, buckled.orbit) == (("rotation",), ("rotation",))
    assert buckled.verification.unfolding < 1e-8
    end = buckled.points[-1].solution
    moment, distance = shoot_twisted_rod(end)
    assert end["moment"] == pytest.approx(moment, rel=1e-8)
    assert end["distance"] == pytest.approx(distance, rel=1e-8)
    for angle in np.linspace(0.0, 2 * np.pi, 5):
        turned = rotated(end, angle)
        again = solve(bvp, turned, ("turn",))
        assert np.abs(again(turned.mesh) - turned.values).max() < 1e-5  # between mesh points of one or the other
        assert again["distance"] == pytest.approx(end["distance"], abs=1e-8)


def rotated(solution: Solution, angle: float) -> Solution:
    """The twisted rod turned about its axis."""
    c, s = np.cos(angle), np.sin(angle)
    values, stages = solution.values.copy(), solution.stages.copy()
    for pair in (("n1", "n2"), ("m1", "m2"), ("q1", "q2"), ("x", "y")):
        i, j = (solution.unknowns.index(name) for name in pair)
        for old, new in ((solution.values, values), (solution.stages, stages)):
            new[..., i], new[..., j] = c * old[..., i] - s * old[..., j], s * old[..., i] + c * old[..., j]
    return replace(solution, values=values, stages=stages)


def shoot_twisted_rod(near: Solution) -> tuple[float, float]:
    """Moment and distance of the clamps of the buckled rod by shooting, turned so that the force lies in one plane."""
    equations = runpy.run_path(str(EXAMPLES / "twisted_rod.py"))["equations"]
    turn = near["turn"]
    c, s = np.cos(turn / 2), np.sin(turn / 2)

    def end(x: np.ndarray) -> np.ndarray:
        start = [x[0], 0.0, *x[1:], 1.0, *[0.0] * 6]
        names = near.unknowns

        def rate(at: float, y: np.ndarray) -> list[float]:
            return equations(at, SimpleNamespace(**dict(zip(names, y, strict=True))), None)

        return solve_ivp(rate, (0, 1), start, rtol=1e-11, atol=1e-12, method="DOP853").y[:, -1]

    def misfit(x: np.ndarray) -> list[float]:
        y = end(x)
        q = y[6:10]
        return [y[2], c * q[1] + s * q[2], c * q[2] - s * q[1], c * q[3] - s * q[0], y[10], y[11]]

    there = rotated(near, -np.arctan2(near["n2"][0], near["n1"][0]))
    guess = np.delete(there.values[0, :6], 1)
    found = least_squares(misfit, guess + 0.02 * np.array([1, 0, -1, 1, 1]), xtol=1e-13, ftol=1e-15, gtol=1e-13)
    return float(end(found.x)[5]), float(end(found.x)[12])
