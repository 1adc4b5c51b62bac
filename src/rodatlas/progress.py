"""What long computations tell while they run, and what is shown of it when nobody asked; below all layers."""

from __future__ import annotations

import functools
import inspect
import multiprocessing
import os
import shutil
import sys
import time
from collections.abc import Callable
from typing import ParamSpec, TextIO, TypeVar

Progress = Callable[[str, int, int], None]
"""Called with (what is being done, pieces finished, pieces known to be left).

What is being done may go on with a colon and details that change from call to call: 'branch U: 12 points'.
"""

UNDER_TEST = "PYTEST_CURRENT_TEST"  # set in the environment while a test runs
PERIOD = 0.1  # seconds between two states of a line: more often nobody reads it

P = ParamSpec("P")
T = TypeVar("T")


def silent(message: str, done: int, pending: int) -> None:
    """A progress that shows nothing: ``compute_slice(settings, progress=silent)``."""


def tells(title: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function with an argument `progress` that shows a line of its own where none is given.

    The line appears on stderr of a terminal or a notebook, is written over as the work goes on, and goes away at the
    end. Scripts whose output goes elsewhere, tests and worker processes show nothing.

    Parameters
    ----------
    title : stands before what is being done.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def telling(*args: P.args, **kwargs: P.kwargs) -> T:
            if not is_watched(sys.stderr):
                return function(*args, **kwargs)
            bound = signature.bind(*args, **kwargs)
            if bound.arguments.get("progress") is not None:
                return function(*args, **kwargs)
            line = Line(sys.stderr, title)
            bound.arguments["progress"] = line
            try:
                return function(*bound.args, **bound.kwargs)
            finally:
                line.clear()

        return telling

    return decorate


def is_watched(stream: TextIO | None) -> bool:
    """Whether somebody sees a stream at once: a terminal or a notebook, not a pipe, a test or a worker process."""
    if stream is None or multiprocessing.parent_process() is not None or UNDER_TEST in os.environ:
        return False
    return stream.isatty() or in_notebook()


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None and "ipykernel" in sys.modules else None
    return getattr(running, "kernel", None) is not None


class Line:
    """A progress that is one line of a terminal or a notebook, written over with plain carriage returns."""

    def __init__(self, stream: TextIO, title: str, clock: Callable[[], float] = time.monotonic):
        self._stream, self._title, self._clock = stream, title, clock
        self._begin, self._last, self._length = clock(), float("-inf"), 0
        self("begun", 0, 0)

    def __call__(self, message: str, done: int, pending: int) -> None:
        now = self._clock()
        if now - self._last < PERIOD:
            return
        self._last = now
        count = f" [{done} of {done + pending}]" if pending else ""
        self._write(f"{self._title}: {message}{count}, {now - self._begin:.0f} s")

    def clear(self) -> None:
        """Take the line away."""
        self._write("")
        self._stream.write("\r")
        self._stream.flush()

    def _write(self, text: str) -> None:
        text = text[: max(shutil.get_terminal_size().columns - 1, 1)]
        self._stream.write("\r" + text.ljust(self._length))
        self._stream.flush()
        self._length = len(text)
