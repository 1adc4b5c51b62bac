"""A task: one result file to be computed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rodatlas.atlas.study.kinds import kind_of
from rodatlas.atlas.study.kinds.base import Kind, Settings


@dataclass(frozen=True)
class Task:
    """One result to be computed.

    Attributes
    ----------
    kind : what it is.
    settings : everything that decides its numbers.
    stem : name of its files without suffix.
    requires : stems of tasks that must be finished before.
    fresh : compute everything again, even what is there.
    """

    kind: Kind
    settings: Settings
    stem: str
    requires: tuple[str, ...] = ()
    fresh: bool = False

    @property
    def file(self) -> str:
        """Name of the file of its result."""
        return f"{self.stem}.h5"

    def __repr__(self) -> str:
        return f"Task({self.stem})"


def task_of(settings: Settings, kind: Kind | None = None) -> Task:
    """The task that computes a result; its kind follows from the class of the settings.

    Raises
    ------
    ValueError
        when no kind of task has such settings.
    """
    kind = kind_of(settings) if kind is None else kind
    needs = tuple(kind_of(s).file_stem(s) for s in kind.requires(settings))
    return Task(kind, settings, kind.file_stem(settings), needs)


def with_requirements(tasks: Iterable[Task]) -> tuple[Task, ...]:
    """Tasks, each once, with those that they require before them."""
    found: dict[str, Task] = {}

    def add(task: Task) -> None:
        if task.stem in found:
            return
        for settings in task.kind.requires(task.settings):
            add(task_of(settings))
        found[task.stem] = task

    for task in tasks:
        add(task)
    return tuple(found.values())
