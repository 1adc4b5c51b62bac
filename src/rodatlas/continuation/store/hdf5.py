"""HDF5 files that are replaced atomically and checked when read, and the arrays and names in them."""

from __future__ import annotations

import errno
import os
import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import as_path

if TYPE_CHECKING:
    import h5py

VERSION = 2
# What reading raises where something is missing, cut off, of another shape or type, or no JSON
DAMAGE = (OSError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RuntimeError)


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
        when the file is damaged, holds something else, or is of another version; it names the file, what was
        expected and what came.
    """
    import h5py

    if not as_path("path", path).exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    expected = f"{path}: expected a '{schema}' file of version {version}, got"
    with ExitStack() as stack:
        try:
            file = stack.enter_context(h5py.File(path, "r"))
            found, number = _text(file.attrs.get("schema", "")), file.attrs.get("version", None)
        except DAMAGE as error:
            raise _damaged(expected, error) from error
        if found != schema:
            raise ValueError(f"{expected} {f'schema {found!r}' if found else 'an HDF5 file without a schema'}")
        if not isinstance(number, (int, np.integer)) or number != version:
            raise ValueError(f"{expected} version {number}: read it with the rodatlas that wrote it, or compute again")
        try:
            yield file
        except DAMAGE as error:
            raise _damaged(expected, error) from error


def _damaged(expected: str, error: Exception) -> ValueError:
    """What is told of a file whose content makes no sense."""
    detail = " ".join(str(error).strip("'\"").split()) or type(error).__name__
    return ValueError(f"{expected} a damaged file ({detail})")


def put_array(group: h5py.Group, name: str, array: np.ndarray) -> None:
    """A dataset whose checksum makes damage show when it is read."""
    array = np.ascontiguousarray(array)
    if array.size == 0:
        group.create_dataset(name, data=array)
    else:
        group.create_dataset(name, data=array, chunks=array.shape, fletcher32=True)


def put_each(
    group: h5py.Group, items: Sequence[object], names: Iterable[str], kind: type[Any] = float, size: int | None = None
) -> None:  # fmt: skip
    """Attributes of some items, a dataset for each name: numbers, or `size` of them an item."""
    for name in names:
        values = np.array([getattr(item, name) for item in items], kind)
        put_array(group, name, values if size is None else values.reshape(-1, size))


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


def _sync(path: Path) -> None:
    """Flush a file, or the entries of a folder, to disk; folders cannot be opened on Windows."""
    if path.is_dir() and os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
