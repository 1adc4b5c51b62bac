"""A band as one parameter grows: drawings of it, and its curvature and twist."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.model.model import parameters_of
from rodatlas.plot.band.render import draw_triad, render_band
from rodatlas.plot.look.heading import ARCLENGTH_LABEL, CURVATURE_LABEL, TWIST_LABEL, setting_of
from rodatlas.plot.look.style import FAINT, TWO_COLUMN, new_figure, styled
from rodatlas.plot.shapes.profiles import SAMPLES
from rodatlas.plot.slices.overlaps import draw_coinciding
from rodatlas.plot.slices.panel import NAME_SIZE
from rodatlas.rods.state import RodState

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution
    from rodatlas.model import Control

INCHES = 4.2
SEQUENCE = ("#031C97", "#237EEB", "#09AF6B", "#D68A00", "#860228", "#3B2658")


def draw_sequence(states: Sequence[Solution], control: Control) -> Figure:
    """Draw states of one branch.

    Parameters
    ----------
    states : one to six, in order. control : in which they differ.

    Returns
    -------
    a figure as wide as a page: drawings above, curvature and twist below, one color for each state.
    """
    if not 1 <= len(states) <= len(SEQUENCE):
        raise ValueError(f"states: expected one to {len(SEQUENCE)}, got {len(states)}")
    s = np.linspace(0.0, 1.0, SAMPLES)
    with styled():
        fig = new_figure(TWO_COLUMN, INCHES)
        panels = [fig.add_axes((0.078 + 0.497 * k, 0.108, 0.412, 0.49)) for k in range(2)]
        sampled = [RodState(state).at(s) for state in states]
        fields = (([x.k1 for x in sampled], CURVATURE_LABEL), ([x.tau for x in sampled], TWIST_LABEL))
        for letter, ax, (curves, title) in zip("ab", panels, fields, strict=True):
            ax.axhline(0.0, color=FAINT, lw=0.5, zorder=0.5)
            lines = [
                ax.plot(s, values, color=color, lw=1.3, gid=f"{state[control.parameter]:g}")[0]
                for color, state, values in zip(SEQUENCE, states, curves, strict=False)
            ]
            ax.set_xlim(0.0, 1.0)
            draw_coinciding(lines, ax)
            ax.set_xlabel(ARCLENGTH_LABEL)
            ax.set_ylabel(title, labelpad=2.0)
            ax.text(0.018, 0.965, f"({letter})", transform=ax.transAxes, va="top", ha="left")
        fig.text(0.078, 0.965, setting_of(states[0], without=(control.name,)), va="center", ha="left", fontsize=9.0)
        _draw_bands(states, control, fig)
        fig.draw_without_rendering()
    return fig


def _draw_bands(states: Sequence[Solution], control: Control, fig: Figure) -> None:
    """All bands at one scale, each with its value below."""
    drawings = []
    for color, state in zip(SEQUENCE, states, strict=False):
        ax = fig.add_axes((0.0, 0.0, 0.1, 0.1), label=f"band {state[control.parameter]:g}")
        render_band(state, ax=ax, color=color)
        drawings.append((ax, np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())))
    page = np.array([TWO_COLUMN, INCHES])
    cell = 0.94 / len(states)
    scale = min(
        0.9 * cell * TWO_COLUMN / max(across for _, across, _ in drawings),
        0.24 * INCHES / max(up for _, _, up in drawings),
    )
    for k, ((ax, across, up), state) in enumerate(zip(drawings, states, strict=True)):
        size = np.array([across, up]) * scale
        middle = 0.06 + (k + 0.5) * cell
        corner = np.array([middle, 0.81]) * page - 0.5 * size
        ax.set_position((*(corner / page), *(size / page)))
        equation = control.equation(control.value(parameters_of(state)))
        fig.text(middle, 0.65, f"${equation}$", color=SEQUENCE[k], ha="center", fontsize=NAME_SIZE)
    triad = fig.add_axes((0.004, 0.63, 0.07, 0.07 * TWO_COLUMN / INCHES))
    draw_triad(ax=triad)
