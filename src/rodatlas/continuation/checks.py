"""Checks of arguments: what is of another kind than expected is told so in one line, before anything is computed."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Iterable, Sequence
from numbers import Real
from pathlib import Path

import numpy as np

_SHORT = reprlib.Repr()
_SHORT.maxother = _SHORT.maxstring = 60


def check_type(field: str, value: object, kind: type | tuple[type, ...], what: str) -> None:
    """Raise ValueError '`field`: expected `what`, got ...' unless a value is of a kind.

    >>> check_type("ends", 15.0, Ends, "Ends such as Ends(15.0)")
    ValueError: ends: expected Ends such as Ends(15.0), got 15.0
    """
    if not isinstance(value, kind):
        raise ValueError(f"{field}: expected {what}, got {shown(value)}")


def check_each(field: str, values: object, kind: type | tuple[type, ...], what: str) -> None:
    """As :func:`check_type`, for a sequence in which every value is of a kind."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ValueError(f"{field}: expected {what}, got {shown(values)}")
    for value in values if isinstance(values, Sequence) else ():  # an iterator would be used up
        check_type(field, value, kind, what)


def check_fields(owner: object, *names: str) -> None:
    """Raise ValueError for an attribute of an object that is no number."""
    for name in names:
        check_type(name, getattr(owner, name), Real, "a number")


def check_has(field: str, value: object, attributes: Iterable[str], what: str) -> None:
    """As :func:`check_type`, for any object with some attributes: figures read results of layers above them."""
    if any(not hasattr(value, name) for name in attributes):
        raise ValueError(f"{field}: expected {what}, got {shown(value)}")


def as_array(field: str, value: object) -> np.ndarray:
    """An array of floats, or ValueError for what is none."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{field}: expected an array of numbers, got {shown(value)}") from None


def shown(value: object) -> str:
    """A value as it stands in an error: on one line, and short."""
    return " ".join(_SHORT.repr(value).split())


def as_path(field: str, value: object) -> Path:
    """A path from a text or any path, or ValueError."""
    check_type(field, value, (str, os.PathLike), "the path of a file or folder")
    return Path(value)  # type: ignore[arg-type]
