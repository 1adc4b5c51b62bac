"""Finished branches of a slice in a folder, one HDF5 file each, so that an interrupted run resumes."""

from __future__ import annotations

import json
import os
from pathlib import Path

from rodatlas import __version__
from rodatlas.atlas.follow import BranchCache
from rodatlas.atlas.settings import SliceSettings
from rodatlas.continuation import Branch

SETTINGS = "settings.json"


class FolderCache(BranchCache):
    """Branches of one slice in `folder`; files of other settings or another version are removed first.

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
        wanted = {"rodatlas": __version__, **settings.as_dict()}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if fresh or self._read_settings() != wanted:
                for old in folder.glob("*.h5"):
                    old.unlink()
                write_text(folder / SETTINGS, json.dumps(wanted, indent=1) + "\n")
        except OSError as error:
            raise ValueError(f"out: expected a folder that can be written, got {folder} ({error.strerror})") from None

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.h5")))

    def get(self, key: str) -> Branch | None:
        path = self._path(key)
        return Branch.load(path) if path.exists() else None

    def put(self, key: str, branch: Branch) -> None:
        branch.save(self._path(key))

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.h5"

    def _read_settings(self) -> dict[str, object] | None:
        try:
            return json.loads((self.folder / SETTINGS).read_text())
        except (OSError, ValueError):
            return None


def write_text(path: Path, text: str) -> None:
    """Replace a text file at once: a reader sees the old one or the new one, never a part."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(text)
    os.replace(partial, path)
