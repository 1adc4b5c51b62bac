"""The catalogue of a study folder: one row for each result in an SQLite file.

It only repeats what the result files say, and is made again from them when it is missing, damaged or behind. Only the
process that holds the folder (see :func:`rodatlas.files.alone_in`) writes it.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import fields
from pathlib import Path

from rodatlas.atlas.study.inspection import Entry

NAME = "catalogue.sqlite"
VERSION = 1
COLUMNS = tuple(f.name for f in fields(Entry))
CREATE = (
    "CREATE TABLE IF NOT EXISTS results (file TEXT PRIMARY KEY, kind TEXT, status TEXT, settings TEXT, contents TEXT, "
    "warnings INTEGER, seconds REAL, size INTEGER, mtime_ns INTEGER, detail TEXT)"
)


def read_catalogue(folder: Path) -> dict[str, Entry]:
    """The rows of a catalogue by file; none where it is missing, damaged or of another version."""
    path = folder / NAME
    if not path.exists():
        return {}
    try:
        with closing(sqlite3.connect(path.resolve().as_uri() + "?mode=ro", uri=True)) as connection:
            if connection.execute("PRAGMA user_version").fetchone() != (VERSION,):
                return {}
            rows = connection.execute(f"SELECT {', '.join(COLUMNS)} FROM results").fetchall()
            return {row[0]: _from_row(row) for row in rows}
    except (sqlite3.Error, ValueError):
        return {}


class Catalogue:
    """Writes the catalogue of a folder; a full disk or a damaged catalogue costs no result.

    Parameters
    ----------
    entries : what the folder holds; the rows are replaced by these.
    warn : told once, in a line, when it cannot be written.
    """

    def __init__(self, folder: Path, entries: Iterable[Entry], warn: Callable[[str], None] = lambda line: None):
        self._path, self._warn, self._works = folder / NAME, warn, True
        rows = [_to_row(entry) for entry in entries]
        try:
            self._replace(rows)
        except sqlite3.DatabaseError:  # damaged
            self._path.unlink(missing_ok=True)
            self._safely(lambda: self._replace(rows))

    def __repr__(self) -> str:
        return f"Catalogue({self._path})"

    def record(self, entry: Entry) -> None:
        """Write one row, instead of that of the same file."""
        self._safely(lambda: self._write([_to_row(entry)]))

    def _safely(self, write: Callable[[], None]) -> None:
        try:
            write()
        except (sqlite3.Error, OSError) as error:
            if self._works:
                self._works = False
                self._warn(f"{self._path} cannot be written ({error}); it is made again from the results later")

    def _replace(self, rows: list[tuple[object, ...]]) -> None:
        with closing(sqlite3.connect(self._path)) as connection, connection:
            connection.execute("DROP TABLE IF EXISTS results")
            connection.execute(CREATE)
            connection.execute(f"PRAGMA user_version = {VERSION}")
            connection.executemany(_INSERT, rows)

    def _write(self, rows: list[tuple[object, ...]]) -> None:
        with closing(sqlite3.connect(self._path)) as connection, connection:
            connection.executemany(_INSERT, rows)


_INSERT = f"INSERT OR REPLACE INTO results ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})"


def _to_row(entry: Entry) -> tuple[object, ...]:
    values = {name: getattr(entry, name) for name in COLUMNS}
    return tuple((values | {"settings": json.dumps(entry.settings)}).values())


def _from_row(row: tuple[object, ...]) -> Entry:
    values = dict(zip(COLUMNS, row, strict=True))
    return Entry(**(values | {"settings": json.loads(str(values["settings"]))}))  # type: ignore[arg-type]
