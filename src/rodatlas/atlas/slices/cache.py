"""Finished branches of a computation that is under way, so that an interrupted run resumes."""

from __future__ import annotations

import json
import os
from pathlib import Path

from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Branch

SETTINGS = "settings.json"


class BranchCache:
    """Keeps finished branches by name; this one forgets them at once."""

    def get(self, key: str) -> Branch | None:
        """The branch that was put under a name, if any."""
        return None

    def put(self, key: str, branch: Branch) -> None:
        """Keep a finished branch."""


class FolderCache(BranchCache):
    """Branches of one slice in `folder`, one HDF5 file each; files of other settings or another version are removed.

    Parameters
    ----------
    folder : made when missing.
    settings : everything that decides the numbers; written to `settings.json` beside the branches.
    fresh : remove what is there in any case.

    Raises
    ------
    ValueError
        when the folder cannot be written.
    """

    def __init__(self, folder: Path, settings: SliceSettings, fresh: bool = False):
        self.folder = folder
        wanted = settings.identity()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if fresh or self._read_settings() != wanted:
                self._remove_branches()
                write_text(folder / SETTINGS, json.dumps(wanted, indent=1) + "\n")
        except OSError as error:
            raise ValueError(f"out: expected a folder that can be written, got {folder} ({error.strerror})") from None

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.h5")))

    def __repr__(self) -> str:
        return f"FolderCache({len(self)} branches in {self.folder})"

    def get(self, key: str) -> Branch | None:
        path = self._path(key)
        try:
            return Branch.load(path) if path.exists() else None
        except ValueError as error:
            raise ValueError(f"{error}; --fresh computes everything again") from None

    def put(self, key: str, branch: Branch) -> None:
        branch.save(self._path(key))

    def clear(self) -> None:
        """Remove the branches, the settings, and the folder if nothing else is in it."""
        self._remove_branches()
        (self.folder / SETTINGS).unlink(missing_ok=True)
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.h5"

    def _remove_branches(self) -> None:
        for old in self.folder.glob("*.h5"):
            old.unlink()

    def _read_settings(self) -> dict[str, object] | None:
        try:
            return json.loads((self.folder / SETTINGS).read_text())
        except (OSError, ValueError):
            return None


class PrefixedCache(BranchCache):
    """Another cache with a prefix before all keys."""

    def __init__(self, inner: BranchCache, prefix: str):
        self._inner, self._prefix = inner, prefix

    def get(self, key: str) -> Branch | None:
        return self._inner.get(self._prefix + key)

    def put(self, key: str, branch: Branch) -> None:
        self._inner.put(self._prefix + key, branch)


def write_text(path: Path, text: str) -> None:
    """Replace a text file at once: a reader sees the old one or the new one, never a part."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(text)
    os.replace(partial, path)
