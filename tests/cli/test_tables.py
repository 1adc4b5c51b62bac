"""Tables on narrow terminals and in pipes keep every digit."""

import io

import pytest
from rich.console import Console
from rich.table import Table

from rodatlas.cli.tables import say_table

ROWS = [("US+-", "0.32768 to 0.82000", "pitchfork 4, no snap"), ("w", "0.50330 to 0.57910", "")]


def printed(width, terminal, wrap=False):
    table = Table(title="States")
    for name in ("state", "shear", "begins at"):
        table.add_column(name, no_wrap=not wrap)
    for row in ROWS:
        table.add_row(*row)
    console = Console(file=io.StringIO(), width=width, force_terminal=terminal, color_system=None)
    say_table(console, table)
    assert console.width == width
    return console.file.getvalue()


def test_a_wide_terminal_gets_the_table():
    text = printed(80, True)
    assert "│ w     │ 0.50330 to 0.57910 │" in text
    assert "…" not in text


@pytest.mark.parametrize("width", [20, 40])
def test_a_narrow_terminal_gets_rows_below_each_other(width):
    text = printed(width, True)
    for row in ROWS:
        for word in " ".join(row).split():
            assert word in text
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    assert text.count("begins at") == 1  # empty cells are left out


def test_columns_that_may_be_wrapped_are():
    text = printed(40, True, wrap=True)
    assert "┃" in text
    assert max(map(len, text.splitlines())) <= 40


@pytest.mark.parametrize("wrap", [True, False])
def test_a_pipe_gets_whole_lines(wrap):
    lines = printed(20, False, wrap).splitlines()
    assert any("US+-" in line and "pitchfork 4, no snap" in line for line in lines)
