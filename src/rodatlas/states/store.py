"""States found by a search in one HDF5 file: the setting and what the search met as attributes of the file,
`/states/0`, ... each a solution with the attribute `record` (JSON: class, name, index, pair, count).
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5
from rodatlas.continuation.store.solutions import read_solutions, write_solutions
from rodatlas.rods.ends import Ends
from rodatlas.states.discover import Discovery, FoundState

SCHEMA = "rodatlas/states"
ALGORITHM = 3  # raised with every change of the program after which a search finds something else


def save_discovery(
    path: str | os.PathLike[str], found: Discovery, identity: Mapping[str, object] | None = None, seconds: float = 0.0
) -> None:
    """Write what a search found to a file of its own.

    Parameters
    ----------
    identity : everything that decided the numbers, as plain values.
    seconds : that the search took.
    """
    with atomic_hdf5(path, SCHEMA) as file:
        file.attrs["identity"] = json.dumps(dict(identity or {}))
        file.attrs["ends"] = json.dumps(asdict(found.ends))
        file.attrs["search"] = json.dumps(_plain(found, "ends", "states", "warnings"))
        file.attrs["count"], file.attrs["stable"] = len(found.states), sum(s.stable for s in found.states)
        file.attrs["warnings"] = json.dumps(found.warnings)  # as in other results, for lists of files
        file.attrs["seconds"] = seconds
        for i, state in enumerate(found.states):
            group = file.create_group(f"states/{i}")
            write_solutions(group, [state.solution])
            group.attrs["record"] = json.dumps(_plain(state, "solution"))


def load_discovery(path: str | os.PathLike[str]) -> Discovery:
    """Read what :func:`save_discovery` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        groups = [file[f"states/{i}"] for i in range(int(file.attrs["count"]))]
        states = tuple(FoundState(read_solutions(g)[0], **json.loads(g.attrs["record"])) for g in groups)
        search: dict[str, Any] = json.loads(file.attrs["search"])
        search |= {name: tuple(value) for name, value in search.items() if isinstance(value, list)}
        warnings = tuple(json.loads(file.attrs["warnings"]))
        return Discovery(Ends(**json.loads(file.attrs["ends"])), states, warnings=warnings, **search)


def _plain(record: Any, *without: str) -> dict[str, Any]:
    """Fields of a dataclass but some, by name; NumPy's numbers as Python's."""
    values = {f.name: getattr(record, f.name) for f in fields(record) if f.name not in without}
    return {name: value.item() if hasattr(value, "item") else value for name, value in values.items()}
