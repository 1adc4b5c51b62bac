r"""Strongly twisted states at one setting, by descent of the energy from a band with half a turn in each half.

Nothing connects these states to the planar ones, and Newton's method alone lands elsewhere. Descent reaches them: the
rod is cut into segments of constant strain (k1, tau), and the energy

.. math:: E = \frac{1}{2} \sum_i h (a k_i^2 + \tau_i^2)

falls at a fixed end pose along its gradient in the metric of E itself, which is the strain minus its projection on the
strains that constant end loads (n, m) cause. Where the gradient vanishes these loads are the multipliers of the end
pose, so the segments are a guess for all unknowns of :func:`rodatlas.rods.perfectly_anisotropic.rod_problem`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve
from rodatlas.rods.band import check_setting
from rodatlas.rods.formulation import Sections, held_by
from rodatlas.rods.kinematics import directors
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import FULL, rod_problem
from rodatlas.rods.poses import Clamps, Pose
from rodatlas.rods.stability import index_of
from rodatlas.rods.symmetry import is_twisted

TWISTED = ("TU", "TW")
SEGMENTS = 48
TWIST = 2.0 * math.pi  # half a turn over each half of the rod
BENDING = (16.0, 18.0, 14.0, 20.0)  # amplitudes of k1 = +/- cos(4 pi s), with four inflections, tried in turn
STEP = 0.3  # of the descent; the metric makes the second variation of order one
CLOSING = 0.1  # largest change of the end pose in one step
MOST_STEPS = 2000
SLOPE, GAP = 1e-2, 1e-6  # gradient and error of the end pose from which Newton takes over


class Chain(NamedTuple):
    """Rod of n segments: `quaternion` (n, 4) and `position` (n, 3) at their middles, and both at the end."""

    quaternion: np.ndarray
    position: np.ndarray
    end_quaternion: np.ndarray
    end_position: np.ndarray


def twisted_states(
    a: float, angle: float, compression: float, tolerance: float = 1e-8
) -> tuple[dict[str, Solution], str]:
    """The stable twisted states TU (above the clamp plane) and TW (below it) at dD = 0, one member of each pair.

    Parameters
    ----------
    a : EI1/GJ; angle : psi0 in radians; compression : dL.

    Returns
    -------
    dict from name to solution, and the names of those that the descent does not reach ('' when it reaches both).
    """
    check_setting(a, angle, compression)
    found: dict[str, Solution] = {}
    for name, side in zip(TWISTED, (1.0, -1.0), strict=True):
        for bending in BENDING:
            strain, load = descend(_shape(-side * bending, side * TWIST), a, angle, compression)
            guess = _guess(strain, load, a, angle, compression)
            try:
                state = solve(rod_problem(), guess, ("dD",), TraceOptions(mesh=MeshControl(tolerance=tolerance)))
            except NotConverged:
                continue
            if is_twisted(state) and state["height"] * side > 0 and index_of(state).index == 0:
                found[name] = state
                break
    return found, ", ".join(name for name in TWISTED if name not in found)


def descend(strain: np.ndarray, a: float, angle: float, compression: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower the energy at fixed end pose.

    Parameters
    ----------
    strain : (n, 2) strains k1 and tau of equal segments to start from; they need not meet the right clamp.

    Returns
    -------
    strain (n, 2) and end load (6,): space force n, and space moment at the right end.
    """
    h, clamps = 1.0 / len(strain), Clamps.symmetric(angle, compression, 0.0)
    bend, _, twist = LinearLaw(a).stiffness
    weight = np.tile([bend, twist], len(strain))
    load = np.zeros(6)
    for _ in range(MOST_STEPS):
        rod = _chain(strain, clamps.left)
        gap = _gap(rod, clamps.right)
        arms, turns = rod.end_position - rod.position, np.stack(directors(rod.quaternion)[::2], axis=1)
        # a strain turns all that lies beyond its segment about d1 or d3: change of end position, then of orientation
        effect = np.concatenate([np.cross(turns, arms[:, None]), turns], axis=-1).reshape(-1, 6)
        flexibility = effect.T @ (effect / weight[:, None]) * h
        load = np.linalg.solve(flexibility, h * effect.T @ strain.ravel())
        slope = strain.ravel() - effect @ load / weight
        size = float(np.linalg.norm(gap))
        if size < GAP and math.sqrt(h * float(weight @ slope**2)) < SLOPE:
            break
        closing = np.linalg.solve(flexibility, gap * min(1.0, CLOSING / max(size, 1e-300)))
        strain = strain - (STEP * slope + effect @ closing / weight).reshape(strain.shape)
    return strain, load


def _shape(bending: float, twist: float) -> np.ndarray:
    """Strains (n, 2) of a rod that is twisted one way and back."""
    s = (np.arange(SEGMENTS) + 0.5) / SEGMENTS
    return np.column_stack([bending * np.cos(4.0 * np.pi * s), twist * np.sign(0.5 - s)])


def _chain(strain: np.ndarray, clamp: Pose) -> Chain:
    """The rod of given strains from the left clamp on."""
    h = 1.0 / len(strain)
    omega = np.insert(strain, 1, 0.0, axis=1)
    half = np.linalg.norm(omega, axis=1, keepdims=True) * h / 4  # half the angle of the turn to a segment's middle
    to_middle = np.hstack([np.cos(half), np.sinc(half / np.pi) * omega * h / 4])
    ends = _product(to_middle, to_middle)
    width = 1
    while width < len(ends):  # products of all segments before each, in log2(n) passes
        ends = np.concatenate([ends[:width], _product(ends[:-width], ends[width:])])
        width *= 2
    start = np.array(clamp.quaternion)
    ends = _product(start, ends)
    middles = _product(np.concatenate([start[None], ends[:-1]]), to_middle)
    steps = h * directors(middles)[2]
    position = np.array(clamp.position) + np.cumsum(steps, axis=0)
    return Chain(middles, position - steps / 2, ends[-1], position[-1])


def _gap(rod: Chain, clamp: Pose) -> np.ndarray:
    """(6,) how far the end is from the right clamp: position, and twice the vector of the turn from the clamp."""
    turn = _product(rod.end_quaternion, np.array(clamp.quaternion) * [1.0, -1.0, -1.0, -1.0])
    away = rod.end_position - np.array(clamp.position)
    return np.concatenate([away, 2.0 * math.copysign(1.0, turn[0]) * turn[1:]])


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternion products p q, (..., 4): the rotation of q first, in the frame of p."""
    p0, q0, p, q = p[..., :1], q[..., :1], p[..., 1:], q[..., 1:]
    return np.concatenate([p0 * q0 - (p * q).sum(-1, keepdims=True), p0 * q + q0 * p + np.cross(p, q)], axis=-1)


def _guess(strain: np.ndarray, load: np.ndarray, a: float, angle: float, compression: float) -> Solution:
    """The rod of a descent as a first guess for collocation; values at the ends are extrapolated."""
    clamp = Clamps.symmetric(angle, compression, 0.0).left
    rod, origin = _chain(strain, clamp), np.array(clamp.position)
    moment = load[3:] + np.cross(rod.end_position - origin, load[:3])
    middles = held_by(LinearLaw(a), load[:3], moment, rod.quaternion, rod.position, origin)
    middles = middles._replace(strain=np.insert(strain, 1, 0.0, axis=1))
    extended = Sections(*(np.vstack([1.5 * x[:1] - 0.5 * x[1:2], x, 1.5 * x[-1:] - 0.5 * x[-2:-1]]) for x in middles))
    s = np.concatenate([[0.0], (np.arange(len(strain)) + 0.5) / len(strain), [1.0]])
    return FULL.guess(s, extended, {**rod_problem().parameters, "a": a, "psi0": angle, "dL": compression})
