"""Where two states of a band store their energy: bending, twist and both along the band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.plot.band.render import draw_triad, render_band
from rodatlas.plot.look.heading import ARCLENGTH_LABEL, setting_of
from rodatlas.plot.look.style import FAINT, TWO_COLUMN, color_of, label_of, new_figure, styled
from rodatlas.plot.shapes.profiles import SAMPLES
from rodatlas.rods.state import RodState

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution

INCHES = 3.75
LINES: tuple[Any, Any] = ("-", (0, (4.0, 1.4)))


def draw_energies(
    states: Mapping[str, Solution], colors: Mapping[str, str], roles: tuple[str, str] = ("before", "after")
) -> Figure:
    r"""Draw twice the energy densities :math:`a\kappa_1^2`, :math:`\tau^2` and their sum of two states.

    Parameters
    ----------
    states : two, name -> solution, in order. colors : by name. roles : a word for each.

    Returns
    -------
    a figure as wide as a page, with drawings of both bands above the panels.
    """
    if len(states) != 2:
        raise ValueError(f"states: expected two, got {len(states)}")
    s = np.linspace(0.0, 1.0, SAMPLES)
    first = next(iter(states.values()))
    titles = (r"bending $a\kappa_1^2$", r"twist $\tau^2$", r"total $a\kappa_1^2+\tau^2$")
    with styled():
        fig = new_figure(TWO_COLUMN, INCHES)
        panels = [fig.add_axes((0.082 + 0.31 * k, 0.125, 0.288, 0.495)) for k in range(3)]
        highest = 0.0
        for (name, solution), line, role in zip(states.items(), LINES, roles, strict=True):
            bending, twist = (2.0 * part for part in RodState(solution).at(s).energy_density_parts)
            highest = max(highest, float((bending + twist).max()))
            for ax, values in zip(panels, (bending, twist, bending + twist), strict=True):
                label = f"{label_of(name)}, {role}"
                ax.plot(s, values, color=color_of(name, colors), lw=1.3, ls=line, label=label, gid=name)
        for letter, ax, title in zip("abc", panels, titles, strict=True):
            ax.axhline(0.0, color=FAINT, lw=0.5, zorder=0.5)
            ax.set_xlim(0.0, 1.0)
            ax.set_ylim(-0.03 * highest, 1.08 * highest)
            ax.set_xticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0], ["0", "0.2", "0.4", "0.6", "0.8", "1"])
            ax.set_xlabel(ARCLENGTH_LABEL)
            ax.text(0.5, 0.955, f"({letter}) {title}", transform=ax.transAxes, va="top", ha="center")
            if ax is not panels[0]:
                ax.tick_params(labelleft=False)
        panels[0].set_ylabel("twice the energy density  ($GJ/L^2$)")
        fig.text(0.082, 0.955, setting_of(first), va="center", ha="left", fontsize=9.0)
        fig.legend(*panels[0].get_legend_handles_labels(), loc="center right", bbox_to_anchor=(0.992, 0.955), ncols=2,
                   fontsize=9.0, borderaxespad=0.0, handlelength=2.2)  # fmt: skip
        _draw_bands(states, colors, fig)
        fig.draw_without_rendering()
    return fig


def _draw_bands(states: Mapping[str, Solution], colors: Mapping[str, str], fig: Figure) -> None:
    """Both bands at one scale, and the directions of space."""
    drawings = []
    for name, solution in states.items():
        ax = fig.add_axes((0.0, 0.0, 0.1, 0.1), label=f"band {name}")
        render_band(solution, ax=ax, color=color_of(name, colors))
        drawings.append((ax, np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())))
    scale = 2.2 / max(across for _, across, _ in drawings)
    page = np.array([TWO_COLUMN, INCHES])
    for (ax, across, up), middle in zip(drawings, (0.27, 0.73), strict=True):
        size = np.array([across, up]) * scale
        corner = np.array([middle, 0.785]) * page - 0.5 * size
        ax.set_position((*(corner / page), *(size / page)))
    triad = fig.add_axes((0.47, 0.73, 0.075, 0.075 * TWO_COLUMN / INCHES))
    draw_triad(ax=triad)
