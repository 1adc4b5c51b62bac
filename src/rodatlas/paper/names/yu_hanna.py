"""The nomenclature of the paper: states U, US+-, ... and bifurcations 0 to 18, where the shear varies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from rodatlas.continuation import Solution, SpecialPoint
from rodatlas.model import Model, Part
from rodatlas.model.nomenclature import PALETTE, LocusTables
from rodatlas.model.orbit import same_state
from rodatlas.paper.names.at_setting import names_of
from rodatlas.paper.names.curled import is_curled
from rodatlas.paper.names.cuts import cut_segment
from rodatlas.paper.names.numbering import ENDS, LOCI, number_neighbors, number_without_states
from rodatlas.paper.names.segments import NAMES, OTHER, middle_curvature, name_parts

COLORS = dict(
    zip(("U", "US+-", "uUu", "w", "W", "WS+-", "uUui", "wi", "S+-", "TU+-", "TW+-"), PALETTE, strict=True)
)
"""One color for each state, the same in every figure."""
EQUAL = ("turn-left", "turn-right", "offset", "twist")  # controls that are zero between the clamps of the paper


class YuHanna:
    """Names and numbers of a band between equal clamps, along the shear.

    Parameters
    ----------
    model : whose states are named.
    """

    names: tuple[str, ...] = NAMES
    other = OTHER
    colors: Mapping[str, str] = COLORS

    def __init__(self, model: Model):
        self._model = model

    def __repr__(self) -> str:
        return "YuHanna()"

    def applies(self, setting: Mapping[str, float], along: str, low: float, high: float) -> bool:
        """Between clamps parallel to the width and tilted alike, along the shear.

        The range has to hold zero: names and numbers tell what a state is at rest, and where it goes from there.
        """
        return along == "shear" and low <= 0.0 <= high and all(setting.get(name, 0.0) == 0.0 for name in EQUAL)

    def parts(self, branches: Sequence[Any], segments: Sequence[Any]) -> list[list[Part]]:
        """Named parts of stable segments, see :mod:`rodatlas.paper.names.segments`."""
        inverted = {f.id for f in branches if _holds_w(f)}
        return [name_parts(s.solutions, s.followed.symmetric, s.followed.id in inverted) for s in segments]

    def cut(self, solutions: Sequence[Solution], parts: Sequence[Part], tolerance: float) -> list[list[Solution]]:
        """Solutions of each part; see :func:`rodatlas.paper.names.cuts.cut_segment`."""
        return cut_segment(solutions, parts, tolerance)

    def numbers(
        self, branches: Sequence[Any], named: Sequence[tuple[Any, list[Part]]],
        event_at: Callable[[SpecialPoint], Any],
    ) -> list[dict[int, int]]:  # fmt: skip
        """The numbers: first those of the ends of named states, then those of their neighbors."""
        given = _numbers_of_ends(named, event_at)
        out = []
        for followed in branches:
            special = followed.bifurcations
            known = {
                i: number for i, x in enumerate(special) for other, number in given
                if x.kind == other.kind and same_state(self._model, x.solution, other.solution)
            }  # fmt: skip
            closed = followed.branch.closed
            numbers = number_neighbors(special, known, closed)
            if not numbers and followed.symmetric and _has_positive_height(followed):
                numbers = number_without_states(special, closed)
            out.append(numbers)
        return out

    def names_at(self, states: Sequence[tuple[Solution, str, int, str]]) -> list[str | None]:
        """Names of all states at one setting; see :func:`rodatlas.paper.names.at_setting.names_of`."""
        return names_of(states)

    def in_plane(self, name: str) -> str:
        """The name itself."""
        return name

    def tables(self, along: str, second: str) -> LocusTables:
        """Of the plane of angle and shear."""
        return LOCI if (along, second) == ("shear", "angle") else LocusTables()

    def change(self, before: str, after: str) -> Callable[[Solution], float] | None:
        """k1(1/2): it vanishes where U becomes w, and is least where w becomes uUui."""
        return middle_curvature


def _holds_w(followed: Any) -> bool:
    """Whether a branch passes a stable symmetric state of negative height at dD = 0."""
    points = followed.branch.points
    return followed.symmetric and any(
        one.solution["dD"] * two.solution["dD"] <= 0
        and one.index == two.index == 0
        and one.solution["height"] < 0
        and not is_curled(one.solution)
        for one, two in pairwise(points)
    )


def _has_positive_height(followed: Any) -> bool:
    """Whether a branch lies above the clamp plane; at psi0 = 0 the other half of the slice is its mirror image."""
    return all(p.solution["height"] > 0 for p in followed.branch.points)


def _numbers_of_ends(
    named: Sequence[tuple[Any, list[Part]]], event_at: Callable[[SpecialPoint], Any]
) -> list[tuple[SpecialPoint, int]]:
    """The numbers of bifurcations at which named states end."""
    given = []
    for segment, parts in named:
        for side, bound, name in (("low", segment.low, parts[0].name), ("high", segment.high, parts[-1].name)):
            event = event_at(bound.special) if bound.special is not None else None
            number = ENDS.get((name, side, event.kind)) if event is not None else None
            if bound.special is not None and number is not None:
                given.append((bound.special, number))
    return given
