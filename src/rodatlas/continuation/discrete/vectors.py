"""Arithmetic of scaled states and tangent vectors."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.linear.matrix import Columns


def add(x: Columns, *terms: tuple[float, Columns], keep: int | None = None) -> Columns:
    """x + sum of factor * vector; scalars beyond `keep` (artificial ones) are dropped."""
    keep = len(x.scalars) if keep is None else keep
    stage, mesh, scal = x.stage.copy(), x.mesh.copy(), x.scalars[:keep].copy()
    for factor_, v in terms:
        stage += factor_ * v.stage
        mesh += factor_ * v.mesh
        scal += factor_ * v.scalars[:keep]
    return Columns(stage, mesh, scal)


def predicted(x: Columns, tangent: Columns, step: float, previous: Columns | None, previous_step: float) -> Columns:
    """Quadratic predictor of a curve: the tangent, bent as it was bent over the last step."""
    if previous is None:
        return add(x, (step, tangent))
    bend = step * step / (2 * previous_step)
    return add(x, (step + bend, tangent), (-bend, previous))


def hermite(ends: tuple[Columns, Columns], tangents: tuple[Columns, Columns], step: float, t: float) -> Columns:
    """Cubic Hermite interpolation of a curve between two points `step` apart, at the fraction t."""
    a, b = 1 - 3 * t**2 + 2 * t**3, 3 * t**2 - 2 * t**3
    c, d = step * (t - 2 * t**2 + t**3), step * (t**3 - t**2)
    return add(scaled(ends[0], a), (b, ends[1]), (c, tangents[0]), (d, tangents[1]))


def arc_over_sine(cosine: float) -> float:
    """Angle over sine, from the cosine: length of a circular arc in units of its projection on a tangent."""
    angle = float(np.arccos(min(1.0, cosine)))
    return angle / float(np.sin(angle)) if angle > 1e-6 else 1.0


def arc_length(chord: float, cosine: float) -> float:
    """Length of a circular arc from its chord and the cosine of the angle between the tangents at its ends."""
    return chord * arc_over_sine(float(np.sqrt((1 + min(1.0, cosine)) / 2)))


def scaled(v: Columns, by: float) -> Columns:
    return Columns(v.stage * by, v.mesh * by, v.scalars * by)
