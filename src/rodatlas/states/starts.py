"""Starts of a search: bands of random smooth strain, relaxed more or less, and random forces and moments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodatlas.rods.ends import Ends

SEGMENTS, PIECES = 8, 64  # of multiple shooting, and of constant strain in a relaxation
BENDS, TWISTS = 5, 4  # cosines in a random k1 and tau
BEND, TWIST = 12.0, 9.0  # standard deviations of their amplitudes [1/L]
FULL = 600  # iterations that carry nearly every band close to a minimum
PARTLY = (0, 2, 5, 12, 30, 80, 200, FULL)  # relaxed less, bands are near saddles as often as near minima


class Starts(NamedTuple):
    """Guesses: poses (B, K + 1, 7) = (q, X), clamps included, and constants (B, 6) = (n, m(0)) in space."""

    poses: np.ndarray
    constants: np.ndarray


def clamps(ends: Ends) -> tuple[np.ndarray, np.ndarray]:
    """Poses (7,) of the left and right clamp, the right one for class +."""
    c, s = np.cos(ends.angle / 2) / np.sqrt(2.0), np.sin(ends.angle / 2) / np.sqrt(2.0)
    left = np.array([c, -s, c, s, 0.0, 0.0, -ends.shear])
    return left, np.array([c, s, c, -s, 1.0 - ends.compression, 0.0, 0.0])


def quasi_random(count: int, dimensions: int, seed: int) -> np.ndarray:
    """Sobol points (count, dimensions) in the open unit cube, shifted at random with a fixed seed.

    Source: R. Cranley and T. N. L. Patterson (1976), SIAM J. Numer. Anal. 13, 904 (the shift).
    """
    from scipy.stats import qmc

    sobol = qmc.Sobol(dimensions, scramble=False)
    sobol.fast_forward(1)
    points = (sobol.random(count) + np.random.default_rng(seed).random(dimensions)) % 1.0
    clipped: np.ndarray = np.clip(points, 1e-9, 1.0 - 1e-9)
    return clipped


def relaxed(ends: Ends, a: float, sign: int, count: int, *, partly: bool, seed: int = 1) -> Starts:
    """Bands of random smooth strain, carried toward a minimum of the energy with the ends held.

    Parameters
    ----------
    a : EI1/GJ. sign : class, +1 or -1. count : number of starts B.
    partly : stop at various distances from the minimum (see `PARTLY`), else relax fully.
    """
    from scipy.special import ndtri

    from rodatlas.states._relaxation_kernel import relax_batch

    amplitudes = ndtri(quasi_random(count, BENDS + TWISTS, seed))
    cosines = np.cos(np.pi * np.outer(np.arange(max(BENDS, TWISTS)), (np.arange(PIECES) + 0.5) / PIECES))
    bend = BEND * amplitudes[:, :BENDS] @ cosines[:BENDS]
    twist = TWIST * amplitudes[:, BENDS:] @ cosines[:TWISTS]
    left, right = _class_clamps(ends, sign)
    poses, constants = np.empty((count, SEGMENTS + 1, 7)), np.empty((count, 6))
    iterations = np.full(count, FULL) if not partly else np.resize(PARTLY, count) + 1
    strains = np.ascontiguousarray(np.stack([bend, twist], axis=-1))
    relax_batch(strains, left, np.tile(right, (count, 1)), 1.0 / a, iterations, 1e-4, poses, constants)
    return Starts(poses, constants)


def random_forces(ends: Ends, a: float, sign: int, count: int, largest: float, seed: int = 2) -> Starts:
    """Bands marched from the left clamp with (n, m(0)) quasi-random: |n_i| <= largest, |m_i| <= sqrt(largest) + 10.

    A bending wave of a force n has moments of the order of sqrt(n) [GJ/L].
    """
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, march_batch

    bound = np.repeat([largest, np.sqrt(largest) + 10.0], 3)
    constants = (2.0 * quasi_random(count, 6, seed) - 1.0) * bound
    left, right = _class_clamps(ends, sign)
    poses = np.empty((count, SEGMENTS + 1, 7))
    poses[:, 0], poses[:, -1] = left, right
    march_batch(poses, constants, 1.0 / a, 5, TABLEAU, WEIGHTS)
    return Starts(poses, constants)


def joined(*starts: Starts) -> Starts:
    """All starts of several sets."""
    return Starts(np.concatenate([s.poses for s in starts]), np.concatenate([s.constants for s in starts]))


def _class_clamps(ends: Ends, sign: int) -> tuple[np.ndarray, np.ndarray]:
    left, right = clamps(ends)
    right[:4] *= sign
    return left, right
