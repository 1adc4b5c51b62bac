"""What the commands share: reading numbers, progress, tables, output files."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from rodatlas.atlas.slices.follow import Progress as Report
    from rodatlas.atlas.slices.settings import SliceSettings


def number(field: str, text: str) -> float:
    """A float from text, or a ValueError that names the field."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{field}: expected a number, got '{text}'") from None


def settings_from(
    angle: str, compression: str, poisson: str, tol: str, shear_max: str = "", shear_min: str = "", search: str = "256"
) -> SliceSettings:
    """Settings of a slice from the texts that the user typed; an empty shear stands for the default."""
    from rodatlas.atlas.slices.settings import SliceSettings

    high, low = (number(k, v) if v else None for k, v in (("shear-max", shear_max), ("shear-min", shear_min)))
    return SliceSettings(
        number("angle", angle), number("compression", compression), number("poisson", poisson),
        high, low,  # type: ignore[arg-type]
        number("tol", tol), whole_number("search", search),
    )  # fmt: skip


def whole_number(field: str, text: str) -> int:
    """An integer from text, or a ValueError that names the field."""
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{field}: expected a whole number, got '{text}'") from None


def writable_folder(text: str, field: str = "out") -> Path:
    """A folder that exists (made when missing) and can be written to."""
    if not text.strip():
        raise ValueError(f"{field}: expected a folder that can be written, got '{text}'")
    folder = Path(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".rodatlas-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise ValueError(f"{field}: expected a folder that can be written, got '{text}' ({error.strerror})") from None
    return folder


def json_target(text: str) -> Path | None:
    """The file for --json, checked before any work is done."""
    if text in ("", "-"):
        return None
    path = Path(text)
    if path.is_dir():
        raise ValueError(f"json: expected a file name or -, got the folder '{text}'")
    writable_folder(str(path.parent), "json")
    return path


def note(line: str) -> None:
    """Tell the user something about the run, on stderr."""
    print(line, file=sys.stderr)


@contextmanager
def progress_bar(title: str) -> Iterator[Report]:
    """A bar on stderr; without a terminal, one line per branch."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _lines()
        return
    columns = (
        SpinnerColumn(), TextColumn("{task.fields[title]}"), BarColumn(24), TextColumn("{task.fields[message]}"),
        TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None, title=title, message="loading")

        def report(message: str, done: int, pending: int) -> None:
            bar.update(task, completed=done, total=done + pending + 1, message=message)

        yield report


def _lines() -> Report:
    """A report that prints what is being done once, without counts."""
    last = ""

    def report(message: str, done: int, pending: int) -> None:
        nonlocal last
        head = message.split(":")[0]
        if head != last:
            last = head
            print(f"  {head}", file=sys.stderr, flush=True)

    return report
