"""Exact derivatives of special points with respect to all parameters, against closed forms and recomputed points."""

from __future__ import annotations

import runpy
from dataclasses import replace
from functools import lru_cache
from math import isnan
from pathlib import Path

import numpy as np
import pytest
from bvp_problems import algebraic, constant, elastica

from rodatlas.continuation import (
    BVP,
    MeshControl,
    NotConverged,
    Solution,
    Status,
    TraceOptions,
    end_value,
    follow_locus,
    integral_of,
    sensitivity,
    trace,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
PI = np.pi
MESH = MeshControl(tolerance=1e-10)


def example(name: str):
    """What a worked example defines."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


@lru_cache
def arch_branch():
    arch = example("arch")
    bvp = arch["arch"]()
    start = Solution.from_function(arch["unloaded"], bvp.unknowns, bvp.parameters)
    options = TraceOptions(mesh=MESH, bounds={"q": (-600.0, 1500.0), "a": (-4.0, 4.0)}, extrema=("N",), zeros={"a": 1})
    return bvp, trace(bvp, start, ("q", "N"), options)


@pytest.mark.parametrize("kind", ["fold", "branch point", "zero of a", "extremum of N"])
def test_every_kind_of_point_of_the_arch(kind: str) -> None:
    """q/pi^4 = h - a + a (h^2 - a^2), N/pi^2 = h^2 - a^2: derivatives of q, N and a with respect to h at h = 3."""
    bvp, branch = arch_branch()
    h = 3.0
    points = branch.of_kind(kind)
    assert points
    for point in points:
        a = point.solution["a"]
        q, n, shape = {
            "fold": (1 + 2 * a * h, 2 * h - 2 * h / 3, h / (3 * a) if a else 0.0),  # 3 a^2 = h^2 - 1
            "branch point": (1 + 3 * h / a if a else 0.0, 0.0, h / a if a else 0.0),  # a^2 = h^2 - 4
            "zero of a": (1 + 2 * a * h, 2 * h, 0.0),
            "extremum of N": (1.0, 2 * h, 0.0),  # a = 0
        }[kind]
        assert sensitivity(bvp, point) == pytest.approx({"h": q * PI**4}, rel=1e-9)
        assert sensitivity(bvp, point, "N")["h"] == pytest.approx(n * PI**2, abs=1e-8)
        assert sensitivity(bvp, point, "a")["h"] == pytest.approx(shape, abs=1e-9)


def test_euler_loads_on_a_foundation() -> None:
    """P_n = (n pi)^2 + k/(n pi)^2 in any mode, and the cubic term has no part in it."""
    bvp = example("foundation")["foundation"]()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 4)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, straight, ("P",), TraceOptions(mesh=MESH, bounds={"P": (5.0, 200.0)}), both=False)
    assert len(branch.special) == 4
    loads = sorted((x.solution["P"], x) for x in branch.special)
    k = bvp.parameters["k"]
    for load, point in loads:
        n = min((1, 2, 3, 4), key=lambda n: abs((n * PI) ** 2 + k / (n * PI) ** 2 - load))
        found = sensitivity(bvp, point)
        assert found["k"] == pytest.approx(1 / (n * PI) ** 2, rel=1e-8)
        assert all(abs(value) < 1e-8 for name, value in found.items() if name != "k")


def test_gelfands_folds_against_their_locus_and_recomputed_points() -> None:
    gelfand = example("gelfand")["gelfand"]

    def folds(eps: float):
        bvp = gelfand(eps)
        cold = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
        options = TraceOptions(mesh=MESH, bounds={"lam": (0.0, 6.0), "mean": (-1.0, 20.0)})
        return bvp, trace(bvp, cold, ("lam",), options).of_kind("fold")

    (bvp, here), (_, less), (_, more) = folds(0.2), folds(0.2 - 1e-3), folds(0.2 + 1e-3)
    assert len(here) == 2
    for fold, low, high in zip(here, less, more, strict=True):
        slope = sensitivity(bvp, fold)["eps"]
        assert slope == pytest.approx((high.solution["lam"] - low.solution["lam"]) / 2e-3, rel=1e-3)
        mean = (high.solution["mean"] - low.solution["mean"]) / 2e-3
        assert sensitivity(bvp, fold, "mean")["eps"] == pytest.approx(mean, rel=2e-3)
        locus = follow_locus(bvp, fold, ("lam", "eps"), TraceOptions(mesh=MESH, max_points=2))
        (start,) = (p for p in locus.points if p.arclength == 0.0)
        assert slope == pytest.approx(start.tangent[0] / start.tangent[1], rel=1e-6)


@pytest.mark.slow
def test_units_do_not_matter() -> None:
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u) + p.load / 1e6], lambda left, right, p: [left.u - p.end, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0, "load": 0.0, "end": 0.0}, scales={"load": 1e6, "lam": 0.1},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )  # fmt: skip
    options = TraceOptions(mesh=MESH, bounds={"mean": (-1.0, 4.0)})

    def fold(**values: float):
        return trace(bvp, constant(bvp, **values), ("lam",), options).of_kind("fold")[0]

    found = sensitivity(bvp, fold())
    assert set(found) == {"load", "end"}
    for name, step in (("load", 1e3), ("end", 1e-3)):
        high, low = (fold(**{name: sign * step}).solution["lam"] for sign in (1, -1))
        assert found[name] == pytest.approx((high - low) / (2 * step), rel=1e-5)


def test_a_branch_point_that_needs_a_symmetry() -> None:
    """x (lam - a - x^2) = b: the pitchfork moves with a, and is gone for b."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - p.a - u.x**2 - 0 * p.c) - p.b], parameters=("lam", "a", "b", "c"))
    (point,) = trace(bvp, constant(bvp, lam=-1.0), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)})).special
    found = sensitivity(bvp, point)
    assert found["a"] == pytest.approx(1.0, abs=1e-9)
    assert isnan(found["b"])
    assert found["c"] == pytest.approx(0.0, abs=1e-12)


def test_a_transcritical_point() -> None:
    """(x - a) (lam - b - x) on x = a: it lies at lam = a + b."""
    bvp = algebraic(lambda u, p: [(u.x - p.a) * (p.lam - p.b - u.x)], parameters=("lam", "a", "b"),
                    observables={"x0": end_value(lambda left, right, p: left.x)})  # fmt: skip
    (point,) = trace(bvp, constant(bvp, lam=-1.0), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)})).special
    assert sensitivity(bvp, point) == pytest.approx({"a": 1.0, "b": 1.0}, abs=1e-9)
    assert sensitivity(bvp, point, "x0") == pytest.approx({"a": 1.0, "b": 0.0}, abs=1e-9)


def test_no_parameter_left() -> None:
    bvp = elastica()
    options = TraceOptions(bounds={"P": (1.0, 60.0)})
    point = trace(bvp, constant(bvp, P=1.0), ("P", "V"), options, both=False).special[0]
    assert sensitivity(bvp, point) == {}


def test_what_cannot_be_differentiated_is_refused() -> None:
    bvp, branch = arch_branch()
    fold = branch.of_kind("fold")[0]
    with pytest.raises(ValueError, match="of: expected one of q, N, a, got 'h'"):
        sensitivity(bvp, fold, "h")
    with pytest.raises(ValueError, match="special: expected a converged point, got a bracketed fold"):
        sensitivity(bvp, replace(fold, status=Status.BRACKETED))
    with pytest.raises(ValueError, match="special: expected a simple point, got one of multiplicity 2"):
        sensitivity(bvp, replace(fold, kind="branch point", multiplicity=2))
    with pytest.raises(ValueError, match="special: expected a special point of a branch"):
        sensitivity(bvp, fold.solution)
    nowhere = replace(fold, solution=fold.solution.with_parameters(q=1e5))
    with pytest.raises(NotConverged, match="sensitivity of"):
        sensitivity(bvp, nowhere)


@pytest.mark.parametrize("log", [(), ("P",), ("k",), ("P", "k")])
def test_parameters_followed_in_their_logarithm(log: tuple[str, ...]) -> None:
    """u'''' + P u'' + k u = 0 buckles at P = pi^2 + k/pi^2, dP/dk = 1/pi^2, however P and k are followed."""
    bvp = BVP(
        lambda s, u, p: [u.slope, u.bend, u.third, -p.P * u.bend - p.k * u.u - u.u**3],
        lambda left, right, p: [left.u, left.bend, right.u, right.bend],
        unknowns=("u", "slope", "bend", "third"),
        parameters={"P": 15.0, "k": 100.0},
        log=log,
    )
    (point,) = trace(bvp, constant(bvp), ("P",), TraceOptions(bounds={"P": (15.0, 25.0)}), both=False).special
    assert point.solution["P"] == pytest.approx(np.pi**2 + 100 / np.pi**2, rel=1e-9)
    assert sensitivity(bvp, point)["k"] == pytest.approx(1 / np.pi**2, rel=1e-7)
