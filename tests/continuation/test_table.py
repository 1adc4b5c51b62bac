"""Tables of results: every column is shown, and they go on behaving like data frames."""

from __future__ import annotations

import pandas as pd
import pytest

from rodatlas.continuation.table import Table

COLUMNS = [f"a rather long name of column {i}" for i in range(24)]
TEXT = "a cell that says more than fifty characters, as descriptions of bifurcations are wont to do"


@pytest.fixture
def table() -> Table:
    return Table({name: range(3) for name in COLUMNS} | {"what": [TEXT] * 3})


@pytest.mark.parametrize("width", [40, 80, 200])
def test_the_text_has_every_column_whole(table: Table, width: int) -> None:
    with pd.option_context("display.width", width, "display.max_columns", 0):
        text = repr(table)
    assert all(name in text for name in COLUMNS)
    assert TEXT in text
    assert "..." not in text
    assert max(map(len, text.splitlines())) <= max(width, len(TEXT) + 6)


def test_so_has_the_html_of_notebooks(table: Table) -> None:
    page = table._repr_html_()
    assert all(name in page for name in COLUMNS)
    assert TEXT in page


def test_the_options_of_pandas_are_left_as_they_were(table: Table) -> None:
    before = pd.get_option("display.max_columns"), pd.get_option("display.max_colwidth")
    assert repr(table)
    assert before == (pd.get_option("display.max_columns"), pd.get_option("display.max_colwidth"))


def test_what_is_made_of_it_shows_all_too(table: Table) -> None:
    made = [table[table["what"] != ""], table.head(2), table.sort_values("what"), table.copy(), table[COLUMNS],
            pd.concat([table, table]), table.drop(columns="what"), table.merge(table, on="what")]  # fmt: skip
    assert all(type(frame) is Table for frame in made)
    assert isinstance(table["what"], pd.Series)
    assert "..." not in repr(made[5])


def test_long_tables_are_cut_as_pandas_does() -> None:
    assert "[1000 rows x 2 columns]" in repr(Table({"a": range(1000), "b": 1.0}))


def test_a_plain_frame_comes_from_it_and_equals_it(table: Table) -> None:
    plain = pd.DataFrame(table)
    assert type(plain) is pd.DataFrame
    assert plain.equals(table)
