"""What the commands share: reading numbers, and what is told on stderr."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rodatlas.cli.progress import progress_bar

if TYPE_CHECKING:
    from rodatlas.rods.ends import Ends

__all__ = [
    "DEFLATIONS", "SAMPLES", "SEARCHES", "STARTS", "WORKERS", "ends_from", "note", "number", "progress_bar",
    "shown", "whole_number",
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


def ends_from(
    angle: str | None, angle_left: str | None, angle_right: str | None, compression: str, shear: str, offset: str,
    twist: str,
) -> Ends:  # fmt: skip
    """The clamps from the texts that the user typed; None stands for an option that was not given.

    Raises
    ------
    ValueError
        unless there is either one angle for both clamps or one for each, and every number is within its limits.
    """
    from rodatlas.rods.ends import Ends

    both = {"angle-left": angle_left, "angle-right": angle_right}
    typed = [name for name, text in both.items() if text is not None]
    if angle is not None and typed:
        raise ValueError(f"{typed[0]}: expected no --angle beside --{typed[0]}, got both")
    if angle is None and not typed:
        raise ValueError("angle: expected --angle, or --angle-left and --angle-right, got none")
    if len(typed) == 1:
        lacking = next(name for name in both if name not in typed)
        raise ValueError(f"{lacking}: expected --{lacking} beside --{typed[0]}, got none")
    others = {"compression": number("compression", compression), "shear": number("shear", shear),
              "offset": number("offset", offset), "twist_deg": number("twist", twist)}  # fmt: skip
    if angle is not None:
        return Ends(number("angle", angle), **others)
    return Ends.unequal(*(number(name, str(text)) for name, text in both.items()), **others)


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
