"""Drawings of bands side by side, at one scale, each with its name and setting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.band.render import DEFAULT_VIEW, DISPLAY_WIDTH, View, draw_triad, render_band
from rodatlas.plot.look.style import TWO_COLUMN, label_of, new_figure, styled
from rodatlas.plot.slices.panel import NAME_SIZE, NOTE_SIZE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution

CAPTION, GAP = 0.22, 0.12  # height of the line under a drawing and gap between rows, in inches
FOOT = 0.56


@dataclass(frozen=True)
class Item:
    """One drawing: a solution, the name of the state, its color, and what stands beside the name."""

    solution: Solution
    name: str
    color: str
    note: str = ""


def draw_gallery(
    items: Sequence[Item], columns: int, width: float = DISPLAY_WIDTH, view: View = DEFAULT_VIEW, foot: str = ""
) -> Figure:
    """Draw bands in rows.

    Parameters
    ----------
    columns : drawings in a row. width : drawn width of the bands, in units of the length.
    foot : a line at the bottom.

    Returns
    -------
    a figure as wide as a page.
    """
    if not items:
        raise ValueError("items: expected at least one, got none")
    rows = math.ceil(len(items) / columns)
    cell = TWO_COLUMN / columns
    with styled():
        fig = new_figure(TWO_COLUMN, 1.0)
        drawings = []
        for item in items:
            ax = fig.add_axes((0.0, 0.0, 0.1, 0.1), label=item.name)
            render_band(item.solution, width, view, ax, color=item.color)
            drawings.append((ax, np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())))
        scale = 0.94 * cell / max(across for _, across, _ in drawings)
        row_heights = [
            scale * max(up for _, _, up in drawings[r * columns : (r + 1) * columns]) + CAPTION + GAP
            for r in range(rows)
        ]
        inches = sum(row_heights) + FOOT
        fig.set_size_inches(TWO_COLUMN, inches)
        low = inches
        for r in range(rows):
            low -= row_heights[r]
            row = slice(r * columns, (r + 1) * columns)
            for c, (item, (ax, across, up)) in enumerate(zip(items[row], drawings[row], strict=True)):
                middle = (c + 0.5) * cell
                size = np.array([across, up]) * scale
                corner = np.array([middle - 0.5 * size[0], low + CAPTION + 0.3 * GAP])
                page = np.array([TWO_COLUMN, inches])
                ax.set_position((*(corner / page), *(size / page)))
                _caption(fig, item, middle / TWO_COLUMN, (low + 0.5 * CAPTION) / inches)
        triad = fig.add_axes((0.1 / TWO_COLUMN, 0.03 / inches, 0.45 / TWO_COLUMN, 0.45 / inches))
        draw_triad(view, triad)
        fig.text(1.0 - 0.1 / TWO_COLUMN, 0.1 / inches, foot, ha="right", va="bottom", fontsize=NOTE_SIZE)
        fig.draw_without_rendering()
    return fig


def _caption(fig: Figure, item: Item, x: float, y: float) -> None:
    """The name in its color, the note in small type, centered together."""
    from matplotlib.offsetbox import AnnotationBbox, HPacker, TextArea

    color = item.color
    parts: list[Artist] = [TextArea(label_of(item.name), textprops={"fontsize": NAME_SIZE + 1.0, "color": color})]
    if item.note:
        parts.append(TextArea(item.note, textprops={"fontsize": NOTE_SIZE + 0.5, "color": color}))
    packed = HPacker(children=parts, align="baseline", pad=0, sep=5)
    box = AnnotationBbox(packed, (x, y), xycoords="figure fraction", frameon=False, pad=0)
    fig.add_artist(box)
