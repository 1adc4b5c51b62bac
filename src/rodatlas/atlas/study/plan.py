"""A study: a name and the tasks that belong to it."""

from __future__ import annotations

import json
import os
import uuid
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rodatlas.atlas.study.cluster_settings import ClusterSettings
from rodatlas.atlas.study.folder import PLAN
from rodatlas.atlas.study.kinds.base import Settings
from rodatlas.atlas.study.task import Task, task_of, with_requirements
from rodatlas.continuation.checks import check_each, check_type
from rodatlas.files import write_text

SCHEMA = "rodatlas/study-plan/1"


@dataclass(frozen=True)
class Study:
    """Results that are wanted.

    Attributes
    ----------
    name : for tables and progress.
    tasks : each once, and what one requires before it.
    retries : how often a task is tried again after a failure.
    cluster : where it is to be computed, None for this machine.
    """

    name: str
    tasks: tuple[Task, ...]
    retries: int = 2
    cluster: ClusterSettings | None = None

    @classmethod
    def of(cls, name: str, settings: Iterable[Settings], retries: int = 2) -> Study:
        """The study of the results for some settings: of slices, loci, searches for states, in any mixture."""
        check_type("name", name, str, "a name for the study")
        check_each("settings", settings, object, "a sequence of settings such as [SliceSettings(15.0)]")
        return cls(name, with_requirements(map(task_of, settings)), retries)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """Read a study file (TOML); see :func:`rodatlas.atlas.study.studyfile.read_study`."""
        from rodatlas.atlas.study.studyfile import read_study

        return read_study(Path(path))

    def __repr__(self) -> str:
        counts = Counter(task.kind.name for task in self.tasks)
        return f"Study({self.name!r}: {', '.join(f'{n} {kind}' for kind, n in counts.items()) or 'no tasks'})"


def write_plan(folder: Path, study: Study) -> str:
    """Record in a folder what is planned, and a mark by which workers know the folder; the mark."""
    from rodatlas import __version__

    run = uuid.uuid4().hex
    tasks = [{"kind": t.kind.name, "file": t.file, "settings": t.settings.identity()} for t in study.tasks]
    plan = {"schema": SCHEMA, "rodatlas": __version__, "name": study.name, "run": run, "tasks": tasks}
    write_text(folder / PLAN, json.dumps(plan, indent=1) + "\n")
    return run
