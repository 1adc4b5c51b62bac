"""Continuous symmetries of problems on any interval, with jumps inside it and parameters in their logarithm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from rodatlas.continuation import (
    BVP,
    ContinuousSymmetry,
    EndReason,
    Inner,
    NewtonOptions,
    Solution,
    TraceOptions,
    follow_locus,
    integral_of,
    is_symmetry,
    sensitivity,
    switch_all,
    trace,
    value_at,
)

SHIFT = ContinuousSymmetry("shift", shift=True)
TURN = ContinuousSymmetry("turn", lambda s, u, p: {"x": -u.y, "y": u.x, "xs": -u.ys, "ys": u.xs})


def ring(symmetries=(SHIFT,), **places) -> BVP:
    """u'' + lam u - mu u^3 = 0 on a circle; mu = 1 by default."""
    return BVP(
        lambda s, u, p: [u.v, -(p.lam * u.u - p.mu * u.u**3)],
        lambda left, right, p: [left.u - right.u, left.v - right.v],
        unknowns=("u", "v"), parameters={"lam": 4.0, "mu": 1.0}, symmetries=symmetries,
        observables={"power": integral_of(lambda s, u, p: u.u**2),
                     "bump": integral_of(lambda s, u, p: (u.u**2 - 1)**2)},
        **places,
    )  # fmt: skip


def rest(bvp: BVP, **parameters: float) -> Solution:
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}
    )


@pytest.mark.parametrize("log", [(), ("lam",)])
def test_a_circle_of_any_length(log) -> None:
    """Lengths scale: lam as 1/L^2 and u as 1/L, so that the integral of u^2 is 1/L of that on the unit circle."""
    ends = []
    for a, b in ((0.0, 1.0), (2.0, 5.0)):
        bvp, length = ring(interval=(a, b), log=log), b - a
        options = TraceOptions(bounds={"lam": (35.0 / length**2, 60.0 / length**2)})
        (point,) = trace(bvp, rest(bvp, lam=35.0 / length**2), ("lam",), options).special
        assert point.solution["lam"] * length**2 == pytest.approx(4 * np.pi**2, rel=1e-8)
        (branch,) = switch_all(bvp, point, ("lam",), options)
        assert branch.orbit == ("shift",)
        assert branch.verification.unfolding < 1e-6
        ends.append(branch.points[-1].solution["power"] * length)
    assert ends[0] == pytest.approx(ends[1], rel=1e-7)


def test_a_period_that_is_the_length_of_the_interval() -> None:
    """r' = r (a - r^2), phi' = 1 + c r^2: a circle of radius sqrt(a), period 2 pi/(1 + c a)."""

    def rhs(s, u, p):
        square = u.x**2 + u.y**2
        speed = 1 + p.c * square
        return [p.a * u.x - speed * u.y - u.x * square, p.a * u.y + speed * u.x - u.y * square]

    bvp = BVP(
        rhs, lambda left, right, p: [left.x - right.x, left.y - right.y], unknowns=("x", "y"), interval=(0.0, "T"),
        parameters={"a": 0.25, "T": 6.0, "c": 0.5}, symmetries=[SHIFT], log=("T",),
    )  # fmt: skip
    guess = Solution.from_function(
        lambda s: 0.45 * np.stack([np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)], axis=1), bvp.unknowns, bvp.parameters
    )
    branch = trace(bvp, guess, ("a", "T"), TraceOptions(bounds={"a": (0.1, 2.0)}))
    assert branch.orbit == ("shift",)
    assert np.allclose(branch.column("T"), 2 * np.pi / (1 + 0.5 * branch.column("a")), rtol=1e-7)


def test_generators_are_functions_of_the_users_coordinate() -> None:
    """u'' = 0 with u(5) - u(2) = 3 u'(2), to which any multiple of s may be added."""

    def line(**places) -> BVP:
        return BVP(
            lambda s, u, p: [u.v, 0.0], lambda left, right, p: [right.u - left.u - 3 * left.v, left.v - right.v],
            unknowns=("u", "v"), parameters={"lam": 1.0}, interval=(2.0, 5.0), **places,
        )  # fmt: skip

    for bvp in (line(), line(breakpoints=(3.0,)), line(inner=[Inner(4.0, jumps=lambda u, p: {})])):
        assert is_symmetry(bvp, ContinuousSymmetry("tilt", lambda s, u, p: {"u": s, "v": 1.0}))
        assert not is_symmetry(bvp, ContinuousSymmetry("tilt", lambda s, u, p: {"u": s / 3, "v": 1.0}))


@pytest.mark.parametrize("places", [
    {"breakpoints": (0.3,)}, {"inner": [Inner(0.5, jumps=lambda u, p: {"v": u.u})]},
])  # fmt: skip
def test_a_shift_would_move_places(places) -> None:
    with pytest.raises(ValueError, match="'shift': expected no breakpoints, inner points or values at places"):
        ring(**places)


def test_places_may_not_depend_on_parameters_that_move() -> None:
    moves = ContinuousSymmetry("move", lambda s, u, p: {}, parameters=lambda p: {"c": 1.0})
    with pytest.raises(ValueError, match=r"'move': expected parameters on which no end or place inside .* depends"):
        BVP(lambda s, u, p: [p.c], lambda left, right, p: [left.u], unknowns=("u",), parameters={"c": 1.0},
            interval=(0.0, "c"), symmetries=[moves])  # fmt: skip


def test_a_parameter_that_moves_in_its_logarithm() -> None:
    """u' = -lam u, u(0) = c may be multiplied by any number; c is multiplied with it."""
    for log in ((), ("c",), ("c", "lam")):
        bvp = BVP(lambda s, u, p: [-p.lam * u.u], lambda left, right, p: [left.u - p.c], unknowns=("u",),
                  parameters={"c": 2.0, "lam": 1.0}, log=log)  # fmt: skip
        grow = ContinuousSymmetry("grow", lambda s, u, p: [u.u], parameters=lambda p: {"c": p.c})
        assert is_symmetry(bvp, grow)
        assert not is_symmetry(bvp, ContinuousSymmetry("grow", lambda s, u, p: [u.u], parameters=lambda p: {"c": 1.0}))


def string(names: str, symmetries=()) -> BVP:
    """A string with a spring in its middle, in one direction or in two."""
    n = len(names)

    def rhs(s, u, p):
        square = sum(x**2 for x in u[:n])
        return [*u[n:], *(-(p.lam - square) * x for x in u[:n])]

    spring = Inner(0.5, jumps=lambda u, p: {f"{name}s": p.stiffness * getattr(u, name) for name in names})
    return BVP(
        rhs, lambda left, right, p: [*left[:n], *right[:n]], unknowns=(*names, *(f"{name}s" for name in names)),
        parameters={"lam": 15.0, "stiffness": 4.0}, inner=[spring], symmetries=symmetries,
        observables={"middle": value_at(0.5, lambda u, p: sum(x**2 for x in u[:n]))},
    )  # fmt: skip


def test_an_orbit_of_a_problem_with_a_jump() -> None:
    """It leaves where tan k/2 = -2 k/stiffness, k^2 = lam, and is as the branch of the string in one direction."""
    bvp, options = string("xy", [TURN]), TraceOptions(bounds={"lam": (12.0, 30.0)})
    (point,) = trace(bvp, rest(bvp, lam=12.0), ("lam",), options).special
    k = brentq(lambda k: np.sin(k / 2) * 4 + 2 * k * np.cos(k / 2), np.pi, 2 * np.pi)
    assert (point.multiplicity, point.continuum) == (2, True)
    assert point.solution["lam"] == pytest.approx(k * k, rel=1e-8)
    (branch,) = switch_all(bvp, point, ("lam",), options)
    assert branch.orbit == ("turn",)
    plane = string("x")
    (point,) = trace(plane, rest(plane, lam=12.0), ("lam",), options).special
    known = switch_all(plane, point, ("lam",), options)[0]
    middle = [b.points[-1].solution["middle"] for b in (branch, known)]
    assert middle[0] == pytest.approx(middle[1], rel=1e-7)


def test_an_extremum_on_an_orbit() -> None:
    """The value of an observable becomes a parameter beside the unfolding one, on the branch and in two parameters."""
    bvp = ring(interval=(0.0, 1.0))
    options = TraceOptions(bounds={"lam": (35.0, 60.0)}, extrema=("bump",))
    (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).of_kind("branch point")
    (branch,) = switch_all(bvp, point, ("lam",), options)
    (least,) = [x for x in branch.special if x.kind == "extremum of bump"]
    near = branch.column("bump")
    assert least.solution["bump"] <= near.min() + 1e-9
    assert least.solution.parameter_names == ("lam", "mu")
    locus = follow_locus(bvp, least, ("lam", "mu"), TraceOptions(bounds={"mu": (0.5, 1.5)}))
    assert locus.ends == (EndReason.RANGE, EndReason.RANGE)
    for p in (locus.points[0], locus.points[-1]):
        lam = p.solution["lam"]
        side = trace(bvp, p.solution, ("lam",), replace(options, bounds={"lam": (lam - 0.5, lam + 0.5)}))
        (again,) = [x for x in side.special if x.kind == "extremum of bump"]
        assert again.solution["lam"] == pytest.approx(lam, abs=1e-5)
        assert p.tangent.shape == (2,)


def test_chords_on_an_orbit() -> None:
    bvp, ends = ring(), []
    for newton in (NewtonOptions(), NewtonOptions(chord=True)):
        options = TraceOptions(bounds={"lam": (35.0, 60.0)}, newton=newton)
        (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).special
        (branch,) = switch_all(bvp, point, ("lam",), options)
        assert branch.special == ()
        ends.append(branch.points[-1].solution["power"])
    assert ends[0] == pytest.approx(ends[1], rel=1e-8)


@pytest.mark.slow
def test_derivatives_of_points_on_an_orbit() -> None:
    """The value lam at which u^2 has a given mean, as mu changes: mu times it is a function of lam alone."""
    bvp = ring()
    options = TraceOptions(bounds={"lam": (35.0, 60.0)}, zeros={"power": 5.0}, extrema=("bump",))
    (point,) = trace(bvp, rest(bvp, lam=35.0), ("lam",), options).of_kind("branch point")
    (branch,) = switch_all(bvp, point, ("lam",), options)
    (zero,) = branch.of_kind("zero of power")
    least = branch.of_kind("extremum of bump")[0]
    shift = 1e-3
    for x, of in ((zero, "lam"), (least, "lam")):
        values = []
        for mu in (1.0 - shift, 1.0 + shift):
            other = trace(bvp, x.solution.with_parameters(mu=mu), ("lam",), options)
            values.append(next(y for y in other.special if y.kind == x.kind).solution["lam"])
        assert sensitivity(bvp, x, of)["mu"] == pytest.approx((values[1] - values[0]) / (2 * shift), rel=1e-3)
