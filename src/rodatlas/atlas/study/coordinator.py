"""Hands tasks to an executor, looks after them, and decides what a failure means for the others."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from rodatlas.atlas.study.outcome import Event, Listener, Outcome, Status
from rodatlas.atlas.study.task import Task
from rodatlas.atlas.study.worker import Report, Ticket, perform

POLL = 0.25  # seconds between two looks at the notes of progress
DIED = "the worker process died (killed, out of memory, or crashed)"
FINAL = ("KilledWorker",)  # Dask has retried these itself; also those that only waited on the workers that died


class Executor(Protocol):
    """Anything with `submit`; one with an integer attribute `capacity` gets no more calls at a time."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Start a call."""
        ...


@dataclass
class Coordinator:
    """Runs tasks to the end, each at most `retries` + 1 times.

    Attributes
    ----------
    folder : that of the study.
    run : mark of this run in the folder, empty when nobody needs to check it.
    progress : folder of the notes of progress.
    check : says what is wrong with the file of a task that a worker reports as done, empty when it is right.
    kept : called with each outcome as soon as it is known.
    tell : told what happens.
    """

    executor: Executor
    folder: Path
    progress: Path
    run: str = ""
    retries: int = 2
    check: Callable[[Task], str] = lambda task: ""
    kept: Callable[[Outcome, str], None] = lambda outcome, trace: None
    tell: Listener = lambda event: None
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    _running: dict[Future[Report], Task] = field(default_factory=dict)
    _attempts: dict[str, int] = field(default_factory=dict)
    _notes: dict[str, str] = field(default_factory=dict)
    _stop: str = ""

    def compute(self, tasks: Iterable[Task]) -> None:
        """Compute tasks that are in order: what one requires comes before it or has its outcome already."""
        waiting = list(tasks)
        while waiting or self._running:
            waiting = self._start(waiting)
            if not self._running:
                continue
            finished, _ = wait(self._running, POLL, FIRST_COMPLETED)
            for future in finished:
                task = self._running.pop(future)
                again = self._finish(task, future)
                waiting = [task, *waiting] if again else waiting
            self._look()

    def _start(self, waiting: list[Task]) -> list[Task]:
        """Submit what is ready, settle what can never be; the tasks that still wait."""
        left: list[Task] = []
        unsettled = {t.stem for t in waiting} | {t.stem for t in self._running.values()}
        for task in waiting:
            lost = [s for s in task.requires if s in self.outcomes and not self.outcomes[s].good]
            if self._stop or lost:
                self._settle(task, Status.SKIPPED, self._stop or f"requires {lost[0]}, which failed")
                unsettled.discard(task.stem)
            elif self._full() or any(s in unsettled for s in task.requires):
                left.append(task)
            else:
                self._submit(task)
        return left

    def _full(self) -> bool:
        return len(self._running) >= getattr(self.executor, "capacity", len(self._running) + 1)

    def _submit(self, task: Task) -> None:
        self._attempts[task.stem] = self._attempts.get(task.stem, 0) + 1
        with suppress(OSError):
            self._note(task).unlink(missing_ok=True)  # of a worker that died
        try:
            future = self.executor.submit(perform, Ticket(task, self.folder, self.progress, self.run))
        except Exception as error:
            self._stop = f"no worker takes tasks: {_line(error)}"
            self._settle(task, Status.FAILED, self._stop)
            return
        self._running[future] = task

    def _finish(self, task: Task, future: Future[Report]) -> bool:
        """Settle a task whose call has ended; whether it is to be started again."""
        self._notes.pop(task.stem, None)
        final = False
        try:
            report = future.result()
        except (Exception, CancelledError) as lost:
            final = type(lost).__name__ in FINAL and self._note(task).exists()  # had begun
            broken = isinstance(lost, BrokenExecutor)
            report = Report("", 0.0, DIED if broken else f"its worker was lost ({_line(lost)})")
        for note in report.notes:
            self.tell(Event("note", task, note))
        error = report.error or self.check(task)
        if not error:
            self._settle(task, Status.DONE, "", report.seconds)
            return False
        if self._attempts[task.stem] <= self.retries and not final:
            self.tell(Event("retry", task, error))
            return True
        self._settle(task, Status.FAILED, error, report.seconds, report.trace)
        if report.disk_full:
            self._stop = f"no space left in {self.folder}; the same command goes on once there is"
        return False

    def _settle(self, task: Task, status: Status, error: str, seconds: float = 0.0, trace: str = "") -> None:
        outcome = Outcome(task, status, self._attempts.get(task.stem, 0), seconds, error)
        self.outcomes[task.stem] = outcome
        self.kept(outcome, trace)
        self.tell(Event(status.value, task, error))

    def _note(self, task: Task) -> Path:
        """The note of progress of a task that has begun."""
        return self.progress / f"{task.stem}.json"

    def _look(self) -> None:
        """Tell how far the running tasks are, from the notes of the workers."""
        for task in self._running.values():
            try:
                text = self._note(task).read_text()
                note = json.loads(text)
            except (OSError, ValueError):
                continue
            if text != self._notes.get(task.stem):
                self._notes[task.stem] = text
                self.tell(Event("working", task, note["message"], note["done"], note["pending"]))


def _line(error: BaseException) -> str:
    """Type and message of an error in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
