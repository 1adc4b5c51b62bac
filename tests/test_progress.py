"""Progress: what is shown where nobody gave one, on terminals and elsewhere."""

from __future__ import annotations

import inspect
import io
import subprocess
import sys
import types

import pytest

from rodatlas import progress
from rodatlas.atlas import compute_loci, compute_phase, compute_slice, reach
from rodatlas.atlas.experiments.real_band import band_report
from rodatlas.cli.progress import Lines
from rodatlas.progress import Line, silent, tells
from rodatlas.states import find_states


class Terminal(io.StringIO):
    """A stream that calls itself a terminal."""

    def isatty(self) -> bool:
        return True

    @property
    def lines(self) -> list[str]:
        """What was shown in turn."""
        return [text.rstrip() for text in self.getvalue().split("\r")]


@tells("work")
def work(count: int, progress: progress.Progress | None = None) -> int:
    """Tells what it does."""
    for i in range(count):
        if progress is not None:
            progress("piece", i, count - i)
    return count


@pytest.fixture
def watched(monkeypatch):
    """Called in a test: makes stderr a stream, and lets the test look like any program."""

    def watch(stream: io.StringIO | None) -> io.StringIO | None:
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(progress, "UNDER_TEST", "")
        return stream

    return watch


def test_a_terminal_shows_a_line_that_goes_away(watched):
    terminal = watched(Terminal())
    assert work(3) == 3
    assert terminal.lines[1] == "work: begun, 0 s"
    assert terminal.lines[-2:] == ["", ""]
    assert "\n" not in terminal.getvalue()


def test_a_line_goes_away_after_an_error(watched):
    terminal = watched(Terminal())

    @tells("work")
    def fail(progress: progress.Progress | None = None) -> None:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fail()
    assert terminal.lines[-2:] == ["", ""]


def test_nothing_is_shown_where_a_progress_is_given(watched):
    terminal = watched(Terminal())
    seen = []
    work(2, lambda *told: seen.append(told))
    work(2, progress=silent)
    assert seen == [("piece", 0, 2), ("piece", 1, 1)]
    assert terminal.getvalue() == ""


def test_nothing_is_shown_without_a_terminal(watched):
    stream = watched(io.StringIO())
    work(2)
    watched(None)  # as under pythonw
    work(2)
    assert stream.getvalue() == ""


def test_a_notebook_shows_the_line(watched, monkeypatch):
    stream = watched(io.StringIO())
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "ipykernel", types.ModuleType("ipykernel"))
    work(2)
    assert "work: begun" in stream.getvalue()


def test_tests_and_worker_processes_show_nothing(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    assert not progress.is_watched(stream)  # a test
    monkeypatch.setattr(progress, "UNDER_TEST", "")
    assert progress.is_watched(stream)
    monkeypatch.setattr("multiprocessing.parent_process", lambda: object())
    assert not progress.is_watched(stream)


def test_a_line_is_written_over_at_most_ten_times_a_second_and_leaves_nothing_of_a_longer_one():
    stream, now = Terminal(), 0.0
    line = Line(stream, "slice", lambda: now)
    for now in (0.05, 0.2, 0.21, 7.3):
        line(f"branch {now}" if now < 1 else "W", 2, 3 if now < 1 else 0)
    assert stream.lines[1:] == ["slice: begun, 0 s", "slice: branch 0.2 [2 of 5], 0 s", "slice: W, 7 s"]
    assert len(stream.getvalue().split("\r")[-1]) == len("slice: branch 0.2 [2 of 5], 0 s")


@pytest.mark.parametrize("function", [compute_slice, compute_loci, compute_phase, find_states, band_report, reach])
def test_long_functions_take_a_progress(function):
    assert inspect.signature(function).parameters["progress"].default is None
    assert hasattr(function, "__wrapped__")


def test_lines_say_what_is_begun_and_now_and_then_how_far_it_is(capsys):
    now = 0.0
    lines = Lines("phase", lambda: now)
    for now, message, done in (  # noqa: B007
        (0.1, "slices: slice-15: branch U", 0), (0.2, "slices: slice-15: branch W", 0), (9.0, "slices: slice-15: w", 0),
        (16.0, "slices: slice-15: branch S", 0), (19.0, "slices: slice-55: done", 1), (23.0, "slices: slice-55: U", 1),
        (24.0, "locus 4", 0),
    ):  # fmt: skip
        lines(message, done, 0 if message == "locus 4" else 3 - done)
    assert capsys.readouterr().err.splitlines() == [
        "phase", "  slices [0 of 3, 0 s]", "  slices: slice-15: branch S [0 of 3, 16 s]",
        "  slices: slice-55: U [1 of 3, 23 s]", "  locus 4 [24 s]",
    ]  # fmt: skip


def test_scripts_whose_output_goes_elsewhere_stay_silent():
    code = (
        "from rodatlas.progress import tells\n"
        "@tells('work')\ndef work(progress=None):\n    assert progress is None\nwork()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert (done.stdout, done.stderr) == ("", "")
