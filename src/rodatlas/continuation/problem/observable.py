"""Observables: scalar functionals of a solution, recorded along branches and usable as bounds and zeros."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rodatlas.continuation.checks import check_function
from rodatlas.continuation.problem.layout import Place, check_place


@dataclass(frozen=True)
class Observable:
    """A scalar functional of a solution with an exact gradient.

    Made by :func:`integral_of`, :func:`end_value` and :func:`value_at`.

    Attributes
    ----------
    kind : 'integral', 'end', or 'inner' for a value at the place `at`, where `side` matters if something jumps.
    """

    kind: str
    function: Callable[..., Any]
    at: Place | None = None
    side: str = "right"

    def __post_init__(self) -> None:
        check_function("function", self.function)


def integral_of(function: Callable[[Any, Any, Any], Any]) -> Observable:
    r"""Observable :math:`\int g(s, u, p)\,ds` over the interval of the problem."""
    return Observable("integral", function)


def end_value(function: Callable[[Any, Any, Any], Any]) -> Observable:
    """Observable `g(left, right, p)` of the two end states."""
    return Observable("end", function)


def value_at(at: Place, function: Callable[[Any, Any], Any], side: str = "right") -> Observable:
    """Observable `g(u, p)` of the state at a place inside the interval, which becomes a breakpoint.

    Parameters
    ----------
    at : a number, the name of a parameter, or a function of the parameters.
    side : 'left' or 'right' of the place, where an unknown jumps there.

    Examples
    --------
    >>> middle = value_at(0.5, lambda u, p: u.y)
    """
    check_place("value_at", at)
    if side not in ("left", "right"):
        raise ValueError(f"side: expected 'left' or 'right', got {side!r}")
    return Observable("inner", function, at, side)
