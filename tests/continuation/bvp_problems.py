"""Boundary value problems with known answers, shared by the tests."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rodatlas.continuation import BVP, Solution, end_value, integral_of

BRATU_FOLD = 3.513830719125161
EULER_LOADS = (39.478417604357434, 80.76291422591535, 157.91367041742973, 238.71806377569)  # modes 1 to 4


@lru_cache(maxsize=1)
def bratu() -> BVP:
    """u'' + lam exp(u) = 0, u(0) = u(1) = 0."""
    return BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)],
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.u), "slope": end_value(lambda left, right, p: left.v)},
        name="bratu",
    )  # fmt: skip


def bratu_exact(theta: float, s: np.ndarray) -> tuple[float, np.ndarray]:
    """Parameter and (u, v) of u = -2 log(cosh((s - 1/2) theta/2) / cosh(theta/4))."""
    lam = theta**2 / (2 * np.cosh(theta / 4) ** 2)
    x = (s - 0.5) * theta / 2
    return lam, np.column_stack([-2 * np.log(np.cosh(x) / np.cosh(theta / 4)), -theta * np.tanh(x)])


@lru_cache(maxsize=1)
def elastica() -> BVP:
    """Planar clamped-clamped elastica (EI = L = 1) under thrust P and shear V, with y(1) = 0."""
    return BVP(
        lambda s, u, p: [np.sin(u.theta), u.k, -p.P * np.sin(u.theta) + p.V * np.cos(u.theta)],
        lambda left, right, p: [left.y, left.theta, right.y, right.theta],
        unknowns=("y", "theta", "k"), parameters={"P": 0.0, "V": 0.0},
        observables={
            "compression": integral_of(lambda s, u, p: 1 - np.cos(u.theta)),
            "area": integral_of(lambda s, u, p: u.y),
            "energy": integral_of(lambda s, u, p: u.k**2 / 2),
            "k0": end_value(lambda left, right, p: left.k),
        },
        scales={"P": 100.0, "V": 100.0, "k": 10.0},
        name="elastica",
    )  # fmt: skip


@lru_cache(maxsize=1)
def phase_separation() -> BVP:
    """eps^2 u'' = mu - u + u^3, u'(0) = u'(1) = 0 with mean m: mu is a free scalar."""
    return BVP(
        lambda s, u, p: [u.v / p.eps, (p.mu - u.u + u.u**3) / p.eps],
        lambda left, right, p: [left.v, right.v],
        lambda s, u, p: u.u - p.m,
        unknowns=("u", "v"), parameters={"m": 0.0, "mu": 0.0, "eps": 0.1}, name="phase separation",
    )  # fmt: skip


@lru_cache(maxsize=1)
def van_der_pol() -> BVP:
    """Periodic orbit with unknown period T: periodic ends and an integral phase condition."""
    return BVP(
        lambda s, u, p: [p.T * u.v, p.T * (p.mu * (1 - u.x**2) * u.v - u.x)],
        lambda left, right, p: [left.x - right.x, left.v - right.v],
        lambda s, u, p: u.x * 2 * np.pi * np.cos(2 * np.pi * s),
        unknowns=("x", "v"), parameters={"mu": 0.5, "T": 6.4}, scales={"T": 6.0},
        name="van der pol",
    )  # fmt: skip


@lru_cache(maxsize=1)
def tangled() -> BVP:
    """Everything at once: nonlinear coupled ends, two integral conditions, four free parameters."""
    return BVP(
        lambda s, u, p: [
            p.a * np.sin(u.y) * u.z + s * p.b, u.x * u.y - p.c * u.z**2, np.exp(-u.x) + p.d * u.z * s,
            p.f * u.w * u.x + p.a,
        ],
        lambda left, right, p: [
            left.x * right.y - p.a, left.y + right.y**2 - p.b * left.z, right.z * left.z - np.cos(p.c),
            right.x - left.w, right.w**2 - p.d * left.x,
        ],
        [lambda s, u, p: [u.x * u.z - p.b, s * u.y**2 - p.c * p.d], lambda s, u, p: u.w - p.a * u.y],
        unknowns=("x", "y", "z", "w"), parameters={"a": 0.7, "b": -0.3, "c": 0.4, "d": 1.1, "e": 0.0, "f": 1.0},
        observables={
            "work": integral_of(lambda s, u, p: p.a * u.x * np.sin(u.z)),
            "gap": end_value(lambda left, right, p: p.b * left.x * right.w**2),
        },
        scales={"x": 2.0, "z": 0.5, "b": 3.0, "c": 0.2},
        name="tangled",
    )  # fmt: skip


def algebraic(residual, unknowns=("x",), parameters=("lam",), **options) -> BVP:
    """Solutions constant in s: the scalar equations residual(u, p) = 0 as a boundary value problem."""
    return BVP(
        lambda s, u, p: [0.0 * u[0]] * len(unknowns),
        lambda left, right, p: residual(left, p),
        unknowns=unknowns, parameters=dict.fromkeys(parameters, 0.0), name="algebraic", **options,
    )  # fmt: skip


def constant(bvp: BVP, values=None, **parameters: float) -> Solution:
    """The guess with all unknowns constant (zero unless given)."""
    values = np.zeros(bvp.size) if values is None else np.asarray(values, float)
    merged = {**bvp.parameters, **parameters}
    return Solution.from_function(lambda s: np.tile(values, (len(s), 1)), bvp.unknowns, merged)


def circle() -> BVP:
    """x^2 + lam^2 = 1: a closed curve with two folds."""
    return algebraic(lambda u, p: [u.x**2 + p.lam**2 - 1], observables={"x0": end_value(lambda left, right, p: left.x)})


def pitchfork() -> BVP:
    """x (lam - x^2) = 0."""
    return algebraic(lambda u, p: [u.x * (p.lam - u.x**2)])


def kinds(branch) -> list[str]:
    """Kinds of the special points of a branch, in order."""
    return [x.kind for x in branch.special]
