"""What lies in a folder: results of any command, whether they are complete, and what they hold."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.results import with_schema
from rodatlas.atlas.study.integrity import read_everything
from rodatlas.atlas.study.kinds import KINDS
from rodatlas.atlas.unfinished import settings_in
from rodatlas.continuation.store.hdf5 import DAMAGE

if TYPE_CHECKING:
    import h5py


@dataclass(frozen=True)
class Entry:
    """One result in a folder.

    Attributes
    ----------
    file : its name; that of a folder, with a slash, where branches of an unfinished result lie.
    kind : 'slice', 'loci', 'states', ...; the schema of a file that this program has no kind for.
    status : 'complete', 'partial', 'damaged', 'failed' or 'missing'.
    settings : everything that decided the numbers, with the version of the program; empty where a file lacks it.
    contents : what is in it, in a few words.
    warnings : how many it holds, None where it keeps none.
    seconds : that it took to compute, None where it is not known.
    size, mtime_ns : of the file, by which a change of it is noticed.
    detail : what is wrong.
    """

    file: str
    kind: str
    status: str
    settings: dict[str, Any] = field(default_factory=dict)
    contents: str = ""
    warnings: int | None = None
    seconds: float | None = None
    size: int = 0
    mtime_ns: int = 0
    detail: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {key: getattr(self, key) for key in self.__dataclass_fields__ if key != "mtime_ns"}


def inspect_file(path: Path, thorough: bool = False) -> Entry:
    """What is in an HDF5 file of any command.

    Parameters
    ----------
    thorough : read all of it, so that damage anywhere shows; else only its head, which tells a truncated file.
    """
    import h5py

    known = path.stat()
    if thorough and (error := read_everything(path)):
        return Entry(path.name, "?", "damaged", size=known.st_size, mtime_ns=known.st_mtime_ns, detail=error)
    try:
        with h5py.File(path, "r") as file:
            return _entry(path.name, file, known.st_size, known.st_mtime_ns)
    except DAMAGE as error:
        line = " ".join(str(error).split()) or type(error).__name__
        return Entry(path.name, "?", "damaged", size=known.st_size, mtime_ns=known.st_mtime_ns, detail=line)


def _entry(name: str, file: h5py.File, size: int, mtime_ns: int) -> Entry:
    schema = str(file.attrs.get("schema", "other HDF5"))
    kind = with_schema(schema)
    contents = kind.contents(file) if kind is not None else ""
    warnings = len(json.loads(file.attrs["warnings"])) if "warnings" in file.attrs else None
    seconds = float(file.attrs["seconds"]) if "seconds" in file.attrs else None
    called = kind.word if kind is not None else schema
    settings = json.loads(file.attrs.get("identity", "{}"))
    return Entry(name, called, "complete", settings, contents, warnings, seconds, size, mtime_ns)


def inspect_work(folder: Path) -> Entry | None:
    """The unfinished result whose curves lie in a folder; None of any other folder."""
    settings = settings_in(folder)
    if settings is None:
        return None
    files = [path.stat() for path in folder.glob("*.h5")]
    kind = next((k for k in KINDS if set(settings) >= {f.name for f in fields(k.settings)}), None)
    called, parts = ("?", "parts") if kind is None else (kind.name, kind.result.parts)
    return Entry(
        f"{folder.name}/", called, "partial", settings, f"{len(files)} {parts} finished",
        size=sum(f.st_size for f in files), mtime_ns=max((f.st_mtime_ns for f in files), default=0),
    )  # fmt: skip
