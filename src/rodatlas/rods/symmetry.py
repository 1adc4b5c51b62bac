"""Symmetries of the clamped band: reversal, angle mirror and shear mirror, acting on solutions.

Each maps solutions to solutions, and the clamps with them. With s -> 1-s (reversal only), unknowns and parameters keep
or change their sign as tabulated (declared in :func:`rodatlas.rods.unknowns.symmetries_of`; each problem is checked to
have them):

============ ===================== ============== ==============
             reversal              angle mirror   shear mirror
============ ===================== ============== ==============
psi0         psi0                  -psi0          psi0
dD           dD                    dD             -dD
dY           -dY                   -dY            dY
turn_left    turn_right            -turn_left     turn_left
turn_right   turn_left             -turn_right    turn_right
twist_left   -twist_right          -twist_left    -twist_left
twist_right  -twist_left           -twist_right   -twist_right
N            N1, -N2, N3           N1, -N2, N3    -N1, N2, N3
M            M1, -M2, M3           -M1, M2, -M3   M1, -M2, -M3
strain       k1, -k2, tau          -k1, k2, -tau  k1, -k2, -tau
q            q0,-q1,q2,-q3         q0,-q1,q2,-q3  q2,-q3,q0,-q1
X            1-dL-x, y-dY, -dD-z   x, -y, z       x, y, -z
============ ===================== ============== ==============

A setting has those that leave its parameters alone (:func:`fixes`). Where it has the reversal, a state equals its
reversal or is one of a pair; between other clamps the reversal of a state belongs to another setting, and the state has
no partner (:func:`has_partner`).

The quaternions q and -q are one frame: where the right clamp is reached at -q of the table in
:mod:`rodatlas.rods.perfectly_anisotropic`, the reversed rod starts at -q, and its image changes the sign of q.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.symmetric.isotropy import action_of, image
from rodatlas.rods.formulation import components, parameters_of
from rodatlas.rods.perfectly_anisotropic import check_rod, rod_problem
from rodatlas.rods.state import SYMMETRIC, RodState, count_sign_changes

ROUND_OFF = 1e-12  # how far a symmetry may move a parameter that it leaves alone


def fixes(symmetry: str, setting: Solution | Mapping[str, float]) -> bool:
    """Whether a symmetry leaves the parameters of a setting alone, so that it maps its states to one another.

    Parameters
    ----------
    symmetry : 'reversal', 'angle mirror', 'shear mirror', or a product 'a * b' of some.
    setting : a solution of :func:`rodatlas.rods.rod_problem`, or its parameters by name; those that are missing have
        their defaults.

    Raises
    ------
    ValueError
        for another symmetry, or a parameter that the problem does not have.

    Examples
    --------
    >>> fixes("reversal", Ends(15.0, shear=0.2).parameters), fixes("shear mirror", Ends(15.0, shear=0.2).parameters)
    (True, False)
    >>> fixes("reversal", Ends.unequal(20.0, 35.0).parameters)
    False
    """
    check_type("symmetry", symmetry, str, "the name of a symmetry such as 'reversal'")
    problem = rod_problem()
    if isinstance(setting, Solution):
        check_rod(setting)
        known = parameters_of(setting)
        setting = {name: known[name] for name in problem.parameters}
    values = problem.parameter_vector(setting)
    return bool(np.abs(action_of(problem, symmetry).parameters(values) - values).max() <= ROUND_OFF)


def symmetries_at(setting: Solution | Mapping[str, float]) -> tuple[str, ...]:
    """Names of the declared symmetries and of their products that a setting has, see :func:`fixes`.

    Examples
    --------
    >>> symmetries_at(Ends.unequal(20.0, -20.0, shear=0.1).parameters)
    ('reversal * angle mirror',)
    """
    names = tuple(rod_problem().symmetries)
    products = (" * ".join(some) for size in range(1, len(names) + 1) for some in combinations(names, size))
    return tuple(product for product in products if fixes(product, setting))


def has_partner(solution: Solution) -> bool:
    """Whether the reversal of a solution is another one at the same setting, so that the two are a +/- pair."""
    return fixes("reversal", solution) and not is_symmetric(solution)


def reverse(solution: Solution) -> Solution:
    """The reversed solution: the other member of a +/- pair, or the solution itself when it is symmetric.

    Between clamps that the reversal exchanges it belongs to the exchanged ones.
    """
    check_rod(solution)
    return image(rod_problem(), "reversal", solution)


def mirror_angle(solution: Solution) -> Solution:
    """The solution with psi0 -> -psi0 and y -> -y (a state of the W family from one of the U family)."""
    check_rod(solution)
    return image(rod_problem(), "angle mirror", solution)


def mirror_shear(solution: Solution) -> Solution:
    """The solution with dD -> -dD and z -> -z."""
    check_rod(solution)
    return image(rod_problem(), "shear mirror", solution)


def asymmetry(solution: Solution) -> float:
    """Largest difference of k1 and tau between a solution and its reversal, relative to the largest strain.

    It compares strains, not clamps: 0 also for a shape with a symmetry that its clamps do not show as the reversal.
    """
    check_rod(solution)
    return RodState(solution).asymmetry


def is_symmetric(solution: Solution, tolerance: float = SYMMETRIC) -> bool:
    """Whether a solution equals its reversal; never between clamps that the reversal exchanges (see
    :func:`has_partner`)."""
    return fixes("reversal", solution) and asymmetry(solution) < tolerance


def half_twist(solution: Solution) -> float:
    """Angle in radians by which the middle is twisted against both clamps, the mean of the two; 0 where symmetric."""
    check_rod(solution)
    state = RodState(solution).at_gauss_points()
    return solution.mean(np.sign(0.5 - state.s) * state.tau) / 2


def is_twisted(solution: Solution) -> bool:
    """Whether a state is strongly twisted, as TU and TW: its middle is twisted by more than 135 degrees.

    Or by more than a right angle, and k1 has four inflections or more. Stable TU and TW have 2.5 to 3.2 rad; other
    stable states at dL = 1/2 less than 2, and two or three inflections.
    """
    twist = abs(half_twist(solution))
    if not np.pi / 2 < twist < 3 * np.pi / 4:
        return twist >= 3 * np.pi / 4
    k1 = RodState(solution).at(np.linspace(0.0, 1.0, 401)[1:-1]).k1
    return count_sign_changes(k1, 1e-6 * np.abs(k1).max()) >= 4


def pair_member(solution: Solution) -> str:
    """'+' or '-' of a reversal-broken state: + has more bending energy in the half s > 1/2.

    Where both halves have the same (S+-, whose k1 is odd about the middle), + has the larger k1 there. The bending of
    strongly twisted states is even at dD = 0: there + is the member whose first half is twisted against the side on
    which the rod lies (half twist and height of opposite sign), which is the same at small positive shear.

    Raises
    ------
    ValueError
        between clamps that the reversal exchanges, where no state has a partner.
    """
    if not fixes("reversal", solution):
        raise ValueError("solution: expected one whose clamps the reversal leaves alone, got one without a partner")
    state = RodState(solution).at_gauss_points()
    if is_twisted(solution):
        _, y, _ = components(state.position)
        return "+" if half_twist(solution) * solution.mean(y) <= 0 else "-"
    k1, arm = state.k1, state.s - 0.5
    moment = solution.mean(arm * k1**2)
    if abs(moment) < 1e-5 * solution.mean(k1**2):
        moment = solution.mean(arm * k1)
    return "+" if moment >= 0 else "-"


def plus_member(solution: Solution) -> Solution:
    """The member + of a pair: the solution or its reversal; a state without a partner itself."""
    return reverse(solution) if has_partner(solution) and pair_member(solution) == "-" else solution
