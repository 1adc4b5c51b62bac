"""Many slices at a time, with the plain file names of `rodatlas slice`."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.stored import peek
from rodatlas.atlas.study.coordinator import Coordinator
from rodatlas.atlas.study.kinds.slices import SLICE
from rodatlas.atlas.study.local import LocalExecutor
from rodatlas.atlas.study.outcome import Event
from rodatlas.atlas.study.task import Task
from rodatlas.atlas.unfinished import Say, silent
from rodatlas.continuation.checks import as_path, check_each
from rodatlas.failures import Failure
from rodatlas.progress import Progress, tells


class TasksFailed(Failure):
    """Some results could not be computed; the message says which and why, in one line."""


@tells("slices")
def obtain_slices(
    settings: Sequence[SliceSettings], folder: Path, workers: int = 2, progress: Progress | None = None, *,
    fresh: bool = False, say: Say = silent,
) -> list[Slice]:  # fmt: skip
    """Slices from the files of a folder, or computed there by several processes and written.

    Files have the names that `rodatlas slice --out FOLDER` gives them, and each reads what the other wrote. What is
    finished stays, whatever happens; the same call goes on. With one slice missing, or one worker, no process is
    started. A script that calls this must guard its main part by ``if __name__ == "__main__":``, as always where
    processes are started.

    Parameters
    ----------
    settings : of the slices, any order; repetitions are computed once.
    folder : an existing one.
    workers : number of processes.
    progress : called as the work goes on, with (what is being done, slices finished, slices left); by default a line
        in a terminal or notebook, `rodatlas.progress.silent` for none.
    fresh : compute everything again.
    say : told what is read, resumed, tried again or damaged.

    Returns
    -------
    list of Slice
        In the order of the settings.

    Raises
    ------
    ValueError
        when the folder cannot be written.
    TasksFailed
        when slices could not be computed; all others are in their files.
    """
    folder = as_path("folder", folder)
    check_each("settings", settings, SliceSettings, "a sequence of SliceSettings")
    unique = list(dict.fromkeys(settings))
    missing = [s for s in unique if fresh or not _is_stored(folder, s)]
    if len(missing) > 1 and workers > 1:
        _compute(missing, len(unique), folder, workers, progress, fresh, say)
        missing = []
    found: dict[SliceSettings, Slice] = {}
    for done, s in enumerate(unique):
        inner = None if progress is None else _Inner(progress, s.stem, done, len(unique) - done)
        found[s] = obtain_slice(s, folder, inner, fresh=fresh and s in missing, say=say if s in missing else silent)
    return [found[s] for s in settings]


def _is_stored(folder: Path, settings: SliceSettings) -> bool:
    """Whether a folder holds the slice of these settings by this version."""
    return peek(folder / f"{settings.stem}.h5", SLICE.result.schema, settings, lambda file: True) is not None


def _compute(
    missing: Sequence[SliceSettings], total: int, folder: Path, workers: int, progress: Progress | None, fresh: bool,
    say: Say,
) -> None:  # fmt: skip
    """Compute slices by several processes."""
    tasks = [Task(SLICE, s, s.stem, fresh=fresh) for s in missing]
    done = total - len(missing)

    def listen(event: Event) -> None:
        nonlocal done
        done += event.kind == "done"
        name = event.task.stem if event.task else ""
        if event.kind in ("retry", "note"):
            say(f"{name}: {event.message}{'; trying again' if event.kind == 'retry' else ''}")
        elif progress is not None and event.kind in ("working", "done"):
            progress(f"{name}: {event.message or 'done'}", done, total - done)

    with tempfile.TemporaryDirectory(prefix="rodatlas-") as notes, LocalExecutor(min(workers, len(tasks))) as executor:
        coordinator = Coordinator(executor, folder.resolve(), Path(notes), tell=listen)
        coordinator.compute(tasks)
    failed = [o for o in coordinator.outcomes.values() if not o.good]
    if failed:
        why = "; ".join(f"{o.task.stem} ({o.error})" for o in failed)
        raise TasksFailed(f"{len(failed)} of {total} slices could not be computed: {why}")


class _Inner:
    """Progress within one slice as a part of several."""

    def __init__(self, outer: Progress, name: str, done: int, left: int):
        self._outer, self._name, self._done, self._left = outer, name, done, left

    def __call__(self, message: str, done: int, pending: int) -> None:
        self._outer(f"{self._name}: {message}", self._done, self._left)
