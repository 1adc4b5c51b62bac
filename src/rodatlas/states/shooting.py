"""Many boundary value problems of the clamped band at once, by multiple shooting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.ends import Ends
from rodatlas.rods.formulation import by_name, held_by
from rodatlas.rods.kinematics import POSE, pose_of
from rodatlas.rods.law import Law, LinearLaw, softness_of_band
from rodatlas.rods.perfectly_anisotropic import FULL, setting
from rodatlas.states.starts import PLACES, Starts


class Plan(NamedTuple):
    """How bands are shot whose force at the start is at most `force` [GJ/L^2].

    `segments` divide PLACES; `steps` of order 8 in each keep sqrt(force / a) times their length below one half, and
    their error near 1e-10. `apart`: see :func:`rodatlas.rods._shooting_kernel.solve_batch`.
    """

    force: float
    segments: int
    steps: int
    apart: bool


PLANS = (Plan(150.0, 8, 5, False), Plan(600.0, 16, 5, True), Plan(2500.0, 32, 5, True), Plan(np.inf, 64, 5, True))
LARGEST_FORCE = 30000.0  # at 0.998 of the limiting shear


class Shots(NamedTuple):
    """What Newton's method made of B starts.

    Attributes
    ----------
    poses (B, PLACES + 1, 7), constants (B, 6) : solutions where `iterations` > 0; of the poses only those between
        segments, every (PLACES / segments)-th, are solved for.
    segments (B,) : of the plan that was used.
    iterations (B,) : Newton iterations, 0 where the method did not converge.
    height (B,), energy (B,) [GJ/L], defect (B,) : the defect is the largest gap in pose between segments.
    """

    poses: np.ndarray
    constants: np.ndarray
    segments: np.ndarray
    iterations: np.ndarray
    height: np.ndarray
    energy: np.ndarray
    defect: np.ndarray

    @property
    def converged(self) -> np.ndarray:
        """(B,) of bool."""
        return self.iterations > 0


def shoot(
    starts: Starts, law: Law, *, tolerance: float = 1e-9, most: int = 30, plan: Plan | None = None
) -> Shots:  # fmt: skip
    """Solve from every start, as the force there demands; the starts are left as they are.

    Parameters
    ----------
    law : of the perfectly anisotropic rod. tolerance : largest defect of a solution. most : Newton iterations.
    plan : used for all starts instead of the ones in `PLANS`.
    """
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, solve_batch

    poses, constants = starts.poses.copy(), starts.constants.copy()
    count = len(poses)
    segments, iterations, observed = np.zeros(count, int), np.zeros(count, int), np.full((count, 3), np.nan)
    force = np.linalg.norm(constants[:, :3], axis=1)
    usable = np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(constants).all(axis=1) & (force < LARGEST_FORCE)
    least, softness = 0.0, softness_of_band(law)
    for one in (plan,) if plan else PLANS:
        rows = np.flatnonzero(usable & ((force >= least) & (force < one.force) | (plan is not None)))
        least = one.force
        if not len(rows):
            continue
        every = PLACES // one.segments
        inner, loads, seen = poses[rows, ::every].copy(), constants[rows], observed[rows]
        iterations[rows] = solve_batch(inner, loads, softness, one.steps, tolerance, most, LARGEST_FORCE, one.apart,
                                       TABLEAU, WEIGHTS, seen)  # fmt: skip
        poses[rows[:, None], np.arange(0, PLACES + 1, every)] = inner
        constants[rows], observed[rows], segments[rows] = loads, seen, one.segments
    return Shots(poses, constants, segments, iterations, *observed.T)


def all_shots(parts: list[Shots]) -> Shots:
    """The shots of several sets of starts as one."""
    return Shots(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def as_guess(shots: Shots, row: int, law: LinearLaw, ends: Ends) -> Solution:
    """A solution of multiple shooting as a guess for the rod problem on PLACES mesh intervals."""
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, march_batch

    poses, constants = shots.poses[row : row + 1].copy(), shots.constants[row]
    march_batch(poses, constants[None], softness_of_band(law), PLACES // int(shots.segments[row]), 2, TABLEAU, WEIGHTS)
    return guess_from(poses[0], constants, setting(law, ends))


def guess_from(poses: np.ndarray, constants: np.ndarray, parameters: Mapping[str, float]) -> Solution:
    """Poses (K + 1, 7) at equidistant places and constants (6,) as a guess for the rod problem on K mesh intervals."""
    quaternion, position = pose_of(by_name(POSE, poses))
    sections = held_by(FULL.law(parameters), constants[:3], constants[3:], quaternion, position, position[0])
    return FULL.guess(np.linspace(0.0, 1.0, len(poses)), sections, parameters)
