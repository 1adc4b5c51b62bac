"""What the commands share: reading numbers, output files, progress."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rodatlas.cli.progress import progress_bar

if TYPE_CHECKING:
    from rodatlas.atlas.slices.settings import SliceSettings

__all__ = [
    "DEFLATIONS", "SAMPLES", "SEARCHES", "STARTS", "WORKERS", "file_target", "json_target", "note", "number",
    "progress_bar", "put_json", "settings_from", "shown", "whole_number", "writable_folder",
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


def settings_from(
    angle: str, compression: str, poisson: str, tol: str, shear_max: str | None = None, shear_min: str | None = None,
    search: str = "256",
) -> SliceSettings:  # fmt: skip
    """Settings of a slice from the texts that the user typed; None stands for the default."""
    from rodatlas.atlas.slices.settings import SliceSettings, default_shear_max, default_shear_min

    held = number("compression", compression)
    return SliceSettings(
        number("angle", angle), held, number("poisson", poisson),
        number("shear-max", shear_max) if shear_max is not None else default_shear_max(held),
        number("shear-min", shear_min) if shear_min is not None else default_shear_min(held),
        number("tol", tol), whole_number("search", search, SEARCHES),
    )  # fmt: skip


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


# -- output files -----------------------------------------------------------------------------------------------------


def writable_folder(text: str, field: str = "out") -> Path:
    """A folder that exists (made when missing) and can be written to.

    It is the last thing to check, so that wrong input leaves no empty folder.
    """
    folder = _place(text, field, "a folder that can be written")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _probe(folder)
    except OSError as error:
        raise ValueError(
            f"{field}: expected a folder that can be written, got '{shown(text)}' ({error.strerror})"
        ) from None
    return folder


def json_target(text: str | None) -> Path | None:
    """The file for --json, checked before any work is done; nothing is made yet."""
    if text is None or text == "-":
        return None
    if not text.strip():
        raise ValueError(f"json: expected a file name or -, got '{text}'")
    path = Path(text)
    if _is_folder(path):
        raise ValueError(f"json: expected a file name or -, got the folder '{shown(text)}'")
    if not _is_device(path):
        _place(str(path.parent), "json", "a folder that can be written")
        _check_name(path, "json")
    return path


def put_json(text: str, wanted: str | None, target: Path | None) -> None:
    """Write a result where --json wants it: `target` is what :func:`json_target` made of it."""
    from rodatlas.atlas.slices.cache import write_text

    if wanted == "-":
        sys.stdout.write(text)
    elif target is not None:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            if _is_device(target):
                target.write_text(text)  # /dev/null and the like are written to, not replaced
            else:
                write_text(target, text)
        except OSError as error:
            raise ValueError(f"json: expected a file that can be written, got '{target}' ({error.strerror})") from None


def file_target(text: str, field: str = "out") -> Path:
    """The file for --out, checked before any work is done; nothing is made yet."""
    path = Path(text)
    if not text.strip():
        raise ValueError(f"{field}: expected a file name, got '{text}'")
    if _is_folder(path):
        raise ValueError(f"{field}: expected a file name, got the folder '{shown(text)}'")
    if _is_device(path):
        raise ValueError(f"{field}: expected a file name, got '{shown(text)}', which is no plain file")
    _place(str(path.parent), field, "a folder that can be written")
    _check_name(path, field)
    return path


def _is_folder(path: Path) -> bool:
    """Whether a path leads to a folder; one that the system refuses does not."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _is_device(path: Path) -> bool:
    """Whether a path leads to something that is neither a file nor a folder: /dev/null, a pipe."""
    try:
        return path.exists() and not path.is_file() and not path.is_dir()
    except (OSError, ValueError):
        return False


def _look(path: Path) -> None:
    """OSError or ValueError where the system does not take a name; a missing file is none."""
    with suppress(FileNotFoundError, NotADirectoryError):
        os.lstat(path)


def _place(text: str, field: str, what: str) -> Path:
    """A folder that is there or can be made, by a trial in what is there of it."""
    folder = Path(text)
    try:
        if not text.strip():
            raise ValueError
        _look(folder)
        known = next(p for p in (folder, *folder.parents) if os.path.lexists(p))
        _probe(known)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        got = f"'{shown(text)}'" + (f" ({why})" if why else "")
        raise ValueError(f"{field}: expected {what}, got {got}") from None
    return folder


def _probe(folder: Path) -> None:
    """OSError where a folder cannot be written to."""
    probe = folder / f".rodatlas-{os.getpid()}"
    probe.touch()
    probe.unlink()


def _check_name(path: Path, field: str) -> None:
    """ValueError where the system does not take the name of a file, or the file must not be replaced."""
    try:
        _look(path.with_name(f".{path.name}.{'0' * 12}.partial"))  # as it is called while it is written
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise ValueError(f"{field}: expected a file that can be written, got '{shown(str(path))}' ({why})") from None


def note(line: str) -> None:
    """Tell the user something about the run, on stderr."""
    print(line, file=sys.stderr)
