"""Loci in HDF5 files, as branches are.

::

    attributes   schema, version, kind, free, ends, settings, pitchfork, unresolved
    /points      solutions; arclength, tangent, tests, unfolding, iterations
    /events      kind, parameter, status, what, effect, coefficients; solutions; arclength, bracket, test
    /scale       unknowns, parameters
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.discrete.collocation import Scale
from rodatlas.continuation.results.branch import EndReason, Status
from rodatlas.continuation.results.locus import Effect, Locus, LocusEvent, LocusPoint
from rodatlas.continuation.store.hdf5 import (
    atomic_hdf5,
    checked_hdf5,
    get_array,
    get_names,
    put_array,
    put_each,
    put_names,
)
from rodatlas.continuation.store.solutions import read_solutions, write_solutions

if TYPE_CHECKING:
    import h5py

SCHEMA = "rodatlas/locus"


def save_locus(path: str | os.PathLike[str], locus: Locus) -> None:
    """Write one locus to a file of its own."""
    with atomic_hdf5(path, SCHEMA) as file:
        write_locus(file, locus)


def load_locus(path: str | os.PathLike[str]) -> Locus:
    """Read what :func:`save_locus` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_locus(file)


def write_locus(group: h5py.Group, locus: Locus) -> None:
    """Write a locus into a group of an open file."""
    put_names(group, "kind", [locus.kind])
    put_names(group, "free", locus.free)
    put_names(group, "ends", [reason.name for reason in locus.ends])
    group.attrs["settings"] = json.dumps(dict(locus.settings))
    group.attrs["pitchfork"] = locus.pitchfork
    group.attrs["unresolved"] = locus.unresolved
    _write_points(group.create_group("points"), locus.points)
    _write_events(group.create_group("events"), locus.events)
    scale = group.create_group("scale")
    put_array(scale, "unknowns", locus.scale.unknowns)
    put_array(scale, "parameters", locus.scale.parameters)


def read_locus(group: h5py.Group) -> Locus:
    """Read what :func:`write_locus` wrote."""
    ends = get_names(group, "ends")
    scale = Scale(*(get_array(group["scale"], key, (None,)) for key in ("unknowns", "parameters")))
    return Locus(
        get_names(group, "kind")[0], get_names(group, "free"), _read_points(group["points"]),
        _read_events(group["events"]), (EndReason[ends[0]], EndReason[ends[1]]), scale,
        json.loads(group.attrs["settings"]), bool(group.attrs["pitchfork"]), int(group.attrs["unresolved"]),
    )  # fmt: skip


def _write_points(group: h5py.Group, points: Sequence[LocusPoint]) -> None:
    write_solutions(group.create_group("solutions"), [p.solution for p in points])
    put_each(group, points, ("arclength", "tangent", "unfolding"))
    put_each(group, points, ("iterations",), np.int64)
    names = tuple(points[0].tests)
    put_names(group, "tests", names)
    put_array(group, "tests", np.array([[p.tests[name] for name in names] for p in points]))


def _read_points(group: h5py.Group) -> tuple[LocusPoint, ...]:
    solutions = read_solutions(group["solutions"])
    count, names = (len(solutions),), get_names(group, "tests")
    arclength, unfolding = (get_array(group, key, count).tolist() for key in ("arclength", "unfolding"))
    tangent, iterations = get_array(group, "tangent", (*count, None)), get_array(group, "iterations", count).tolist()
    values = get_array(group, "tests", (*count, len(names))).tolist() if names else [[]] * len(solutions)
    tests = [dict(zip(names, row, strict=True)) for row in values]
    return tuple(map(LocusPoint, solutions, arclength, tangent, tests, unfolding, iterations))


def _write_events(group: h5py.Group, events: Sequence[LocusEvent]) -> None:
    write_solutions(group.create_group("solutions"), [e.solution for e in events])
    for key in ("kind", "parameter", "what"):
        put_names(group, key, [getattr(e, key) for e in events])
    put_names(group, "status", [e.status.name for e in events])
    put_names(group, "effect", [e.effect.name if e.effect else "" for e in events])
    put_each(group, events, ("arclength", "test"))
    put_each(group, events, ("bracket",), size=2)
    put_names(group, "coefficients", [json.dumps(dict(e.coefficients)) for e in events])


def _read_events(group: h5py.Group) -> tuple[LocusEvent, ...]:
    solutions = read_solutions(group["solutions"])
    n = len(solutions)
    kind, parameter, what, status = (get_names(group, key) for key in ("kind", "parameter", "what", "status"))
    arclength, test = (get_array(group, key, (n,)).tolist() for key in ("arclength", "test"))
    bracket = get_array(group, "bracket", (n, 2)).tolist()
    effect = [Effect[name] if name else None for name in get_names(group, "effect")]
    coefficients = [json.loads(text) for text in get_names(group, "coefficients")]
    return tuple(
        LocusEvent(kind[i], parameter[i], solutions[i], arclength[i], Status[status[i]], tuple(bracket[i]), test[i],
                   what[i], coefficients[i], effect[i])
        for i in range(n)
    )  # fmt: skip
