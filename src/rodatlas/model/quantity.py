"""Numbers read from a solution: what a diagram is drawn against, and what tells one state from another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rodatlas.continuation import Solution


@dataclass(frozen=True)
class Quantity:
    """What a diagram can be drawn against.

    Attributes
    ----------
    name : as in options and files: 'height', 'force-x'.
    symbol : in formulas, TeX without dollars.
    read : the number of a solution.
    unit : '', or as in 'GJ/L^2'.
    observable : of the problem, where it is one: then a diagram can be cut out by it.
    what : in words, for axes.
    conjugate : the control whose displacement it does work on, '' for none.
    work : dE/d(control) along a branch, as a multiple of the quantity.
    """

    name: str
    symbol: str
    read: Callable[[Solution], float]
    unit: str = ""
    observable: str = ""
    what: str = ""
    conjugate: str = ""
    work: float = 1.0

    @classmethod
    def of(cls, observable: str, symbol: str = "", unit: str = "", what: str = "", conjugate: str = "") -> Quantity:
        """An observable of the problem."""
        return cls(observable, symbol or rf"\mathrm{{{observable}}}", _Reader(observable), unit, observable, what,
                   conjugate)  # fmt: skip

    @property
    def conjugate_text(self) -> str:
        """What a diagram of it against its conjugate control tells, in words."""
        sign = "-" if self.work < 0 else ""
        return f"the area under a curve is work: along a branch dE/d({self.conjugate}) = {sign}{self.name}"

    @property
    def label(self) -> str:
        """Of an axis: 'energy $E$  ($GJ/L$)'."""
        unit = f"units of ${self.unit}$" if self.unit.isalpha() else f"${self.unit}$"
        what = self.what or ("" if self.symbol == rf"\mathrm{{{self.name}}}" else self.name)
        return f"{what} ${self.symbol}${f'  ({unit})' if self.unit else ''}".lstrip()


@dataclass(frozen=True)
class _Reader:
    """Reads one observable."""

    name: str

    def __call__(self, solution: Solution) -> float:
        return float(solution[self.name])


@dataclass(frozen=True)
class Invariant:
    """A number that is equal for all images of a state under the symmetries of its setting.

    Attributes
    ----------
    name : of an observable.
    slack : two values v of one state differ by less than slack * tolerance, or by that times max(1, |v|).
    relative : which of the two.
    """

    name: str
    slack: float = 1.0
    relative: bool = False

    def differs(self, one: Solution, two: Solution, tolerance: float) -> bool:
        """Whether the values of two solutions are those of different states."""
        a, b = one[self.name], two[self.name]
        return not abs(a - b) < self.slack * tolerance * (max(1.0, abs(a)) if self.relative else 1.0)
