"""The perfectly anisotropic rod (kappa2 = 0): balance equations, clamps and observables as boundary value problems.

Two formulations of one model: :func:`rod_problem` with 13 unknowns, and :func:`reduced_problem` with the seven
unknowns (q, X) and the six constants that balance without body force leaves. Source: T. Yu and J. A. Hanna,
"Bifurcations of buckled, clamped anisotropic rods and thin bands under lateral end translations".
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rodatlas.continuation import BVP, MeshControl, Solution, TraceOptions, end_value, integral_of, solve
from rodatlas.rods.ends import Ends
from rodatlas.rods.formulation import (
    Columns,
    Formulation,
    Parameters,
    Sections,
    by_name,
    components,
    held_by,
    parameters_of,
    pose_columns,
    stacked,
)
from rodatlas.rods.kinematics import (
    POSE,
    balance,
    cross,
    director_components,
    directors,
    pose_of,
    quaternion_rate,
)
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.unknowns import (
    CIRCLE,
    CLAMPS,
    FORCE,
    FORCE_SCALE,
    MOMENT_SCALE,
    clamps_of,
    space_force,
    symmetries_of,
    unit_length,
)

LOADS = ("k1", "M2", "tau")  # the strain where it can change, otherwise the moment
UNKNOWNS = (*FORCE, "M2", "k1", "tau", *POSE)
REDUCED_UNKNOWNS = POSE
SETTING = ("a", *CLAMPS)
CONSTANTS = ("nx", "ny", "nz", "mx", "my", "mz")
SYMMETRIES = symmetries_of(LOADS)
"""See :mod:`rodatlas.rods.symmetry` for the table."""


@lru_cache(maxsize=1)
def rod_problem() -> BVP:
    r"""Thirteen equations for (N, M2, k1, tau, q, X) with M1 = a k1, M3 = tau.

    .. math:: N' + \omega \times N = 0, \quad M' + \omega \times M + d_3 \times N = 0, \quad X' = d_3

    Parameters: a = EI1/GJ, and those of the clamps: psi0 [rad], dL, dD, dY, turn_left, turn_right, twist_left and
    twist_right [rad], see :meth:`rodatlas.rods.Clamps.changed`. Observables: height = int y ds, energy =
    int (a k1^2 + tau^2)/2 ds, end_force_z = z component of N in space at s = 0 (dE/d(dD) along a branch).

    The energy of equilibria changes with a clamp by the work that the clamp does, of the force n = N and the moment m
    there: dE/d(dL) = -n_x, dE/d(dD) = n_z, dE/d(dY) = n_y, dE/d(turn_left) = -m_z(0), dE/d(turn_right) = -m_z(1),
    dE/d(twist_left) = -M3(0), dE/d(twist_right) = M3(1).
    """

    return BVP(
        lambda s, u, p: rates(u, p), _held, unknowns=UNKNOWNS,
        parameters={"a": 0.625, **CIRCLE},
        observables={
            "height": integral_of(lambda s, u, p: u.y),
            "energy": integral_of(lambda s, u, p: LinearLaw(p.a).energy_density(*_loaded(u, p))),
            "end_force_z": end_value(lambda left, right, p: space_force(left)[2]),
        },
        scales={**dict.fromkeys(FORCE, FORCE_SCALE), **dict.fromkeys(LOADS, MOMENT_SCALE)},
        symmetries=SYMMETRIES, identities=unit_length,
        name="perfectly anisotropic rod",
    )  # fmt: skip


def rates(u: Any, p: Any) -> list[Any]:
    """Right-hand side of :func:`rod_problem`, (13,), for unknowns and parameters by name: numbers or symbols."""
    (strain, moment), q = _loaded(u, p), (u.q0, u.q1, u.q2, u.q3)
    force_rate, moment_rate = balance((u.N1, u.N2, u.N3), moment, strain)
    k1_rate, _, tau_rate = LinearLaw(p.a).strain(moment_rate)  # the law is linear
    return [
        *force_rate, moment_rate[1], k1_rate, tau_rate, *quaternion_rate(q, *strain), *director_components(*q)[2]
    ]  # fmt: skip


def _loaded(u: Any, p: Any) -> tuple[Sequence[Any], Sequence[Any]]:
    """Strain and moment (3,) from the unknowns."""
    strain = (u.k1, 0.0, u.tau)
    return strain, LinearLaw(p.a).moment(strain, reaction=(0.0, u.M2, 0.0))


@lru_cache(maxsize=1)
def reduced_problem() -> BVP:
    r"""Seven equations for (q, X) with constant space force n and moment m(0).

    .. math:: m(s) = m(0) - (X(s) - X(0)) \times n, \quad \kappa_1 = d_1 \cdot m / a, \quad \tau = d_3 \cdot m

    Parameters: as :func:`rod_problem`, and nx .. mz, free on every branch together with the control parameter.
    """

    def moment(u: Any, p: Any) -> list[Any]:
        start, force = clamps_of(p).left.position, (p.nx, p.ny, p.nz)
        arm = [here - there for here, there in zip((u.x, u.y, u.z), start, strict=True)]
        m = [m0 - turned for m0, turned in zip((p.mx, p.my, p.mz), cross(arm, force), strict=True)]
        frame = director_components(u.q0, u.q1, u.q2, u.q3)
        return [sum(a * b for a, b in zip(d, m, strict=True)) for d in frame]

    def rhs(s: Any, u: Any, p: Any) -> list[Any]:
        q = (u.q0, u.q1, u.q2, u.q3)
        return [*quaternion_rate(q, *LinearLaw(p.a).strain(moment(u, p))), *director_components(*q)[2]]

    def energy(s: Any, u: Any, p: Any) -> Any:
        law, m = LinearLaw(p.a), moment(u, p)
        return law.energy_density(law.strain(m), m)

    return BVP(
        rhs, _held, unknowns=REDUCED_UNKNOWNS,
        parameters={"a": 0.625, **CIRCLE, **dict.fromkeys(CONSTANTS, 0.0)},
        observables={"height": integral_of(lambda s, u, p: u.y), "energy": integral_of(energy),
                     "end_force_z": end_value(lambda left, right, p: p.nz)},
        scales={**dict.fromkeys(CONSTANTS[:3], FORCE_SCALE), **dict.fromkeys(CONSTANTS[3:], MOMENT_SCALE)},
        name="perfectly anisotropic rod, reduced",
    )  # fmt: skip


def _law(p: Parameters) -> LinearLaw:
    return LinearLaw(p["a"])


def _read(u: Columns, p: Parameters) -> Sections:
    zero = np.zeros_like(u["k1"])
    strain = [u["k1"], zero, u["tau"]]
    moment = _law(p).moment(strain, reaction=[zero, u["M2"], zero])
    return Sections(stacked(u, FORCE), np.stack(moment, -1), np.stack(strain, -1), *pose_of(u))


def _write(x: Sections, p: Parameters) -> Columns:
    (_, m2, _), (k1, _, tau) = components(x.moment), components(x.strain)
    return {**by_name(FORCE, x.force), "M2": m2, "k1": k1, "tau": tau, **pose_columns(x)}


def _read_reduced(u: Columns, p: Parameters) -> Sections:
    force, moment = (np.array([p[name] for name in names]) for names in (CONSTANTS[:3], CONSTANTS[3:]))
    return held_by(_law(p), force, moment, *pose_of(u), origin=np.array(clamps_of(p).left.position))


FULL = Formulation(UNKNOWNS, SETTING, _law, clamps_of, _read, _write)
REDUCED = Formulation(
    REDUCED_UNKNOWNS, (*SETTING, *CONSTANTS), _law, clamps_of, _read_reduced, lambda x, p: pose_columns(x)
)


def setting(law: LinearLaw, ends: Ends) -> dict[str, float]:
    """Parameters of :func:`rod_problem` for a perfectly anisotropic rod between clamps."""
    return {"a": law.a, **ends.parameters}


HELD = ("dD",)
"""Names a free parameter where all are held: a solve at fixed parameters takes any for its units."""


def settled(guess: Solution, tolerance: float = 1e-8) -> Solution:
    """The state of :func:`rod_problem` near a guess, at its parameters.

    Raises
    ------
    NotConverged
        when Newton's method does not converge.
    """
    return solve(rod_problem(), guess, HELD, TraceOptions(mesh=MeshControl(tolerance=tolerance)))


def check_rod(solution: object) -> None:
    """Raise ValueError for what is no solution of :func:`rod_problem`."""
    FULL.check(solution)


def to_reduced(solution: Solution) -> Solution:
    """The same state as a solution of :func:`reduced_problem`."""
    check_rod(solution)
    start = FULL.sections(solution, solution.values[0])
    frame = np.array(directors(start.quaternion))
    known = parameters_of(solution)
    parameters = {name: known[name] for name in reduced_problem().parameters if name not in CONSTANTS}
    loads = zip(CONSTANTS, [*(start.force @ frame).tolist(), *(start.moment @ frame).tolist()], strict=True)
    return FULL.rewritten(solution, REDUCED, {**parameters, **dict(loads)})


def from_reduced(solution: Solution) -> Solution:
    """The same state as a solution of :func:`rod_problem`."""
    REDUCED.check(solution)
    known = parameters_of(solution)
    return REDUCED.rewritten(solution, FULL, {name: known[name] for name in rod_problem().parameters})


def _held(left: Any, right: Any, p: Any) -> list[Any]:
    return clamps_of(p).residual(left, right)
