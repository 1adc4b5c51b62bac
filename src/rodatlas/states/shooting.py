"""Many boundary value problems of the clamped band at once, by condensed multiple shooting."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.ends import Ends
from rodatlas.rods.kinematics import directors
from rodatlas.rods.perfectly_anisotropic import UNKNOWNS
from rodatlas.states.starts import Starts

STEPS = 5  # of order 8 in each segment
FINE = 32  # segments of a guess for collocation


class Shots(NamedTuple):
    """What Newton's method made of B starts.

    Attributes
    ----------
    poses (B, K + 1, 7), constants (B, 6) : solutions where `iterations` > 0.
    iterations (B,) : Newton iterations, 0 where the method did not converge.
    height (B,), energy (B,) [GJ/L], defect (B,) : the defect is the largest gap in pose between segments.
    """

    poses: np.ndarray
    constants: np.ndarray
    iterations: np.ndarray
    height: np.ndarray
    energy: np.ndarray
    defect: np.ndarray

    @property
    def converged(self) -> np.ndarray:
        """(B,) of bool."""
        return self.iterations > 0


def shoot(
    starts: Starts, a: float, *, steps: int = STEPS, tolerance: float = 1e-9, most: int = 30,
    largest_force: float = 3000.0,
) -> Shots:  # fmt: skip
    """Solve from every start; the starts are left as they are.

    Parameters
    ----------
    a : EI1/GJ. steps : integration steps per segment. tolerance : largest defect of a solution.
    most : Newton iterations. largest_force : iterations whose |n| grows beyond it are given up [GJ/L^2].
    """
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, solve_batch

    poses, constants = starts.poses.copy(), starts.constants.copy()
    observed = np.full((len(poses), 3), np.nan)
    iterations = solve_batch(poses, constants, 1.0 / a, steps, tolerance, most, largest_force, TABLEAU, WEIGHTS,
                             observed)  # fmt: skip
    return Shots(poses, constants, iterations, *observed.T)


def refined(poses: np.ndarray, constants: np.ndarray, a: float) -> Shots:
    """One solution (K + 1, 7), (6,) solved again with `FINE` segments."""
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, march_batch

    fine = np.empty((1, FINE + 1, 7))
    fine[0, 0], fine[0, -1] = poses[0], poses[-1]
    march_batch(fine, constants[None], 1.0 / a, 2, TABLEAU, WEIGHTS)
    every = FINE // (len(poses) - 1)
    fine[0, ::every] = poses
    return shoot(Starts(fine, constants[None]), a, steps=2)


def as_guess(poses: np.ndarray, constants: np.ndarray, a: float, ends: Ends) -> Solution:
    """A solution of multiple shooting (K + 1, 7), (6,) as a guess for the rod problem on K mesh intervals."""
    frame = np.moveaxis(np.array(directors(poses[:, :4])), 0, -2)
    force = frame @ constants[:3]
    arm = poses[:, 4:] - poses[0, 4:]
    moment = np.einsum("kda,ka->kd", frame, constants[3:] - np.cross(arm, constants[:3]))
    values = np.column_stack([force, moment[:, 1], moment[:, 0] / a, moment[:, 2], poses])
    parameters = {"a": a, "psi0": ends.angle, "dL": ends.compression, "dD": ends.shear}
    return Solution.from_values(np.linspace(0.0, 1.0, len(poses)), values, UNKNOWNS, parameters)
