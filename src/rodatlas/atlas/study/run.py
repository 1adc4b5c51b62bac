"""Run a study in a folder: find what is there, compute what is missing, keep account."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rodatlas.atlas.study.catalogue import Catalogue, read_catalogue
from rodatlas.atlas.study.coordinator import Coordinator, Executor
from rodatlas.atlas.study.folder import FAILURE, PLAN, PROGRESS, forget_failure, write_failure
from rodatlas.atlas.study.inspection import Entry, inspect_file
from rodatlas.atlas.study.listing import drop_leftovers, scan
from rodatlas.atlas.study.local import LocalExecutor
from rodatlas.atlas.study.outcome import Event, Listener, Outcome, Status, StudyResult, ignore
from rodatlas.atlas.study.plan import Study, write_plan
from rodatlas.atlas.study.task import Task
from rodatlas.continuation.checks import as_path, check_type
from rodatlas.files import alone_in, remove_partials, set_aside

PATIENCE = 10.0  # seconds for a file that a worker on another machine has written to appear here


def run_study(
    study: Study, folder: str | os.PathLike[str], *, workers: int | None = None, scheduler: str = "",
    executor: Executor | None = None, listen: Listener = ignore,
) -> StudyResult:  # fmt: skip
    """Compute what a study lacks in a folder.

    What is finished stays, whatever happens: a kill, Ctrl-C or a full disk costs at most the branches in work. A file
    is taken as a result only if it reads to the last byte and was computed for the same settings, tolerance and
    version; a damaged one is renamed and computed again. A script that calls this must guard its main part by
    ``if __name__ == "__main__":``, as always where processes are started.

    Parameters
    ----------
    folder : made when missing; the workers must see it under the same path.
    workers : processes on this machine; as many as it has processors when left out.
    scheduler : address of a Dask scheduler, 'tcp://host:8786', whose workers are used instead.
    executor : anything with `submit` that gives :class:`concurrent.futures.Future`, instead of both.
    listen : told what happens, see :class:`rodatlas.atlas.study.outcome.Event`.

    Returns
    -------
    StudyResult
        What became of each task. A task that fails stops only those that require it.

    Raises
    ------
    ValueError
        when the folder cannot be used, another study is running in it, or the cluster cannot.
    """
    folder = as_path("folder", folder)
    check_type("study", study, Study, "a Study, see Study.of and Study.load")
    begin = time.perf_counter()
    place = Path(folder).resolve()
    place.mkdir(parents=True, exist_ok=True)
    with alone_in(place):
        run = write_plan(place, study)
        local = executor is None and not scheduler and (study.cluster is None or workers is not None)
        _remove_partials(place, study, 0.0 if local else 60.0)
        drop_leftovers(place)
        account = _Account(place, listen)
        outcomes = {t.stem: Outcome(t, Status.REUSED) for t in study.tasks if account.has(t)}
        missing = [t for t in study.tasks if t.stem not in outcomes]
        for outcome in outcomes.values():
            listen(Event("reused", outcome.task))
        if missing:
            with _executor(study, place, run, len(missing), workers, scheduler, executor, listen) as hands:
                coordinator = Coordinator(
                    hands, place, place / PROGRESS, run, study.retries, account.check, account.keep, listen, outcomes
                )
                coordinator.compute(missing)
        shutil.rmtree(place / PROGRESS, ignore_errors=True)
        _remove_partials(place, study, 0.0 if local else 60.0)
    found = tuple(outcomes[t.stem] for t in study.tasks)
    return StudyResult(study.name, Path(folder), found, time.perf_counter() - begin)


def _remove_partials(folder: Path, study: Study, older_than: float) -> None:
    """Remove what kills have left of files of this study; of those of others, which may be at work, what is old."""
    remove_partials(folder)
    files = {PLAN} | {f"{t.stem}{end}" for t in study.tasks for end in ("", ".h5", FAILURE)}
    remove_partials(folder, older_than, files.__contains__)


class _Account:
    """Checks result files and keeps the catalogue and the reasons of failures."""

    def __init__(self, folder: Path, listen: Listener):
        self._folder, self._listen = folder, listen
        entries = scan(folder, read_catalogue(folder))
        self._catalogue = Catalogue(folder, entries, lambda line: listen(Event("note", None, line)))

    def has(self, task: Task) -> bool:
        """Whether the result of a task is there; a file that is no such result is renamed."""
        path = self._folder / task.file
        if not path.exists():
            return False
        entry, error = self._look_at(task, thorough=True)
        if not error:
            self._catalogue.record(entry)
            return True
        aside = set_aside(path)
        self._listen(Event("note", task, f"{task.file} {error}; it is kept as {aside.name} and computed again"))
        return False

    def check(self, task: Task) -> str:
        """What is wrong with the file of a finished task; over a network it may take a while to appear."""
        end = time.monotonic() + PATIENCE
        path = self._folder / task.file
        while not path.exists():
            if time.monotonic() > end:
                return f"the worker says that it is done, but {path} is not there: is the folder shared?"
            time.sleep(0.1)
        return self._look_at(task, thorough=False)[1]

    def _look_at(self, task: Task, thorough: bool) -> tuple[Entry, str]:
        """The file of a task, and what is wrong with it."""
        entry = inspect_file(self._folder / task.file, thorough)
        if entry.status != "complete":
            return entry, f"is {entry.status} ({entry.detail})"
        if entry.settings != task.settings.identity():
            return entry, "was computed for other settings or by another version"
        return entry, ""

    def keep(self, outcome: Outcome, trace: str) -> None:
        """Record what became of a task."""
        task = outcome.task
        try:
            if outcome.good:
                forget_failure(self._folder, task.stem)
            elif outcome.status is Status.FAILED:
                write_failure(self._folder, task.stem, outcome.error, trace)
        except OSError as error:
            self._listen(Event("note", task, f"its failure is not kept in a file ({error.strerror})"))
        if outcome.good:
            self._catalogue.record(self._look_at(task, thorough=False)[0])
        else:
            status = "failed" if outcome.status is Status.FAILED else "missing"
            settings = task.settings.identity()
            self._catalogue.record(Entry(task.file, task.kind.name, status, settings, detail=outcome.error))


@contextmanager
def _executor(
    study: Study, folder: Path, run: str, count: int, workers: int | None, scheduler: str, given: Executor | None,
    listen: Listener,
) -> Iterator[Executor]:  # fmt: skip
    """Who computes: the given executor, a scheduler, this machine when its workers are counted, or the cluster."""
    if given is not None:
        yield given
    elif scheduler or (study.cluster is not None and workers is None):
        from rodatlas.atlas.study.cluster import cluster_executor

        def tell(line: str) -> None:
            listen(Event("note", None, line))

        with cluster_executor(scheduler, study.cluster, folder, run, tell) as executor:
            yield executor
    else:
        with LocalExecutor(min(workers or os.cpu_count() or 1, count)) as local:
            yield local
