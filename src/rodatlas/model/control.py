"""Something of a problem that the user can vary, in the unit in which they think of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from rodatlas.continuation.checks import WrongInput, check_between

Range = tuple[float, float]
DEGREES = "deg"
MARGIN = 0.02  # of the limits, that a usual range keeps from one which it would pass


class Limits(NamedTuple):
    """The bounds of a control, themselves left out, and both in words, as errors say it."""

    low: float = -math.inf
    high: float = math.inf
    what: str = "a finite number"


def everywhere(setting: Mapping[str, float]) -> Limits:
    """No limits."""
    return Limits()


@dataclass(frozen=True)
class Control:
    r"""A parameter of a problem as its user knows it.

    .. math:: \text{value} = \text{scale}\,(p + \sum_i p_i) + \text{origin}

    with the parameter p, and further ones to which it is added. Where the unit is 'deg' the scale is 180/pi.

    Attributes
    ----------
    name : as in options and files: 'shear'.
    parameter : of the problem: 'dD'.
    symbol : in formulas, TeX without dollars.
    default : value where none is given.
    unit : 'deg', or '' for what has none.
    of : what the value is a multiple of, TeX without dollars: 'L'; it stands in figures only.
    scale, origin, added : see the formula; `added` are names of parameters.
    limits : what can be computed, at the values of the other controls.
    usual : the range that is followed where none is given, at those values; None: it has to be given.
    wide : the same for planes and loci; as `usual` where it is None.
    care : what a reader should know of results at a value, '' where nothing is to be said.
    derived : whether it only says in another way what a control of the same parameter says: settings do not hold it.
    what : in words, for help pages and axes.
    meaning : of its value, what the words leave open, for help pages: 'dL, the clamps are 1 - dL apart along x'.
    short : in names of files: 'dL'. Where it is empty the bare value stands first in every name.
    """

    name: str
    parameter: str
    symbol: str
    default: float
    unit: str = ""
    of: str = ""
    scale: float = 1.0
    origin: float = 0.0
    added: tuple[str, ...] = ()
    limits: Callable[[Mapping[str, float]], Limits] = everywhere
    usual: Callable[[Mapping[str, float]], Range] | None = None
    wide: Callable[[Mapping[str, float]], Range] | None = None
    care: Callable[[float, Mapping[str, float]], str] | None = None
    derived: bool = False
    what: str = ""
    meaning: str = ""
    short: str | None = None

    def __repr__(self) -> str:
        return f"Control({self.name}: {self.parameter}{f' [{self.unit}]' if self.unit else ''})"

    @property
    def key(self) -> str:
        """The name in files, with the unit: 'angle_deg'."""
        bare = self.name.replace("-", "_")
        return f"{bare}_{self.unit}" if self.unit else bare

    @property
    def in_files(self) -> str:
        """What stands before a value in a name of a file."""
        return f"{self.name}-" if self.short is None else self.short

    @property
    def label(self) -> str:
        """Of an axis: 'clamp angle $\\psi_0$  (degrees)'."""
        return f"{self.what or self.name} {self.short_label}"

    @property
    def short_label(self) -> str:
        """Of a small axis: '$\\psi_0$  (degrees)'."""
        unit = "degrees" if self.unit == DEGREES else f"units of ${self.of}$" if self.of else self.unit
        return f"${self.symbol}${f'  ({unit})' if unit else ''}"

    def range_text(self, setting: Mapping[str, float]) -> str:
        """What a value means and where it can lie at a setting, for help pages: 'degrees with 0 <= angle < 90'."""
        return "; ".join(text for text in (self.meaning, self.limits(setting).what) if text)

    def equation(self, value: float, digits: int = 6) -> str:
        """The symbol and a value, in TeX without dollars: '\\psi_0=15^\\circ'."""
        unit = r"^\circ" if self.unit == DEGREES else rf"\,{self.of}" if self.of else self.unit
        return f"{self.symbol}={round(value, 9) + 0.0:.{digits}g}{unit}"

    def value(self, parameters: Mapping[str, float]) -> float:
        """The user's value at parameters of the problem."""
        raw = parameters[self.parameter] + sum(parameters[name] for name in self.added)
        return (math.degrees(raw) if self.unit == DEGREES else self.scale * raw) + self.origin

    def raw(self, value: float, parameters: Mapping[str, float]) -> float:
        """The parameter that has a value, the other parameters being as they are."""
        bare = value - self.origin
        raw = math.radians(bare) if self.unit == DEGREES else bare / self.scale
        return raw - sum(parameters[name] for name in self.added)

    def usual_within(self, setting: Mapping[str, float], wide: bool = False) -> Range | None:
        """The usual range at a setting, or that for planes, inside the limits there; None where there is none."""
        make = (self.wide or self.usual) if wide else self.usual
        if make is None:
            return None
        (low, high), (least, most, _) = make(setting), self.limits(setting)
        margin = MARGIN * (most - least) if math.isfinite(most - least) else 0.0
        return (low if low > least else least + margin), (high if high < most else most - margin)

    def range_with(
        self, setting: Mapping[str, float], low: float | None, high: float | None, wide: bool = False
    ) -> Range:
        """A range whose ends are the usual ones where they are not given.

        Raises
        ------
        ValueError
            when an end is missing and there is no usual range.
        """
        usual = self.usual_within(setting, wide)
        if usual is None and (low is None or high is None):
            what = f"the least and largest {self.name}, which has no usual range"
            raise WrongInput("range", f"expected {what}, got none")
        least, most = usual or (0.0, 0.0)
        return (least if low is None else low), (most if high is None else high)

    def check(self, value: object, setting: Mapping[str, float]) -> float:
        """A value inside the limits at a setting.

        Raises
        ------
        ValueError
            naming the control, its limits and what came.
        """
        return check_between(self.name, value, *self.limits(setting))
