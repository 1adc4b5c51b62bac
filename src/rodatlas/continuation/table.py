"""Results as tables of pandas that show every column. This module imports pandas: import it where a table is made."""

from __future__ import annotations

import pandas as pd

SHOWN_WHOLE = ("display.max_columns", None, "display.max_colwidth", None, "display.expand_frame_repr", True)


class Table(pd.DataFrame):
    """A data frame whose text and HTML hide no column and no part of a cell; rows are shown as pandas does.

    What is made of it by slicing, sorting, :func:`pandas.concat` or :meth:`merge` is one too. `pandas.DataFrame(table)`
    gives a plain one.
    """

    @property
    def _constructor(self) -> type[Table]:
        return Table

    def __repr__(self) -> str:
        """Columns beyond the width of the terminal (`pandas.options.display.width`) are in blocks below."""
        with pd.option_context(*SHOWN_WHOLE):
            return super().__repr__()

    def _repr_html_(self) -> str | None:
        with pd.option_context(*SHOWN_WHOLE):
            return super()._repr_html_()
