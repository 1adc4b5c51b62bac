"""Sketches of the set-up: a clamped band with its clamp angles, compression, shear and directors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.plot.band.render import DEFAULT_VIEW, View, draw_triad, render_band
from rodatlas.plot.band.surface import band_surface
from rodatlas.plot.look.style import INK, TWO_COLUMN, color_of, label_of, new_figure, styled
from rodatlas.plot.slices.panel import NAME_SIZE
from rodatlas.rods.state import RodState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution

INCHES = 2.9
WIDTH = 1.0 / 12.0
RADIUS, BASE = 0.13, 0.2  # of the arcs of the clamp angle and length of their base lines [L]
ARROW = 0.13  # length of the directors [L]
THIN: dict[str, Any] = {"color": INK, "lw": 0.6, "zorder": 8}
DIRECTOR_COLORS = ("#860228", "#09AF6B", "#031C97")


def draw_setup(
    states: Mapping[str, tuple[Solution, float]], colors: Mapping[str, str], view: View = DEFAULT_VIEW
) -> Figure:
    """Draw bands side by side with what defines their setting.

    Parameters
    ----------
    states : name -> solution, and the arclength at which its directors are drawn. colors : by name.

    Returns
    -------
    a figure as wide as a page.
    """
    with styled():
        fig = new_figure(TWO_COLUMN, INCHES)
        drawings = []
        for k, (name, (solution, at)) in enumerate(states.items()):
            ax = fig.add_axes((0.0, 0.0, 0.1, 0.1), label=name)
            render_band(solution, WIDTH, view, ax, color=color_of(name, colors), margin=0.14)
            _draw_lengths(solution, view, ax)
            for end in (0, 1):
                _draw_angle(solution, view, end, ax)
            _draw_directors(solution, view, at, ax)
            drawings.append((ax, np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())))
            middle = (k + 0.5) / len(states)
            fig.text(middle, 0.94, f"({'abcdef'[k]})  {label_of(name)}", ha="center", fontsize=NAME_SIZE)
        page = np.array([TWO_COLUMN, INCHES])
        cell = TWO_COLUMN / len(states)
        scale = min(
            0.96 * cell / max(across for _, across, _ in drawings), 0.86 * INCHES / max(up for _, _, up in drawings)
        )
        for k, (ax, across, up) in enumerate(drawings):
            size = np.array([across, up]) * scale
            ax.set_position((*((np.array([(k + 0.5) / len(states), 0.47]) * page - 0.5 * size) / page), *(size / page)))
        draw_triad(view, fig.add_axes((0.0, 0.0, 0.085, 0.085 * TWO_COLUMN / INCHES)), size=8.5)
        fig.draw_without_rendering()
    return fig


def _line(points: list[np.ndarray], view: View, ax: Axes, **style: Any) -> None:
    """A line in space."""
    ax.plot(*view.project(np.array(points))[:, :2].T, **(THIN | style))


def _draw_lengths(solution: Solution, view: View, ax: Axes) -> None:
    """The distance of the clamps along x and their shear along z, as two sides of a triangle below the clamps."""
    lowest = float(band_surface(solution, WIDTH).vertices[..., 1].min())
    down = np.array([0.0, min(lowest, 0.0) - 0.15, 0.0])
    clamps = RodState(solution).clamps
    left, right = np.array(clamps.left.position), np.array(clamps.right.position)
    corner = np.array([*right[:2], left[2]])
    for end in (left, right):
        _line([end + 0.1 * down, end + 1.15 * down], view, ax, lw=0.4, ls=(0, (2.0, 2.0)))
    sides = ((left, corner, r"$L-\Delta L$", (9.0, -5.0)), (corner, right, r"$\Delta D$", (-9.0, -5.0)))
    for one, two, text, side in sides:
        seen = view.project(np.array([one + down, two + down]))[:, :2]
        _arrow(seen[0], seen[1], ax, style="<|-|>,head_length=0.3,head_width=0.1", lw=0.6, color=INK)
        middle = seen.mean(axis=0)
        ax.annotate(
            text, xy=(middle[0], middle[1]), xytext=side, textcoords="offset points", ha="center", va="top",
            fontsize=9.0, zorder=9,
        )  # fmt: skip


def _arrow(tail: np.ndarray, tip: np.ndarray, ax: Axes, style: str, **look: Any) -> None:
    """An arrow on the page."""
    arrow = {"arrowstyle": style, "shrinkA": 0, "shrinkB": 0, **look}
    ax.annotate("", xy=(tip[0], tip[1]), xytext=(tail[0], tail[1]), arrowprops=arrow, zorder=9)


def _draw_angle(solution: Solution, view: View, end: int, ax: Axes) -> None:
    """The clamp angle between the direction of x and the tangent, in the plane of x and y."""
    from matplotlib.patheffects import withStroke

    clamps = RodState(solution).clamps
    pose, outward = (clamps.left, 1.0) if end == 0 else (clamps.right, -1.0)
    place, tangent = np.array(pose.position), pose.directors[2]
    angle = np.arctan2(tangent[1], tangent[0])
    turns = np.linspace(0.0, angle, 30)
    _line([place, place + outward * BASE * np.array([1.0, 0.0, 0.0])], view, ax, ls=(0, (4.0, 2.0)))
    _line([place, place + outward * BASE * tangent], view, ax)
    _line([place + outward * RADIUS * np.array([np.cos(t), np.sin(t), 0.0]) for t in turns], view, ax)
    middle = view.project(place + outward * 1.5 * RADIUS * np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0]))[:2]
    halo = [withStroke(linewidth=2.5, foreground="white")]
    ax.text(middle[0], middle[1], r"$\psi_0$", ha="center", va="center", fontsize=9.0, zorder=9, path_effects=halo)


def _draw_directors(solution: Solution, view: View, at: float, ax: Axes) -> None:
    """The directors d1 (width), d2 (normal), d3 (tangent) at an arclength."""
    surface = band_surface(solution, WIDTH, 201)
    k = round(200 * at)
    start = surface.centerline[k]
    for name, direction, color in zip("123", surface.directors[:, k], DIRECTOR_COLORS, strict=True):
        tail, tip = view.project(start)[:2], view.project(start + ARROW * direction)[:2]
        _arrow(tail, tip, ax, style="-|>,head_length=0.35,head_width=0.14", lw=1.1, color=color)
        x, y = tip + 0.035 * (tip - tail) / max(np.hypot(*(tip - tail)), 1e-9)
        ax.text(x, y, rf"$\mathbf{{d}}_{name}$", color=color, ha="center", va="center", fontsize=9.0, zorder=9)
