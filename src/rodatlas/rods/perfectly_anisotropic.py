"""The perfectly anisotropic rod (kappa2 = 0): balance equations, clamps and observables as boundary value problems.

Two formulations of one model: :func:`rod_problem` with 13 unknowns, and :func:`reduced_problem` with the seven
unknowns (q, X) and the six constants that balance without body force leaves. Source: T. Yu and J. A. Hanna,
"Bifurcations of buckled, clamped anisotropic rods and thin bands under lateral end translations".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from rodatlas.continuation import BVP, Solution, end_value, integral_of
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.problem.symmetry import Symmetry
from rodatlas.rods.kinematics import clamp_residual, director_components, directors, quaternion_rate

UNKNOWNS = ("N1", "N2", "N3", "M2", "k1", "tau", "q0", "q1", "q2", "q3", "x", "y", "z")
REDUCED_UNKNOWNS = UNKNOWNS[6:]
CONSTANTS = ("nx", "ny", "nz", "mx", "my", "mz")
FORCE_SCALE = 300.0
MOMENT_SCALE = 60.0

# q and -q are one rotation: the reversal of a state whose right clamp is reached at -q starts at -q
_FRAME = {"q1": -1, "q3": -1}
SYMMETRIES = (
    Symmetry("reversal", {"N2": -1, "M2": -1, **_FRAME, "x": "1 - dL - x", "z": "-dD - z"}, reverse=True),
    Symmetry("angle mirror", {"N2": -1, "k1": -1, "tau": -1, **_FRAME, "y": -1}, {"psi0": -1}),
    Symmetry(
        "shear mirror",
        {"N1": -1, "M2": -1, "tau": -1, "q0": "q2", "q1": "-q3", "q2": "q0", "q3": "-q1", "z": -1}, {"dD": -1},
    ),
    Symmetry("quaternion sign", {"q0": -1, "q1": -1, "q2": -1, "q3": -1}, gauge=True),
)  # fmt: skip
"""See :mod:`rodatlas.rods.symmetry` for the table."""


@lru_cache(maxsize=1)
def rod_problem() -> BVP:
    r"""Thirteen equations for (N, M2, k1, tau, q, X) with M1 = a k1, M3 = tau.

    .. math:: N' + \omega \times N = 0, \quad M' + \omega \times M + d_3 \times N = 0, \quad X' = d_3

    Parameters: a = EI1/GJ, psi0 [rad], dL, dD. Observables: height = int y ds, energy = int (a k1^2 + tau^2)/2 ds,
    end_force_z = z component of N in space at s = 0 (dE/d(dD) along a branch).
    """

    def rhs(s: Any, u: Any, p: Any) -> list[Any]:
        m1, m3 = p.a * u.k1, u.tau
        d3 = director_components(u.q0, u.q1, u.q2, u.q3)[2]
        return [
            u.N2 * u.tau,
            -u.N1 * u.tau + u.N3 * u.k1,
            -u.N2 * u.k1,
            -m1 * u.tau + m3 * u.k1 - u.N1,
            (u.M2 * u.tau + u.N2) / p.a,
            -u.M2 * u.k1,
            *quaternion_rate((u.q0, u.q1, u.q2, u.q3), u.k1, 0.0, u.tau),
            *d3,
        ]

    return BVP(
        rhs, _clamps, unknowns=UNKNOWNS, parameters={"a": 0.625, "psi0": np.pi, "dL": 1.0, "dD": 0.0},
        observables={
            "height": integral_of(lambda s, u, p: u.y),
            "energy": integral_of(lambda s, u, p: (p.a * u.k1**2 + u.tau**2) / 2),
            "end_force_z": end_value(_end_force_z),
        },
        scales={"N1": FORCE_SCALE, "N2": FORCE_SCALE, "N3": FORCE_SCALE, "M2": MOMENT_SCALE, "k1": MOMENT_SCALE,
                "tau": MOMENT_SCALE},
        symmetries=SYMMETRIES, identities=lambda u, p: u.q0**2 + u.q1**2 + u.q2**2 + u.q3**2 - 1,
        name="perfectly anisotropic rod",
    )  # fmt: skip


@lru_cache(maxsize=1)
def reduced_problem() -> BVP:
    r"""Seven equations for (q, X) with constant space force n and moment m(0).

    .. math:: m(s) = m(0) - (X(s) - X(0)) \times n, \quad \kappa_1 = d_1 \cdot m / a, \quad \tau = d_3 \cdot m

    Parameters: as :func:`rod_problem`, and nx .. mz, free on every branch together with the control parameter.
    """

    def strains(u: Any, p: Any) -> tuple[Any, Any]:
        d1, _, d3 = director_components(u.q0, u.q1, u.q2, u.q3)
        rx, ry, rz = u.x, u.y, u.z + p.dD
        m = [p.mx - (ry * p.nz - rz * p.ny), p.my - (rz * p.nx - rx * p.nz), p.mz - (rx * p.ny - ry * p.nx)]
        return sum(a * b for a, b in zip(d1, m, strict=True)) / p.a, sum(a * b for a, b in zip(d3, m, strict=True))

    def rhs(s: Any, u: Any, p: Any) -> list[Any]:
        k1, tau = strains(u, p)
        q = (u.q0, u.q1, u.q2, u.q3)
        return [*quaternion_rate(q, k1, 0.0, tau), *director_components(*q)[2]]

    def energy(s: Any, u: Any, p: Any) -> Any:
        k1, tau = strains(u, p)
        return (p.a * k1**2 + tau**2) / 2

    return BVP(
        rhs, _clamps, unknowns=REDUCED_UNKNOWNS,
        parameters={"a": 0.625, "psi0": np.pi, "dL": 1.0, "dD": 0.0, **dict.fromkeys(CONSTANTS, 0.0)},
        observables={"height": integral_of(lambda s, u, p: u.y), "energy": integral_of(energy),
                     "end_force_z": end_value(lambda left, right, p: p.nz)},
        scales={**dict.fromkeys(CONSTANTS[:3], FORCE_SCALE), **dict.fromkeys(CONSTANTS[3:], MOMENT_SCALE)},
        name="perfectly anisotropic rod, reduced",
    )  # fmt: skip


def check_rod(solution: object, names: Sequence[str] = UNKNOWNS) -> None:
    """Raise ValueError for what is no solution of :func:`rod_problem`, or of another problem with some names."""
    check_type("solution", solution, Solution, "a Solution such as state_at(Ends(15.0))")
    assert isinstance(solution, Solution)
    if not {*names} <= {*solution.unknowns, *solution.parameter_names}:
        raise ValueError(f"solution: expected one with {', '.join(names)}, got one with {', '.join(solution.unknowns)}")


def to_reduced(solution: Solution) -> Solution:
    """The same state as a solution of :func:`reduced_problem`."""
    check_rod(solution)
    frame = np.array(directors(solution.values[0, 6:10]))
    n1, n2, n3, m2, k1, tau = solution.values[0, :6]
    force = np.array([n1, n2, n3]) @ frame
    moment = np.array([solution["a"] * k1, m2, tau]) @ frame
    parameters = dict(zip(solution.parameter_names, solution.parameters, strict=True))
    values = np.array([*(parameters[k] for k in ("a", "psi0", "dL", "dD")), *force, *moment])
    return replace(
        solution, unknowns=REDUCED_UNKNOWNS, parameter_names=tuple(reduced_problem().parameters), parameters=values,
        values=solution.values[:, 6:].copy(), stages=solution.stages[..., 6:].copy(),
    )  # fmt: skip


def from_reduced(solution: Solution) -> Solution:
    """The same state as a solution of :func:`rod_problem`."""
    check_rod(solution, (*REDUCED_UNKNOWNS, *CONSTANTS))
    p = dict(zip(solution.parameter_names, solution.parameters, strict=True))
    force = np.array([p[k] for k in CONSTANTS[:3]])
    moment = np.array([p[k] for k in CONSTANTS[3:]])
    origin = np.array([0.0, 0.0, -p["dD"]])

    def extended(u: np.ndarray) -> np.ndarray:
        frame = np.moveaxis(np.array(directors(u[..., :4])), 0, -2)
        body_force = frame @ force
        body_moment = np.einsum("...da,...a->...d", frame, moment - np.cross(u[..., 4:] - origin, force))
        strains = body_moment[..., [0, 2]] / [p["a"], 1.0]
        return np.concatenate([body_force, body_moment[..., 1:2], strains, u], axis=-1)

    return replace(
        solution, unknowns=UNKNOWNS, parameter_names=solution.parameter_names[:4],
        parameters=solution.parameters[:4].copy(), values=extended(solution.values), stages=extended(solution.stages),
    )  # fmt: skip


def _clamps(left: Any, right: Any, p: Any) -> list[Any]:
    """Both clamps: q(0) = (c, -s, c, s), q(1) = +/- (c, s, c, -s), X(0) = (0, 0, -dD), X(1) = (1 - dL, 0, 0)."""
    c, s = np.cos(p.psi0 / 2) / np.sqrt(2.0), np.sin(p.psi0 / 2) / np.sqrt(2.0)
    return [
        left.q0 - c, left.q1 + s, left.q2 - c, left.q3 - s, left.x, left.y, left.z + p.dD,
        right.x - (1 - p.dL), right.y, right.z,
        *clamp_residual((right.q0, right.q1, right.q2, right.q3), (c, s, c, -s)),
    ]  # fmt: skip


def _end_force_z(left: Any, right: Any, p: Any) -> Any:
    d1, d2, d3 = director_components(left.q0, left.q1, left.q2, left.q3)
    return left.N1 * d1[2] + left.N2 * d2[2] + left.N3 * d3[2]
