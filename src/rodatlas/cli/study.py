"""`rodatlas study`: compute what a study file describes, with live progress."""

from __future__ import annotations

import os
import re
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from rodatlas import __version__
from rodatlas.cli.common import WORKERS, note, shown, whole_number
from rodatlas.cli.output import JsonTarget, json_text, writable_folder
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.study import Event, Study, StudyResult
    from rodatlas.atlas.study.outcome import Listener

ADDRESS = re.compile(r"[a-z]+://\S+:\d{1,5}")
ROWS = 60  # of the table at the end; the rest is what `rodatlas show` is for


def run(file: str, out: str, workers: str | None, scheduler: str | None, dry_run: bool, json_to: JsonTarget) -> int:
    """The command; texts come as typed and are checked here. The exit code: 1 when a result is missing."""
    from rodatlas.atlas.study import Study
    from rodatlas.atlas.study.folder import PLAN

    count = whole_number("workers", workers, WORKERS) if workers is not None else None
    if scheduler is not None and not ADDRESS.fullmatch(scheduler):
        raise ValueError(f"scheduler: expected an address such as tcp://host:8786, got '{shown(scheduler)}'")
    if scheduler is not None and count is not None:
        raise ValueError(f"workers: expected no --workers beside --scheduler, which has its own, got {count}")
    study = Study.load(file)
    identity = {
        "rodatlas": __version__, "name": study.name, "folder": os.path.abspath(out), "dry_run": dry_run,
        "tasks": [t.file for t in study.tasks],
    }  # fmt: skip
    json_to.expect(identity, [Path(out) / PLAN])
    console = Console(stderr=json_to.on_stdout)
    if dry_run:
        data = _dry_run(study, Path(out), console)
    else:
        data, failed = _run(study, out, count, scheduler or "", console)
    json_to.write(json_text(data, identity), identity)
    return 1 if not dry_run and failed else 0


def _run(study: Study, out: str, workers: int | None, scheduler: str, console: Console) -> tuple[dict[str, Any], int]:
    """Compute, print the table; the result as JSON and the number of results that are missing."""
    from rodatlas.atlas.study import run_study

    folder = writable_folder(out)
    finished = 0

    def count(event: Event) -> None:
        nonlocal finished
        finished += event.kind in ("done", "reused")
        listen(event)

    try:
        with progress_of(study) as listen:
            found = run_study(study, folder, workers=workers, scheduler=scheduler, listen=count)
    except KeyboardInterrupt:
        note(f"interrupted: {finished} of {len(study.tasks)} results and all finished branches are kept in {folder}; "
             "the same command goes on")  # fmt: skip
        raise
    say_table(console, _table(found))
    for outcome in found.failed:
        console.print(f"{outcome.task.stem} {outcome.status.value}: {outcome.error}", markup=False, highlight=False,
                      soft_wrap=True)  # fmt: skip
    console.print(_summary(found), markup=False, highlight=False, soft_wrap=True)
    return found.to_json(), len(found.failed)


def _table(found: StudyResult) -> Table:
    table = Table(title=found.name, box=None, pad_edge=False)
    for name in ("result", "status"):
        table.add_column(name, overflow="fold")
    for name in ("attempts", "seconds"):
        table.add_column(name, justify="right", no_wrap=True)
    first = sorted(found.outcomes, key=lambda o: o.good)[:ROWS] if len(found.outcomes) > ROWS else found.outcomes
    for o in first:
        table.add_row(
            o.task.file, o.status.value, str(o.attempts) if o.attempts else "", f"{o.seconds:.1f}" if o.seconds else "",
            style=None if o.good else "red",
        )  # fmt: skip
    if len(first) < len(found.outcomes):
        table.caption = f"and {len(found.outcomes) - len(first)} more: rodatlas show {found.folder}"
    return table


def _summary(found: StudyResult) -> str:
    counts = Counter(o.status.value for o in found.outcomes)
    return f"{', '.join(f'{n} {status}' for status, n in counts.items())} in {found.seconds:.1f} s; {found.folder}"


def _dry_run(study: Study, folder: Path, console: Console) -> dict[str, Any]:
    """Print what would be computed, and what is there already as far as the names tell."""
    from rodatlas.atlas.study.plan import SCHEMA

    rows: list[dict[str, Any]] = [
        {
            "kind": t.kind.name, "file": t.file, "there": (folder / t.file).exists(),
            "requires": [f"{stem}.h5" for stem in t.requires], "settings": t.settings.identity(),
        }
        for t in study.tasks
    ]  # fmt: skip
    table = Table(title=f"{study.name}: would be computed", box=None, pad_edge=False)
    for name in ("result", "there", "requires"):
        table.add_column(name, overflow="fold")
    for row in rows:
        table.add_row(str(row["file"]), "yes" if row["there"] else "", " ".join(row["requires"]))
    say_table(console, table)
    left = sum(not row["there"] for row in rows)
    console.print(f"{len(rows)} results, {left} to be computed; nothing was done", highlight=False)
    return {"schema": SCHEMA, "name": study.name, "tasks": rows}


@contextmanager
def progress_of(study: Study) -> Iterator[Listener]:
    """Live progress on stderr: a line for each running task; without a terminal, lines as things happen."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield Lines(len(study.tasks))
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(16), MofNCompleteColumn(), TextColumn("{task.fields[message]}"),
        TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True) as bar:
        yield Live(bar, study.name, len(study.tasks))


class Lines:
    """Prints what happens, one line for each task that begins or ends."""

    def __init__(self, total: int):
        self._total, self._over, self._begun, self._start = total, 0, set[str](), time.monotonic()

    def __call__(self, event: Event) -> None:
        name = f"{event.task.stem}: " if event.task is not None else ""
        if event.kind == "working":
            if event.task is not None and event.task.stem not in self._begun:
                self._begun.add(event.task.stem)
                note(f"  {name}begun")
            return
        if event.kind in ("retry", "note"):
            note(f"  {name}{event.message}{'; trying again' if event.kind == 'retry' else ''}")
            return
        self._over += 1
        why = f" ({event.message})" if event.message else ""
        elapsed = f"{time.monotonic() - self._start:.0f} s"
        note(f"  {name}{event.kind}{why} [{self._over} of {self._total}, {elapsed}]")


class Live:
    """A bar for the study and one for each running task."""

    def __init__(self, bar: Progress, name: str, total: int):
        self._bar, self._rows = bar, dict[str, TaskID]()
        self._all = bar.add_task(name, total=total, message="")

    def __call__(self, event: Event) -> None:
        if event.task is None or event.kind in ("retry", "note", "failed", "skipped"):
            words = {"retry": "; trying again", "note": ""}.get(event.kind, f" ({event.kind})")
            name = f"{event.task.stem}: " if event.task is not None else ""
            self._bar.console.print(f"{name}{event.message}{words}", markup=False, highlight=False, soft_wrap=True)
        if event.task is None or event.kind == "note":
            return
        stem = event.task.stem
        if event.kind == "working":
            if stem not in self._rows:
                self._rows[stem] = self._bar.add_task(f"  {stem}", total=None, message="")
            total = event.done + event.pending + 1
            self._bar.update(self._rows[stem], completed=event.done, total=total, message=event.message)
            return
        if stem in self._rows:
            self._bar.remove_task(self._rows.pop(stem))
        if event.kind != "retry":
            self._bar.advance(self._all)
