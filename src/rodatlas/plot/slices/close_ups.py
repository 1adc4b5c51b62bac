"""A sequence of windows of slices, in which a transition of the diagram is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rodatlas.plot.look.heading import setting_text
from rodatlas.plot.look.protocols import SliceLike
from rodatlas.plot.look.style import TWO_COLUMN, new_figure, styled
from rodatlas.plot.slices.panel import draw_legend, draw_window, label_events, label_states

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROW = 2.35  # height of a row of panels, in inches
LEFT, RIGHT, BOTTOM, TOP, ACROSS, BETWEEN = 0.66, 0.08, 0.48, 0.5, 0.42, 0.46  # borders and gaps, in inches


@dataclass(frozen=True)
class Panel:
    """One window: a slice, and the ranges of value and response that are shown."""

    slice: SliceLike
    values: tuple[float, float]
    responses: tuple[float, float]


def draw_close_ups(panels: Sequence[Panel], differs: str) -> Figure:
    """Draw windows of slices side by side in two columns, each with the value of the control by which they differ.

    Parameters
    ----------
    panels : at least one, in order, of slices along one control.
    differs : the control by which they differ.

    Returns
    -------
    a figure as wide as a page.
    """
    if not panels:
        raise ValueError("panels: expected at least one, got none")
    rows = (len(panels) + 1) // 2
    inches = BOTTOM + TOP + rows * ROW + (rows - 1) * BETWEEN
    width = (TWO_COLUMN - LEFT - RIGHT - ACROSS) / 2
    with styled():
        fig = new_figure(TWO_COLUMN, inches)
        touching = False
        for k, panel in enumerate(panels):
            row, column = divmod(k, 2)
            left, low = LEFT + column * (width + ACROSS), BOTTOM + (rows - 1 - row) * (ROW + BETWEEN)
            ax = fig.add_axes((left / TWO_COLUMN, low / inches, width / TWO_COLUMN, ROW / inches))
            drawn = draw_window(panel.slice, panel.values, panel.responses, ax)
            touching |= drawn.touching
            settings = panel.slice.settings
            equation = settings.model.control(differs).equation(settings.setting[differs])
            ax.set_title(f"({'abcdefghij'[k]})  ${equation}$", loc="left", pad=4.0)
            ax.locator_params(nbins=5)
            ax.locator_params(axis="x", prune="upper")  # a number at the corner would meet the next panel
            label_events(drawn, ax)
            label_states(drawn, ax)
            if row == rows - 1 or k == len(panels) - 2:
                ax.set_xlabel(settings.control.label)
        fixed = panels[0].slice.settings
        label = fixed.model.quantity(fixed.against).label
        fig.text(0.13 / TWO_COLUMN, (BOTTOM + (inches - BOTTOM - TOP) / 2) / inches, label, rotation=90,
                 ha="center", va="center", fontsize=9.0)  # fmt: skip
        setting = setting_text(fixed.model.controls, {k: v for k, v in fixed.setting.items() if k != differs})
        fig.text(LEFT / TWO_COLUMN, 1 - 0.05 / inches, setting, ha="left", va="top", fontsize=9.0)
        draw_legend((1 - RIGHT / TWO_COLUMN, 1 - 0.02 / inches), on=fig, touching=touching)
        fig.draw_without_rendering()
    return fig
