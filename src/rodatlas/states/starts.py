"""Starts of a search: bands of random smooth strain, relaxed more or less, and random forces and moments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodatlas.rods.ends import Ends
from rodatlas.rods.law import Law, softness_of_band

PLACES = 64  # intervals between the poses of a start
RESOLVED = 0.3  # largest length of a piece of constant strain in a relaxation, in units of the slack
BENDS, TWISTS = 5, 4  # cosines in a random k1 and tau
BEND, TWIST, SPREAD = 12.0, 7.0, 2.0  # standard deviations of their amplitudes [1/L], and how far these are spread
FULL = 200  # iterations that carry nearly every band to a minimum; most need 20 to 100
PARTLY = (0, 1, 2, 4, 7, 11, 16, FULL)  # relaxed less, bands are near saddles as often as near minima
RELAXED = 1e-4  # error of the strains of a relaxed band, relative to 1 + the force


class Starts(NamedTuple):
    """Guesses: poses (B, PLACES + 1, 7) = (q, X), clamps included, and constants (B, 6) = (n, m(0)) in space."""

    poses: np.ndarray
    constants: np.ndarray


def pieces_for(ends: Ends) -> int:
    """Pieces of constant strain in a relaxation, a multiple of PLACES.

    The slack 1 - c, c the distance of the clamps, sets the force, up to about 5 / slack^2 in the states that have
    names, and with it the length of the layers in which the band bends, sqrt(a / force) or about slack / 3.
    """
    slack = 1.0 - ends.distance
    pieces = PLACES
    while pieces * RESOLVED * slack < 1.0:
        pieces *= 2
    return pieces


def quasi_random(rows: range, dimensions: int, seed: int) -> np.ndarray:
    """Sobol points (len(rows), dimensions) in the open unit cube, shifted at random with a fixed seed.

    `rows` are places in the sequence, without a step: `range(0, 8)` and `range(8, 16)` together are `range(0, 16)`.
    Source: R. Cranley and T. N. L. Patterson (1976), SIAM J. Numer. Anal. 13, 904 (the shift).
    """
    from scipy.stats import qmc

    sobol = qmc.Sobol(dimensions, scramble=False)
    sobol.fast_forward(1 + rows.start)
    points = (sobol.random(len(rows)) + np.random.default_rng(seed).random(dimensions)) % 1.0
    clipped: np.ndarray = np.clip(points, 1e-9, 1.0 - 1e-9)
    return clipped


def random_strains(rows: range, pieces: int, seed: int) -> np.ndarray:
    """Smooth k1 and tau (len(rows), pieces, 2) of random bands, sums of cosines with normal amplitudes.

    Blocks of bands without a symmetry and of such that are symmetric under reversal take turns. A symmetric band stays
    so while it is relaxed, and most symmetric minima attract few others. Each kind has a sequence of its own; its last
    number scales all amplitudes of a band by a factor between 1 / SPREAD and SPREAD.
    """
    from scipy.special import ndtri

    places = np.array(rows)
    block = len(PARTLY)
    symmetric = places // block % 2 == 1
    within = places // (2 * block) * block + places % block  # place in the sequence of its kind
    out = np.zeros((len(rows), pieces, 2))
    s = (np.arange(pieces) + 0.5) / pieces
    for kind, step in ((False, 1), (True, 2)):
        chosen = symmetric == kind
        if not chosen.any():
            continue
        bends, twists = np.arange(0, BENDS, step), np.arange(0, TWISTS, step)
        first, last = int(within[chosen][0]), int(within[chosen][-1])
        points = quasi_random(range(first, last + 1), len(bends) + len(twists) + 1, seed + 1000 * kind)
        points = points[within[chosen] - first]
        amplitudes = ndtri(points[:, :-1]) * SPREAD ** (2.0 * points[:, -1:] - 1.0)
        out[chosen, :, 0] = BEND * amplitudes[:, : len(bends)] @ np.cos(np.pi * np.outer(bends, s))
        out[chosen, :, 1] = TWIST * amplitudes[:, len(bends) :] @ np.cos(np.pi * np.outer(twists, s))
    return out


def relaxed(ends: Ends, law: Law, sign: int, rows: range, *, partly: bool, seed: int = 1) -> Starts:
    """Bands of random smooth strain, carried toward a minimum of the energy with the ends held.

    Parameters
    ----------
    law : of the perfectly anisotropic rod.
    sign : class, +1 or -1. rows : places in the quasi-random sequence, one for each start.
    partly : stop at various distances from the minimum (see `PARTLY`), else relax fully.
    """
    from rodatlas.states._relaxation_kernel import relax_batch

    strains = random_strains(rows, pieces_for(ends), seed)
    left, right = _class_clamps(ends, sign)
    poses, constants = np.empty((len(rows), PLACES + 1, 7)), np.empty((len(rows), 6))
    iterations = np.array(PARTLY)[np.array(rows) % len(PARTLY)] + 1 if partly else np.full(len(rows), FULL)
    relax_batch(strains, left, right, softness_of_band(law), iterations, RELAXED, poses, constants)
    return Starts(poses, constants)


def random_forces(ends: Ends, law: Law, sign: int, rows: range, largest: float, seed: int = 2) -> Starts:
    """Bands marched from the left clamp with (n, m(0)) quasi-random: |n_i| <= largest, |m_i| <= sqrt(largest) + 10.

    A bending wave of a force n has moments of the order of sqrt(n) [GJ/L].
    """
    from rodatlas.rods._shooting_kernel import TABLEAU, WEIGHTS, march_batch

    bound = np.repeat([largest, np.sqrt(largest) + 10.0], 3)
    constants = (2.0 * quasi_random(rows, 6, seed) - 1.0) * bound
    left, right = _class_clamps(ends, sign)
    poses = np.empty((len(rows), PLACES + 1, 7))
    poses[:, 0], poses[:, -1] = left, right
    march_batch(poses, constants, softness_of_band(law), PLACES, 1, TABLEAU, WEIGHTS)
    return Starts(poses, constants)


def _class_clamps(ends: Ends, sign: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses (7,) of the left and the right clamp, the right one of a class."""
    return ends.clamps.left.numbers, ends.clamps.right.of_class(sign).numbers
