r"""Places inside the interval: breakpoints and inner points, and the reference interval on which all is computed.

Every problem is solved on the reference interval 0 <= x <= 1. It is cut into **parts**: one for each piece between
neighboring places, and a narrow one for each place where something jumps, is required or is measured::

    reference   0 ........... x1 x1+w ............ 1
    place       a             s1   s1              b

On a piece from s0 to s1, of width w in x, s is linear in x, and u' = f becomes du/dx = (s1 - s0)/w f. So places may
move with parameters while the mesh stays. On the part of an inner point du/dx = jump/w: the solution is linear there,
collocation is exact, and the states on both sides follow from the one anywhere in between,

.. math:: u^- = u - (x - x_1)\, j / w, \qquad u^+ = u + (x_1 + w - x)\, j / w,

because the jump j depends on parameters and on what does not jump only. A condition g(u-, u+, p) = 0 is therefore the
integral of g/w over that part, and the linear algebra of two-point problems serves unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rodatlas.continuation.checks import check_function

Place = float | str | Callable[[Any], Any]

WIDTH = 2.0**-10  # of the part of an inner point: round-off in x is 1e-13 of it
GRID = 2.0**20  # knots are multiples of 1/GRID, so that widths and mirrored knots carry no round-off
NARROWEST = 0.02  # reference width of a short piece
FEWEST = 2  # intervals of a piece: one has no neighbor to tell where points are wanted
TIE = 1e-9  # shares of intervals that are equal but for round-off, as on the two halves of a symmetric mesh


def check_place(field: str, place: object) -> None:
    """Raise ValueError for what is no place."""
    number = isinstance(place, (int, float, np.number)) and not isinstance(place, bool) and math.isfinite(place)
    if not (number or isinstance(place, str) or callable(place)):
        raise ValueError(f"{field}: expected numbers, names of parameters or functions of them, got {place!r}")


@dataclass(frozen=True)
class Inner:
    """What holds at a place inside the interval; everything else is continuous there.

    Parameters
    ----------
    at : a number, the name of a parameter, or a function of the parameters.
    jumps : callable
        `jumps(u, p)` returns by how much unknowns jump, from left to right, as a mapping by name. It may depend on
        parameters and on unknowns that do not jump here. For any other law make the jump a free parameter, and the
        law a condition.
    conditions : callable
        `conditions(left, right, p)` returns what vanishes, with the states on both sides. Each condition needs one
        more free parameter.

    Examples
    --------
    A support at s1 whose unknown reaction R is the jump of the shear force:

    >>> Inner("s1", jumps=lambda u, p: {"shear": p.R}, conditions=lambda left, right, p: [left.w])
    """

    at: Place
    jumps: Callable[[Any, Any], Any] | None = None
    conditions: Callable[[Any, Any, Any], Any] | None = None

    def __post_init__(self) -> None:
        check_place("at", self.at)
        for field in ("jumps", "conditions"):
            value = getattr(self, field)
            if value is not None:
                check_function(field, value)
        if self.jumps is None and self.conditions is None:
            raise ValueError("inner: expected jumps or conditions, got neither: a place alone is a breakpoint")


@dataclass(frozen=True, eq=False)
class Layout:
    """The parts of the reference interval.

    Attributes
    ----------
    knots : (K+1,) ends of the parts, from 0 to 1.
    places : (K+1,) number of the place at each knot; the two knots of an inner point have the same.
    weights : (K,) share of each part in the norm of a solution, per reference length: that of its length at the default
        parameters, and none for an inner point.
    """

    knots: np.ndarray
    places: np.ndarray
    weights: np.ndarray

    @cached_property
    def is_inner(self) -> np.ndarray:
        """(K,) whether a part belongs to an inner point."""
        return np.diff(self.places) == 0

    def part_of(self, x: np.ndarray) -> np.ndarray:
        """Number of the part in which places of the reference interval lie."""
        return np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.weights) - 1)

    def part_of_intervals(self, mesh: np.ndarray) -> np.ndarray:
        """Number of the part to which each interval of a mesh belongs, (N,)."""
        return self.part_of((mesh[1:] + mesh[:-1]) / 2)

    def fitted(self, mesh: np.ndarray) -> np.ndarray:
        """The mesh with all knots among its points, and as dense everywhere as it was.

        It keeps its number of intervals, unless there are too few for all parts or a symmetric mesh would lose its
        symmetry; the part of an inner point gets one interval.
        """
        if len(self.weights) == 1 or np.isin(self.knots, mesh).all():
            return mesh
        count = np.arange(len(mesh), dtype=float)
        at = np.interp(self.knots, mesh, count)
        number = self._shared(np.diff(at), len(mesh) - 1)
        parts = [
            np.interp(np.linspace(a, b, n + 1), count, mesh)
            for a, b, n in zip(at[:-1], at[1:], number, strict=True)
        ]  # fmt: skip
        for part, a, b in zip(parts, self.knots[:-1], self.knots[1:], strict=True):
            part[0], part[-1] = a, b
        return np.concatenate([[0.0], *(part[1:] for part in parts)])

    def _shared(self, wanted: np.ndarray, total: int) -> np.ndarray:
        """Whole numbers of intervals (K,) near the wanted ones, equal where these are equal."""
        inner = self.is_inner
        free = np.where(inner, 0.0, wanted)
        free *= max(0, total - inner.sum()) / free.sum()
        number = np.where(inner, 1, np.maximum(np.floor(free + TIE), FEWEST)).astype(int)
        rest = np.where(number > free, -1.0, free - number)
        for share in sorted(set(np.round(rest[rest > TIE] / TIE) * TIE), reverse=True):
            group = np.abs(rest - share) < 2 * TIE
            if number.sum() + group.sum() / 2 > total:
                break
            number[group] += 1
        return number

    def samples(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Random places (K * count,) of the reference interval, as many in each part."""
        share = rng.uniform(0.0, 1.0, (count, len(self.weights)))
        return (self.knots[:-1] + share * np.diff(self.knots)).ravel()


def laid_out(places: Sequence[float], has_width: Sequence[bool], moving: bool) -> Layout:
    """Layout for places at default parameters, ends included, and which of them have a part of their own.

    Fixed pieces are as wide as they are long, so that a mesh is uniform in s where it is in x; pieces whose length is
    a matter of parameters are equally wide.
    """
    length = np.diff(places) / (places[-1] - places[0])
    share = np.full(len(length), 1.0 / len(length)) if moving else np.maximum(length, NARROWEST)
    widths, owner, weights = list[float](), [0], list[float]()
    room = 1.0 - WIDTH * sum(has_width)
    for i, (long, wide) in enumerate(zip(length, share / share.sum() * room, strict=True)):
        widths.append(wide)
        weights.append(long / wide)
        owner.append(i + 1)
        if has_width[i + 1]:
            widths.append(WIDTH)
            weights.append(0.0)
            owner.append(i + 1)
    knots = np.concatenate([[0.0], np.cumsum(widths)])
    low = np.round(knots * GRID) / GRID
    high = 1.0 - np.round((1.0 - knots) * GRID) / GRID
    knots = np.where(knots <= 0.5, low, high)
    knots[0], knots[-1] = 0.0, 1.0
    return Layout(knots, np.array(owner), np.array(weights))
