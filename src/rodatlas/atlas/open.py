"""Open a result file without knowing what it holds."""

from __future__ import annotations

import os
from pathlib import Path

from rodatlas.atlas.results import RESULTS, Result, with_schema


def open_result(path: str | os.PathLike[str]) -> Result:
    """The result in an HDF5 file of this program: of any kind in :data:`rodatlas.atlas.results.RESULTS`.

    Raises
    ------
    ValueError
        when there is no such file, or it is damaged, or holds something else: one line that names the file.
    """
    import h5py

    where = Path(path)
    expected = f"{where}: expected an HDF5 file written by rodatlas ({', '.join(k.word for k in RESULTS)}), got"
    try:
        if not where.exists():
            raise ValueError(f"{expected} no such file")
        if where.is_dir():
            raise ValueError(f"{expected} a folder")
        with h5py.File(where, "r") as file:
            found = file.attrs.get("schema", "")
    except OSError as error:
        raise ValueError(f"{expected} a file of another kind, or a damaged one ({error})") from None
    schema = found.decode() if isinstance(found, bytes) else str(found)
    kind = with_schema(schema)
    if kind is None:
        raise ValueError(f"{expected} {f'the schema {schema!r}' if schema else 'an HDF5 file without a schema'}")
    opened: Result = kind.load(where)
    return opened
