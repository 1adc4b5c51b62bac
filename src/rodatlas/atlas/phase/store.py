"""A phase diagram in one HDF5 file: settings, warnings and tables as attributes (JSON), `/lines/0`, ... and
`/faces/0/ring0`, ... as arrays (n, 2) of both controls.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.regions import Face
from rodatlas.atlas.phase.result import Interval, PhaseDiagram
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5, get_array, put_array

if TYPE_CHECKING:
    import h5py

SCHEMA = "rodatlas/phase"


def save_phase(path: str | os.PathLike[str], diagram: PhaseDiagram) -> None:
    """Write a phase diagram to a file of its own."""
    with atomic_hdf5(path, SCHEMA) as file:
        file.attrs["identity"] = json.dumps(diagram.settings.identity())
        file.attrs["edge"] = json.dumps([asdict(i) for i in diagram.edge])
        file.attrs["events"] = json.dumps([asdict(e) for e in diagram.events])
        file.attrs["places"] = json.dumps(diagram.places)
        file.attrs["completed"] = json.dumps(diagram.completed)
        file.attrs["warnings"] = json.dumps(diagram.warnings)
        file.attrs["seconds"] = diagram.seconds
        for i, line in enumerate(diagram.lines):
            put_array(file, f"lines/{i}", line.points)
            file[f"lines/{i}"].attrs["record"] = json.dumps({"label": line.label, "kind": line.kind})
        for i, face in enumerate(diagram.faces):
            group = file.create_group(f"faces/{i}")
            group.attrs["record"] = json.dumps({"states": face.states, "samples": face.samples})
            for k, ring in enumerate(face.rings):
                put_array(group, f"ring{k}", ring)


def load_phase(path: str | os.PathLike[str]) -> PhaseDiagram:
    """Read what :func:`save_phase` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_phase(file)


def read_phase(file: h5py.File) -> PhaseDiagram:
    """The phase diagram in an open file."""

    def table(name: str) -> list:
        return json.loads(file.attrs[name])

    lines = []
    for i in range(len(file["lines"])):
        record = json.loads(file[f"lines/{i}"].attrs["record"])
        lines.append(Line(record["label"], record["kind"], _places(file, f"lines/{i}")))
    faces = []
    for i in range(len(file["faces"])):
        group = file[f"faces/{i}"]
        record = json.loads(group.attrs["record"])
        rings = tuple(_places(group, f"ring{k}") for k in range(max(1, len(group))))
        states = None if record["states"] is None else tuple(record["states"])
        faces.append(Face(rings, states, tuple((a, d) for a, d in record["samples"])))
    events = [PlaneEvent(**e | {k: tuple(e[k]) for k in ("ending", "passing")}) for e in table("events")]
    return PhaseDiagram(
        PhaseSettings.from_identity(json.loads(file.attrs["identity"])), tuple(lines), tuple(faces),
        tuple(Interval(**i) for i in table("edge")), tuple(events), tuple(table("places")), tuple(table("completed")),
        tuple(table("warnings")), float(file.attrs["seconds"]),
    )  # fmt: skip


def _places(group: h5py.Group, name: str) -> np.ndarray:
    """An array (n, 2) of finite numbers; KeyError or ValueError for anything else."""
    found = get_array(group, name, (None, 2))
    if not np.isfinite(found).all():
        raise ValueError(f"{group.name}/{name} holds what is no finite number")
    return found
