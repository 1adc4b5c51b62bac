"""The folder of a study: who works in it, what is planned, and what kills and damage leave behind."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rodatlas.atlas.slices.cache import write_text
from rodatlas.atlas.study.integrity import read_everything

PLAN = "study.json"
LOCK = ".study.lock"
PROGRESS = ".progress"
ASIDE = ".damaged"
FAILURE = ".error.txt"


def run_of(folder: Path) -> str:
    """The mark of the run that is recorded in a folder, empty without one."""
    try:
        return str(json.loads((folder / PLAN).read_text())["run"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ""


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder for one coordinator; the system lets go of it when the process ends, however it does.

    Raises
    ------
    ValueError
        when another process holds it.
    """
    with open(folder / LOCK, "a+b") as file:
        try:
            _lock(file.fileno())
        except OSError:
            raise ValueError(f"out: expected a folder that no other study is running in, got {folder}") from None
        yield


def _lock(descriptor: int) -> None:
    """An exclusive lock, or OSError at once."""
    if os.name == "nt":
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
    else:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def drop_damaged(folder: Path, say: Callable[[str], None]) -> None:
    """Remove unreadable curves of an unfinished result, so that they are computed again; say which."""
    for path in sorted(folder.glob("*.h5")):
        error = read_everything(path)
        if error:
            say(f"{path.parent.name}/{path.name} is damaged ({error}) and is computed again")
            path.unlink()


def set_aside(path: Path) -> Path:
    """Rename a file that cannot be used; its new name."""
    aside = path.with_name(path.name + ASIDE)
    os.replace(path, aside)
    return aside


def write_failure(folder: Path, stem: str, error: str, trace: str) -> None:
    """Keep why a task failed: a line and the traceback, in a text file beside the results."""
    write_text(folder / f"{stem}{FAILURE}", f"{error}\n\n{trace}")


def failure_of(folder: Path, stem: str) -> str:
    """Why a task failed when it was last tried, in one line; empty if it did not."""
    try:
        return (folder / f"{stem}{FAILURE}").read_text().partition("\n")[0]
    except OSError:
        return ""


def forget_failure(folder: Path, stem: str) -> None:
    """The task has its result now."""
    (folder / f"{stem}{FAILURE}").unlink(missing_ok=True)
