"""Problems with places, and their answers, shared by tests."""

from __future__ import annotations

import numpy as np
from scipy.special import iv, kv

from rodatlas.continuation import BVP, Inner, Solution, end_value, integral_of, value_at


def zero(bvp: BVP, intervals: int = 20, **parameters: float) -> Solution:
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}, intervals
    )


def fin(**more) -> BVP:
    """An annular fin, (r T')' = m^2 r T on (1, b), T(1) = 1, T'(b) = 0: modified Bessel functions."""
    return BVP(
        lambda r, u, p: [u.q, p.m**2 * u.T - u.q / r], lambda left, right, p: [left.T - 1, right.q],
        unknowns=("T", "q"), parameters={"m": 1.5, "b": 3.0}, interval=(1.0, "b"),
        observables={
            "mean": integral_of(lambda r, u, p: r * u.T), "tip": end_value(lambda left, right, p: right.T),
            "middle": value_at(2.0, lambda u, p: u.T),
        },
        **more,
    )  # fmt: skip


def fin_exact(r: float | np.ndarray, b: float, m: float = 1.5) -> np.ndarray:
    return (iv(0, m * r) * kv(1, m * b) + kv(0, m * r) * iv(1, m * b)) / (
        iv(0, m) * kv(1, m * b) + kv(0, m) * iv(1, m * b)
    )


def spring(at: float = 0.5, **more) -> BVP:
    """A pinned column w'''' + P w'' + w^3 = 0 with a spring of stiffness k: the shear force jumps by -k w."""
    return BVP(
        lambda s, u, p: [u.t, u.m, u.q, -p.P * u.m - 50 * u.w**3],
        lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"), parameters={"P": 5.0, "k": 100.0},
        scales={"P": 20.0, "k": 50.0, "t": 3.0, "m": 10.0, "q": 30.0},
        inner=[Inner(at, jumps=lambda u, p: {"q": -p.k * u.w})], **more,
    )  # fmt: skip
