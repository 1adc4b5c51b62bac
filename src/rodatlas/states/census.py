"""Counts of rediscovery: which solutions of a batch are equal, and how many others there may be."""

from __future__ import annotations

import numpy as np

from rodatlas.states.shooting import Shots

SAME = 1e-5


def invariants(shots: Shots, rows: np.ndarray, pairs: bool = True) -> np.ndarray:
    """(len(rows), d) of some shots, by which equal states are known.

    Parameters
    ----------
    pairs : whether the reversal maps the states at this setting to one another. If so, energy, height, n.n and n.m,
        scaled: d = 4 numbers that a state and its partner share. If not, the directions of n and m(0) too, d = 10: a
        mirror may map the setting to itself, and two different states have the same four numbers then.
    """
    n, m = shots.constants[rows, :3], shots.constants[rows, 3:]
    square = np.einsum("bi,bi->b", n, n)
    product = np.einsum("bi,bi->b", n, m)
    energy, size = np.log1p(shots.energy[rows]), 1.0 + square
    shared = np.column_stack([energy, shots.height[rows], np.log(size), product / size])
    if pairs:
        return shared
    m_size = 1.0 + np.einsum("bi,bi->b", m, m)
    return np.column_stack([shared, n / np.sqrt(size)[:, None], m / np.sqrt(m_size)[:, None]])


def species(keys: np.ndarray) -> np.ndarray:
    """Number (B,) of the first row that equals each row of `keys` (B, d), differences up to `SAME` ignored."""
    first = np.empty(len(keys), dtype=int)
    found: list[int] = []
    for i, key in enumerate(keys):
        near = np.flatnonzero(np.abs(keys[found] - key).max(axis=1, initial=0.0) < SAME)
        if len(near) == 0:
            found.append(i)
        first[i] = found[int(near[0])] if len(near) else i
    return first


FEW = 10  # solutions from which on the estimates below mean anything


def unseen(counts: np.ndarray) -> tuple[float, float]:
    """Estimated number of states not met, and probability that one more solution is a new state.

    With f1 states met once and f2 met twice in n solutions: f1 (f1 - 1) / (2 (f2 + 1)) (A. Chao (1984), Scand. J.
    Statist. 11, 265, in the form without bias; a lower bound) and f1 / n (I. J. Good (1953), Biometrika 40, 237).
    """
    once, twice = int(np.sum(counts == 1)), int(np.sum(counts == 2))
    total = int(np.sum(counts))
    return once * (once - 1) / (2.0 * (twice + 1)), (once / total if total else 1.0)
