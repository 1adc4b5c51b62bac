"""What became of the tasks of a study, and what is told while it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.study.task import Task

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/study/1"


class Status(Enum):
    """What became of a task."""

    DONE = "done"
    REUSED = "reused"
    FAILED = "failed"
    SKIPPED = "skipped"
    """Something that it requires failed, or the disk was full."""


@dataclass(frozen=True)
class Outcome:
    """What became of one task.

    Attributes
    ----------
    attempts : how often it was started.
    seconds : of the attempt that ended it.
    error : one line, why it failed or was skipped.
    """

    task: Task
    status: Status
    attempts: int = 0
    seconds: float = 0.0
    error: str = ""

    @property
    def good(self) -> bool:
        """Whether its result is there."""
        return self.status in (Status.DONE, Status.REUSED)

    def __repr__(self) -> str:
        return f"Outcome({self.task.stem}: {self.status.value}{', ' + self.error if self.error else ''})"


@dataclass(frozen=True)
class Event:
    """Something that happened while a study runs.

    Attributes
    ----------
    kind : 'reused', 'working' (with how far it is), 'done', 'retry', 'failed', 'skipped' or 'note'.
    message : what the task is doing, or what went wrong, in one line.
    done, pending : parts of the task that are finished and known to be left, while it is working.
    """

    kind: str
    task: Task | None
    message: str = ""
    done: int = 0
    pending: int = 0


Listener = Callable[[Event], None]


def ignore(event: Event) -> None:
    """A listener that says nothing."""


@dataclass(frozen=True)
class StudyResult:
    """What became of a study.

    Attributes
    ----------
    outcomes : one for each task, in the order of the study.
    seconds : wall time of this run.
    """

    name: str
    folder: Path
    outcomes: tuple[Outcome, ...]
    seconds: float

    @property
    def failed(self) -> tuple[Outcome, ...]:
        """Tasks without a result."""
        return tuple(o for o in self.outcomes if not o.good)

    def __repr__(self) -> str:
        counts = ", ".join(f"{n} {s.value}" for s in Status if (n := sum(o.status is s for o in self.outcomes)))
        return f"StudyResult({self.name!r}: {counts or 'no tasks'}; {self.seconds:.1f} s, in {self.folder})"

    def path(self, settings: Any) -> Path:
        """The file of the result for some settings.

        Raises
        ------
        KeyError
            when the study has no such task.
        """
        for o in self.outcomes:
            if o.task.settings == settings:
                return self.folder / o.task.file
        raise KeyError(f"{settings!r} is no task of the study '{self.name}'")

    def rows(self) -> list[dict[str, Any]]:
        """One plain row for each task."""
        return [
            {
                "kind": o.task.kind.name, "file": o.task.file, "status": o.status.value, "attempts": o.attempts,
                "seconds": o.seconds, "error": o.error, "settings": o.task.settings.identity(),
            }
            for o in self.outcomes
        ]  # fmt: skip

    def to_frame(self) -> Table:
        """One row for each task; settings in columns of their own."""
        from rodatlas.continuation.table import Table

        return Table([{**{k: v for k, v in r.items() if k != "settings"}, **r["settings"]} for r in self.rows()])

    def to_json(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "schema": SCHEMA, "name": self.name, "folder": str(self.folder), "seconds": self.seconds,
            "tasks": self.rows(),
        }  # fmt: skip
