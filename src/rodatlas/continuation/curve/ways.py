"""A curve followed both ways from one start; what was computed is kept when something interrupts it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from rodatlas.continuation.results.branch import EndReason


class Way(Protocol):
    """A walk in one direction."""

    @property
    def end(self) -> EndReason | None:
        """Why it ended, None before that."""

    def walk(self) -> None:
        """Take all steps."""


W = TypeVar("W", bound=Way)
R = TypeVar("R")


def walked(
    way: Callable[[float], W], joined: Callable[[W, W | None, EndReason], R], name: str, both: bool = True,
    start: EndReason = EndReason.START,
) -> R:  # fmt: skip
    """Walk forward and, unless the curve closes, backward; the curve from both.

    Parameters
    ----------
    way : makes the walk from the start, forward for 1 and backward for -1.
    joined : makes the curve of the forward walk, the backward one if it began, and the reason of the first end.
    name : attribute of an exception in which the part computed so far is kept.
    both : walk backward too; start : the reason of the first end when not.
    """
    forward, backward = way(1.0), None
    try:
        forward.walk()
        if both and forward.end is not EndReason.CLOSED:
            backward = way(-1.0)
            backward.walk()
    except BaseException as error:
        setattr(error, name, joined(forward, backward, EndReason.INTERRUPTED if both else start))
        raise
    return joined(forward, backward, EndReason.CLOSED if both and backward is None else start)
