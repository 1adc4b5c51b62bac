"""What loci and planes are computed for: two controls vary, all others are fixed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from rodatlas import __version__
from rodatlas.atlas.slices.settings import CODE as SLICES
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.names import SeenNames
from rodatlas.continuation import LocusEvent, LocusPoint, Solution
from rodatlas.continuation.checks import WrongInput, check_number, check_type
from rodatlas.files import exact
from rodatlas.files.code import code_hash
from rodatlas.model import Control, Model, Nomenclature, Setting, model_named
from rodatlas.model.control import DEGREES
from rodatlas.model.nomenclature import LocusTables
from rodatlas.model.orbit import fixing

SHARES = (0.5, 0.2, 0.8)  # of the range of the second control, where slices are looked at if nobody knows better
DEGREES_PER_LENGTH = 100.0  # degrees that count as much as a unit of length in distances


@dataclass(frozen=True)
class PlaneSettings:
    """A plane of two controls of a model.

    Attributes
    ----------
    model : what is solved.
    setting : values of the controls that are fixed.
    along : the control that varies along slices; low, high : its range, in the user's unit.
    second : the other control; second_low, second_high : its range.
    against : the quantity that slices are seen by, and special points are told apart by.
    tolerance : as for a slice.
    """

    model: Model
    setting: Setting
    along: str
    second: str
    low: float
    high: float
    second_low: float
    second_high: float
    against: str
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        check_type("model", self.model, Model, "a Model, see rodatlas.model")
        if self.model.control(self.along).parameter == self.second_control.parameter:
            raise WrongInput("second", f"expected another control than {self.along}, got {self.second}")
        low, high, what = self.second_control.limits({**self.setting, self.along: self.low})
        inside = math.nextafter(low, high), math.nextafter(high, low)
        check_number(f"{self.second}-min", self.second_low, *inside, what)
        more = f"{what}, above {self.second_low:g}, the least {self.second}"
        check_number(f"{self.second}-max", self.second_high, math.nextafter(self.second_low, high), inside[1], more)
        self._check_range()
        self.slice_at(self.anchor)  # checks the others

    def _check_range(self) -> None:
        """Raise ValueError for a range along slices that is empty, or beyond what is possible anywhere in the plane."""
        places = (self.second_control.default, self.second_low, self.second_high)
        there = [self.along_control.limits({**self.setting, self.second: second}) for second in places]
        low, high, what = max(there, key=lambda limits: limits.high - limits.low)
        inside = math.nextafter(low, high), math.nextafter(high, low)
        check_number(f"{self.along}-max", self.high, *inside, what)
        below = f"{what}, below {self.high:g}, the largest {self.along}"
        check_number(f"{self.along}-min", self.low, inside[0], math.nextafter(self.high, low), below)

    @classmethod
    def of(
        cls, model: Model, *, along: str | None = None, second: str | None = None, low: float | None = None,
        high: float | None = None, second_low: float | None = None, second_high: float | None = None,
        against: str | None = None, tolerance: float = 1e-8, **values: float,
    ) -> Self:  # fmt: skip
        """Settings with defaults: the last two controls of the model vary over their usual ranges.

        Parameters
        ----------
        values : of the other controls, by name with underscores for dashes.
        """
        check_type("model", model, Model, "a Model, see rodatlas.model")
        held = [c.name for c in model.controls if not c.derived]
        along = held[-1] if along is None else model.control(along, "along").name
        others = [name for name in (*model.plane, *reversed(held)) if name != model.holder(along).name]
        second = others[0] if second is None else model.control(second, "second").name
        varying_names = (model.holder(along).name, model.holder(second).name)
        for name in (along, second):
            model.refuse_moved(model.control(name), values)
        whole = model.setting(**values)
        setting = whole.without(*varying_names)
        first = model.control(along).range_with(whole, low, high, wide=True)
        across = model.control(second).range_with(whole, second_low, second_high, wide=True)
        against = model.quantities[0].name if against is None else against
        return cls(model, setting, along, second, *first, *across, against, tolerance)

    def __repr__(self) -> str:
        ranges = (
            f"{self.along} {self.low:g} to {self.high:g}, {self.second} {self.second_low:g} to {self.second_high:g}"
        )
        return f"{type(self).__name__}({self.model.name}, {self.place_text}: {ranges})"

    # -- what varies --------------------------------------------------------------------------------------------------

    @property
    def along_control(self) -> Control:
        return self.model.control(self.along, "along")

    @property
    def second_control(self) -> Control:
        return self.model.control(self.second, "second")

    @property
    def free(self) -> tuple[str, ...]:
        """The free parameters of every locus."""
        return self.model.free_with(self.along, self.second)

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Least and largest value of the second control, least and largest of the first."""
        return self.second_low, self.second_high, self.low, self.high

    @property
    def anchor(self) -> float:
        """The value of the second control whose slice is looked at first."""
        return min(max(self.second_control.default, self.second_low), self.second_high)

    @property
    def place_text(self) -> str:
        """Values of the fixed controls, in words."""
        return self.model.setting_text(self.setting)

    def slice_at(self, second: float) -> SliceSettings:
        """Settings of a slice of the plane, over the usual range of what varies there."""
        found = SliceSettings.at_setting(self.model, {**self.setting, self.second: second}, self.along)
        if self.along_control.usual is None:
            found = replace(found, low=self.low, high=self.high)
        return replace(found, against=self.against, tolerance=self.tolerance)

    @cached_property
    def nomenclature(self) -> Nomenclature:
        """Who names states and numbers bifurcations."""
        known = self.model.nomenclature
        there = known is not None and known.applies(self.setting, self.along, self.low, self.high)
        return known if known is not None and there else SeenNames(self.slice_at(self.anchor))

    @property
    def tables(self) -> LocusTables:
        """What is known of the loci."""
        return self.nomenclature.tables(self.along, self.second)

    @property
    def starts(self) -> tuple[float, ...]:
        """Values of the second control at whose slices bifurcations are looked for, that which gives numbers first."""
        if self.tables.starts:
            return self.tables.starts
        spread = self.second_high - self.second_low
        shares = [self.second_low + share * spread for share in SHARES]
        return tuple(dict.fromkeys(float(f"{x:.4g}") for x in (self.anchor, *shares)))

    @cached_property
    def mirrored(self) -> bool:
        """Whether a symmetry turns the sign of what varies along slices and leaves the rest alone, as the shear mirror
        of a band does: where it is zero a locus meets its own image."""
        parameters = self.model.parameters(self.slice_at(self.anchor).whole_setting(0.0)) if self._holds_zero else {}
        if not parameters:
            return False
        away = {**parameters, self.along_control.parameter: 0.381966 * self.along_control.raw(self.high, parameters)}
        at_zero, beside = (fixing(self.model, list(p.values())) for p in (parameters, away))
        return len(at_zero) > len(beside)

    @property
    def _holds_zero(self) -> bool:
        return self.low <= 0.0 <= self.high

    # -- places -------------------------------------------------------------------------------------------------------

    def value(self, solution: Solution) -> float:
        """Of what varies along slices."""
        return self.model.value(self.along, solution)

    def second_value(self, solution: Solution) -> float:
        """Of the second control."""
        return self.model.value(self.second, solution)

    def response(self, solution: Solution) -> float:
        """The quantity that slices are seen by."""
        return self.model.quantity(self.against).read(solution)

    def point(self, found: LocusPoint | LocusEvent | Solution) -> tuple[float, float, float]:
        """Second control, control along slices, and response."""
        solution = found if isinstance(found, Solution) else found.solution
        return self.second_value(solution), self.value(solution), self.response(solution)

    def control_of(self, parameter: str) -> str:
        """The name of the control that moves a parameter of the problem; '' for any other parameter."""
        known = {self.second_control.parameter: self.second, self.along_control.parameter: self.along}
        return known.get(parameter, "")

    def lengths(self, places: np.ndarray) -> np.ndarray:
        """(n,) lengths along a curve through places (n, 3)."""
        steps = np.linalg.norm(np.diff(self.measured(places), axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def measured(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 2 or 3) of `point` with angles in radians, for lengths along curves."""
        scale = [np.pi / 180.0 if c.unit == DEGREES else 1.0 for c in (self.second_control, self.along_control)]
        return points * [*scale, 1.0][: points.shape[-1]]

    @property
    def second_scale(self) -> float:
        """How much of the second control counts as much as a unit of the first in the plane."""
        one, two = (DEGREES_PER_LENGTH if c.unit == DEGREES else 1.0 for c in (self.second_control, self.along_control))
        return one / two

    @cached_property
    def units(self) -> tuple[float, float, float]:
        """Sizes (second, first, response) in which small distances are told: a degree, or a hundredth of what a second
        control of another kind has as its range; 1 for the shear of a band."""
        second = _power(self.second_high - self.second_low) / 100.0
        return 1.0 if self.second_control.unit == DEGREES else second, _power(self.high - self.low), 1.0

    def near(self, one: Sequence[float], two: Sequence[float], tolerance: float) -> bool:
        """Whether two points are one, up to a tolerance in `units`."""
        return all(abs(a - b) < tolerance * u for a, b, u in zip(one, two, self.units, strict=True))

    # -- as a record --------------------------------------------------------------------------------------------------

    def _identity(self, *code: str) -> dict[str, object]:
        return {
            "rodatlas": __version__, "code": code_hash(*SLICES, *code), **self.model.identity(),
            "setting": dict(self.setting), "along": self.along, "second": self.second, "low": self.low,
            "high": self.high, "second_low": self.second_low, "second_high": self.second_high, "against": self.against,
            "tolerance": self.tolerance,
        }  # fmt: skip

    @classmethod
    def from_identity(cls, identity: Mapping[str, Any]) -> Self:
        """The settings behind an identity, of whatever version; ValueError when nobody knows the model."""
        names = ("along", "second", "low", "high", "second_low", "second_high", "against", "tolerance")
        return cls(model_named(identity["model"]), Setting(identity["setting"]), *(identity[name] for name in names))

    def head_json(self) -> dict[str, Any]:
        """What stands first in the JSON of a result."""
        head = self.model.head_json(self.setting, self.along, self.against)
        return {**head, "second": self.second, "tolerance": self.tolerance}

    def stem_of(self, word: str) -> str:
        """Name of files: which plane, and what differs from the defaults."""
        parts = [word, *self.model.stem_parts(self.setting)]
        if (self.second, self.along) != self.model.plane:
            parts.append(f"{self.second}-{self.along}")
        if self.tolerance != PlaneSettings.tolerance:
            parts.append(f"tol{exact(self.tolerance)}")
        return "-".join(parts)


def _power(length: float) -> float:
    """The power of ten next to a length."""
    return float(10.0 ** round(math.log10(length)))


@dataclass(frozen=True, repr=False)
class LociSettings(PlaneSettings):
    """Loci of the bifurcations of a model in a plane of two controls.

    Examples
    --------
    >>> LociSettings.of(model_named("band"), second="compression", angle=20.0)
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(self.second_low <= start <= self.second_high for start in self.starts):
            places = ", ".join(f"{start:g}" for start in self.starts)
            raise WrongInput(
                f"{self.second}-max",
                f"expected a range of {self.second} that holds one of {places}, at whose slices "
                f"bifurcations are looked for, got {self.second_low:g} to {self.second_high:g}",
            )

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values."""
        return self._identity("atlas/loci")

    def identity_of(self, numbers: Sequence[int]) -> dict[str, object]:
        """As :meth:`identity`, of some loci only."""
        some = {"numbers": sorted(set(numbers))} if numbers and set(numbers) != set(self.tables.known) else {}
        return {**self.identity(), **some}

    def check_numbers(self, numbers: Sequence[int]) -> None:
        """Raise ValueError for numbers that no bifurcation has."""
        known = self.tables.known
        for number in numbers:
            if known and number not in known:
                raise WrongInput("number", f"expected one of {known[0]} to {known[-1]}, got {number}")
            if number < (min(known) if known else 1):
                raise WrongInput("number", f"expected a positive whole number, got {number}")

    def stem(self, numbers: Sequence[int] = ()) -> str:
        """Name of the files of loci: which, unless all, and what differs from the defaults."""
        some = sorted(set(numbers)) if numbers and set(numbers) != set(self.tables.known) else []
        stem = self.stem_of("loci" + "".join(f"-{n}" for n in some))
        for control, low, high in ((self.second_control, self.second_low, self.second_high),
                                   (self.along_control, self.low, self.high)):  # fmt: skip
            at = self.slice_at(self.anchor).whole_setting(self.along_control.default)
            if (low, high) != control.usual_within(at, wide=True):
                stem += f"-{control.in_files}{exact(low)}to{exact(high)}"
        return stem

    def over(self, second_low: float, second_high: float) -> LociSettings:
        """The same loci over another range of the second control."""
        return replace(self, second_low=second_low, second_high=second_high)
