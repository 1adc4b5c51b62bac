"""The plane of clamp angle and shear with the loci of numbered bifurcations and their special points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.plot.style import INK, TWO_COLUMN, UNNAMED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
NAMES = {
    "cusp": "cusp", "extremum": "extreme angle", "criticality": "super-/subcritical",
    "coalescence": "fold meets branch point", "crossing": "crossing",
}  # fmt: skip


def draw_loci(loci: Any, numbers: Sequence[int] = (), ax: Axes | None = None) -> Axes:
    """Draw loci in the plane of angle and shear.

    Parameters
    ----------
    loci : a :class:`rodatlas.atlas.Loci`.
    numbers : those to label and draw in color, all when empty; other pieces of the same curves are thin and gray.
    ax : where to draw; a new figure by default.

    Returns
    -------
    the axes drawn on.
    """
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    with styled():
        if ax is None:
            fig = new_figure(TWO_COLUMN, 4.6)
            ax = fig.add_axes((0.075, 0.1, 0.91, 0.86))
        shown = [p for p in loci.pieces if p.number is not None and (not numbers or p.number in numbers)]
        curves = {p.curve for p in shown}
        for piece in loci.pieces:
            angle, shear = _plane(piece.points)
            style = dict(LINES[piece.kind])
            if piece in shown:
                ax.plot(angle, shear, **style)
            elif piece.curve in curves:
                ax.plot(angle, shear, **(style | {"color": UNNAMED, "lw": 0.5}))
        _draw_events(shown, ax)
        _label(shown, ax)
        _draw_legend(shown, ax)
        ax.set_xlabel(r"clamp angle $\psi_0$ [deg]")
        ax.set_ylabel(r"shear $\Delta D$")
        ax.set_xlim(0.0, loci.settings.angle_max)
    return ax


def draw_loci_figure(loci: Any, numbers: Sequence[int] = ()) -> Figure:
    """The same as a figure of its own."""
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    return draw_loci(loci, numbers).figure  # type: ignore[return-value]


def _plane(points: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Angle in degrees and shear, smooth between the points."""
    from scipy.interpolate import CubicSpline

    values = np.array([[np.degrees(p["psi0"]) / 100, p["dD"]] for p in points])
    values = values[np.concatenate([[True], np.linalg.norm(np.diff(values, axis=0), axis=1) > 1e-9])]
    if len(values) < 3:
        return 100 * values[:, 0], values[:, 1]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
    fine = CubicSpline(length, values)(np.unique(np.concatenate([length, np.linspace(0, length[-1], 400)])))
    return 100 * fine[:, 0], fine[:, 1]


def _draw_events(shown: Sequence[Any], ax: Axes) -> None:
    """Special points, those at which a locus is extreme in shear left out: nothing happens to a slice there."""
    drawn: list[tuple[float, float]] = []
    for e in (e for p in shown for e in p.events if e.event.parameter != "dD"):
        place = (e.angle_deg, e.shear)
        if any(abs(a - place[0]) < 0.01 and abs(b - place[1]) < 1e-4 for a, b in drawn):
            continue
        drawn.append(place)
        style = EVENTS[e.event.kind]
        ax.plot(*place, ls="none", mec=INK, mew=0.7, zorder=4, **style)


def _label(shown: Sequence[Any], ax: Axes) -> None:
    """Numbers beside the curves, where other curves and numbers are far."""
    clouds = [np.column_stack(_plane(p.points)) / [80.0, 1.0] for p in shown]
    taken: list[np.ndarray] = []
    for k in sorted(range(len(shown)), key=lambda k: len(clouds[k])):
        others = np.vstack([c for i, c in enumerate(clouds) if i != k] + [np.full((1, 2), 9.0)])
        inner = clouds[k][len(clouds[k]) // 12 : -max(len(clouds[k]) // 12, 1)]
        inner = inner if len(inner) else clouds[k]
        gap = np.min(np.linalg.norm(inner[:, None] - others[None], axis=2), axis=1)
        if taken:
            gap = np.minimum(gap, np.min(np.linalg.norm(inner[:, None] - np.array(taken)[None], axis=2), axis=1))
        at = inner[int(np.argmax(np.minimum(gap, 0.08)))]
        taken.append(at)
        color = LINES[shown[k].kind]["color"]
        style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.5, "color": color, "zorder": 5}
        style["bbox"] = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none"}
        if np.ptp(clouds[k], axis=0).max() < 0.05:  # too short to carry its number
            style |= {"xytext": (26, 16), "textcoords": "offset points", "arrowprops": {"arrowstyle": "-", "lw": 0.5}}
        ax.annotate(str(shown[k].number), (at[0] * 80.0, at[1]), **style)


def _draw_legend(shown: Sequence[Any], ax: Axes) -> None:
    from matplotlib.lines import Line2D

    kinds = dict.fromkeys(p.kind for p in shown)
    events = {e.event.kind for p in shown for e in p.events if e.event.parameter != "dD"}
    handles = [Line2D([], [], **LINES[kind], label=kind) for kind in LINES if kind in kinds]
    marks: dict[str, Any] = {"ls": "none", "mec": INK, "mew": 0.7}
    handles += [Line2D([], [], **marks, **EVENTS[kind], label=NAMES[kind]) for kind in EVENTS if kind in events]
    if handles:
        ax.legend(handles=handles, loc="upper left", ncols=2, handlelength=2.6)
