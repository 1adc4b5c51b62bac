"""The folder beside the file of a result in which finished curves lie while the others are computed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from rodatlas.files import try_claim
from rodatlas.files.atomic import remove_folder

SETTINGS = "settings.json"
Say = Callable[[str], None]
"""Told in one line what is read, resumed, kept, or damaged."""


class Identified(Protocol):
    """Settings that say what decides the numbers."""

    def identity(self) -> dict[str, object]:
        """The fields as plain values, and the version of the program."""
        ...


def silent(line: str) -> None:
    """Tells nobody."""


def settings_in(folder: Path) -> dict[str, object] | None:
    """What the curves in a folder belong to; None when it holds none, or the record of it is damaged."""
    try:
        found = json.loads((folder / SETTINGS).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def clear_curves(folder: Path) -> None:
    """Remove the curves and settings of a finished result: in one step where nothing else is in their folder."""
    names = [p.name for p in folder.iterdir() if not p.name.startswith(".")]
    if all(name == SETTINGS or name.endswith(".h5") for name in names):
        remove_folder(folder)
        return
    for old in folder.glob("*.h5"):
        old.unlink()
    (folder / SETTINGS).unlink(missing_ok=True)


def clear_leftover(data: Path, identity: dict[str, object]) -> bool:
    """Remove the curves of a result that a kill has left beside its complete file; whether there were any.

    Parameters
    ----------
    data : the complete file.
    identity : of the result in it.
    """
    folder = data.with_suffix("")
    if not folder.is_dir() or settings_in(folder) != identity:
        return False
    with try_claim(data) as mine:
        if mine:
            clear_curves(folder)
        return mine
