"""Finished curves of a result that is being computed, in a folder beside its file: an interrupted run resumes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from rodatlas.continuation.checks import as_path, check_has
from rodatlas.files import remove_partials, set_aside, try_claim, write_text
from rodatlas.files.atomic import remove_folder

SETTINGS = "settings.json"
Say = Callable[[str], None]
"""Told in one line what is read, resumed, kept, or damaged."""


class Curve(Protocol):
    """A branch or a locus."""

    def save(self, path: Path) -> None:
        """Write it to a file of its own."""
        ...


class Identified(Protocol):
    """Settings that say what decides the numbers."""

    def identity(self) -> dict[str, object]:
        """The fields as plain values, and the version of the program."""
        ...


AnyCurve = TypeVar("AnyCurve", bound=Curve)
Read = TypeVar("Read")


def silent(line: str) -> None:
    """Tells nobody."""


class CurveFolder(Generic[AnyCurve]):
    """Curves of one result in `folder`, one HDF5 file each.

    Curves of another version of the program are removed, and so is what a kill has left half written. A damaged file is
    removed and its curve computed again.

    Parameters
    ----------
    folder : made when missing.
    settings : everything that decides the numbers; written to `settings.json` beside the curves.
    fresh : remove what is there in any case.
    say : told what is damaged or cannot be used.

    Raises
    ------
    ValueError
        when the folder cannot be written, or is there and was not made by this program.
    """

    def __init__(self, folder: Path, settings: Identified, fresh: bool = False, say: Say = silent):
        folder = as_path("folder", folder)
        check_has("settings", settings, ("identity",), "SliceSettings such as SliceSettings(15.0)")
        self.folder, self._say = folder, say
        wanted = settings.identity()
        try:
            known = self._known()
            folder.mkdir(parents=True, exist_ok=True)
            remove_partials(folder, 0.0)
            if fresh or known != wanted:
                if known and not fresh and len(self):
                    say(f"{len(self)} unfinished curves in {folder} are of another version and are computed again")
                self._remove_curves()
                write_text(folder / SETTINGS, json.dumps(wanted, indent=1) + "\n")
        except OSError as error:
            raise ValueError(f"out: expected a folder that can be written, got {folder} ({error.strerror})") from None

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.h5")))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} finished in {self.folder})"

    def get(self, key: str) -> AnyCurve | None:
        """The curve that was put under a name, if any."""
        return self._read(key, self._load)

    def put(self, key: str, curve: AnyCurve) -> None:
        """Keep a finished curve."""
        curve.save(self._path(key))

    def clear(self) -> None:
        """Remove the curves and settings at once, and the folder unless something else is in it."""
        clear_curves(self.folder)

    def _load(self, path: Path) -> AnyCurve:
        """The curve in a file; ValueError when it is damaged."""
        raise NotImplementedError

    def _read(self, key: str, load: Callable[[Path], Read]) -> Read | None:
        path = self._path(key)
        if not path.exists():
            return None
        try:
            return load(path)
        except ValueError as error:
            self._say(f"{path.parent.name}/{path.name} is damaged and is computed again ({error})")
            path.unlink()
            return None

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.h5"

    def _remove_curves(self) -> None:
        for old in self.folder.glob("*.h5"):
            old.unlink()

    def _known(self) -> dict[str, object] | None:
        """The settings of what the folder holds; None when it is missing or empty."""
        if not self.folder.is_dir() or not any(p for p in self.folder.iterdir() if not p.name.startswith(".")):
            return None
        known = settings_in(self.folder)
        if known is not None:
            return known
        if not (self.folder / SETTINGS).exists():
            raise ValueError(f"out: expected no folder named '{self.folder.name}' with other files in "
                             f"{self.folder.parent}, where unfinished curves are kept, got one")  # fmt: skip
        aside = set_aside(self.folder)
        self._say(f"{self.folder.name}/{SETTINGS} is damaged; the folder is kept as {aside.name}, and its curves are "
                  "computed again")  # fmt: skip
        return None


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
