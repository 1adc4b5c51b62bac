"""Who names the stable states of a diagram and numbers its bifurcations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from rodatlas.continuation import Solution

# Any two differ by at least 24 CIE Lab units, also as seen with protanopia and deuteranopia (Machado, Oliveira &
# Fernandes 2009), and stand out from white by at least 2.8 to 1.
PALETTE = (
    "#031C97", "#237EEB", "#09AF6B", "#D68A00", "#860228", "#C684C4", "#3B2658", "#8F48A0", "#7E6000", "#7133FE",
    "#4F7770",
)  # fmt: skip
"""Colors of states, in the order in which they are given away."""


class Part(NamedTuple):
    """A named part of a stable segment: its name, and its first and last position in the segment's solutions."""

    name: str
    first: int
    last: int


class Nomenclature(Protocol):
    """Names that a field knows, for settings at which it knows them.

    Attributes
    ----------
    names : that a state can have, in the order of lists. A name that ends in '+-' is that of a pair.
    other : the name of a stable state that has none of them.
    colors : of the names, as matplotlib takes them.
    """

    names: tuple[str, ...]
    other: str
    colors: Mapping[str, str]

    def applies(self, setting: Mapping[str, float], along: str) -> bool:
        """Whether states of a diagram at a setting have these names."""

    def parts(self, branches: Sequence[Any], segments: Sequence[Any]) -> list[list[Part]]:
        """The named parts of each stable segment, with all branches at hand."""

    def cut(self, solutions: Sequence[Solution], parts: Sequence[Part], tolerance: float) -> list[list[Solution]]:
        """Solutions of each named part of a segment; neighbors share the solution at the cut."""

    def numbers(
        self, branches: Sequence[Any], named: Sequence[tuple[Any, list[Part]]], event_at: Callable[[Any], Any]
    ) -> list[dict[int, int]]:
        """For each branch the numbers of its folds and branch points, by their position among these.

        Parameters
        ----------
        event_at : the event of a located point.
        """
