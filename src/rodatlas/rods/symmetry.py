"""Symmetries of the clamped band: reversal, angle mirror and shear mirror, acting on solutions.

Each maps solutions to solutions. With s -> 1-s (reversal only), unknowns keep or change their sign as tabulated:

======== ================ ======================== =======================
         reversal         angle mirror             shear mirror
======== ================ ======================== =======================
dD       dD               dD                       -dD
psi0     psi0             -psi0                    psi0
N        N1, -N2, N3      N1, -N2, N3              -N1, N2, N3
M        M1, -M2, M3      -M1, M2, -M3             M1, -M2, -M3
strain   k1, -k2, tau     -k1, k2, -tau            k1, -k2, -tau
q        q0,-q1,q2,-q3    q0,-q1,q2,-q3            q2,-q3,q0,-q1
X        1-dL-x, y,-dD-z  x, -y, z                 x, y, -z
======== ================ ======================== =======================
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation import Solution

_SIGNS = {
    "reversal": {"N2": -1, "M2": -1, "q1": -1, "q3": -1},
    "angle": {"N2": -1, "k1": -1, "tau": -1, "q1": -1, "q3": -1, "y": -1},
    "shear": {"N1": -1, "M2": -1, "tau": -1, "z": -1, "q1": -1, "q3": -1},
}


def reverse(solution: Solution) -> Solution:
    """The reversed solution: the other member of a +/- pair, or the solution itself when it is symmetric."""
    mesh = 1.0 - solution.mesh[::-1]
    dl, dd = solution.parameter("dL"), solution.parameter("dD")

    def act(values: np.ndarray) -> np.ndarray:
        out = _signed(values, solution.unknowns, "reversal")
        out[..., solution.unknowns.index("x")] += 1.0 - dl
        out[..., solution.unknowns.index("z")] -= dd
        return out

    # x and z change sign about the middle of the chord: x -> (1 - dL) - x, z -> -dD - z
    turned = np.ones(len(solution.unknowns))
    turned[[solution.unknowns.index("x"), solution.unknowns.index("z")]] = -1.0
    values, stages = solution.values[::-1] * turned, solution.stages[::-1, ::-1] * turned
    return replace(solution, mesh=mesh, values=act(values), stages=act(stages))


def mirror_angle(solution: Solution) -> Solution:
    """The solution with psi0 -> -psi0 and y -> -y (a state of the W family from one of the U family)."""
    return _mirrored(solution, "angle", "psi0", "height")


def mirror_shear(solution: Solution) -> Solution:
    """The solution with dD -> -dD and z -> -z."""
    out = _mirrored(solution, "shear", "dD", "end_force_z")
    order = list(range(len(out.unknowns)))
    for one, two in (("q0", "q2"), ("q1", "q3")):
        i, j = out.unknowns.index(one), out.unknowns.index(two)
        order[i], order[j] = order[j], order[i]
    return replace(out, values=out.values[:, order], stages=out.stages[..., order])


def asymmetry(solution: Solution, samples: int = 21) -> float:
    """Largest difference of k1 and tau between a solution and its reversal, relative to the largest strain."""
    s = np.linspace(0.0, 0.5, samples)
    columns = [solution.unknowns.index("k1"), solution.unknowns.index("tau")]
    strains = solution(np.concatenate([s, 1.0 - s]))[:, columns]
    difference = np.abs(strains[:samples] - strains[samples:]).max()
    return float(difference / max(np.abs(strains).max(), 1e-300))


def is_symmetric(solution: Solution, tolerance: float = 1e-5) -> bool:
    """Whether a solution equals its reversal."""
    return asymmetry(solution) < tolerance


def pair_member(solution: Solution) -> str:
    """'+' or '-' of a reversal-broken state: + has more bending energy in the half s > 1/2.

    Where both halves have the same (S+-, whose k1 is odd about the middle), + has the larger k1 there.
    """
    k1 = solution.stages[..., solution.unknowns.index("k1")]
    arm = solution.gauss_points() - 0.5
    moment = solution.mean(arm * k1**2)
    if abs(moment) < 1e-5 * solution.mean(k1**2):
        moment = solution.mean(arm * k1)
    return "+" if moment >= 0 else "-"


def plus_member(solution: Solution) -> Solution:
    """The member + of a pair: the solution or its reversal."""
    return solution if pair_member(solution) == "+" else reverse(solution)


def _signed(values: np.ndarray, unknowns: tuple[str, ...], kind: str) -> np.ndarray:
    signs = np.array([_SIGNS[kind].get(name, 1) for name in unknowns], dtype=float)
    return values * signs


def _mirrored(solution: Solution, kind: str, parameter: str, odd: str) -> Solution:
    """Flip one parameter, the tabulated unknowns and the observable that is odd under the mirror."""
    flipped = solution.with_parameters(**{parameter: 0.0 - solution.parameter(parameter)})
    observables = {k: -v if k == odd else v for k, v in solution.observables.items()}
    return replace(
        flipped, values=_signed(solution.values, solution.unknowns, kind),
        stages=_signed(solution.stages, solution.unknowns, kind), observables=observables,
    )  # fmt: skip
