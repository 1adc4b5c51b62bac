"""What a worker process does: compute one task in the folder of a study and report."""

from __future__ import annotations

import errno
import json
import os
import socket
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rodatlas import __version__
from rodatlas.atlas.study.folder import PLAN, run_of
from rodatlas.atlas.study.kinds.base import Workplace
from rodatlas.atlas.study.task import Task
from rodatlas.files import write_text

PATIENCE = 5.0  # seconds for a file of another machine to appear in a shared folder
PERIOD = 0.5  # seconds between two notes of progress


@dataclass(frozen=True)
class Ticket:
    """One task as sent to a worker.

    Attributes
    ----------
    folder : of the study, as this worker and the coordinator both see it.
    run : what `study.json` in that folder must say, so that a worker that sees another folder is noticed; empty where
        coordinator and worker are on one machine.
    progress : folder for notes of progress.
    version : of the coordinator's program.
    """

    task: Task
    folder: Path
    progress: Path
    run: str = ""
    version: str = __version__


@dataclass(frozen=True)
class Report:
    """What a worker says of a task that it is done with.

    Attributes
    ----------
    error : one line, empty when all went well.
    trace : the traceback of the error.
    disk_full : whether there was no space left.
    notes : what else the user should know.
    """

    worker: str
    seconds: float
    error: str = ""
    trace: str = ""
    disk_full: bool = False
    notes: tuple[str, ...] = ()


def perform(ticket: Ticket) -> Report:
    """Compute a task; whatever goes wrong comes back as a report, so that every executor can carry it."""
    begin = time.perf_counter()
    notes: list[str] = []
    who = worker_name()
    try:
        check_place(ticket.folder, ticket.run, ticket.version)
        task, note = ticket.task, ProgressNote(ticket.progress / f"{ticket.task.stem}.json")
        try:
            task.kind.compute(task.settings, Workplace(ticket.folder, task.stem, note, notes.append, task.fresh))
        finally:
            note.remove()
    except Exception as error:
        line = f"{type(error).__name__}: {' '.join(str(error).split())}"
        full = no_space(error)
        return Report(who, time.perf_counter() - begin, line, traceback.format_exc(), full, tuple(notes))
    return Report(who, time.perf_counter() - begin, notes=tuple(notes))


def worker_name() -> str:
    """Host and process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def check_place(folder: Path, run: str, version: str = __version__) -> None:
    """Whether this process sees the folder of a study and runs the same program.

    Raises
    ------
    RuntimeError
        when it does not; the message names this worker.
    """
    if version != __version__:
        raise RuntimeError(f"worker {worker_name()} runs rodatlas {__version__}, this study runs {version}")
    end = time.monotonic() + PATIENCE
    while run and run_of(folder) != run and time.monotonic() < end:
        time.sleep(0.2)
    if run and run_of(folder) != run:
        raise RuntimeError(
            f"worker {worker_name()} does not see the folder {folder} of the study ({PLAN} is not there or another's); "
            f"results go through a folder that all workers share"
        )


def no_space(error: BaseException | None) -> bool:
    """Whether an error, or what caused it, is a full disk; HDF5 tells it in words only."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            return True
        if "No space left on device" in str(error) or f"errno = {errno.ENOSPC}," in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False


class ProgressNote:
    """Writes what a worker is doing into a small file, at most twice a second; a disk that is full does not matter."""

    def __init__(self, path: Path):
        self._path, self._next = path, 0.0
        self("starting", 0, 0)

    def __call__(self, message: str, done: int, pending: int) -> None:
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PERIOD
        with suppress(OSError):
            self._path.parent.mkdir(exist_ok=True)
            text = {"worker": worker_name(), "message": message, "done": done, "pending": pending}
            write_text(self._path, json.dumps(text))

    def remove(self) -> None:
        """The task is over."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
