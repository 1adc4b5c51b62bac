"""Whether a curve is back at its start: a step that passes it, corrected there, has to meet it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns

NEAR = 0.1  # distance of the start from the interpolated step, in units of that
ALONG = 0.95  # cosine of the angle between the directions
MET = 1e-3  # distance from the start of the point corrected in the plane through it, in units of the step


class End(Protocol):
    """A point of a curve on its discretization, with the last estimate of its error."""

    @property
    def colloc(self) -> Collocation: ...

    @property
    def x(self) -> Columns: ...

    @property
    def tangent(self) -> Columns: ...

    @property
    def error(self) -> float: ...


class Arc(Protocol):
    """One step of a curve, its ends on one discretization."""

    @property
    def left(self) -> End: ...

    @property
    def right(self) -> End: ...

    @property
    def step(self) -> float: ...

    def interpolate(self, fraction: float) -> Columns:
        """The state at a fraction of the step."""

    def direction(self, fraction: float) -> Columns:
        """Unit tangent there."""


Corrected = Callable[[Columns, Columns], Columns | None]
"""(state, normal) -> the point of the curve in the plane through the state; None when Newton fails."""


def passes(arc: Arc, start: End, corrected: Corrected, tolerance: float) -> float | None:
    """Fraction of a step at which it passes the start of its curve, in the same direction; else None.

    A near miss is not enough: the curve is corrected in the plane through the start and has to meet it, up to a
    thousandth of the step and a hundred times the tolerance of the mesh.
    """
    left, colloc = arc.left.x, arc.right.colloc
    if np.abs(start.x.scalars - left.scalars).max() > 2 * arc.step:
        return None
    x, tangent = (start.colloc.interpolate(v, colloc) for v in (start.x, start.tangent))
    chord = add(arc.right.x, (-1.0, left))
    fraction = colloc.inner(chord, add(x, (-1.0, left))) / colloc.inner(chord, chord)
    if not 0.0 < fraction <= 1.0 or colloc.inner(tangent, arc.direction(fraction)) < ALONG:
        return None
    guess = arc.interpolate(fraction)
    gap = add(x, (-1.0, guess))
    if colloc.norm(gap) > NEAR * arc.step:
        return None
    met = corrected(add(guess, (colloc.inner(tangent, gap), tangent)), tangent)
    if met is None:
        return None
    missed = colloc.norm(add(met, (-1.0, x)))
    return fraction if missed < MET * arc.step + 100 * tolerance else None
