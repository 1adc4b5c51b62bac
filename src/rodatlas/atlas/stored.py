"""A result from its file in a folder if it is the wanted one; what is damaged or another's keeps another name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rodatlas.atlas.unfinished import Identified, Say, clear_leftover
from rodatlas.continuation.store import checked_hdf5
from rodatlas.files import remove_partials, set_aside

if TYPE_CHECKING:
    import h5py

Found = TypeVar("Found")


def peek(path: Path, schema: str, settings: Identified, read: Callable[[h5py.File], Found]) -> Found | None:
    """The result in a file if it was computed for these settings by this version; None of any other or damaged file."""
    try:
        return _read(path, schema, settings, read)[0] if path.exists() else None
    except ValueError:
        return None


def stored(path: Path, schema: str, settings: Identified, read: Callable[[h5py.File], Found], say: Say) -> Found | None:
    """As :func:`peek` for who is about to compute the result: its name is free afterwards, and nothing is lost.

    A file that is damaged, or was computed by another version, is renamed. What kills have left of finished results is
    removed.

    Parameters
    ----------
    say : told in one line what was renamed and why.
    """
    remove_partials(path.parent)
    remove_partials(path.parent, 0.0, path.name)
    if not path.exists():
        return None
    try:
        found, why = _read(path, schema, settings, read)
    except ValueError as error:
        found, why = None, f"is damaged ({error})"
    if found is not None:
        clear_leftover(path, settings.identity())
        return found
    aside = set_aside(path, "damaged" if why.startswith("is damaged") else "other")
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
