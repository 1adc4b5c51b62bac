"""What a slice is computed for; everything that decides its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from rodatlas import __version__
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import WrongInput, check_number, check_type, check_whole
from rodatlas.files import exact
from rodatlas.files.code import code_hash
from rodatlas.model import Control, Model, Setting, View, model_named
from rodatlas.model.model import parameters_of
from rodatlas.model.orbit import fixing, pairing

CODE = ("continuation", "model", "rods", "states", "atlas/slices", "paper/names", "paper/model")
"""Folders whose code decides what a slice holds."""
MOST_STARTS = 1_000_000
GENERIC = 0.381966  # no round share of a range: at those, symmetries may hold that the whole of it has not


@dataclass(frozen=True)
class SliceSettings:
    """A slice of the atlas of a model: one control varies, all others are fixed.

    Attributes
    ----------
    model : what is solved.
    setting : values of the controls that are fixed.
    along : the control that varies.
    low, high : its range, in the user's unit.
    against : the quantity that diagrams show and tables list.
    tolerance : largest error of a solution at its mesh points, relative to the scale of each unknown.
    search : starts of the search for stable states at each of some places, 0 for none; see
        :mod:`rodatlas.atlas.slices.branches.search`.

    Examples
    --------
    >>> SliceSettings.of(model_named("band"), along="compression", against="force-x", angle=20.0, shear=0.1)
    """

    model: Model
    setting: Setting
    along: str
    low: float
    high: float
    against: str
    tolerance: float = 1e-8
    search: int = 256

    def __post_init__(self) -> None:
        check_type("model", self.model, Model, "a Model, see rodatlas.model")
        control = self.control
        self.model.quantity(self.against)
        low, high, what = control.limits(self.setting)
        check_number(f"{self.along}-max", self.high, math.nextafter(low, high), math.nextafter(high, low), what)
        below = f"a number from {low:g} to below {self.high:g}, the largest {self.along}"
        least = math.nextafter(low, high)
        check_number(f"{self.along}-min", self.low, least, math.nextafter(self.high, -math.inf), below)
        check_number("tol", self.tolerance, 1e-10, 1e-6, "a number between 1e-10 and 1e-06")
        what = f"a whole number from 0 to {MOST_STARTS}"
        check_number("search", check_whole("search", self.search, 0, what), 0, MOST_STARTS, what)

    @classmethod
    def of(
        cls, model: Model, *, along: str | None = None, low: float | None = None, high: float | None = None,
        against: str | None = None, tolerance: float = 1e-8, search: int = 256, **values: float,
    ) -> SliceSettings:  # fmt: skip
        """Settings with defaults: the last control varies over its usual range, seen by the first quantity.

        Parameters
        ----------
        values : of the other controls, by name with underscores for dashes.
        """
        check_type("model", model, Model, "a Model, see rodatlas.model")
        against = model.quantities[0].name if against is None else against
        found = cls.at_setting(model, values, along, low, high)
        return replace(found, against=against, tolerance=tolerance, search=search)

    @classmethod
    def at_setting(
        cls, model: Model, values: Mapping[str, float], along: str | None = None, low: float | None = None,
        high: float | None = None,
    ) -> SliceSettings:  # fmt: skip
        """As :meth:`of`, with the values of fixed controls by name, and all else by default."""
        held = [c for c in model.controls if not c.derived]
        control = model.control(held[-1].name if along is None else along, "along")
        varying = model.holder(control.name).name
        if taken := {control.name, varying} & {name.replace("_", "-") for name in values}:
            raise WrongInput(min(taken), f"expected none, since the slice goes along {control.name}, got one")
        model.refuse_moved(control, values)
        beside = {} if high is None or control.name != varying else {varying: high}  # others may need it to be large
        try:
            setting = model.setting(**values, **beside).without(varying)
        except WrongInput as error:
            if beside and error.field == varying:  # by the name by which it was given
                raise WrongInput(f"{varying}-max", error.rest) from None
            raise
        low, high = control.range_with(setting, low, high)
        return cls(model, setting, control.name, low, high, model.quantities[0].name)

    def __repr__(self) -> str:
        return f"SliceSettings({self.model.name}, {self.place_text}: {self.along} {self.low:g} to {self.high:g})"

    # -- what is varied -----------------------------------------------------------------------------------------------

    @property
    def control(self) -> Control:
        """What varies."""
        return self.model.control(self.along, "along")

    @property
    def parameter(self) -> str:
        """The parameter of the problem that varies."""
        return self.control.parameter

    @property
    def free(self) -> tuple[str, ...]:
        """The free parameters of every branch."""
        return self.model.free_with(self.along)

    @property
    def view(self) -> View:
        """Along which control, against which quantity."""
        return View(self.along, self.against)

    @property
    def anchor(self) -> float:
        """Where starts are carried to: the default of what varies, or the end of the range that is nearer to it."""
        return min(max(self.control.default, self.low), self.high)

    @property
    def reach(self) -> float:
        """The largest value that the control can have, or the length of the range where that is not finite."""
        limit = self.control.limits(self.setting).high
        return limit if math.isfinite(limit) and limit > 0 else self.high - self.low

    def part(self, share: float) -> float:
        """The value at a share of what the control can be: of its limit where it has one, else of the range."""
        limit = self.control.limits(self.setting).high
        return share * limit if math.isfinite(limit) and self._from_zero else self.low + share * (self.high - self.low)

    @property
    def _from_zero(self) -> bool:
        """Whether the control can be zero and of either sign, as the shear of a band."""
        low, high, _ = self.control.limits(self.setting)
        return low == -high

    def value(self, solution: Solution) -> float:
        """The value of what varies at a solution."""
        return self.control.value(parameters_of(solution))

    def raw(self, value: float) -> float:
        """The parameter of the problem at a value of what varies."""
        return self.control.raw(value, self.parameters)

    def value_at(self, raw: float) -> float:
        """The value of what varies at a parameter of the problem."""
        return self.control.value({**self.parameters, self.parameter: raw})

    def response(self, solution: Solution) -> float:
        """The quantity at a solution."""
        return self.model.quantity(self.against).read(solution)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the problem at the setting."""
        return self.model.parameters(self.setting)

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """The range as bounds of a trace."""
        one, two = sorted((self.raw(self.low), self.raw(self.high)))
        return {self.parameter: (one, two)}

    @property
    def named(self) -> bool:
        """Whether the nomenclature of the model knows the states of this slice."""
        known = self.model.nomenclature
        return known is not None and known.applies(self.setting, self.along, self.low, self.high)

    @cached_property
    def symmetries(self) -> tuple[str, ...]:
        """Declared symmetries that leave the setting alone, and what varies, whatever its value."""
        between = self.low + GENERIC * (self.high - self.low)
        return fixing(self.model, list(self.model.parameters(self.whole_setting(between)).values()))

    @cached_property
    def local(self) -> Model:
        """The model with those pairing symmetries only that the whole slice has.

        An offset of the clamps breaks the reversal: where it is zero the reversal holds, and the states of a pair that
        meet there are different ones along the slice.
        """
        return self.model.restricted([name for name in self.symmetries if name in pairing(self.model)])

    def whole_setting(self, value: float) -> Setting:
        """Values of all controls where what varies has a value."""
        return self.model.setting(**self.setting, **{self.along: value})

    # -- other settings -----------------------------------------------------------------------------------------------

    def at(self, **values: float) -> SliceSettings:
        """The slice at other values of fixed controls; its range is the usual one where the old one does not fit."""
        setting = self.model.setting(**{**self.setting, **values})
        setting = setting.without(self.model.holder(self.along).name)
        fits = self.control.limits(setting) == self.control.limits(self.setting)
        low, high = (self.low, self.high) if fits else self.control.usual_within(setting) or (self.low, self.high)
        return replace(self, setting=setting, low=low, high=high)

    def references(self) -> list[SliceSettings]:
        """Settings from which states are carried over that are not connected within the slice."""
        known = self.model.references
        wanted = [] if known is None else [self.at(**setting) for setting in known(self.setting, self.along)]
        return [s for s in dict.fromkeys(wanted) if s.setting != self.setting]

    # -- in words, and as a record ------------------------------------------------------------------------------------

    @property
    def place_text(self) -> str:
        """The fixed controls that are not at their defaults, or have none that is usual, in words."""
        return self.model.setting_text(self.setting)

    @property
    def care(self) -> str:
        """What a reader should know of results in this range, '' where nothing is to be said."""
        if self.control.care is None:
            return ""
        return self.control.care(max(self.high, -self.low), self.setting)

    def identity(self) -> dict[str, object]:
        """Everything that decides the result, as plain values: the fields, the versions of program and code."""
        return {
            "rodatlas": __version__, "code": code_hash(*CODE), **self.model.identity(), "setting": dict(self.setting),
            "along": self.along, "low": self.low, "high": self.high, "against": self.against,
            "tolerance": self.tolerance, "search": self.search,
        }  # fmt: skip

    @classmethod
    def from_identity(cls, identity: Mapping[str, Any]) -> SliceSettings:
        """The settings behind :meth:`identity`, of whatever version; ValueError when nobody knows the model."""
        plain = {name: identity[name] for name in ("along", "low", "high", "against", "tolerance", "search")}
        return cls(model_named(identity["model"]), Setting(identity["setting"]), **plain)

    @property
    def stem(self) -> str:
        """Name of the files of a slice, other for all other settings: where it is, and what differs from the defaults.

        'slice-15', 'slice-15-dL0.4-nu0.3', 'slice-15-dD-0.1to0.86-search0'.
        """
        parts = ["slice", *self.model.stem_parts(self.setting)]
        held = [c.name for c in self.model.controls if not c.derived]
        if self.along != held[-1]:
            parts.append(f"along-{self.along}")
        if (self.low, self.high) != self.control.usual_within(self.setting):
            parts.append(f"{self.control.in_files}{exact(self.low)}to{exact(self.high)}")
        if self.against != self.model.quantities[0].name:
            parts.append(f"against-{self.against}")
        if self.tolerance != SliceSettings.tolerance:
            parts.append(f"tol{exact(self.tolerance)}")
        if self.search != SliceSettings.search:
            parts.append(f"search{self.search}")
        return "-".join(parts)
