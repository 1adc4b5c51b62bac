"""Solutions and branches in HDF5 files: one object a file, replaced atomically, checked when read.

Layout of a branch file (S solutions with N_i intervals of m Gauss points, n unknowns)::

    /            schema, version, settings (JSON), free, ends, failures, newton_iterations
    /points      arclength, tangent, fold_test, branch_test, index, iterations, step  (S, ...)
    /points/solutions    offsets (S+1,) of intervals; mesh, values (sum N_i + S, n), stages (sum N_i, m, n),
                         parameters (S, np), error (S,), observables (S, no); names as attributes
    /special     kind, status, arclength, bracket, tests, index, residual, curvature, turns, normal_form; solutions;
                 directions, bend; multiplicity, continuum, unverified, nearby
    /discrepancies

Meshes differ in size from point to point, so they lie end to end and `offsets` tells them apart.
"""

from __future__ import annotations

import errno
import json
import os
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import as_path
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

if TYPE_CHECKING:
    import h5py

VERSION = 1
# What reading raises where something is missing, cut off, of another shape or type, or no JSON
DAMAGE = (OSError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RuntimeError)
NO_INDEX = np.iinfo(np.int64).min


@contextmanager
def atomic_hdf5(path: str | os.PathLike[str], schema: str, version: int = VERSION) -> Iterator[h5py.File]:
    """An HDF5 file open for writing that appears under its name only when it is complete and on disk.

    It is made in memory, written under another name in the same folder, synced and renamed; after an exception or a
    kill the file that was there before is untouched.

    Raises
    ------
    ValueError
        when the folder does not exist.
    OSError
        when it cannot be written, a full disk say.
    """
    import h5py

    path = as_path("path", path)
    if not path.name:
        raise ValueError(f"path: expected a file name, got '{path}'")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: expected a file in an existing folder, got the missing folder {path.parent}")
    partial = path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}.partial")
    try:
        with h5py.File(str(partial), "x", driver="core", backing_store=False) as file:
            file.attrs["schema"] = schema
            file.attrs["version"] = version
            yield file
            file.flush()
            image = file.id.get_file_image()  # HDF5 itself cannot give up a file on a full disk without a mess
        try:
            partial.write_bytes(image)
            _sync(partial)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from None
        os.replace(partial, path)
        _sync(path.parent)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def checked_hdf5(path: str | os.PathLike[str], schema: str, version: int = VERSION) -> Iterator[h5py.File]:
    """An HDF5 file open for reading, whose schema and version this code understands.

    Raises
    ------
    FileNotFoundError
    ValueError
        when the file is damaged, holds something else, or comes from a newer version; it names the file, what was
        expected and what came.
    """
    import h5py

    if not as_path("path", path).exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    expected = f"{path}: expected a '{schema}' file of version {version} or older, got"
    with ExitStack() as stack:
        try:
            file = stack.enter_context(h5py.File(path, "r"))
            found, number = _text(file.attrs.get("schema", "")), file.attrs.get("version", None)
        except DAMAGE as error:
            raise _damaged(expected, error) from error
        if found != schema:
            raise ValueError(f"{expected} {f'schema {found!r}' if found else 'an HDF5 file without a schema'}")
        if not isinstance(number, (int, np.integer)) or number > version:
            raise ValueError(f"{expected} version {number}: update rodatlas to read it")
        try:
            yield file
        except DAMAGE as error:
            raise _damaged(expected, error) from error


def _damaged(expected: str, error: Exception) -> ValueError:
    """What is told of a file whose content makes no sense."""
    detail = " ".join(str(error).strip("'\"").split()) or type(error).__name__
    return ValueError(f"{expected} a damaged file ({detail})")


def save_solution(
    path: str | os.PathLike[str], solution: Solution, identity: Mapping[str, object] | None = None
) -> None:
    """Write one solution to a file of its own, with what it was computed for if that is given."""
    with atomic_hdf5(path, "rodatlas/solution") as file:
        if identity is not None:
            file.attrs["identity"] = json.dumps(dict(identity))
        write_solutions(file, [solution])


def load_solution(path: str | os.PathLike[str]) -> Solution:
    """Read what :func:`save_solution` wrote."""
    with checked_hdf5(path, "rodatlas/solution") as file:
        return read_solutions(file)[0]


def save_branch(path: str | os.PathLike[str], branch: Branch) -> None:
    """Write one branch to a file of its own."""
    with atomic_hdf5(path, "rodatlas/branch") as file:
        write_branch(file, branch)


def load_branch(path: str | os.PathLike[str]) -> Branch:
    """Read what :func:`save_branch` wrote."""
    with checked_hdf5(path, "rodatlas/branch") as file:
        return read_branch(file)


# -- solutions --------------------------------------------------------------------------------------------------------


def write_solutions(group: h5py.Group, solutions: Sequence[Solution]) -> None:
    """Write solutions of one problem, with equally many Gauss points, end to end."""
    if len({(s.unknowns, s.parameter_names, s.points) for s in solutions}) > 1:
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
    error, seen = get_array(group, "error", (count,)), get_array(group, "observables", (count, len(names)))
    for name, array in (("mesh", mesh), ("values", values), ("stages", stages), ("parameters", numbers)):
        if not np.isfinite(array).all():
            raise ValueError(f"{group.name}/{name} holds what is no finite number")
    if np.any(np.diff(offsets) < 1):
        raise ValueError(f"{group.name}/offsets do not increase")
    found = []
    for i, (a, b) in enumerate(zip(offsets[:-1].tolist(), offsets[1:].tolist(), strict=True)):
        at = slice(a + i, b + i + 1)
        found.append(
            Solution(unknowns, parameters, mesh[at], values[at], stages[a:b], numbers[i], float(error[i]),
                     dict(zip(names, seen[i].tolist(), strict=True)))
        )  # fmt: skip
    return found


# -- branches ---------------------------------------------------------------------------------------------------------


def write_branch(group: h5py.Group, branch: Branch) -> None:
    """Write a branch into a group of an open file."""
    put_names(group, "free", branch.free)
    put_names(group, "orbit", branch.orbit)
    put_names(group, "ends", [reason.name for reason in branch.ends])
    put_names(group, "failures", [code.name if code else "" for code in branch.failures])
    group.attrs["newton_iterations"] = branch.newton_iterations
    group.attrs["verification"] = json.dumps(asdict(branch.verification) if branch.verification else None)
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
        _verification(json.loads(group.attrs.get("verification", "null"))), get_names(group, "orbit"),
    )  # fmt: skip


_POINT_NUMBERS = ("arclength", "fold_test", "branch_test", "step")


def _write_points(group: h5py.Group, points: Sequence[Point]) -> None:
    write_solutions(group.create_group("solutions"), [p.solution for p in points])
    for key in (*_POINT_NUMBERS, "weakness"):
        put_array(group, key, np.array([getattr(p, key) for p in points], float))
    put_array(group, "tangent", np.array([p.tangent for p in points], float))
    put_array(group, "index", _indices([p.index for p in points]))
    put_array(group, "iterations", np.array([p.iterations for p in points], np.int64))


def _read_points(group: h5py.Group) -> tuple[Point, ...]:
    solutions = read_solutions(group["solutions"])
    count = (len(solutions),)
    arclength, fold, branch, step = (get_array(group, key, count).tolist() for key in _POINT_NUMBERS)
    unknown = [float("nan")] * len(solutions)  # in files of older versions
    weakness = get_array(group, "weakness", count).tolist() if "weakness" in group else unknown
    tangent = get_array(group, "tangent", (len(solutions), None))
    index, iterations = _optional(get_array(group, "index", count)), get_array(group, "iterations", count).tolist()
    return tuple(map(Point, solutions, arclength, tangent, fold, branch, index, iterations, step, weakness))


_MULTIPLE_NUMBERS = ("multiplicity", "continuum", "unverified")


def _write_special(group: h5py.Group, special: Sequence[SpecialPoint]) -> None:
    write_solutions(group.create_group("solutions"), [x.solution for x in special])
    put_names(group, "kind", [x.kind for x in special])
    put_names(group, "status", [x.status.name for x in special])
    for key in ("arclength", "residual", "curvature"):
        put_array(group, key, np.array([getattr(x, key) for x in special], float))
    for key in ("bracket", "tests"):
        put_array(group, key, np.array([getattr(x, key) for x in special], float).reshape(-1, 2))
    put_array(group, "index", _indices([i for x in special for i in x.index]).reshape(-1, 2))
    put_array(group, "turns", np.array([x.turns for x in special], bool))
    forms = [x.normal_form or NormalForm("") for x in special]
    put_names(group, "normal_form", [form.kind for form in forms])
    put_array(group, "normal_form", np.array([(form.slope, form.bend) for form in forms], float).reshape(-1, 2))
    _write_vectors(group.create_group("directions"), [x.directions for x in special])
    _write_vectors(group.create_group("bend"), [() if x.bend is None else (x.bend,) for x in special])
    for key in _MULTIPLE_NUMBERS:
        put_array(group, key, np.array([getattr(x, key) for x in special], np.int64))
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
    """Normal forms and bends, which files of older versions lack."""
    if "normal_form" not in group:
        return [None] * len(solutions), [None] * len(solutions)
    numbers = get_array(group, "normal_form", (len(solutions), 2)).tolist()
    kinds = get_names(group, "normal_form")
    forms = [NormalForm(kind, *pair) if kind else None for kind, pair in zip(kinds, numbers, strict=True)]
    return forms, [v[0] if v else None for v in _read_vectors(group["bend"], solutions, k)]


def _read_multiple(group: h5py.Group, solutions: Sequence[Solution], k: int) -> list[dict[str, Any]]:
    """Multiplicity and symmetry, which files of older versions lack."""
    if "multiplicity" not in group:
        return [{} for _ in solutions]
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


def _verification(record: dict[str, Any] | None) -> Verification | None:
    if record is None:
        return None
    return Verification(**(record | {"untrusted": tuple(tuple(pair) for pair in record["untrusted"])}))


def _write_discrepancies(group: h5py.Group, found: Sequence[Discrepancy]) -> None:
    for key in ("bracket", "parameter"):
        put_array(group, key, np.array([getattr(x, key) for x in found], float).reshape(-1, 2))
    put_array(group, "index", _indices([i for x in found for i in x.index]).reshape(-1, 2))
    put_names(group, "events", [json.dumps(x.events) for x in found])
    put_names(group, "reason", [x.reason for x in found])


def _read_discrepancies(group: h5py.Group) -> tuple[Discrepancy, ...]:
    events, pairs = get_names(group, "events"), ("bracket", "index", "parameter")
    bracket, index, parameter = (get_array(group, key, (len(events), 2)).tolist() for key in pairs)
    reason = get_names(group, "reason") if "reason" in group.attrs else ("",) * len(events)
    return tuple(
        Discrepancy(tuple(b), (i[0], i[1]), tuple(json.loads(e)), tuple(p), r)
        for b, i, e, p, r in zip(bracket, map(_optional, np.array(index)), events, parameter, reason, strict=True)
    )


# -- small parts ------------------------------------------------------------------------------------------------------


def put_array(group: h5py.Group, name: str, array: np.ndarray) -> None:
    """A dataset whose checksum makes damage show when it is read."""
    array = np.ascontiguousarray(array)
    if array.size == 0:
        group.create_dataset(name, data=array)
    else:
        group.create_dataset(name, data=array, chunks=array.shape, fletcher32=True)


def get_array(group: h5py.Group, name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """A dataset of the expected shape (None: any length)."""
    array: np.ndarray = group[name][()]
    if len(array.shape) != len(shape) or any(b is not None and a != b for a, b in zip(array.shape, shape, strict=True)):
        raise KeyError(f"{group.name}/{name} has shape {array.shape}, not {shape}")
    return array


def put_names(group: h5py.Group, name: str, names: Iterable[str]) -> None:
    """Strings as an attribute."""
    import h5py

    group.attrs[name] = np.array(list(names), dtype=h5py.string_dtype())


def get_names(group: h5py.Group, name: str) -> tuple[str, ...]:
    """What :func:`put_names` wrote."""
    return tuple(_text(value) for value in group.attrs[name])


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _indices(values: Sequence[int | None]) -> np.ndarray:
    return np.array([NO_INDEX if v is None else v for v in values], np.int64)


def _optional(values: np.ndarray) -> list[int | None]:
    return [None if v == NO_INDEX else v for v in values.tolist()]


def _sync(path: Path) -> None:
    """Flush a file, or the entries of a folder, to disk; folders cannot be opened on Windows."""
    if path.is_dir() and os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
