"""Loci in one HDF5 file: settings and warnings as attributes, `/curves/0`, ... each a locus (see
:mod:`rodatlas.continuation.store.locus`) with the numbers of its pieces as the attribute `numbers` (JSON).
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from typing import TYPE_CHECKING

from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.loci.stretches import Stretch, pieces, stretches
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5
from rodatlas.continuation.store.locus import read_locus, write_locus

if TYPE_CHECKING:
    import h5py

SCHEMA = "rodatlas/loci"


def save_loci(path: str | os.PathLike[str], loci: Loci) -> None:
    """Write loci to a file of their own."""
    with atomic_hdf5(path, SCHEMA) as file:
        file.attrs["identity"] = json.dumps(loci.identity())
        file.attrs["wanted"] = json.dumps(loci.wanted)
        file.attrs["roles"] = json.dumps({n: sorted(roles) for n, roles in loci.roles.items()})
        file.attrs["warnings"] = json.dumps(loci.warnings)
        file.attrs["seconds"] = loci.seconds
        for i, curve in enumerate(loci.curves):
            group = file.create_group(f"curves/{i}")
            write_locus(group, curve)
            group.attrs["numbers"] = json.dumps([p.number for p in loci.pieces if p.curve == i])


def load_loci(path: str | os.PathLike[str]) -> Loci:
    """Read what :func:`save_loci` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_loci(file)


def read_loci(file: h5py.File) -> Loci:
    """The loci in an open file."""
    settings = LociSettings.from_identity(json.loads(file.attrs["identity"]))
    groups = [file[f"curves/{i}"] for i in range(len(file["curves"]))] if "curves" in file else []
    curves = tuple(read_locus(group) for group in groups)
    parts: list[Stretch] = []
    for i, (curve, group) in enumerate(zip(curves, groups, strict=True)):
        numbers = json.loads(group.attrs["numbers"])
        parts += [replace(p, number=n) for p, n in zip(stretches(curve, i, settings), numbers, strict=True)]
    wanted, warnings = (tuple(json.loads(file.attrs[key])) for key in ("wanted", "warnings"))
    kept = json.loads(file.attrs["roles"])
    roles = {int(n): frozenset((state, side) for state, side in ends) for n, ends in kept.items()}
    found = tuple(pieces(parts, curves, settings))
    return Loci(settings, curves, found, wanted, roles, warnings, float(file.attrs["seconds"]))
