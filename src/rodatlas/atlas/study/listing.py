"""What a folder holds, for `rodatlas show`: results of any command, and what a study has planned but not finished."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.study.catalogue import NAME, Catalogue, read_catalogue
from rodatlas.atlas.study.folder import PLAN, failure_of
from rodatlas.atlas.study.inspection import Entry, inspect_file, inspect_work
from rodatlas.atlas.unfinished import clear_leftover, settings_in
from rodatlas.continuation.checks import as_path
from rodatlas.files import alone_in, remove_partials

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/show/1"


@dataclass(frozen=True)
class Listing:
    """What is in a folder.

    Attributes
    ----------
    study : name of the study that was last run there, empty without one.
    entries : results in order of file name, then what is planned and not there.
    others : number of other files (figures, tables, text).
    """

    folder: Path
    study: str
    entries: tuple[Entry, ...]
    others: int

    def count(self, status: str) -> int:
        """Number of entries of a status."""
        return sum(e.status == status for e in self.entries)

    def __repr__(self) -> str:
        kinds = dict.fromkeys(e.status for e in self.entries)
        return f"Listing({self.folder}: {', '.join(f'{self.count(k)} {k}' for k in kinds) or 'nothing'})"

    def to_frame(self) -> Table:
        """One row for each entry; settings in columns of their own."""
        from rodatlas.continuation.table import Table

        rows = [e.to_json() for e in self.entries]
        return Table([{**{k: v for k, v in r.items() if k != "settings"}, **r["settings"]} for r in rows])

    def to_json(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "schema": SCHEMA, "folder": str(self.folder), "study": self.study, "others": self.others,
            "results": [e.to_json() for e in self.entries],
        }  # fmt: skip


def list_folder(folder: Path, thorough: bool = False) -> Listing:
    """What is in a folder.

    Files that the catalogue of a study knows, and that have not changed since by size and time, are not opened.
    A catalogue that is missing or behind is written again, unless a study is running there.

    Parameters
    ----------
    thorough : read every file to the last byte.

    Raises
    ------
    ValueError
        when there is no such folder.
    """
    folder = as_path("folder", folder)
    try:
        if not folder.is_dir():
            raise ValueError("no folder")
        next(folder.iterdir(), None)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"folder: expected a folder with results, got '{folder}' ({why})") from None
    drop_leftovers(folder)
    known = read_catalogue(folder)
    entries = scan(folder, {} if thorough else known, thorough)
    plan = read_plan(folder)
    names = {e.file for e in entries}
    planned = [t for t in plan.get("tasks", []) if t["file"] not in names and f"{t['file'][:-3]}/" not in names]
    entries += [_absent(folder, task) for task in planned]
    if plan and known != {e.file: e for e in entries}:
        _write_catalogue(folder, entries)
    files = {e.file for e in entries}
    others = sum(1 for p in folder.iterdir() if p.is_file() and not p.name.startswith(".") and p.name not in files)
    return Listing(folder, str(plan.get("name", "")), tuple(entries), others - sum((folder / n).exists() for n in OWN))


OWN = (PLAN, NAME)


def drop_leftovers(folder: Path) -> None:
    """Remove what kills have left: the curves of results that are complete, and half-written files of old.

    What another process is working on is left alone, and so is everything in a folder that cannot be written.
    """
    try:
        remove_partials(folder)
        for curves in [p for p in folder.iterdir() if p.is_dir() and not p.name.startswith(".")]:
            data = curves.with_name(f"{curves.name}.h5")
            if settings_in(curves) is not None and data.exists():
                clear_leftover(data, inspect_file(data).settings)
    except OSError:
        return


def scan(folder: Path, known: Mapping[str, Entry], thorough: bool = False) -> list[Entry]:
    """Results and unfinished results in a folder, in order of file name, numbers by their size."""
    found = []
    for path in sorted(folder.iterdir(), key=_by_number):
        if path.name.startswith("."):
            continue
        with suppress(FileNotFoundError):  # renamed or removed meanwhile by a run that has finished it
            found += [entry] if (entry := _inspect(path, known, thorough)) is not None else []
    return found


def _inspect(path: Path, known: Mapping[str, Entry], thorough: bool) -> Entry | None:
    """The result or unfinished result that a file or folder holds, if any."""
    if path.is_dir():
        return inspect_work(path)
    if path.suffix == ".h5":
        return _known(path, known.get(path.name)) or inspect_file(path, thorough)
    if path.suffix == ".json" and path.name != PLAN and not path.with_suffix(".h5").exists():
        return _inspect_json(path)
    return None


def _by_number(path: Path) -> list[str | float]:
    """Key of sorting by name: slice-5.h5 before slice-27.5.h5 before slice-30.h5."""
    parts = re.split(r"(\d+(?:\.\d+)?)", path.name)
    return [float(part) if i % 2 else part for i, part in enumerate(parts)]


def _known(path: Path, entry: Entry | None) -> Entry | None:
    """What the catalogue says of a file, if that has not changed since."""
    now = path.stat()
    same = entry is not None and (entry.size, entry.mtime_ns) == (now.st_size, now.st_mtime_ns)
    return entry if same else None


def _inspect_json(path: Path) -> Entry | None:
    """A result that is there as JSON only, as `rodatlas states --json FILE` writes it."""
    now = path.stat()
    try:
        data = json.loads(path.read_text())
        schema = data["schema"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if not isinstance(schema, str):
        return None
    kind = schema.removeprefix("rodatlas/").rpartition("/")[0]
    contents = f"{len(data['states'])} states" if isinstance(data.get("states"), list) else ""
    settings = {k: data[k] for k in ("angle_deg", "shear", "compression", "poisson") if data.get(k) is not None}
    if isinstance(clamps := data.get("setting"), dict):
        settings |= {k: clamps[k] for k in ("angle_left", "angle_right", "offset", "twist") if clamps.get(k)}
    bounds = data.get("shear_range")
    if isinstance(bounds, list) and len(bounds) == 2:
        settings |= dict(zip(("shear_min", "shear_max"), bounds, strict=True))
    return Entry(path.name, kind, "complete", settings, contents, size=now.st_size, mtime_ns=now.st_mtime_ns)


def _absent(folder: Path, task: Mapping[str, Any]) -> Entry:
    """What is planned and not there: failed with its reason, or missing."""
    error = failure_of(folder, task["file"][:-3])
    return Entry(task["file"], task["kind"], "failed" if error else "missing", task["settings"], detail=error)


def read_plan(folder: Path) -> dict[str, Any]:
    """What the last study in a folder has planned; empty without one."""
    try:
        plan = json.loads((folder / PLAN).read_text())
        return plan if isinstance(plan, dict) and all(map(_is_planned, plan.get("tasks", []))) else {}
    except TypeError:
        return {}
    except (OSError, ValueError, RecursionError):
        return {}


def _is_planned(task: Any) -> bool:
    """Whether an entry of a plan is what a study writes."""
    texts = isinstance(task, dict) and all(isinstance(task.get(name), str) for name in ("file", "kind"))
    return texts and isinstance(task.get("settings"), dict)


def _write_catalogue(folder: Path, entries: list[Entry]) -> None:
    """Write the catalogue unless the folder is held by a study or cannot be written."""
    try:
        with alone_in(folder):
            Catalogue(folder, entries)
    except (ValueError, OSError):
        return
