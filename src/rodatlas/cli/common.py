"""What the commands share: reading numbers, and what is told on stderr."""

from __future__ import annotations

import sys

from rodatlas.cli.progress import progress_bar

__all__ = [
    "DEFLATIONS", "SAMPLES", "SEARCHES", "STARTS", "WORKERS", "note", "number", "progress_bar", "shown",
    "whole_number",
]  # fmt: skip

# Ranges of whole numbers, against slips of the keyboard that would take the machine down.
WORKERS = (1, 1024)  # processes, and threads
STARTS = (1, 1_000_000)  # of a search for states
SEARCHES = (0, 1_000_000)  # of the search in a slice
DEFLATIONS = (1, 100_000)
SAMPLES = (3, 100_000)  # cross-sections of a shape

MOST_SHOWN = 200  # characters of what the user typed


def number(field: str, text: str, low: float | None = None, high: float | None = None) -> float:
    """A float from text, or a ValueError that names the field.

    Parameters
    ----------
    low, high : where nobody else checks the range.
    """
    from rodatlas.rods.band import number_from_text

    try:
        value = number_from_text(text)
    except ValueError:
        raise ValueError(f"{field}: expected a number, got '{shown(text)}'") from None
    if low is not None and high is not None and not low <= value <= high:
        raise ValueError(f"{field}: expected a number from {low:g} to {high:g}, got {value:g}")
    return value


def whole_number(field: str, text: str, bounds: tuple[int, int] | None = None) -> int:
    """An integer from text, or a ValueError that names the field.

    Parameters
    ----------
    bounds : least and largest value, one of the ranges above.
    """
    bare = text.strip()
    digits = bare.removeprefix("-").removeprefix("+")
    what = f"a whole number from {bounds[0]} to {bounds[1]}" if bounds else "a whole number"
    if not (digits.isascii() and digits.isdecimal() and len(digits) <= 18):
        raise ValueError(f"{field}: expected {what}, got '{shown(text)}'")
    value = int(bare)
    if bounds and not bounds[0] <= value <= bounds[1]:
        raise ValueError(f"{field}: expected {what}, got {value}")
    return value


def shown(text: str) -> str:
    """What the user typed, cut where it is long."""
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."


def note(line: str) -> None:
    """Tell the user something about the run, on stderr."""
    print(line, file=sys.stderr)
