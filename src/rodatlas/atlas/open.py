"""Open a result file without knowing what it holds."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.slices.result import Slice
from rodatlas.continuation import Branch, Locus, Solution
from rodatlas.states.discover import Discovery
from rodatlas.states.store import load_discovery

Result = Solution | Branch | Locus | Slice | Loci | Discovery
KINDS: dict[str, Callable[[Path], Result]] = {
    "rodatlas/solution": Solution.load, "rodatlas/branch": Branch.load, "rodatlas/locus": Locus.load,
    "rodatlas/slice": Slice.load, "rodatlas/loci": Loci.load, "rodatlas/states": load_discovery,
}  # fmt: skip


def open_result(path: str | os.PathLike[str]) -> Result:
    """The solution, branch, locus, slice, set of loci or found states in an HDF5 file of this program.

    Raises
    ------
    ValueError
        when there is no such file, or it is damaged, or holds something else: one line that names the file.
    """
    import h5py

    where = Path(path)
    expected = f"{where}: expected an HDF5 file written by rodatlas ({', '.join(k[9:] for k in KINDS)}), got"
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
    if schema not in KINDS:
        raise ValueError(f"{expected} {f'the schema {schema!r}' if schema else 'an HDF5 file without a schema'}")
    return KINDS[schema](where)
