"""Who names the stable states of a diagram and numbers its bifurcations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class LocusTables:
    """What a nomenclature knows of the loci of its numbered bifurcations in a plane of two controls.

    Attributes
    ----------
    known : all numbers; empty: those of the slices that loci start from.
    starts : values of the second control at whose slices bifurcations are looked for, the first of which gives numbers
        to all that it has; empty: chosen in the range.
    elsewhere : numbers that are found at another of these values.
    successors : (number, kinds of the turns passed from there on) -> number.
    born : number of a pitchfork -> that of the fold born where it turns subcritical.
    shared : number -> another one on the same curve, which is followed from there.
    roles : what the locus of a number bounds, (name of a state, 'low' or 'high' end); empty: as the slices show.
    """

    known: tuple[int, ...] = ()
    starts: tuple[float, ...] = ()
    elsewhere: Mapping[int, float] = field(default_factory=dict)
    successors: Mapping[tuple[int, tuple[str, ...]], int] = field(default_factory=dict)
    born: Mapping[int, int] = field(default_factory=dict)
    shared: Mapping[int, int] = field(default_factory=dict)
    roles: Mapping[int, frozenset[tuple[str, str]]] = field(default_factory=dict)


class Nomenclature(Protocol):
    """Names that a field knows, for settings at which it knows them.

    Attributes
    ----------
    names : that a state can have, in the order of lists. A name that ends in '+-' is that of a pair.
    other : the name of a stable state that has none of them.
    colors : of the names, as matplotlib takes them.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def other(self) -> str: ...

    @property
    def colors(self) -> Mapping[str, str]: ...

    def applies(self, setting: Mapping[str, float], along: str, low: float, high: float) -> bool:
        """Whether states of a slice at a setting, over a range of what varies, have these names."""

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

    def names_at(self, states: Sequence[tuple[Solution, str, int, str]]) -> list[str | None]:
        """Names of all states that a search found at one setting, given as (solution, class, index, sign of a pair or
        ''); None of those that have none."""

    def in_plane(self, name: str) -> str:
        """What a state of a slice is called where many slices are compared."""

    def tables(self, along: str, second: str) -> LocusTables:
        """What is known of loci in a plane."""

    def change(self, before: str, after: str) -> Callable[[Solution], float] | None:
        """A number that vanishes, or is least, where a state changes its name smoothly; None where names do not."""
