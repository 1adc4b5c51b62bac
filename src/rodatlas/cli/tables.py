"""Tables that lose nothing, whatever the width of the terminal."""

from __future__ import annotations

from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

WIDEST = 10_000


def say_table(console: Console, table: Table) -> None:
    """Print a table whole.

    Where it fits, it is printed as it is. What goes into a file or a pipe is as wide as it needs to be, so that
    nothing is wrapped or cut. On a terminal that is too narrow even with its texts wrapped, each row becomes a few
    lines: the first cell, and below it the others with the names of their columns.
    """
    least, most = _widths(console, table)
    if not console.is_terminal:
        width = console.width
        try:
            console.width = max(width, most)
            console.print(table)
        finally:
            console.width = width
    elif least <= console.width:
        console.print(table)
    else:
        _print_rows(console, table)


def _widths(console: Console, table: Table) -> tuple[int, int]:
    """Width of a table with its texts wrapped where their columns allow it, and with none of them wrapped."""
    room = console.options.update(width=WIDEST, max_width=WIDEST)
    most = Measurement.get(console, room, table).maximum
    spared = 0
    for column in table.columns:
        texts = [str(column.header), *map(str, column.cells)]
        if not column.no_wrap:
            longest_word = max((cell_len(word) for text in texts for word in text.split()), default=0)
            spared += max(map(cell_len, texts)) - longest_word
    return most - spared, most


def _print_rows(console: Console, table: Table) -> None:
    """Rows one below the other, cells without text left out."""
    for text in (table.title, table.caption):
        if text:
            console.print(text, highlight=False, markup=False)
    headers = [str(column.header) for column in table.columns]
    size = max(map(len, headers), default=0)
    for row in zip(*(column.cells for column in table.columns), strict=True):
        console.print(f"{headers[0]} {row[0]}".strip(), style="bold", highlight=False, markup=False)
        for header, cell in zip(headers[1:], row[1:], strict=True):
            if str(cell):
                console.print(f"  {header:{size}} {str(cell).strip()}", highlight=False, markup=False)
