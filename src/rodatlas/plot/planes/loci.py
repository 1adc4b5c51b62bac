"""The plane of two controls with the loci of bifurcations and their special points."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.plot.look.heading import setting_text
from rodatlas.plot.look.labels import label_lines
from rodatlas.plot.look.protocols import PlaneLike
from rodatlas.plot.look.style import INK, TWO_COLUMN, UNNAMED, check_axes, new_figure, styled

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
    "cusp": "cusp", "extremum": "extremum", "criticality": "super-/subcritical",
    "coalescence": "fold meets branch point", "crossing": "crossing",
}  # fmt: skip


def draw_loci(loci: Any, numbers: Sequence[int] = (), ax: Axes | None = None) -> Axes:
    """Draw loci in the plane of two controls, with the values of the others above.

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
        settings = loci.settings
        places = {id(p): _plane(p.places[:, :2], settings.second_scale) for p in loci.pieces}
        curves = {p.curve for p in shown}
        for piece in loci.pieces:
            style = dict(LINES[piece.kind])
            if piece in shown:
                ax.plot(*places[id(piece)].T, **style)
            elif piece.curve in curves:
                ax.plot(*places[id(piece)].T, **(style | OTHER))
        _draw_events(settings, shown, ax)
        draw_plane_axes(settings, ax)
        ax.set_xlim(settings.second_low, settings.second_high)
        ax.set_title(setting_text(settings.model.controls, settings.setting), loc="left", pad=TITLE_PAD)
        _draw_legend(loci, shown, ax)
        texts, colors = [str(p.number) for p in shown], [LINES[p.kind]["color"] for p in shown]
        label_lines([places[id(p)] for p in shown], texts, colors, ax)
    return ax


def draw_plane_axes(settings: PlaneLike, ax: Axes) -> None:
    """The names of the axes of a plane, with their units."""
    ax.set_xlabel(settings.second_control.label)
    ax.set_ylabel(settings.along_control.label)


def draw_loci_figure(loci: Any, numbers: Sequence[int] = ()) -> Figure:
    """The same as a figure of its own."""
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    return cast("Figure", draw_loci(loci, numbers).figure)


def _plane(places: np.ndarray, scale: float) -> np.ndarray:
    """(n, 2) places of the second and the first control, smooth between the points.

    Parameters
    ----------
    scale : how much of the second control counts as much as a unit of the first.
    """
    from scipy.interpolate import CubicSpline

    values = places / [scale, 1.0]
    values = values[np.concatenate([[True], np.linalg.norm(np.diff(values, axis=0), axis=1) > 1e-9])]
    if len(values) < 3:
        return values * [scale, 1.0]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
    fine = CubicSpline(length, values)(np.unique(np.concatenate([length, np.linspace(0, length[-1], 400)])))
    return fine * [scale, 1.0]


def _seen(settings: PlaneLike, shown: Sequence[Any]) -> list[Any]:
    """Special points of pieces, without those at which a locus is extreme in the control along slices: there nothing
    happens to a slice."""
    return [e for p in shown for e in p.events if settings.control_of(e.event.parameter) != settings.along]


def _draw_events(settings: PlaneLike, shown: Sequence[Any], ax: Axes) -> None:
    """Special points, each once."""
    drawn: list[tuple[float, float]] = []
    size = settings.units
    for e in _seen(settings, shown):
        place = (e.second, e.value)
        if any(abs(a - place[0]) < 0.01 * size[0] and abs(b - place[1]) < 1e-4 * size[1] for a, b in drawn):
            continue
        drawn.append(place)
        style = EVENTS[e.event.kind]
        ax.plot(*place, zorder=4, **MARK, **style)


def _draw_legend(loci: Any, shown: Sequence[Any], ax: Axes) -> None:
    """What lines and marks mean, above the axes on the right, in at most two rows."""
    from matplotlib.lines import Line2D

    kinds = {p.kind for p in shown}
    events = {e.event.kind for e in _seen(loci.settings, shown)}
    handles = key_of(loci.settings, kinds, events)
    curves = {p.curve for p in shown}
    if any(p.curve in curves and p not in shown for p in loci.pieces):
        handles.insert(len(kinds), Line2D([], [], **OTHER, label="rest of the curve"))
    if handles:
        ax.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(4, len(handles)),
            handlelength=2.4, columnspacing=1.4, borderaxespad=0.2, fontsize=7.5, labelspacing=0.35,
        )  # fmt: skip


def key_of(settings: PlaneLike, kinds: Collection[str], events: Collection[str]) -> list[Line2D]:
    """Entries of a legend for the kinds of bifurcations and of special points that are drawn."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **LINES[kind], label=kind) for kind in LINES if kind in kinds]
    names = NAMES | {"extremum": f"extreme {settings.second}"}
    return handles + [Line2D([], [], **MARK, **EVENTS[kind], label=names[kind]) for kind in EVENTS if kind in events]
