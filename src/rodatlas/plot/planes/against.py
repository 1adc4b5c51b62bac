"""Where numbered bifurcations lie, against a second control."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.look.style import FAINT, ONE_COLUMN, TWO_COLUMN, new_figure, styled
from rodatlas.plot.planes.loci import LINES
from rodatlas.plot.slices.panel import NOTE_SIZE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCHES = 4.3
GAP = 0.026  # smallest distance of two labels, part of the axes' height


def draw_curves_against(
    curves: Mapping[str, tuple[str, np.ndarray, np.ndarray]], labels: tuple[str, str], setting: str = ""
) -> Figure:
    """Draw curves with their names at the right end.

    Parameters
    ----------
    curves : name -> kind of bifurcation, values of the second control (n,), values of the first one (n,).
    labels : of the axes, the second control first. setting : what is fixed, above the axes.

    Returns
    -------
    a figure of one and a half columns.
    """
    from matplotlib.lines import Line2D
    from scipy.interpolate import CubicSpline

    if not curves:
        raise ValueError("curves: expected at least one, got none")
    with styled():
        fig = new_figure(0.5 * (ONE_COLUMN + TWO_COLUMN), INCHES)
        ax = fig.add_axes((0.115, 0.105, 0.825, 0.825))
        ends = {}
        for name, (kind, values, places) in curves.items():
            even = np.linspace(values[0], values[-1], 200)
            smooth = CubicSpline(values, places)(even) if len(values) > 2 else np.interp(even, values, places)
            ax.plot(even, smooth, gid=name, **LINES[kind])
            ends[name] = (kind, float(values[-1]), float(places[-1]))
        low, high = min(v[0] for _, v, _ in curves.values()), max(v[-1] for _, v, _ in curves.values())
        ax.set_xlim(low, high)
        ax.set_xlabel(labels[0])
        ax.set_ylabel(labels[1])
        bottom, top = ax.get_ylim()
        bottom = min(bottom, 0.0)
        ax.set_ylim(bottom, top)
        ax.axhline(0.0, color=FAINT, lw=0.5, zorder=0.5)
        heights = _apart([(place - bottom) / (top - bottom) for _, _, place in ends.values()])
        for (name, (kind, value, place)), y in zip(ends.items(), heights, strict=True):
            seen = ax.transAxes.inverted().transform(ax.transData.transform((value, place)))
            ax.annotate(
                name, xy=(seen[0], seen[1]), xytext=(1.028, y), xycoords="axes fraction", textcoords="axes fraction",
                ha="left", va="center_baseline", fontsize=NOTE_SIZE + 1.0, color=LINES[kind]["color"],
                annotation_clip=False, arrowprops={"arrowstyle": "-", "lw": 0.4, "color": LINES[kind]["color"],
                                                   "shrinkA": 0.5, "shrinkB": 0.5, "relpos": (0.0, 0.4)},
            )  # fmt: skip
        ax.set_title(setting, loc="left", pad=5.0)
        kinds = dict.fromkeys(kind for kind, _, _ in curves.values())
        handles = [Line2D([], [], **LINES[kind], label=kind) for kind in kinds]
        ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1,
                  handlelength=2.6, borderpad=0.3)  # fmt: skip
        fig.draw_without_rendering()
    return fig


def _apart(places: list[float]) -> list[float]:
    """Places moved apart to at least `GAP`, in their order, each as little as this allows."""
    from rodatlas.plot.slices.arrangement import isotonic

    order = np.argsort(places, kind="stable")
    shift = GAP * np.arange(len(places))
    moved = np.empty(len(places))
    moved[order] = np.asarray(isotonic(np.array(places)[order] - shift)) + shift
    return [float(y) for y in moved]
