"""The plane of clamp angle and shear with the loci of numbered bifurcations and their special points."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.plot.heading import setting_text
from rodatlas.plot.labels import label_lines
from rodatlas.plot.style import INK, TWO_COLUMN, UNNAMED, check_axes, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# Curves of folds are solid, of pitchforks dashed; colors as far apart as those of the states.
LINES: dict[str, dict[str, Any]] = {
    "fold": {"color": "#237EEB", "lw": 1.2, "ls": "-"},
    "pitchfork": {"color": "#860228", "lw": 1.2, "ls": (0, (5.0, 1.8))},
    "branch point": {"color": "#7E6000", "lw": 1.2, "ls": (0, (1.2, 1.4))},
}
EVENTS: dict[str, dict[str, Any]] = {
    "cusp": {"marker": "v", "ms": 4.6, "mfc": "white"},
    "extremum": {"marker": "o", "ms": 4.2, "mfc": "white"},
    "criticality": {"marker": "D", "ms": 3.6, "mfc": INK},
    "coalescence": {"marker": "s", "ms": 3.6, "mfc": INK},
    "crossing": {"marker": "X", "ms": 4.6, "mfc": INK},
}
MARK: dict[str, Any] = {"ls": "none", "mec": INK, "mew": 0.7}
OTHER: dict[str, Any] = {"color": UNNAMED, "lw": 0.5, "ls": "-"}  # pieces of a shown curve that have other numbers
INCHES, TITLE_PAD = 4.8, 5.0  # height of a figure of its own; distance of the setting from the axes in points
NAMES = {
    "cusp": "cusp", "extremum": "extreme angle", "criticality": "super-/subcritical",
    "coalescence": "fold meets branch point", "crossing": "crossing",
}  # fmt: skip


def draw_loci(loci: Any, numbers: Sequence[int] = (), ax: Axes | None = None) -> Axes:
    """Draw loci in the plane of angle and shear, with the compression and Poisson's ratio above.

    Parameters
    ----------
    loci : a :class:`rodatlas.atlas.Loci`.
    numbers : those to label and draw in color, all when empty; other pieces of the same curves are thin and gray.
    ax : where to draw; a figure as wide as a page by default.

    Returns
    -------
    the axes drawn on.
    """
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    check_axes(ax)
    with styled():
        if ax is None:
            ax = new_figure(TWO_COLUMN, INCHES).add_axes((0.075, 0.092, 0.91, 0.82))
        shown = [p for p in loci.pieces if p.number is not None and (not numbers or p.number in numbers)]
        places = {id(p): _plane(p.points) for p in loci.pieces}
        curves = {p.curve for p in shown}
        for piece in loci.pieces:
            style = dict(LINES[piece.kind])
            if piece in shown:
                ax.plot(*places[id(piece)].T, **style)
            elif piece.curve in curves:
                ax.plot(*places[id(piece)].T, **(style | OTHER))
        _draw_events(shown, ax)
        draw_plane_axes(ax)
        ax.set_xlim(0.0, loci.settings.angle_max)
        settings = loci.settings
        ax.set_title(setting_text(dL=settings.compression, nu=settings.poisson), loc="left", pad=TITLE_PAD)
        _draw_legend(loci, shown, ax)
        texts, colors = [str(p.number) for p in shown], [LINES[p.kind]["color"] for p in shown]
        label_lines([places[id(p)] for p in shown], texts, colors, ax)
    return ax


def draw_plane_axes(ax: Axes) -> None:
    """The names of the axes of the plane of angle and shear, with their units."""
    ax.set_xlabel(ANGLE_LABEL)
    ax.set_ylabel(SHEAR_LABEL)


def draw_loci_figure(loci: Any, numbers: Sequence[int] = ()) -> Figure:
    """The same as a figure of its own."""
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    return cast("Figure", draw_loci(loci, numbers).figure)


def _plane(points: Sequence[Any]) -> np.ndarray:
    """(n, 2) angles in degrees and shears, smooth between the points."""
    from scipy.interpolate import CubicSpline

    values = np.array([[np.degrees(p["psi0"]) / 100, p["dD"]] for p in points])
    values = values[np.concatenate([[True], np.linalg.norm(np.diff(values, axis=0), axis=1) > 1e-9])]
    if len(values) < 3:
        return values * [100, 1]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
    fine = CubicSpline(length, values)(np.unique(np.concatenate([length, np.linspace(0, length[-1], 400)])))
    return fine * [100, 1]


def _draw_events(shown: Sequence[Any], ax: Axes) -> None:
    """Special points, those at which a locus is extreme in shear left out: nothing happens to a slice there."""
    drawn: list[tuple[float, float]] = []
    for e in (e for p in shown for e in p.events if e.event.parameter != "dD"):
        place = (e.angle_deg, e.shear)
        if any(abs(a - place[0]) < 0.01 and abs(b - place[1]) < 1e-4 for a, b in drawn):
            continue
        drawn.append(place)
        style = EVENTS[e.event.kind]
        ax.plot(*place, zorder=4, **MARK, **style)


def _draw_legend(loci: Any, shown: Sequence[Any], ax: Axes) -> None:
    """What lines and marks mean, above the axes on the right, in at most two rows."""
    from matplotlib.lines import Line2D

    kinds = {p.kind for p in shown}
    events = {e.event.kind for p in shown for e in p.events if e.event.parameter != "dD"}
    handles = key_of(kinds, events)
    curves = {p.curve for p in shown}
    if any(p.curve in curves and p not in shown for p in loci.pieces):
        handles.insert(len(kinds), Line2D([], [], **OTHER, label="rest of the curve"))
    if handles:
        ax.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(4, len(handles)),
            handlelength=2.4, columnspacing=1.4, borderaxespad=0.2, fontsize=7.5, labelspacing=0.35,
        )  # fmt: skip


def key_of(kinds: Collection[str], events: Collection[str]) -> list[Line2D]:
    """Entries of a legend for the kinds of bifurcations and of special points that are drawn."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **LINES[kind], label=kind) for kind in LINES if kind in kinds]
    return handles + [Line2D([], [], **MARK, **EVENTS[kind], label=NAMES[kind]) for kind in EVENTS if kind in events]
