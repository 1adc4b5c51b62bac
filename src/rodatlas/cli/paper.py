"""`rodatlas paper`: our version of the figures of the paper, and its numbers beside ours."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from rodatlas import __version__
from rodatlas.cli.common import WORKERS, note, progress_bar, whole_number
from rodatlas.cli.output import JsonTarget, json_text, writable_folder
from rodatlas.cli.tables import say_table
from rodatlas.failures import Failure
from rodatlas.paper import ENTRIES, NOT_DRAWN, Entry, chosen


def run(wanted: Sequence[str], out: str, workers: str | None, json_to: JsonTarget, fresh: bool) -> None:
    """The command; texts come as typed and are checked here."""
    entries = chosen(wanted)
    processes = whole_number("workers", workers, WORKERS) if workers is not None else os.cpu_count() or 1
    identity = {"rodatlas": __version__, "folder": os.path.abspath(out)}
    names = ("paper", *(f"fig-{entry.name}" for entry in ENTRIES))
    json_to.expect(identity, [Path(out) / f"{name}.json" for name in names])
    folder = writable_folder(out)
    from rodatlas.paper.output import stored_records, to_json

    records, failed = _drawn(entries, folder, processes, fresh)
    console = Console(stderr=json_to.on_stdout)
    _say(records, console)
    console.print(f"files: {folder}/fig-*.png, fig-*.pdf, paper.md, paper.json", highlight=False, soft_wrap=True)
    json_to.write(json_text(to_json(stored_records(folder)), identity), identity)
    for name, why in failed.items():
        note(f"rodatlas: figure {name}: {' '.join(why.split())}")
    if failed:
        sys.exit(1)


def _drawn(
    entries: Sequence[Entry], folder: Path, workers: int, fresh: bool
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Draw figures one after the other; the records of all, and why those that could not be drawn failed.

    What is finished stays.
    """
    from rodatlas.paper.output import draw_to, write_tables
    from rodatlas.paper.sources import Sources, slice_settings

    records: list[dict[str, Any]] = []
    failed: dict[str, str] = {}
    with progress_bar("figures of the paper") as report:
        sources = Sources(
            folder, workers, lambda message, done, left: report(f"slices: {message}", done, left), note, fresh=fresh
        )
        sources.prepare(slice_settings(angle, high) for entry in entries for angle, high in entry.needs)
        for done, entry in enumerate(entries):
            what, left = f"figure {entry.name}", len(entries) - done - 1
            report(what, done, left)
            sources.report = lambda message, *_, what=what, done=done, left=left: report(
                f"{what}: {message}", done, left
            )
            try:
                records.append(draw_to(entry, sources, folder))
            except (ValueError, Failure) as error:  # the other figures do not need it
                failed[entry.name] = str(error)
            write_tables(folder, note)
    return records, failed


def show_list() -> None:
    """Print the figures that can be drawn, and those that cannot yet."""
    table = Table(title="Figures of the paper")
    for name in ("name", "figure", "what it shows"):
        table.add_column(name, no_wrap=name == "name")
    for entry in ENTRIES:
        table.add_row(entry.name, entry.of_paper or "-", entry.description)
    for of, why in NOT_DRAWN.items():
        table.add_row("(not drawn)", of, why)
    say_table(Console(), table)


def _say(records: Sequence[dict[str, Any]], console: Console) -> None:
    """Numbers that are known from elsewhere, beside ours."""
    from rodatlas.paper.output import texts_of

    table = Table(title="Numbers known from elsewhere")
    for name in ("figure", "quantity", "ours", "known", "difference"):
        table.add_column(name, no_wrap=name != "quantity")
    for record in records:
        for n in (n for n in record["numbers"] if "known" in n):
            ours, theirs = texts_of(n["value"], n["known"]["value"], n["known"]["resolution"])
            style = "" if n["agrees"] else "bold red"
            table.add_row(record["name"], n["quantity"], ours, theirs, f"{n['difference']:.1e}", style=style)
    if table.row_count:
        say_table(console, table)
    for record in records:
        for remark in record["remarks"]:
            console.print(f"{record['name']}: {remark}", highlight=False, markup=False, soft_wrap=True)
