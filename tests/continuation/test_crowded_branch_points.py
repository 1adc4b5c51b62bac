"""Branch points close together on a plain branch, whose steps and meshes know nothing of them; none may be missed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import mathieu_a

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, integral_of, trace

pytestmark = pytest.mark.slow


def along_rest(bvp: BVP, name: str, low: float, high: float, state: tuple[float, ...] | None = None) -> Branch:
    """The branch of a constant state from low to high, with default options."""
    constant = np.zeros(bvp.size) if state is None else np.array(state)
    start = Solution.from_function(lambda s: np.tile(constant, (len(s), 1)), bvp.unknowns, {name: low})
    return trace(bvp, start, (name,), TraceOptions(bounds={name: (low, high)}), both=False)


def found(branch: Branch, name: str) -> list[float]:
    assert {x.kind for x in branch.special} == {"branch point"}
    return [x.solution[name] for x in branch.special for _ in range(x.multiplicity)]


def test_swift_hohenberg():
    """u'''' + 2 u'' + (1 - l) u + u^3 = 0, u = u'' = 0 at 0 and 20: l = (1 - (n pi/20)^2)^2; three lie on a step."""
    length = 20.0
    bvp = BVP(
        lambda s, u, p: [
            length * u.slope,
            length * u.bend,
            length * u.third,
            length * (-2 * u.bend - (1 - p.l) * u.u - u.u**3),
        ],
        lambda left, right, p: [left.u, left.bend, right.u, right.bend],
        unknowns=("u", "slope", "bend", "third"),
        parameters={"l": -0.2},
    )
    branch = along_rest(bvp, "l", -0.2, 2.0)
    expected = sorted(v for n in range(1, 20) if (v := (1 - (n * np.pi / length) ** 2) ** 2) < 2)
    assert len(expected) == 9
    assert np.allclose(found(branch, "l"), expected, rtol=0, atol=1e-7)
    assert branch.verification is not None
    assert branch.verification.complete


def test_brusselator():
    """Steady patterns, fixed ends: B = 1 + A^2 D1/D2 + D1 k^2 + A^2/(D2 k^2), k = n pi; crowded where it is least."""
    a, d1, d2 = 2.0, 0.0016, 0.006
    bvp = BVP(
        lambda s, u, p: [
            u.du,
            -(a - (p.B + 1) * u.u + u.u**2 * u.v) / d1,
            u.dv,
            -(p.B * u.u - u.u**2 * u.v) / d2,
        ],
        lambda left, right, p: [left.u - a, left.v - p.B / a, right.u - a, right.v - p.B / a],
        unknowns=("u", "du", "v", "dv"),
        parameters={"B": 2.0},
    )
    branch = along_rest(bvp, "B", 2.0, 8.0, (a, 0.0, 1.0, 0.0))
    k2 = (np.arange(1, 60) * np.pi) ** 2
    expected = np.sort(1 + a**2 * d1 / d2 + d1 * k2 + a**2 / (d2 * k2))
    expected = expected[expected < 8.0]
    assert len(expected) == 16
    assert np.allclose(found(branch, "B"), expected, rtol=0, atol=1e-7)
    assert branch.discrepancies == ()


def test_mathieu():
    """y'' + (lam - 10 cos 2x) y = 0, y' = 0 at 0 and pi: the characteristic values a_n(5), as SciPy has them."""
    q = 5.0
    bvp = BVP(
        lambda s, u, p: [np.pi * u.v, -np.pi * (p.lam - 2 * q * np.cos(2 * np.pi * s)) * u.y - u.y**3],
        lambda left, right, p: [left.v, right.v],
        unknowns=("y", "v"),
        parameters={"lam": -10.0},
    )
    branch = along_rest(bvp, "lam", -10.0, 300.0)
    expected = [v for n in range(30) if (v := mathieu_a(n, q)) < 300]
    assert len(expected) == 18
    assert np.allclose(found(branch, "lam"), expected, rtol=1e-8, atol=1e-6)


def test_coffey_evans():
    """-y'' + (b^2 sin^2 2x - 2 b cos 2x) y = lam y, b = 20: triples of eigenvalues (Pryce 1993), 1e-3 wide."""
    b = 20.0

    def place(s):
        return np.pi * (s - 0.5)

    bvp = BVP(
        lambda s, u, p: [
            np.pi * u.v,
            np.pi * ((b**2 * np.sin(2 * place(s)) ** 2 - 2 * b * np.cos(2 * place(s)) - p.lam) * u.y + u.y**3),
        ],
        lambda left, right, p: [left.y, right.y],
        unknowns=("y", "v"),
        parameters={"lam": -10.0},
    )
    branch = along_rest(bvp, "lam", -10.0, 300.0)
    known = [0.0, 77.91619567714, 151.46277834646, 151.46322365766, 151.46366898835]
    known += [220.15422983525, 283.0948146954, 283.2507437431, 283.4087354034]
    assert np.allclose(found(branch, "lam"), known, rtol=1e-8, atol=1e-7)


def test_trapped_condensate():
    """u'' + (mu - x^2) u = u^3 on (-8, 8): mu = 1, 3, 5 ... Other singular values are smaller than those of modes."""
    length = 16.0
    bvp = BVP(
        lambda s, u, p: [length * u.v, length * (u.u**3 - (p.mu - (length * (s - 0.5)) ** 2) * u.u)],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"mu": 0.0},
    )
    branch = along_rest(bvp, "mu", 0.0, 20.0)
    assert np.allclose(found(branch, "mu"), np.arange(1, 20, 2), rtol=0, atol=1e-6)


@pytest.mark.parametrize("excess", [0.0, 1.0])
def test_two_loads_together(excess: float):
    """Column on springs, k = 36 pi^4 + excess: modes 2 and 3 buckle together, or nearly; all ten are met."""
    k = 36 * np.pi**4 + excess
    bvp = BVP(
        lambda s, u, p: [u.slope, u.bend, u.third, -p.P * u.bend - k * u.u - u.u**3],
        lambda left, right, p: [left.u, left.bend, right.u, right.bend],
        unknowns=("u", "slope", "bend", "third"),
        parameters={"P": 5.0},
    )
    branch = along_rest(bvp, "P", 5.0, 1000.0)
    n = np.arange(1, 40)
    expected = np.sort((n * np.pi) ** 2 + k / (n * np.pi) ** 2)
    assert np.allclose(found(branch, "P"), expected[expected < 1000], rtol=1e-8)


def test_pitchfork_met_on_its_side_branch():
    """u'' + lam u = u^3, u' = 0 at both ends: u = sqrt(lam) turns at lam = 0; no eigenvalue changes sign on it."""
    bvp = BVP(
        lambda s, u, p: [u.v, u.u**3 - p.lam * u.u],
        lambda left, right, p: [left.v, right.v],
        unknowns=("u", "v"),
        parameters={"lam": 1.0},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )
    start = Solution.from_function(lambda s: np.tile([1.0, 0.0], (len(s), 1)), bvp.unknowns, {"lam": 1.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 30.0)}))
    (point,) = branch.special
    assert (point.kind, point.turns) == ("branch point", True)
    assert abs(point.solution["lam"]) < 1e-9
