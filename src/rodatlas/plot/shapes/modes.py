"""A critical mode: the band moved along it to both sides, and displacement and rotation along the band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rodatlas.plot.band.render import draw_triad, render_band
from rodatlas.plot.look.heading import ARCLENGTH_LABEL, setting_of
from rodatlas.plot.look.style import FAINT, TWO_COLUMN, label_of, new_figure, styled
from rodatlas.plot.shapes.sequence import SEQUENCE
from rodatlas.plot.slices.panel import NOTE_SIZE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution

INCHES = 4.4
STYLES: tuple[dict[str, Any], ...] = (
    {"color": SEQUENCE[0], "ls": "-"},
    {"color": SEQUENCE[4], "ls": (0, (4.0, 1.4))},
    {"color": SEQUENCE[3], "ls": (0, (1.4, 1.2))},
)


class ModeLike(Protocol):
    """What is read from a mode; see :class:`rodatlas.rods.Mode`."""

    @property
    def solution(self) -> Solution: ...
    @property
    def s(self) -> np.ndarray: ...
    @property
    def rotation(self) -> np.ndarray: ...
    @property
    def displacement(self) -> np.ndarray: ...
    def moved(self, amplitude: float) -> Solution: ...


def draw_mode(mode: ModeLike, amplitude: float, name: str, color: str) -> Figure:
    """Draw an equilibrium, the band moved along a mode by some amplitude to both sides, and the mode.

    Parameters
    ----------
    amplitude : largest displacement of the drawn bands, in units of the length.
    name, color : of the state.

    Returns
    -------
    a figure as wide as a page.
    """
    if not amplitude > 0:
        raise ValueError(f"amplitude: expected a positive number, got {amplitude}")
    first = mode.solution
    with styled():
        fig = new_figure(TWO_COLUMN, INCHES)
        panels = [fig.add_axes((0.078 + 0.497 * k, 0.105, 0.412, 0.42)) for k in range(2)]
        fields = (
            ("displacement / its largest", mode.displacement, ("$u_x$", "$u_y$", "$u_z$")),
            ("rotation / largest displacement  ($1/L$)", mode.rotation, (r"$\theta_x$", r"$\theta_y$", r"$\theta_z$")),
        )
        even = np.linspace(0.0, 1.0, 401)
        for letter, ax, (title, values, labels) in zip("ab", panels, fields, strict=True):
            ax.axhline(0.0, color=FAINT, lw=0.5, zorder=0.5)
            for column, label, style in zip(values.T, labels, STYLES, strict=True):
                ax.plot(even, _smooth(mode.s, column, even), lw=1.3, label=label, **style)
            ax.set_xlim(0.0, 1.0)
            low, high = ax.get_ylim()
            ax.set_ylim(low, high + 0.22 * (high - low))
            ax.set_xlabel(ARCLENGTH_LABEL)
            ax.set_ylabel(title, labelpad=2.0)
            ax.text(0.018, 0.965, f"({letter})", transform=ax.transAxes, va="top", ha="left")
            ax.legend(loc="upper right", ncols=3, handlelength=2.2, columnspacing=1.0, borderaxespad=0.2)
        fig.text(0.078, 0.965, setting_of(first), va="center", ha="left", fontsize=9.0)
        bands = {
            rf"moved by $-{amplitude:g}\,L$": mode.moved(-amplitude), f"{label_of(name)}, in equilibrium": first,
            rf"moved by $+{amplitude:g}\,L$": mode.moved(amplitude),
        }  # fmt: skip
        _draw_bands(bands, color, fig)
        fig.draw_without_rendering()
    return fig


def _smooth(s: np.ndarray, values: np.ndarray, even: np.ndarray) -> np.ndarray:
    from scipy.interpolate import CubicSpline

    return CubicSpline(s, values)(even)


def _draw_bands(bands: dict[str, Solution], color: str, fig: Figure) -> None:
    """The bands side by side at one scale."""
    drawings = []
    for label, state in bands.items():
        ax = fig.add_axes((0.0, 0.0, 0.1, 0.1), label=label)
        render_band(state, ax=ax, color=color)
        drawings.append((ax, np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())))
    page = np.array([TWO_COLUMN, INCHES])
    scale = min(1.75 / max(across for _, across, _ in drawings), 1.3 / max(up for _, _, up in drawings))
    for k, ((ax, across, up), label) in enumerate(zip(drawings, bands, strict=True)):
        size = np.array([across, up]) * scale
        middle = 0.2 + 0.31 * k
        ax.set_position((*((np.array([middle, 0.775]) * page - 0.5 * size) / page), *(size / page)))
        fig.text(middle, 0.585, label, ha="center", fontsize=NOTE_SIZE + 1.0, color=color)
    triad = fig.add_axes((0.0, 0.565, 0.07, 0.07 * TWO_COLUMN / INCHES))
    draw_triad(ax=triad)
