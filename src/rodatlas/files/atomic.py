"""Writing a file at once: a reader sees the old one or the new one, never a part."""

from __future__ import annotations

import os
import re
import shutil
import time
import uuid
from collections.abc import Callable
from pathlib import Path

PARTIAL = ".partial"  # end of the names of hidden files and folders that are being written or removed
MADE = re.compile(rf"\.(?P<of>.+)\.[0-9a-z_]{{8,12}}{re.escape(PARTIAL)}", re.DOTALL)  # as here, or by `tempfile`
STALE = 3600.0  # seconds without a change after which one of unknown origin was left by a kill: writing takes seconds


def partial_of(path: Path) -> Path:
    """A hidden name in the same folder, that no other process uses."""
    return path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}{PARTIAL}")


def replace_file(path: str | os.PathLike[str], content: bytes) -> Path:
    """Write bytes under another name in the same folder, and rename.

    Raises
    ------
    OSError
        when that is not possible; an older file is untouched then.
    """
    target = Path(path)
    partial = partial_of(target)
    try:
        partial.write_bytes(content)
        os.replace(partial, target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from None
    finally:
        partial.unlink(missing_ok=True)
    return target


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """As :func:`replace_file`, with text in UTF-8."""
    return replace_file(path, text.encode("utf-8"))


def remove_folder(folder: Path) -> None:
    """Remove a folder and all in it; its name is free at once, and what a kill leaves is a partial."""
    gone = partial_of(folder)
    os.replace(folder, gone)
    shutil.rmtree(gone, ignore_errors=True)


def anything(name: str) -> bool:
    """True of every name."""
    return True


def remove_partials(folder: Path, older_than: float = STALE, of: Callable[[str], bool] = anything) -> None:
    """Remove what a kill has left of files that were being written, and of folders that were being removed.

    Parameters
    ----------
    older_than : seconds without a change; zero only where nobody else can be writing.
    of : whether it is meant, by the name of what was to be written or removed.
    """
    limit = time.time() - older_than
    for path in folder.glob(f".*{PARTIAL}"):
        made = MADE.fullmatch(path.name)
        if made is None or not of(made["of"]):
            continue
        try:
            if path.stat().st_mtime > limit:
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()
        except FileNotFoundError:
            continue  # renamed or removed meanwhile
