"""A slice in one HDF5 file, through the store of branches and solutions.

Layout: settings, version of the program, warnings and seconds as attributes; `/branches/0`, `/branches/1`, ... each a
branch (see :mod:`rodatlas.continuation.store.branch`) with the attribute `record` (JSON: name, symmetry, origin,
events);
`/states/0`, ... the solutions of each named state with the attribute `record` (JSON: name, ends, contact).
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from typing import TYPE_CHECKING

from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation.store.branch import read_branch, write_branch
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5
from rodatlas.continuation.store.solutions import read_solutions, write_solutions

if TYPE_CHECKING:
    import h5py

SCHEMA = "rodatlas/slice"


def save_slice(path: str | os.PathLike[str], slice_: Slice) -> None:
    """Write a slice to a file of its own."""
    with atomic_hdf5(path, SCHEMA) as file:
        file.attrs["identity"] = json.dumps(slice_.settings.identity())
        file.attrs["warnings"] = json.dumps(slice_.warnings)
        file.attrs["seconds"] = slice_.seconds
        for i, b in enumerate(slice_.branches):
            _write_branch(file.create_group(f"branches/{i}"), b)
        for i, state in enumerate(slice_.states):
            _write_state(file.create_group(f"states/{i}"), state)


def load_slice(path: str | os.PathLike[str]) -> Slice:
    """Read what :func:`save_slice` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_slice(file)


def read_slice(file: h5py.File) -> Slice:
    """The slice in an open file."""
    settings = SliceSettings.from_identity(json.loads(file.attrs["identity"]))
    branches = tuple(_read_branch(group, settings) for group in _numbered(file, "branches"))
    states = tuple(_read_state(group, settings) for group in _numbered(file, "states"))
    warnings = tuple(json.loads(file.attrs["warnings"]))
    return Slice(settings, branches, states, warnings, float(file.attrs["seconds"]))


def _numbered(file: h5py.File, name: str) -> list[h5py.Group]:
    """The subgroups 0, 1, ... of a group; there is no group when there is nothing in it."""
    return [file[f"{name}/{i}"] for i in range(len(file[name]))] if name in file else []


def _write_branch(group: h5py.Group, b: SliceBranch) -> None:
    events = [
        {"kind": e.kind, "number": e.number, "criticality": e.criticality, "index": e.special.index,
         "breaks": e.special.breaks}
        for e in b.events
    ]  # fmt: skip
    f = b.followed
    record = {"id": b.id, "symmetries": sorted(f.symmetries), "pair": f.pair, "origin": f.origin, "source": f.source,
              "mirror": b.mirror, "events": events}  # fmt: skip
    write_branch(group, b.followed.branch)
    group.attrs["record"] = json.dumps(record)


def _read_branch(group: h5py.Group, settings: SliceSettings) -> SliceBranch:
    branch, record = read_branch(group), json.loads(group.attrs["record"])
    origin = (record["origin"][0], record["origin"][1]) if record["origin"] else None
    symmetries = frozenset(record["symmetries"])
    followed = Followed(record["id"], branch, symmetries, record["pair"], origin, record["source"])
    events = []
    for special, e in zip(followed.bifurcations, record["events"], strict=True):
        # an event may know the index where the branch ends, and symmetries that are products
        breaks = tuple(e["breaks"])
        known = replace(special, index=(e["index"][0], e["index"][1]), breaks=breaks)
        events.append(Event.at(settings, e["kind"], known, e["number"], e["criticality"]))
    return SliceBranch(followed, tuple(events), record["mirror"])


def _write_state(group: h5py.Group, state: State) -> None:
    ends = [{"kind": e.kind, "number": e.number, "snap": e.snap} for e in (state.low, state.high)]
    record = {"name": state.name, "branch": state.branch, "pair": state.pair, "path": state.path, "ends": ends,
              "contact": state.contact}  # fmt: skip
    write_solutions(group, state.solutions)
    group.attrs["record"] = json.dumps(record)


def _read_state(group: h5py.Group, settings: SliceSettings) -> State:
    solutions, record = tuple(read_solutions(group)), json.loads(group.attrs["record"])
    low, high = (
        StateEnd.at(settings, solution=solutions[at], **end) for at, end in zip((0, -1), record["ends"], strict=True)
    )
    contact = tuple((a, b) for a, b in record["contact"])
    return State(record["name"], record["branch"], record["pair"], record["path"], solutions, low, high, contact)
