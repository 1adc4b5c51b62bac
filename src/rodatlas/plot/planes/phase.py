"""The phase diagram: all loci in the plane of two controls, shaded by the number of stable states; and one panel for
each state with its region of stability.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.plot.look.heading import setting_text
from rodatlas.plot.look.labels import label_lines
from rodatlas.plot.look.style import (
    INK,
    ONE_COLUMN,
    TWO_COLUMN,
    UNNAMED,
    check_axes,
    color_of,
    colors_in_order,
    label_of,
    new_figure,
    styled,
)
from rodatlas.plot.planes.loci import EVENTS, LINES, MARK, TITLE_PAD, draw_plane_axes, key_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMOOTH: dict[str, Any] = {"color": INK, "lw": 0.9, "ls": (0, (1.0, 1.6))}
ELSEWHERE: dict[str, Any] = {"color": "#C4C4C4", "lw": 0.4, "ls": "-"}  # loci that do not bound a state's region
THIN = 0.6  # width of pieces of loci without a number
LEAST_PAD = 0.006  # of the plane, around the mark of a close-up
SIDE = 1.3  # width of the sides of a state's region
# Heights in inches: of the plane, below it, of its key above, of close-ups; of a row of panels and the line above them.
PLANE, BELOW, ABOVE, CLOSER, ROW, HEAD = 4.1, 0.42, 0.58, 2.1, 2.0, 0.25
Window = tuple[float, float, float, float]
"""Least and largest value of the second control, least and largest of the first."""


class CloseUp(NamedTuple):
    """A part of a plane that is shown larger: where, its title, and the corner at which its letter stands."""

    window: Window
    title: str
    corner: Literal["upper", "lower"]


def draw_phase_figure(diagram: Any, close_ups: Sequence[CloseUp] = ()) -> Figure:
    """The whole plane with numbers on its loci, and close-ups of what is too small to see in it.

    Parameters
    ----------
    diagram : a :class:`rodatlas.atlas.PhaseDiagram`.
    close_ups : of which those are drawn that the diagram covers.

    Returns
    -------
    a figure as wide as a page.
    """
    check_has("diagram", diagram, ("settings", "faces", "names"), "a PhaseDiagram, see PhaseDiagram.load")
    settings = diagram.settings
    shown = [close_up for close_up in close_ups if _inside(close_up.window, settings.frame)]
    with styled():
        height = BELOW + PLANE + ABOVE + (CLOSER if shown else 0.0)
        fig = new_figure(TWO_COLUMN, height)
        main = fig.add_axes((0.072, (BELOW + (CLOSER if shown else 0.0)) / height, 0.915, PLANE / height))
        draw_phase(diagram, keep_clear=[(box[1], box[3]) for box, *_ in shown], ax=main)
        for k, (box, title, corner) in enumerate(shown):
            left, width = 0.072 + k * 0.2415, 0.19
            ax = fig.add_axes((left, 0.38 / height, width, 1.45 / height))
            draw_phase(diagram, box, ax=ax)
            ax.set_title(f"({chr(98 + k)}) {title}", fontsize=8.0, loc="left", pad=3.0)
            ax.set_xlabel(settings.second_control.short_label, labelpad=1.0)
            ax.set_ylabel(settings.along_control.short_label if k == 0 else "", labelpad=1.0)
            ax.tick_params(labelsize=7.0)
            _mark(box, chr(98 + k), corner, main)
    return fig


def draw_phase(
    diagram: Any, window: Window | None = None,
    keep_clear: Sequence[tuple[float, float]] = (), ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """The plane or a window of it: shading, lines, special points, numbers.

    Above the whole plane stand the values of the other controls and the meaning of lines, marks and shades.

    Parameters
    ----------
    diagram : a :class:`rodatlas.atlas.PhaseDiagram`.
    window : the whole diagram by default.
    keep_clear : points (second control, first control) at which no number shall stand.
    ax : where to draw; a figure as wide as a page by default.

    Returns
    -------
    the axes drawn on.
    """
    check_has("diagram", diagram, ("settings", "faces", "names"), "a PhaseDiagram, see PhaseDiagram.load")
    check_axes(ax)
    from matplotlib.ticker import MaxNLocator

    frame = window or diagram.settings.frame
    with styled():
        if ax is None:
            inches = BELOW + PLANE + ABOVE
            ax = new_figure(TWO_COLUMN, inches).add_axes((0.072, BELOW / inches, 0.915, PLANE / inches))
        ax.set_xlim(frame[0], frame[1])
        ax.set_ylim(frame[2], frame[3])
        shades = count_colors(diagram)
        for face in (f for f in diagram.faces if f.count is not None):
            _fill(face.rings, shades[face.count], ax)
        for line in diagram.lines:
            ax.plot(*line.points.T, **_style(line), zorder=2.5)
        _draw_events(diagram, ax)
        lines = [x for x in diagram.lines if x.kind != "smooth"]
        texts = [x.label.replace("'", "′") if _is_named(x) or window is not None else "" for x in lines]
        colors = [_style(x)["color"] for x in lines]
        label_lines([x.points for x in lines], texts, colors, ax, keep_clear=keep_clear)
        draw_plane_axes(diagram.settings, ax)
        if window is None:
            _draw_key(diagram, ax)
        else:
            ax.xaxis.set_major_locator(MaxNLocator(3))
            ax.yaxis.set_major_locator(MaxNLocator(4))
    return ax


def draw_phase_states(diagram: Any, first: Sequence[str] = ()) -> Figure:
    """One panel for each state: where it is stable, and which loci bound that region.

    Parameters
    ----------
    diagram : a :class:`rodatlas.atlas.PhaseDiagram`.
    first : names of states that come first, in this order.

    Returns
    -------
    a figure as wide as a page.
    """
    check_has("diagram", diagram, ("settings", "faces", "names"), "a PhaseDiagram, see PhaseDiagram.load")
    from matplotlib.ticker import MaxNLocator

    names = [name for name in dict.fromkeys((*first, *diagram.names)) if name in diagram.names]
    settings = diagram.settings
    columns = 5
    rows = -(-len(names) // columns)
    with styled():
        height = 0.42 + ROW * rows + HEAD
        fig = new_figure(TWO_COLUMN, height)
        for k, name in enumerate(names):
            row, column = divmod(k, columns)
            bottom = 1.0 - (HEAD + (row + 1) * ROW - 0.02) / height
            ax = fig.add_axes((0.066 + column * 0.187, bottom, 0.176, (ROW - 0.12) / height))
            draw_region(diagram, name, ax)
            last = k + columns >= len(names)
            ax.tick_params(labelleft=column == 0, labelbottom=last, labelsize=7.0)
            ax.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
            ax.set_xlabel(settings.second_control.short_label if last else "", labelpad=1.0)
            ax.set_ylabel(settings.along_control.short_label if column == 0 else "", labelpad=1.0)
        _draw_states_key(diagram, fig)
    return fig


def draw_region(diagram: Any, name: str, ax: Axes | None = None) -> Axes:
    """Where one state is stable: the region, its sides with their numbers, and all other loci in gray.

    Parameters
    ----------
    diagram : a :class:`rodatlas.atlas.PhaseDiagram`.
    name : of the state, of a pair that of both: 'A2+-'.
    ax : where to draw; a figure of one column by default.

    Returns
    -------
    the axes drawn on.

    Raises
    ------
    ValueError
        when the diagram has no such state.
    """
    check_has("diagram", diagram, ("settings", "faces", "names"), "a PhaseDiagram, see PhaseDiagram.load")
    check_axes(ax)
    if name not in diagram.names:
        raise ValueError(f"name: expected one of {', '.join(diagram.names)}, got '{name}'")
    frame = diagram.settings.frame
    color = color_of(name, colors_in_plane(diagram))
    with styled():
        if ax is None:
            ax = new_figure(ONE_COLUMN, ONE_COLUMN).add_axes((0.15, 0.13, 0.82, 0.78))
            ax.set_title(_setting(diagram), loc="left", pad=TITLE_PAD)
            draw_plane_axes(diagram.settings, ax)
        ax.set_xlim(frame[0], frame[1])
        ax.set_ylim(frame[2], frame[3])
        for line in diagram.lines:
            ax.plot(*line.points.T, **ELSEWHERE, zorder=1.0)
        kinds = {x.label: x for x in diagram.lines}
        clouds, texts = [], []
        for region in diagram.state_regions(name):
            _fill(region.rings, color, ax, alpha=0.28)
            for side in (s for s in region.sides if s.label in kinds):
                ax.plot(*side.points.T, **(_style(kinds[side.label]) | {"color": color, "lw": SIDE}), zorder=3.0)
                clouds.append(side.points)
                texts.append(side.label if kinds[side.label].kind != "smooth" and _is_named(kinds[side.label]) else "")
        for interval in (i for i in diagram.edge if i.name == name and not diagram.state_regions(name)):
            only = diagram.settings.second_control.equation(interval.second)
            style: dict[str, Any] = {"color": color, "lw": 4.0, "solid_capstyle": "butt", "clip_on": False}
            ax.plot([interval.second] * 2, [interval.low, interval.high], **style)
            ax.annotate(
                f"only at ${only}$", (interval.second, 0.5 * (interval.low + interval.high)), (8, 0), fontsize=7.5,
                textcoords="offset points", va="center",
            )  # fmt: skip
        label_lines(clouds, texts, [color] * len(clouds), ax, size=7.5)
        ax.text(0.97, 0.95, label_of(name), transform=ax.transAxes, ha="right", va="top", fontsize=10.0, color=color,
                bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"}, zorder=6)  # fmt: skip
    return ax


def colors_in_plane(diagram: Any) -> Mapping[str, str]:
    """Colors of the states of a plane by name: those of a nomenclature that has some."""
    return diagram.settings.nomenclature.colors or colors_in_order(diagram.names)


def count_colors(diagram: Any) -> dict[int, Any]:
    """A light color for each number of stable states that occurs."""
    from matplotlib import colormaps

    counts = sorted({f.count for f in diagram.faces if f.count is not None})
    shades = colormaps["YlGnBu"](np.linspace(0.02, 0.58, max(len(counts), 2)))
    return dict(zip(counts, shades, strict=False))


def _inside(box: Sequence[float], frame: Sequence[float]) -> bool:
    return frame[0] <= box[0] and box[1] <= frame[1] and frame[2] <= box[2] and box[3] <= frame[3]


def _is_named(line: Any) -> bool:
    return line.number is not None


def _style(line: Any) -> dict[str, Any]:
    """Kind by color and dashes; pieces without a number are thin."""
    if line.kind == "smooth":
        return SMOOTH
    style = dict(LINES[line.kind])
    return style if _is_named(line) else style | {"lw": THIN}


def _fill(rings: Sequence[np.ndarray], color: Any, ax: Axes, *, alpha: float = 1.0) -> None:
    """A polygon with holes."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    codes = [np.array([Path.MOVETO, *[Path.LINETO] * (len(r) - 2), Path.CLOSEPOLY]) for r in rings]
    path = Path(np.concatenate(rings), np.concatenate(codes))
    # A thin edge of the same color closes the hairlines that renderers leave between neighbors.
    edge = {"ec": color, "lw": 0.25} if alpha == 1.0 else {"ec": "none", "lw": 0.0}
    ax.add_patch(PathPatch(path, fc=color, alpha=alpha, zorder=0.5, **edge))


def _draw_events(diagram: Any, ax: Axes) -> None:
    """Special points, without those at which a locus is extreme in the control along slices: there nothing happens."""
    for e in diagram.events:
        if e.parameter != diagram.settings.along:
            ax.plot(e.second, e.value, zorder=4, **MARK, **EVENTS[e.kind])


def _mark(box: Sequence[float], letter: str, where: str, ax: Axes) -> None:
    """Where in the plane a close-up lies, with its letter at the upper or lower right corner."""
    from matplotlib.patches import Rectangle

    (x0, x1, y0, y1) = box
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    pad_x, pad_y = max(LEAST_PAD * (right - left), 0.1 * (x1 - x0)), max(LEAST_PAD * (top - bottom), 0.1 * (y1 - y0))
    corner, size = (x0 - pad_x, y0 - pad_y), (x1 - x0 + 2 * pad_x, y1 - y0 + 2 * pad_y)
    ax.add_patch(Rectangle(corner, *size, fc="none", ec=INK, lw=0.6, zorder=4.5))
    at, shift = ((x1 + pad_x, y1 + pad_y), (1.5, 1.0)) if where == "upper" else ((x1 + pad_x, y0 - pad_y), (1.0, -6.5))
    ax.annotate(f"({letter})", at, shift, textcoords="offset points", fontsize=7.5, zorder=5)


def _setting(diagram: Any) -> str:
    return setting_text(diagram.settings.model.controls, diagram.settings.setting)


def _draw_key(diagram: Any, ax: Axes) -> None:
    """Above the plane the setting, and what lines, marks and shades mean."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    events = {e.kind for e in diagram.events if e.parameter != diagram.settings.along}
    kinds = {x.kind for x in diagram.lines}
    handles = key_of(diagram.settings, kinds, events)
    if any(not _is_named(x) and x.kind != "smooth" for x in diagram.lines):
        handles.insert(len(kinds - {"smooth"}), Line2D([], [], color=UNNAMED, lw=THIN, label="without a number"))
    if "smooth" in kinds:
        handles.insert(len(kinds - {"smooth"}), Line2D([], [], **SMOOTH, label="change of name"))
    style: dict[str, Any] = {
        "handlelength": 2.4, "columnspacing": 1.4, "borderaxespad": 0.0, "fontsize": 7.5, "labelspacing": 0.35,
        "borderpad": 0.0,
    }  # fmt: skip
    columns = 4 if len(handles) <= 8 else 5
    first = ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.015), ncols=columns, **style)
    ax.add_artist(first)
    rows = -(-len(handles) // columns)
    pad = 6.0 + 11.5 * rows
    ax.set_title(_setting(diagram), loc="left", pad=pad)
    shades = [Patch(fc="none", ec="none", label="stable states:")]
    shades += [Patch(fc=c, ec="none", label=str(n)) for n, c in count_colors(diagram).items()]
    if any(f.count is None for f in diagram.faces):
        shades.append(Patch(fc="white", ec=UNNAMED, lw=0.4, label="not known"))
    above = 1.0 + pad / (72.0 * ax.get_window_extent().height / ax.figure.dpi)
    ax.legend(
        handles=shades, loc="lower right", bbox_to_anchor=(1.0, above), ncols=len(shades),
        **(style | {"handlelength": 1.0, "columnspacing": 0.7}),
    )  # fmt: skip


def _draw_states_key(diagram: Any, fig: Figure) -> None:
    """Above the panels the setting, and what lines and areas mean."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    kinds = {x.kind for x in diagram.lines}
    handles: list[Any] = [Patch(fc=UNNAMED, ec="none", alpha=0.28, label="stable")]
    handles += [
        Line2D([], [], **(style | {"color": UNNAMED, "lw": SIDE}), label=f"ends at a {kind}")
        for kind, style in LINES.items() if kind in kinds
    ]  # fmt: skip
    if "smooth" in kinds:
        handles.append(Line2D([], [], **(SMOOTH | {"color": UNNAMED, "lw": SIDE}), label="changes its name"))
    handles.append(Line2D([], [], **(ELSEWHERE | {"lw": 0.8}), label="other loci"))
    height = fig.get_figheight()
    middle = 1.0 - 0.5 * HEAD / height
    fig.text(0.066, middle, _setting(diagram), ha="left", va="center", fontsize=9.0)
    fig.legend(
        handles=handles, loc="center right", bbox_to_anchor=(0.992, middle), ncols=len(handles), handlelength=2.2,
        columnspacing=1.2, borderaxespad=0.0, borderpad=0.0, fontsize=7.5,
    )  # fmt: skip
