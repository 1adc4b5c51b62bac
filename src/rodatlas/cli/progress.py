"""Progress of a command on stderr: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rodatlas.progress import Progress, silent

OFTEN, SELDOM = 5.0, 15.0  # seconds between lines where another piece is finished, and where none is


@contextmanager
def progress_bar(title: str, lines: bool = True) -> Iterator[Progress]:
    """A bar on stderr; without a terminal, lines that say what is begun and how far it is.

    Parameters
    ----------
    lines : whether to print lines without a terminal; not where the work takes a few seconds at most.
    """
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield Lines(title) if lines else silent
        return
    from rich import progress

    columns = (
        progress.SpinnerColumn(), progress.TextColumn("{task.fields[title]}", markup=False), progress.BarColumn(24),
        progress.TextColumn("{task.fields[message]}", markup=False), progress.TimeElapsedColumn(),
    )  # fmt: skip
    with progress.Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None, title=title, message="loading")

        def report(message: str, done: int, pending: int) -> None:
            bar.update(task, completed=done, total=done + pending + 1, message=message)

        yield report


class Lines:
    """Prints what is begun at once, how far it is now and then.

    A piece of work is named by what stands before the first colon of a message, see
    :data:`rodatlas.progress.Progress`.
    """

    def __init__(self, title: str, clock: Callable[[], float] = time.monotonic):
        self._clock = clock
        self._begin, self._last = clock(), clock()
        self._piece, self._done = "", 0
        self._print(title)

    def __call__(self, message: str, done: int, pending: int) -> None:
        now, piece = self._clock(), message.split(":")[0]
        waited = now - self._last
        if piece != self._piece:
            text = piece
        elif waited >= (OFTEN if done != self._done else SELDOM):
            text = message
        else:
            return
        self._piece, self._done, self._last = piece, done, now
        count = f"{done} of {done + pending}, " if pending else ""
        self._print(f"  {text} [{count}{now - self._begin:.0f} s]")

    @staticmethod
    def _print(line: str) -> None:
        print(line, file=sys.stderr, flush=True)
