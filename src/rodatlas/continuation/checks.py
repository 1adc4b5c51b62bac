"""Checks of arguments: what is of another kind than expected is told so in one line, before anything is computed."""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Collection, Iterable, Sequence
from numbers import Real
from pathlib import Path

import numpy as np

_SHORT = reprlib.Repr()
_SHORT.maxother = _SHORT.maxstring = 60


class WrongInput(ValueError):
    """Input that is refused: "`field`: expected ..., got ...".

    Attributes
    ----------
    field : what is wrong, by the name that the caller knows; who reads it from a file may know it by another.
    rest : what was expected and what came.
    """

    def __init__(self, field: str, rest: str):
        super().__init__(field, rest)  # both, so that it can be sent to another process
        self.field, self.rest = field, rest

    def __str__(self) -> str:
        return f"{self.field}: {self.rest}"


def check_type(field: str, value: object, kind: type | tuple[type, ...], what: str) -> None:
    """Raise :class:`WrongInput` '`field`: expected `what`, got ...' unless a value is of a kind.

    >>> check_type("ends", 15.0, Ends, "Ends such as Ends(15.0)")
    WrongInput: ends: expected Ends such as Ends(15.0), got 15.0
    """
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if isinstance(value, bool) and not (bool in kinds or object in kinds):
        kinds = ()  # True is no number, though Python says so
    if not isinstance(value, kinds):
        raise WrongInput(field, f"expected {what}, got {shown(value)}")


def check_flag(field: str, value: object) -> None:
    """As :func:`check_type`, for what is either so or not."""
    check_type(field, value, bool, "True or False")


def check_function(field: str, value: object) -> None:
    """As :func:`check_type`, for what is called."""
    if not callable(value):
        raise WrongInput(field, f"expected a function, got {shown(value)}")


def check_each(field: str, values: object, kind: type | tuple[type, ...], what: str) -> None:
    """As :func:`check_type`, for a sequence in which every value is of a kind."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise WrongInput(field, f"expected {what}, got {shown(values)}")
    for value in values if isinstance(values, Sequence) else ():  # an iterator would be used up
        check_type(field, value, kind, what)


def as_names(field: str, values: object, what: str) -> list[str]:
    """As :func:`check_each`, for names in anything but an iterator, which would be used up; the names."""
    if isinstance(values, str | bytes) or not isinstance(values, Collection):
        raise WrongInput(field, f"expected {what}, got {shown(values)}")
    for name in values:
        check_type(field, name, str, what)
    return list(values)


def check_distinct(field: str, values: object, what: str) -> None:
    """As :func:`as_names`, where none may come twice."""
    names = as_names(field, values, what)
    for name in names:
        if names.count(name) > 1:
            raise WrongInput(field, f"expected {what}, each once, got '{name}' twice")


def check_fields(owner: object, *names: str) -> None:
    """Raise ValueError for an attribute of an object that is no number."""
    for name in names:
        check_type(name, getattr(owner, name), Real, "a number")


def check_number(field: str, value: object, low: float, high: float, what: str) -> float:
    """A finite float in [low, high], or a ValueError that names the field, what was expected and what came."""
    try:
        number = math.nan if isinstance(value, str | bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not (math.isfinite(number) and low <= number <= high):
        raise WrongInput(field, f"expected {what}, got {repr(value) if isinstance(value, str) else value}")
    return number


def check_whole(field: str, value: object, low: int, what: str) -> int:
    """A whole number of at least `low`, or a ValueError that names the field, what was expected and what came."""
    number = check_number(field, value, low, math.inf, what)
    if number != int(number):
        raise WrongInput(field, f"expected {what}, got {value}")
    return int(number)


def check_between(field: str, value: object, low: float, high: float, what: str) -> float:
    """As :func:`check_number`, with the bounds themselves left out."""
    return check_number(field, value, math.nextafter(low, high), math.nextafter(high, low), what)


def check_has(field: str, value: object, attributes: Iterable[str], what: str) -> None:
    """As :func:`check_type`, for any object with some attributes: figures read results of layers above them."""
    if any(not hasattr(value, name) for name in attributes):
        raise WrongInput(field, f"expected {what}, got {shown(value)}")


def as_finite(field: str, name: str, value: object) -> float:
    """The value of a name as a finite float, or ValueError."""
    try:
        number = math.nan if isinstance(value, str | bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise WrongInput(field, f"expected a finite number for '{name}', got {shown(value)}")
    return number


def as_array(field: str, value: object) -> np.ndarray:
    """An array of floats, or ValueError for what is none."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise WrongInput(field, f"expected an array of numbers, got {shown(value)}") from None


def shown(value: object) -> str:
    """A value as it stands in an error: on one line, and short."""
    return " ".join(_SHORT.repr(value).split())


def as_path(field: str, value: object) -> Path:
    """A path from a text or any path, or ValueError."""
    check_type(field, value, (str, os.PathLike), "the path of a file or folder")
    return Path(value)  # type: ignore[arg-type]
