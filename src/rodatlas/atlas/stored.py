"""A result from its file in a folder if it is the wanted one; what is damaged or another's keeps another name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rodatlas.atlas.unfinished import Identified, Say, clear_leftover
from rodatlas.continuation.checks import as_path
from rodatlas.continuation.store.hdf5 import checked_hdf5
from rodatlas.files import remove_partials, set_aside

if TYPE_CHECKING:
    import h5py

Found = TypeVar("Found")


def made_folder(folder: object) -> Path:
    """The path of a folder, which is made when missing: what is not there cannot be locked.

    Raises
    ------
    ValueError
        when it cannot be made.
    """
    path = as_path("folder", folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"folder: expected one that can be made, got '{path}' ({error.strerror})") from None
    return path


def peek(path: Path, schema: str, settings: Identified, read: Callable[[h5py.File], Found]) -> Found | None:
    """The result in a file if it was computed for these settings by this version; None of any other or damaged file."""
    try:
        return _read(path, schema, settings, read)[0] if path.exists() else None
    except (ValueError, FileNotFoundError):  # another run may have renamed it meanwhile
        return None


def stored(
    path: Path, schema: str, settings: Identified, read: Callable[[h5py.File], Found], say: Say, fresh: bool = False
) -> Found | None:
    """As :func:`peek` for who is about to compute the result: its name is free afterwards, and nothing is lost.

    A file that is damaged, or was computed by another version, is renamed. What kills have left of finished results is
    removed.

    Parameters
    ----------
    say : told in one line what was renamed and why.
    fresh : the result is to be computed again: None even if the file has it, which stays until it is replaced.
    """
    remove_partials(path.parent)
    remove_partials(path.parent, 0.0, lambda name: name == path.name)
    if not path.exists():
        return None
    try:
        found, why = _read(path, schema, settings, read)
        reason = "other"
    except FileNotFoundError:  # somebody has taken it away
        return None
    except ValueError as error:
        found, why, reason = None, f"is damaged ({error})", "damaged"
    if found is not None:
        if fresh:
            return None
        clear_leftover(path, settings.identity())
        return found
    aside = set_aside(path, reason)
    say(f"{path.name} {why}; it is kept as {aside.name} and computed again")
    return None


def _read(
    path: Path, schema: str, settings: Identified, read: Callable[[h5py.File], Found]
) -> tuple[Found | None, str]:
    """The result, or why it is another one; ValueError when the file is damaged."""
    with checked_hdf5(path, schema) as file:
        known = json.loads(file.attrs["identity"])
        if known == settings.identity():
            return read(file), ""
    return None, "was computed by another version of rodatlas, or for other settings"
