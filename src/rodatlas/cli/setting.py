"""Settings of slices from the options of a command: each control of the model is an option of its name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rodatlas.cli.common import SEARCHES, number, shown, whole_number
from rodatlas.cli.controls import Fixed

if TYPE_CHECKING:
    from rodatlas.atlas.slices.settings import SliceSettings
    from rodatlas.model import Control, Model



@dataclass(frozen=True)
class Range:
    """What a slice goes along and is seen by, as the user typed it; None for what was not given.

    Attributes
    ----------
    along, low, high, against : options --along, --from, --to and --against.
    shear_max, shear_min : the range of a slice along the shear, in the words of the paper.
    """

    along: str | None = None
    low: str | None = None
    high: str | None = None
    against: str | None = None
    shear_max: str | None = None
    shear_min: str | None = None


def slice_settings_from(fixed: Fixed, tol: str, search: str = "256", where: Range | None = None) -> SliceSettings:
    """Settings of a slice of a model.

    Raises
    ------
    ValueError
        for a value that is wrong, a control that is given and varied at once, and where the one that stands first in
        names, the clamp angle, is not given.
    """
    from rodatlas.atlas.slices.settings import SliceSettings
    model, where = fixed.model, where or Range()
    control = model.control(model.plane[1] if where.along is None else where.along, "along")
    _refuse_varied(fixed, (control,), f"--along {control.name}")
    values = control_values(fixed, control)
    low, high = _ends(model, values, control, where)
    return SliceSettings.of(
        model, along=control.name, low=low, high=high, against=where.against, tolerance=number("tol", tol),
        search=whole_number("search", search, SEARCHES), **keywords(values),
    )  # fmt: skip


class Plane(NamedTuple):
    """A plane as the user asked for it: the model, its two controls, and values of the others.

    Attributes
    ----------
    second, along : names of the controls, across and along slices.
    fixed : values of others.
    """

    model: Model
    second: str
    along: str
    fixed: dict[str, float]


def plane_from(fixed: Fixed, where: str | None) -> Plane:
    """A plane of a model.

    Parameters
    ----------
    where : names of two controls, 'compression,shear'; None for those by default.

    Raises
    ------
    ValueError
        as :func:`slice_settings_from`.
    """
    model = fixed.model
    names = model.plane if where is None else tuple(name.strip() for name in where.split(","))
    if len(names) != 2:
        raise ValueError(f"in: expected two controls such as {','.join(model.plane)}, got '{shown(where or '')}'")
    second, along = (model.control(name, "in") for name in names)
    if second.parameter == along.parameter:
        raise ValueError(f"in: expected two controls that are independent, got '{shown(where or '')}'")
    _refuse_varied(fixed, (second, along), f"--in {second.name},{along.name}")
    values = control_values(fixed, second, along)
    return Plane(model, second.name, along.name, keywords(values))


def control_values(fixed: Fixed, *varied: Control) -> dict[str, float]:
    """Values of controls by name; unequal clamps have their mean for the common angle.

    Raises
    ------
    ValueError
        where the control that stands first in names is missing, the clamp angle, or told twice.
    """
    model = fixed.model
    values = {name: number(name, text) for name, text in fixed.texts.items() if text is not None}
    first = next((c for c in model.controls if c.short == ""), None)
    if first is None:
        return values
    each = [c.name for c in model.controls if c.derived and first.parameter in c.added]
    given = [name for name in each if name in values]
    told = {*values, *(control.name for control in varied)}
    if first.name in values and given:
        raise ValueError(f"{given[0]}: expected no --{first.name} beside --{given[0]}, got both")
    if first.name in told or not given:
        if first.name not in told:
            instead = f", or {' and '.join(f'--{name}' for name in each)}" if each else ""
            raise ValueError(f"{first.name}: expected --{first.name}{instead}, got none")
        return values
    if missing := [name for name in each if name not in told]:
        raise ValueError(f"{missing[0]}: expected --{missing[0]} beside --{given[0]}, got none")
    low, high, _ = first.limits({})
    mean = sum(values[name] for name in given) / len(given)
    return {**values, first.name: min(max(mean, math.nextafter(low, high)), math.nextafter(high, low))}


def _ends(
    model: Model, values: Mapping[str, float], control: Control, where: Range
) -> tuple[float | None, float | None]:
    """The range as far as it was given."""
    from rodatlas.paper.model import shear_range

    setting = model.setting(**keywords(values)).without(model.holder(control.name).name)
    in_words = {"shear-max": where.shear_max, "shear-min": where.shear_min}
    given = {name: text for name, text in in_words.items() if text is not None}
    for name, text in given.items():
        if control.name != "shear" or "compression" not in setting or where.low is not None or where.high is not None:
            raise ValueError(f"{name}: expected the range by --from and --to alone, got --{name} {shown(text)} too")
    if given:
        most, least = (None if text is None else number(name, text) for name, text in in_words.items())
        return shear_range(setting, most, least)
    bottom, top, what = control.limits(setting)
    ends = []
    for name, typed in (("from", where.low), ("to", where.high)):
        value = None if typed is None else number(name, typed)
        if value is not None and not bottom < value < top:
            raise ValueError(f"{name}: expected {what}, got {value:g}")
        ends.append(value)
    if ends[0] is not None and ends[1] is not None and not ends[0] < ends[1]:
        raise ValueError(f"from: expected a number below that of --to, {ends[1]:g}, got {ends[0]:g}")
    return ends[0], ends[1]


def _refuse_varied(fixed: Fixed, varied: Sequence[Control], beside: str) -> None:
    """ValueError for a value of a control that varies."""
    for control in varied:
        for name in (control.name, fixed.model.holder(control.name).name):
            if (text := fixed.texts.get(name)) is not None:
                raise ValueError(f"{name}: expected none beside {beside}, got '{shown(text)}'")


def keywords(values: Mapping[str, float]) -> dict[str, float]:
    """Names of controls as names of arguments."""
    return {name.replace("-", "_"): value for name, value in values.items()}


def with_unit(control: Control) -> str:
    """The name of a control as it heads a column: 'angle [deg]'."""
    return f"{control.name} [{control.unit}]" if control.unit else control.name
