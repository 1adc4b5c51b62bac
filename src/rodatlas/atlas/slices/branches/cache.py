"""Finished curves of a computation that is under way, so that an interrupted run resumes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rodatlas.atlas.unfinished import CurveFolder
from rodatlas.continuation import Branch, Solution
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5
from rodatlas.continuation.store.solutions import read_solutions, write_solutions

STATES = "rodatlas/slice states"


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


class FolderCache(CurveFolder[Branch], BranchCache):
    """Branches of one slice, and states that a search has found, in a folder."""

    def get_states(self, key: str) -> tuple[Solution, ...] | None:
        return self._read(key, _load_states)

    def put_states(self, key: str, states: Sequence[Solution]) -> None:
        with atomic_hdf5(self._path(key), STATES) as file:
            if states:
                write_solutions(file.create_group("states"), states)

    def _load(self, path: Path) -> Branch:
        return Branch.load(path)


def _load_states(path: Path) -> tuple[Solution, ...]:
    with checked_hdf5(path, STATES) as file:
        return tuple(read_solutions(file["states"])) if "states" in file else ()


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
