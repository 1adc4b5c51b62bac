"""Branches in HDF5 files: one a file, replaced atomically, checked when read.

Layout of a branch file::

    /            schema, version, settings and verification (JSON), free, ends, failures, newton_iterations
    /points      solutions; arclength, tangent, fold_test, branch_test, index, iterations, step, weakness  (S, ...)
    /special     solutions; kind, status, arclength, bracket, tests, index, residual, curvature, turns, normal_form,
                 isotropy, breaks; directions, bend; multiplicity, continuum, unverified, nearby
    /discrepancies
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.discrete.collocation import Scale
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import (
    Branch,
    Discrepancy,
    EndReason,
    NormalForm,
    Point,
    SpecialPoint,
    Status,
    Verification,
)
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

SCHEMA = "rodatlas/branch"
NO_INDEX = np.iinfo(np.int64).min


def save_branch(path: str | os.PathLike[str], branch: Branch) -> None:
    """Write one branch to a file of its own."""
    with atomic_hdf5(path, SCHEMA) as file:
        write_branch(file, branch)


def load_branch(path: str | os.PathLike[str]) -> Branch:
    """Read what :func:`save_branch` wrote."""
    with checked_hdf5(path, SCHEMA) as file:
        return read_branch(file)


def write_branch(group: h5py.Group, branch: Branch) -> None:
    """Write a branch into a group of an open file."""
    put_names(group, "free", branch.free)
    put_names(group, "orbit", branch.orbit)
    put_names(group, "ends", [reason.name for reason in branch.ends])
    put_names(group, "failures", [code.name if code else "" for code in branch.failures])
    group.attrs["newton_iterations"] = branch.newton_iterations
    group.attrs["verification"] = json.dumps(asdict(branch.verification))
    group.attrs["settings"] = json.dumps(dict(branch.settings))
    _write_points(group.create_group("points"), branch.points)
    _write_special(group.create_group("special"), branch.special)
    _write_discrepancies(group.create_group("discrepancies"), branch.discrepancies)


def read_branch(group: h5py.Group) -> Branch:
    """Read what :func:`write_branch` wrote."""
    ends = get_names(group, "ends")
    failures = [NewtonCode[name] if name else None for name in get_names(group, "failures")]
    return Branch(
        get_names(group, "free"), _read_points(group["points"]), _read_special(group["special"]),
        (EndReason[ends[0]], EndReason[ends[1]]), _read_discrepancies(group["discrepancies"]),
        int(group.attrs["newton_iterations"]), (failures[0], failures[1]), json.loads(group.attrs["settings"]),
        _verification(json.loads(group.attrs["verification"])), get_names(group, "orbit"),
    )  # fmt: skip


_POINT_NUMBERS = ("arclength", "fold_test", "branch_test", "step", "weakness")


def _write_points(group: h5py.Group, points: Sequence[Point]) -> None:
    write_solutions(group.create_group("solutions"), [p.solution for p in points])
    put_each(group, points, (*_POINT_NUMBERS, "tangent"))
    put_each(group, points, ("iterations",), np.int64)
    put_array(group, "index", _indices([p.index for p in points]))


def _read_points(group: h5py.Group) -> tuple[Point, ...]:
    solutions = read_solutions(group["solutions"])
    count = (len(solutions),)
    arclength, fold, branch, step, weakness = (get_array(group, key, count).tolist() for key in _POINT_NUMBERS)
    tangent = get_array(group, "tangent", (len(solutions), None))
    index, iterations = _optional(get_array(group, "index", count)), get_array(group, "iterations", count).tolist()
    return tuple(map(Point, solutions, arclength, tangent, fold, branch, index, iterations, step, weakness))


_MULTIPLE_NUMBERS = ("multiplicity", "continuum", "unverified")


def _write_special(group: h5py.Group, special: Sequence[SpecialPoint]) -> None:
    write_solutions(group.create_group("solutions"), [x.solution for x in special])
    put_names(group, "kind", [x.kind for x in special])
    put_names(group, "status", [x.status.name for x in special])
    put_each(group, special, ("arclength", "residual", "curvature"))
    put_each(group, special, ("bracket", "tests"), size=2)
    put_array(group, "index", _indices([i for x in special for i in x.index]).reshape(-1, 2))
    put_each(group, special, ("turns",), bool)
    forms = [x.normal_form or NormalForm("") for x in special]
    put_names(group, "normal_form", [form.kind for form in forms])
    put_array(group, "normal_form", np.array([(form.slope, form.bend) for form in forms], float).reshape(-1, 2))
    _write_vectors(group.create_group("directions"), [x.directions for x in special])
    _write_vectors(group.create_group("bend"), [() if x.bend is None else (x.bend,) for x in special])
    put_each(group, special, _MULTIPLE_NUMBERS, np.int64)
    _write_vectors(group.create_group("nearby"), [x.nearby for x in special])
    for key in ("isotropy", "breaks"):
        put_names(group, key, [json.dumps(getattr(x, key)) for x in special])
    scale = next((x.scale for x in special if x.scale is not None), None)
    put_names(group["directions"], "free", next((x.free for x in special if x.free), ()))
    if scale is not None:
        put_array(group["directions"], "scale_unknowns", scale.unknowns)
        put_array(group["directions"], "scale_parameters", scale.parameters)


def _write_vectors(group: h5py.Group, lists: Sequence[tuple[Columns, ...]]) -> None:
    """Vectors that lie on the meshes of some solutions, several or none for each."""
    put_array(group, "count", np.array([len(vectors) for vectors in lists], np.int64))
    parts = [v for vectors in lists for v in vectors]
    for key in ("stage", "mesh", "scalars"):
        put_array(group, key, np.concatenate([getattr(v, key) for v in parts]) if parts else np.empty(0))


def _read_special(group: h5py.Group) -> tuple[SpecialPoint, ...]:
    solutions = read_solutions(group["solutions"])
    kind, status = get_names(group, "kind"), get_names(group, "status")
    n = len(solutions)
    numbers = ("arclength", "residual", "curvature")
    arclength, residual, curvature = (get_array(group, key, (n,)).tolist() for key in numbers)
    bracket, tests = (get_array(group, key, (n, 2)).tolist() for key in ("bracket", "tests"))
    index = get_array(group, "index", (n, 2))
    at = group["directions"]
    free = get_names(at, "free")
    directions = _read_vectors(at, solutions, len(free))
    scale = Scale(at["scale_unknowns"][()], at["scale_parameters"][()]) if "scale_unknowns" in at else None
    turns = get_array(group, "turns", (n,)).tolist()
    forms, bends = _read_forms(group, solutions, len(free))
    multiple = _read_multiple(group, solutions, len(free))
    found = []
    for i in range(n):
        before, after = _optional(index[i])
        found.append(
            SpecialPoint(
                kind[i], solutions[i], arclength[i], Status[status[i]], tuple(bracket[i]), tuple(tests[i]),
                (before, after), residual[i], curvature[i], directions[i], free, scale, turns[i], forms[i], bends[i],
                **multiple[i],
            )
        )  # fmt: skip
    return tuple(found)


def _read_forms(
    group: h5py.Group, solutions: Sequence[Solution], k: int
) -> tuple[list[NormalForm | None], list[Columns | None]]:
    """Normal forms and bends, where there are any."""
    numbers = get_array(group, "normal_form", (len(solutions), 2)).tolist()
    kinds = get_names(group, "normal_form")
    forms = [NormalForm(kind, *pair) if kind else None for kind, pair in zip(kinds, numbers, strict=True)]
    return forms, [v[0] if v else None for v in _read_vectors(group["bend"], solutions, k)]


def _read_multiple(group: h5py.Group, solutions: Sequence[Solution], k: int) -> list[dict[str, Any]]:
    """Multiplicity and symmetry."""
    size, family, missing = (get_array(group, key, (len(solutions),)).tolist() for key in _MULTIPLE_NUMBERS)
    nearby = _read_vectors(group["nearby"], solutions, k)
    own, lost = ([tuple(json.loads(text)) for text in get_names(group, key)] for key in ("isotropy", "breaks"))
    return [
        {"multiplicity": d, "continuum": bool(c), "unverified": u, "nearby": near, "isotropy": i, "breaks": b}
        for d, c, u, near, i, b in zip(size, family, missing, nearby, own, lost, strict=True)
    ]


def _read_vectors(group: h5py.Group, solutions: Sequence[Solution], k: int) -> list[tuple[Columns, ...]]:
    """What :func:`_write_vectors` wrote, with k scalars each."""
    count = get_array(group, "count", (len(solutions),)).tolist()
    stage, mesh, scalars = (group[key][()] for key in ("stage", "mesh", "scalars"))
    found, a, b, c = [], 0, 0, 0
    for solution, number in zip(solutions, count, strict=True):
        mine = []
        for _ in range(number):
            n_int = solution.intervals
            mine.append(Columns(stage[a : a + n_int], mesh[b : b + n_int + 1], scalars[c : c + k]))
            a, b, c = a + n_int, b + n_int + 1, c + k
        found.append(tuple(mine))
    return found


def _verification(record: dict[str, Any]) -> Verification:
    return Verification(**(record | {"untrusted": tuple(tuple(pair) for pair in record["untrusted"])}))


def _write_discrepancies(group: h5py.Group, found: Sequence[Discrepancy]) -> None:
    put_each(group, found, ("bracket", "parameter"), size=2)
    put_array(group, "index", _indices([i for x in found for i in x.index]).reshape(-1, 2))
    put_names(group, "events", [json.dumps(x.events) for x in found])
    put_names(group, "reason", [x.reason for x in found])


def _read_discrepancies(group: h5py.Group) -> tuple[Discrepancy, ...]:
    events, pairs = get_names(group, "events"), ("bracket", "index", "parameter")
    bracket, index, parameter = (get_array(group, key, (len(events), 2)).tolist() for key in pairs)
    reason = get_names(group, "reason")
    return tuple(
        Discrepancy(tuple(b), (i[0], i[1]), tuple(json.loads(e)), tuple(p), r)
        for b, i, e, p, r in zip(bracket, map(_optional, np.array(index)), events, parameter, reason, strict=True)
    )


def _indices(values: Sequence[int | None]) -> np.ndarray:
    return np.array([NO_INDEX if v is None else v for v in values], np.int64)


def _optional(values: np.ndarray) -> list[int | None]:
    return [None if v == NO_INDEX else v for v in values.tolist()]
