"""Finished parts of a computation that is under way, kept by name: an interrupted run resumes with them.

What asks for parts knows a :class:`Cache` only. Parts lie in memory, for another computation in this process, or in a
folder beside the file of their result.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from rodatlas.atlas.unfinished import SETTINGS, Identified, Say, clear_curves, settings_in, silent
from rodatlas.continuation import Branch, Locus, Solution
from rodatlas.continuation.checks import as_path, check_has
from rodatlas.continuation.store.branch import load_branch, save_branch
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5
from rodatlas.continuation.store.locus import load_locus, save_locus
from rodatlas.continuation.store.solutions import read_solutions, write_solutions
from rodatlas.files import remove_partials, set_aside, write_text

SOLUTIONS_SCHEMA = "rodatlas/solutions"
Part = TypeVar("Part")


@dataclass(frozen=True)
class Form(Generic[Part]):
    """A kind of part: how it is written to a file of its own, and read; ValueError when the file is damaged."""

    save: Callable[[Path, Part], None]
    load: Callable[[Path], Part]


def _save_solutions(path: Path, solutions: Sequence[Solution]) -> None:
    with atomic_hdf5(path, SOLUTIONS_SCHEMA) as file:
        if solutions:
            write_solutions(file.create_group("states"), solutions)


def _load_solutions(path: Path) -> tuple[Solution, ...]:
    with checked_hdf5(path, SOLUTIONS_SCHEMA) as file:
        return tuple(read_solutions(file["states"])) if "states" in file else ()


BRANCH: Form[Branch] = Form(save_branch, load_branch)
LOCUS: Form[Locus] = Form(save_locus, load_locus)
SOLUTIONS: Form[tuple[Solution, ...]] = Form(_save_solutions, _load_solutions)


class Cache(Protocol):
    """Keeps finished parts by name."""

    def get(self, key: str, form: Form[Part]) -> Part | None:
        """The part that was put under a name, if any."""
        ...

    def put(self, key: str, part: Part, form: Form[Part]) -> None:
        """Keep a finished part."""
        ...


class MemoryCache:
    """Parts of one computation, kept for another one at the same settings in this process."""

    def __init__(self) -> None:
        self._parts: dict[str, Any] = {}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self._parts)} finished)"

    def get(self, key: str, form: Form[Part]) -> Part | None:
        """The part that was put under a name, if any."""
        found: Part | None = self._parts.get(key)
        return found

    def put(self, key: str, part: Part, form: Form[Part]) -> None:
        """Keep a finished part."""
        self._parts[key] = part


class FolderCache:
    """Parts of one result in `folder`, one HDF5 file each.

    Parts of another version of the program are removed, and so is what a kill has left half written. A damaged file is
    removed and its part computed again.

    Parameters
    ----------
    folder : made when missing.
    settings : everything that decides the numbers; written to `settings.json` beside the parts.
    fresh : remove what is there in any case.
    say : told what is damaged or cannot be used.

    Raises
    ------
    ValueError
        when the folder cannot be written, or is there and was not made by this program.

    Examples
    --------
    >>> compute_slice(settings, FolderCache(Path("out/slice-15"), settings))
    """

    def __init__(self, folder: Path, settings: Identified, fresh: bool = False, say: Say = silent):
        folder = as_path("folder", folder)
        check_has("settings", settings, ("identity",), "settings that have an identity, such as SliceSettings")
        self.folder, self._say = folder, say
        wanted = settings.identity()
        try:
            known = self._known()
            folder.mkdir(parents=True, exist_ok=True)
            remove_partials(folder, 0.0)
            if fresh or known != wanted:
                if known and not fresh and len(self):
                    say(f"{len(self)} unfinished curves in {folder} are of another version and are computed again")
                self._remove_parts()
                write_text(folder / SETTINGS, json.dumps(wanted, indent=1) + "\n")
        except OSError as error:
            raise ValueError(f"out: expected a folder that can be written, got {folder} ({error.strerror})") from None

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.h5")))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} finished in {self.folder})"

    def get(self, key: str, form: Form[Part]) -> Part | None:
        """The part that was put under a name, if any."""
        path = self._path(key)
        if not path.exists():
            return None
        try:
            return form.load(path)
        except ValueError as error:
            self._say(f"{path.parent.name}/{path.name} is damaged and is computed again ({error})")
            path.unlink()
            return None

    def put(self, key: str, part: Part, form: Form[Part]) -> None:
        """Keep a finished part."""
        form.save(self._path(key), part)

    def clear(self) -> None:
        """Remove the parts and settings at once, and the folder unless something else is in it."""
        clear_curves(self.folder)

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.h5"

    def _remove_parts(self) -> None:
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


@dataclass(frozen=True)
class PrefixedCache:
    """Another cache with a prefix before all names."""

    inner: Cache
    prefix: str

    def get(self, key: str, form: Form[Part]) -> Part | None:
        """The part that was put under a name, if any."""
        return self.inner.get(self.prefix + key, form)

    def put(self, key: str, part: Part, form: Form[Part]) -> None:
        """Keep a finished part."""
        self.inner.put(self.prefix + key, part, form)
