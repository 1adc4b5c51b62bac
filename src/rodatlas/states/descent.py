"""Where a band goes that is let go: descent of the energy with the ends held, to the stable state it ends in."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import NotConverged, Solution
from rodatlas.rods.ends import check_shear
from rodatlas.rods.formulation import components, parameters_of
from rodatlas.rods.law import Law, softness_of_band
from rodatlas.rods.perfectly_anisotropic import settled
from rodatlas.rods.state import RodState
from rodatlas.states.shooting import guess_from

NODES = 64  # intervals of the guess for Newton's method
PIECES = 1024  # of constant strain: where forces are large, few would shift a fold by more than 0.01 in shear
STEPS = 20000  # of the descent at most
TOLERANCE = 1e-8  # the descent ends when the projected gradient and the gap at the clamp are smaller
SETTLED = 1e-3  # projected gradient [GJ/L^1.5] at which Newton takes over
NEAR = 2e-3  # relative difference of energy between the pieces and the solution that Newton's method may make


def descend(shape: Solution, shear: float | None = None, tolerance: float = 1e-8) -> Solution | None:
    """The equilibrium at which the steepest descent of the energy ends, starting from a shape.

    The strains of the shape are relaxed with the ends held (see `rodatlas.states._descent_kernel`): the path of an
    overdamped band, in the metric of the energy. Only a stable state is an end of such a path. It is then solved by
    Newton's method.

    Parameters
    ----------
    shape : any shape of a rod, of class +, between any clamps; need not be an equilibrium.
    shear : dD at which the ends are held, if other than that of the shape.
    tolerance : of the solution.

    Returns
    -------
    the equilibrium, or None when the descent has not settled or Newton's method leaves its end.
    """
    from rodatlas.states._descent_kernel import descend_band

    if shear is not None:
        check_shear(shear, shape["dL"], shape["dY"])
        shape = shape.with_parameters(dD=shear)
    pieces = RodState(shape).at((np.arange(PIECES) + 0.5) / PIECES)
    left, right, softness = pieces.clamps.left.numbers, pieces.clamps.right.numbers, softness_of_band(pieces.law)
    strain = np.column_stack([pieces.k1, pieces.tau])
    poses, constants = np.empty((NODES + 1, 7)), np.empty(6)
    gradient = descend_band(strain, left, right, softness, STEPS, TOLERANCE, poses, constants)
    if not gradient < SETTLED:
        return None
    energy = float(np.mean(pieces.law.energy_density(*_loaded(strain, pieces.law))))
    try:
        guess = guess_from(poses, constants, parameters_of(shape))
        found = settled(guess, tolerance)
    except NotConverged:
        return None
    return found if abs(found["energy"] - energy) < NEAR * (1.0 + energy) else None


def _loaded(strain: np.ndarray, law: Law) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Strains and moments by component, of pieces (J, 2) that bend about the width and twist."""
    full = components(np.insert(strain, 1, 0.0, axis=1))
    return full, law.moment(full, reaction=components(np.zeros((len(strain), 3))))  # a reaction does no work
