"""Solutions in HDF5 files, end to end.

Layout (S solutions with N_i intervals of m Gauss points, n unknowns)::

    offsets     (S+1,) of intervals; meshes differ in size, and tell apart by them what lies end to end
    mesh, values (sum N_i + S, n); stages (sum N_i, m, n); parameters (S, np); places (S, K+1, 2); error (S,);
                observables (S, no)
    attributes  names of unknowns, parameters and observables
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5, get_array, get_names, put_array, put_names

if TYPE_CHECKING:
    import h5py

SCHEMA = "rodatlas/solution"


def save_solution(
    path: str | os.PathLike[str], solution: Solution, identity: Mapping[str, object] | None = None
) -> None:
    """Write one solution to a file of its own, with what it was computed for if that is given."""
    with atomic_hdf5(path, SCHEMA) as file:
        if identity is not None:
            file.attrs["identity"] = json.dumps(dict(identity))
        write_solutions(file, [solution])


def load_solution(path: str | os.PathLike[str]) -> Solution:
    """Read what :func:`save_solution` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_solutions(file)[0]


def write_solutions(group: h5py.Group, solutions: Sequence[Solution]) -> None:
    """Write solutions of one problem, with equally many Gauss points, end to end."""
    if len({(s.unknowns, s.parameter_names, s.points, len(s.places)) for s in solutions}) > 1:
        raise ValueError("solutions: expected one problem and one number of Gauss points, got several")
    observables = tuple(solutions[0].observables) if solutions else ()
    put_names(group, "unknowns", solutions[0].unknowns if solutions else ())
    put_names(group, "parameter_names", solutions[0].parameter_names if solutions else ())
    put_names(group, "observable_names", observables)
    put_array(group, "offsets", np.concatenate([[0], np.cumsum([s.intervals for s in solutions])]).astype(np.int64))
    if not solutions:
        return
    put_array(group, "mesh", np.concatenate([s.mesh for s in solutions]))
    put_array(group, "values", np.concatenate([s.values for s in solutions]))
    put_array(group, "stages", np.concatenate([s.stages for s in solutions]))
    put_array(group, "parameters", np.array([s.parameters for s in solutions]))
    put_array(group, "places", np.array([s.places for s in solutions]))
    put_array(group, "error", np.array([s.error for s in solutions]))
    put_array(group, "observables", np.array([[s.observables[k] for k in observables] for s in solutions]))


def read_solutions(group: h5py.Group) -> list[Solution]:
    """Read what :func:`write_solutions` wrote."""
    unknowns, parameters, names = (get_names(group, k) for k in ("unknowns", "parameter_names", "observable_names"))
    offsets = group["offsets"][()]
    count = len(offsets) - 1
    if count == 0:
        return []
    total, n = int(offsets[-1]), len(unknowns)
    mesh, values = get_array(group, "mesh", (total + count,)), get_array(group, "values", (total + count, n))
    stages = get_array(group, "stages", (total, None, n))
    numbers = get_array(group, "parameters", (count, len(parameters)))
    places = get_array(group, "places", (count, None, 2))
    error, seen = get_array(group, "error", (count,)), get_array(group, "observables", (count, len(names)))
    for name, array in (("mesh", mesh), ("values", values), ("stages", stages), ("parameters", numbers),
                        ("places", places)):  # fmt: skip
        if not np.isfinite(array).all():
            raise ValueError(f"{group.name}/{name} holds what is no finite number")
    if np.any(np.diff(offsets) < 1):
        raise ValueError(f"{group.name}/offsets do not increase")
    found = []
    for i, (a, b) in enumerate(zip(offsets[:-1].tolist(), offsets[1:].tolist(), strict=True)):
        at = slice(a + i, b + i + 1)
        found.append(
            Solution(unknowns, parameters, mesh[at], values[at], stages[a:b], numbers[i], float(error[i]),
                     dict(zip(names, seen[i].tolist(), strict=True)), places[i])
        )  # fmt: skip
    return found
