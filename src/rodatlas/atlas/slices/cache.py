"""Finished curves of a computation that is under way, so that an interrupted run resumes."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from rodatlas.continuation import Branch, Solution
from rodatlas.continuation.checks import as_path, check_has
from rodatlas.continuation.store import atomic_hdf5, checked_hdf5, read_solutions, write_solutions

SETTINGS = "settings.json"
STATES = "rodatlas/slice states"


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


class BranchCache:
    """Keeps finished branches by name; this one forgets them at once."""

    def get(self, key: str) -> Branch | None:
        """The branch that was put under a name, if any."""
        return None

    def put(self, key: str, branch: Branch) -> None:
        """Keep a finished branch."""

    def get_states(self, key: str) -> tuple[Solution, ...] | None:
        """The states that were put under a name, if any."""
        return None

    def put_states(self, key: str, states: Sequence[Solution]) -> None:
        """Keep some states."""


class MemoryCache(BranchCache):
    """Branches and states of one computation, kept for another one at the same settings in this process."""

    def __init__(self) -> None:
        self._branches: dict[str, Branch] = {}
        self._states: dict[str, tuple[Solution, ...]] = {}

    def get(self, key: str) -> Branch | None:
        return self._branches.get(key)

    def put(self, key: str, branch: Branch) -> None:
        self._branches[key] = branch

    def get_states(self, key: str) -> tuple[Solution, ...] | None:
        return self._states.get(key)

    def put_states(self, key: str, states: Sequence[Solution]) -> None:
        self._states[key] = tuple(states)


class CurveFolder(Generic[AnyCurve]):
    """Curves of one result in `folder`, one HDF5 file each; files of other settings or another version are removed.

    What a kill has left half written is removed too.

    Parameters
    ----------
    folder : made when missing.
    settings : everything that decides the numbers; written to `settings.json` beside the curves.
    fresh : remove what is there in any case.

    Raises
    ------
    ValueError
        when the folder cannot be written.
    """

    def __init__(self, folder: Path, settings: Identified, fresh: bool = False):
        folder = as_path("folder", folder)
        check_has("settings", settings, ("identity",), "SliceSettings such as SliceSettings(15.0)")
        self.folder = folder
        wanted = settings.identity()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            remove_partials(folder)
            if fresh or self._read_settings() != wanted:
                self._remove_curves()
                write_text(folder / SETTINGS, json.dumps(wanted, indent=1) + "\n")
        except OSError as error:
            raise ValueError(f"out: expected a folder that can be written, got {folder} ({error.strerror})") from None

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.h5")))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} finished in {self.folder})"

    def get(self, key: str) -> AnyCurve | None:
        """The curve that was put under a name, if any.

        Raises
        ------
        ValueError
            when its file is damaged.
        """
        path = self._path(key)
        try:
            return self._load(path) if path.exists() else None
        except ValueError as error:
            raise ValueError(f"{error}; --fresh computes everything again") from None

    def put(self, key: str, curve: AnyCurve) -> None:
        """Keep a finished curve."""
        curve.save(self._path(key))

    def clear(self) -> None:
        """Remove the curves, the settings, and the folder if nothing else is in it."""
        self._remove_curves()
        (self.folder / SETTINGS).unlink(missing_ok=True)
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _load(self, path: Path) -> AnyCurve:
        raise NotImplementedError

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.h5"

    def _remove_curves(self) -> None:
        for old in self.folder.glob("*.h5"):
            old.unlink()

    def _read_settings(self) -> dict[str, object] | None:
        try:
            return json.loads((self.folder / SETTINGS).read_text())
        except (OSError, ValueError):
            return None


class FolderCache(CurveFolder[Branch], BranchCache):
    """Branches of one slice, and states that a search has found, in a folder."""

    def get_states(self, key: str) -> tuple[Solution, ...] | None:
        path = self._path(key)
        try:
            if not path.exists():
                return None
            with checked_hdf5(path, STATES) as file:
                return tuple(read_solutions(file["states"])) if "states" in file else ()
        except ValueError as error:
            raise ValueError(f"{error}; --fresh computes everything again") from None

    def put_states(self, key: str, states: Sequence[Solution]) -> None:
        with atomic_hdf5(self._path(key), STATES) as file:
            if states:
                write_solutions(file.create_group("states"), states)

    def _load(self, path: Path) -> Branch:
        return Branch.load(path)


class PrefixedCache(BranchCache):
    """Another cache with a prefix before all keys."""

    def __init__(self, inner: BranchCache, prefix: str):
        self._inner, self._prefix = inner, prefix

    def get(self, key: str) -> Branch | None:
        return self._inner.get(self._prefix + key)

    def put(self, key: str, branch: Branch) -> None:
        self._inner.put(self._prefix + key, branch)

    def get_states(self, key: str) -> tuple[Solution, ...] | None:
        return self._inner.get_states(self._prefix + key)

    def put_states(self, key: str, states: Sequence[Solution]) -> None:
        self._inner.put_states(self._prefix + key, states)


def write_text(path: Path, text: str) -> None:
    """Replace a text file at once: a reader sees the old one or the new one, never a part."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(text)
    os.replace(partial, path)


def remove_partials(folder: Path, older_than: float = 0.0, name: str = "*") -> None:
    """Remove what a kill has left of files that were being written.

    Parameters
    ----------
    older_than : seconds without a change, where other processes may still be writing.
    name : of the files, all when left out.
    """
    limit = time.time() - older_than
    for path in folder.glob(f".{name}.*partial"):
        try:
            if path.stat().st_mtime <= limit:
                path.unlink()
        except FileNotFoundError:
            continue  # renamed or removed meanwhile
