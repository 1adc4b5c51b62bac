"""A start at which something is left undetermined is refused, and what it is has a name."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import algebraic, constant

from rodatlas.continuation import BVP, NewtonCode, NotConverged, Solution, TraceOptions, solve, trace


def hopf() -> BVP:
    """Normal form of a Hopf bifurcation in scaled time: a circle of radius sqrt(a), period 2 pi; or rest."""
    return BVP(
        lambda s, u, p: [
            p.T * (p.a * u.x - u.y - u.x * (u.x**2 + u.y**2)), p.T * (u.x + p.a * u.y - u.y * (u.x**2 + u.y**2)),
        ],
        lambda left, right, p: [left.x - right.x, left.y - right.y, left.y], unknowns=("x", "y"),
        parameters={"a": 0.25, "T": 6.0}, name="hopf",
    )  # fmt: skip


def orbit(amplitude: float) -> Solution:
    def circle(s: np.ndarray) -> np.ndarray:
        return amplitude * np.column_stack([np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)])

    return Solution.from_function(circle, ("x", "y"), {"a": 0.25, "T": 6.0})


@pytest.mark.parametrize("verb", [solve, trace])
@pytest.mark.parametrize("amplitude", [0.0, 0.1, 0.2])
def test_a_guess_that_falls_to_rest_has_no_period(verb, amplitude: float) -> None:
    with pytest.raises(NotConverged, match=r"singular: .*\(nothing determines T here\)") as caught:
        verb(hopf(), orbit(amplitude), ("a", "T"), TraceOptions(bounds={"a": (0.1, 1.0)}))
    assert caught.value.code is NewtonCode.SINGULAR
    assert caught.value.undetermined == ("T",)


@pytest.mark.parametrize("amplitude", [0.4, 0.7])
def test_a_better_guess_finds_the_circle(amplitude: float) -> None:
    branch = trace(hopf(), orbit(amplitude), ("a", "T"), TraceOptions(bounds={"a": (0.1, 1.0)}))
    assert branch.special == ()
    np.testing.assert_allclose(branch.column("T"), 2 * np.pi, atol=1e-7)
    np.testing.assert_allclose([p.solution["x"][0] for p in branch], np.sqrt(branch.column("a")), atol=1e-7)


def test_a_period_without_a_phase_condition() -> None:
    """The phase of an orbit is left open if the third condition says nothing, and the pinned value is a repetition."""
    bvp = BVP(
        lambda s, u, p: [p.T * u.y, -p.T * u.x],
        lambda left, right, p: [left.x - right.x, left.y - right.y, 0 * left.x],
        unknowns=("x", "y"), parameters={"a": 1.0, "T": 6.0},
    )  # fmt: skip
    with pytest.raises(NotConverged) as caught:
        solve(bvp, Solution.from_function(lambda s: np.column_stack([np.cos(6 * s), -np.sin(6 * s)]), bvp.unknowns,
                                          bvp.parameters), ("a", "T"))  # fmt: skip
    assert caught.value.code is NewtonCode.SINGULAR


def test_a_parameter_that_enters_nowhere_is_named() -> None:
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u, left.v - 0.5],
        unknowns=("u", "v"), parameters={"lam": 1.0, "idle": 2.0},
    )  # fmt: skip
    with pytest.raises(NotConverged, match="nothing determines idle here"):
        solve(bvp, constant(bvp), ("lam", "idle"))


def test_branch_points_are_still_starts() -> None:
    """There a parameter may be without effect too, on a trunk that does not depend on it."""
    fork = algebraic(lambda u, p: [u.x * (p.lam - u.x**2), u.y - p.mu, u.y - 1.0], ("x", "y"), ("lam", "mu"))
    start = constant(fork, [0.0, 1.0], lam=0.0, mu=1.0)
    branch = trace(fork, start, ("lam", "mu"), TraceOptions(bounds={"lam": (-1.0, 1.0)}))
    np.testing.assert_allclose(branch.column("lam")[[0, -1]], [-1.0, 1.0])
