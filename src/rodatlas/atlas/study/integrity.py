"""Whether an HDF5 file can be read to the last byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rodatlas.continuation.store.hdf5 import DAMAGE


def read_everything(path: Path) -> str:
    """Read every dataset and attribute of an HDF5 file, whose checksums tell damage; what is wrong, or nothing."""
    import h5py

    def visit(name: str, item: Any) -> None:
        dict(item.attrs)
        if isinstance(item, h5py.Dataset):
            item[()]

    try:
        with h5py.File(path, "r") as file:
            dict(file.attrs)
            file.visititems(visit)
    except DAMAGE as error:
        return " ".join(str(error).split()) or type(error).__name__
    return ""
