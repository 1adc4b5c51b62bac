"""The bifurcation diagram of a slice: alone, or with drawings of the shapes of its states around it."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.model.control import DEGREES
from rodatlas.model.orbit import pairing
from rodatlas.plot.band.render import DISPLAY_WIDTH, draw_triad, render_band
from rodatlas.plot.look.placement import dense, to_points
from rodatlas.plot.look.protocols import SettingsLike, SliceLike, StateLike
from rodatlas.plot.look.style import (
    ONE_COLUMN,
    TWO_COLUMN,
    check_axes,
    color_of,
    colors_of,
    label_of,
    new_figure,
    styled,
)
from rodatlas.plot.slices.arrangement import MOST, TRIAD, Layout, Shown, Slot, arrange
from rodatlas.plot.slices.inset import draw_insets
from rodatlas.plot.slices.panel import (
    NAME_SIZE,
    NOTE_SIZE,
    Drawn,
    draw_curves,
    draw_heading,
    label_events,
    label_states,
)
from rodatlas.rods.contact import self_contact

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


DIAGRAM, STRIP = 3.2, 1.1  # heights in inches: of the diagram itself, and of a strip of drawings
LEFT, RIGHT, BOTTOM, TOP = 0.62, 0.06, 0.58, 0.26
LINE, LINE_LENGTH, MOST_WARNINGS = 0.135, 118, 4  # height in inches and characters of a line of warnings; how many
MOST_DRAWN = 12  # states: the time to arrange their drawings doubles with each
DEGREE = r"^\circ"
CAPTION = 13.0  # height of the line under or over a drawing, in points


def draw_slice(slice_: SliceLike, ax: Axes | None = None) -> Axes:
    """Draw the bifurcation diagram of a slice.

    Stable stretches are solid, in the color of their state, and dotted where the band touches itself; unstable ones
    are thin and dashed. Folds are open disks, pitchforks and other branch points filled ones, with the numbers of the
    literature where they have one. Where the members of a pair have the same response one curve stands for all.

    Parameters
    ----------
    slice_ : a slice; see :mod:`rodatlas.plot.look.protocols` for what is read from it.
    ax : where to draw; a figure of one and a half columns by default.

    Returns
    -------
    the axes drawn on.
    """
    check_has("slice", slice_, ("settings", "branches", "states"), "a Slice, see compute_slice and Slice.load")
    check_axes(ax)
    with styled():
        if ax is None:
            fig = new_figure(0.5 * (ONE_COLUMN + TWO_COLUMN), 4.1)
            ax = fig.add_axes((0.115, 0.108, 0.87, 0.82))
        drawn = draw_curves(slice_, ax)
        draw_heading(slice_.settings, drawn, ax)
        label_events(drawn, ax)
        draw_insets(drawn, ax)
        label_states(drawn, ax)
        settle = getattr(ax.figure, "draw_without_rendering", None)  # a subfigure has none
        if settle is not None:
            settle()  # makes the tick labels while the style holds
    return ax


def draw_slice_figure(slice_: SliceLike, width: float = DISPLAY_WIDTH) -> Figure:
    """Draw the bifurcation diagram with a drawing of the band in every named state; without shapes, as draw_slice.

    Each named state is drawn once, at a computed solution of its stable range (of a pair: the member +), and a thin
    line leads to the point of the curve that it shows. Which point, and the order of the drawings, are chosen so that
    the lines are short, do not cross each other, and cross few curves.

    Parameters
    ----------
    width : width of the drawn bands in units of the length; the narrow band of 1/80 would be hardly a line.

    Returns
    -------
    a figure as wide as a page.
    """
    check_has("slice", slice_, ("settings", "branches", "states"), "a Slice, see compute_slice and Slice.load")
    settings = slice_.settings
    states = _one_of_each(slice_.states, settings) if settings.model.ribbon is not None else []
    strips = _strips_needed(states, slice_)
    warnings = _warning_lines(slice_)
    bottom = BOTTOM + LINE * len(warnings)
    inches = DIAGRAM + STRIP * sum(strips) + bottom + TOP
    with styled():
        fig = new_figure(TWO_COLUMN, inches)
        box = (LEFT / TWO_COLUMN, bottom / inches, 1 - (LEFT + RIGHT) / TWO_COLUMN, 1 - (bottom + TOP) / inches)
        ax = fig.add_axes(box)
        drawn = _draw_diagram(slice_, strips, ax)
        draw_heading(slice_.settings, drawn, ax)
        label_events(drawn, ax)
        shown = [_choices(ax, state, settings) for state in states]
        layout = Layout(ax, drawn, strips, STRIP * 72.0)
        slots, chosen = arrange(layout, shown) if shown else ([], [])
        _draw_bands(layout, shown, slots, chosen, slice_, width, ax)
        draw_insets(drawn, ax, leaders=_leaders(layout, shown, slots, chosen))
        if not shown:
            label_states(drawn, ax)
        _draw_notes(layout, states, slice_, width, warnings, fig)
        fig.draw_without_rendering()
    return fig


def _warning_lines(slice_: SliceLike) -> list[str]:
    """What a reader of the slice should know, in lines as wide as the page; some only, where there are many."""
    remarks = [textwrap.wrap(f"Warning: {text}", LINE_LENGTH) for text in getattr(slice_, "remarks", ())]
    lines = [line for remark in remarks[:MOST_WARNINGS] for line in remark]
    return lines + ([f"and {len(remarks) - MOST_WARNINGS} more warnings"] if len(remarks) > MOST_WARNINGS else [])


def _one_of_each(states: Sequence[StateLike], settings: SettingsLike) -> list[StateLike]:
    """For each name the state with the longest range; of many names those with the longest."""
    longest: dict[str, StateLike] = {}
    for state in states:
        known = longest.get(state.name)
        if known is None or _length(state, settings) > _length(known, settings):
            longest[state.name] = state
    kept = sorted(longest.values(), key=lambda state: -_length(state, settings))[:MOST_DRAWN]
    return [state for state in longest.values() if any(state is other for other in kept)]


def _length(state: StateLike, settings: SettingsLike) -> float:
    return abs(settings.value(state.solutions[-1]) - settings.value(state.solutions[0]))


def _strips_needed(states: Sequence[StateLike], slice_: SliceLike) -> tuple[bool, bool]:
    """Whether there are strips of drawings below and above: below for states under the line of zero."""
    middles = [slice_.settings.response(s.solutions[len(s.solutions) // 2]) for s in states]
    below = min(middles, default=0.0) < 0.0 or len(states) > MOST
    return below, bool(states)


def _draw_diagram(slice_: SliceLike, strips: tuple[bool, bool], ax: Axes) -> Drawn:
    """The diagram, with room for the strips."""
    total = DIAGRAM + STRIP * sum(strips)
    below, above = (STRIP * strip / total for strip in strips)
    drawn = draw_curves(slice_, ax, free=(below, above))
    middle = below + 0.5 * DIAGRAM / total
    ax.yaxis.set_label_coords(-0.42 / (TWO_COLUMN - LEFT - RIGHT), middle)
    return drawn


def _choices(ax: Axes, state: StateLike, settings: SettingsLike) -> Shown:
    """Computed solutions in the middle part of a stable range, by the length of its curve, at most nine."""
    solutions = list(state.solutions)
    places = to_points(ax, np.array([(settings.value(s), settings.response(s)) for s in solutions]))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    part = along / max(along[-1], 1e-12)
    inner = [i for i in range(1, len(solutions) - 1) if 0.2 <= part[i] <= 0.8]
    inner = inner or [len(solutions) // 2]
    kept = [inner[i] for i in np.unique(np.linspace(0, len(inner) - 1, min(9, len(inner))).astype(int))]
    return Shown(state.name, [solutions[i] for i in kept], places[kept])


def _draw_bands(
    layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int], slice_: SliceLike, width: float, ax: Axes
) -> None:
    """All drawings, at one scale, with their captions and lines."""
    fig, drawings, colors = cast("Figure", ax.figure), [], colors_of(slice_)
    for one, slot, k in zip(shown, slots, chosen, strict=True):
        inset = fig.add_axes((0.0, 0.0, 0.1, 0.1), zorder=6)
        inset.patch.set_visible(False)
        member = slice_.settings.model.member(one.solutions[k], "+")
        render_band(member, width, ax=inset, color=color_of(one.name, colors))
        drawings.append((inset, np.ptp(inset.get_xlim()), np.ptp(inset.get_ylim())))
        _caption(layout, one, slot, k, slice_, ax)
    columns = {strip: sum(slot.strip == strip for slot in slots) for strip in (1, -1)}
    room = [(layout.cell_width(slot.strip, columns[slot.strip]) - 6.0, layout.height - CAPTION - 8.0) for slot in slots]
    scale = min(
        min(across / w, up / h) for (across, up), (_, w, h) in zip(room, drawings, strict=True)
    ) if drawings else 1.0  # fmt: skip
    page = np.array([fig.get_figwidth(), fig.get_figheight()]) * 72.0
    for (inset, w, h), slot in zip(drawings, slots, strict=True):
        left, bottom, across, up = layout.cell(slot, columns[slot.strip])
        size = np.array([w, h]) * scale
        free = 0.5 * (up - CAPTION - size[1])
        low = bottom + CAPTION + min(free, 6.0) if slot.strip > 0 else bottom + up - CAPTION - size[1] - min(free, 6.0)
        corner = np.array([left + 0.5 * (across - size[0]), low])
        inset.set_position((*(corner / page), *(size / page)))


def _leaders(layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]) -> np.ndarray:
    """(n, 2) samples of the lines from the drawings to their points, in points."""
    ends = [(layout.start(slot), one.places[k]) for one, slot, k in zip(shown, slots, chosen, strict=True)]
    return np.concatenate([np.empty((0, 2)), *(dense(np.array(pair), 2.0) for pair in ends)])


def _caption(layout: Layout, one: Shown, slot: Slot, k: int, slice_: SliceLike, ax: Axes) -> None:
    """Name and value of a drawing, between it and the diagram, and the line to its point."""
    settings = slice_.settings
    fig, color, solution = cast("Figure", ax.figure), color_of(one.name, colors_of(slice_)), one.solutions[k]
    name = label_of(one.name[:-1] if one.name.endswith("+-") else one.name)
    start = layout.start(slot)
    page = np.array([fig.get_figwidth(), fig.get_figheight()]) * 72.0
    y = start[1] + (0.5 * CAPTION if slot.strip > 0 else -0.5 * CAPTION)
    model = settings.model
    touching = ", touches itself" if model.width and self_contact(solution, model.width) else ""
    place = settings.value(solution), settings.response(solution)
    gap = 2.5
    common: dict[str, Any] = {"va": "center_baseline", "color": color, "zorder": 7}
    fig.text((start[0] - 12.0) / page[0], y / page[1], name, ha="right", fontsize=NAME_SIZE, **common)
    fig.text(
        (start[0] - 12.0 + gap) / page[0], y / page[1], f"  ${_value_text(settings, place[0])}${touching}", ha="left",
        fontsize=NOTE_SIZE + 0.5, **common,
    )  # fmt: skip
    data = ax.transData.inverted().transform(np.array([start, one.places[k]]) * fig.dpi / 72.0)
    ax.plot(*data.T, color=color, lw=0.5, alpha=0.75, zorder=1.5, gid="leader")
    ax.plot(
        [place[0]], [place[1]], ls="none", marker="s", ms=3.6, mfc=color, mec="white", mew=0.5,
        zorder=3.5, gid="shown",
    )  # fmt: skip


def _value_text(settings: SettingsLike, value: float) -> str:
    """The value of what varies, to a thousandth of the scale of the range."""
    digits = max(3 - round(math.log10(settings.high - settings.low)), 0)
    return f"{settings.control.symbol}={value:.{digits}f}{DEGREE if settings.control.unit == DEGREES else ''}"


def _draw_notes(
    layout: Layout, states: Sequence[StateLike], slice_: SliceLike, width: float, warnings: Sequence[str], fig: Figure
) -> None:
    """The directions of space in the corner that is free for them, what the drawings are, and warnings below it."""
    page = np.array([fig.get_figwidth(), fig.get_figheight()]) * 72.0
    below = LINE * 72.0 * len(warnings)
    for i, line in enumerate(warnings):
        y = (5.0 + below - LINE * 72.0 * (i + 1)) / page[1]
        fig.text(LEFT / TWO_COLUMN, y, line, ha="left", va="bottom", fontsize=NOTE_SIZE, parse_math=False)
    if not states:
        return
    low = layout.low if layout.triad_strip < 0 else layout.high - layout.height
    corner, size = np.array([layout.right - TRIAD + 2.0, low + 6.0]), np.array([34.0, 34.0])
    inset = fig.add_axes((*(corner / page), *(size / page)))
    inset.patch.set_visible(False)
    draw_triad(ax=inset)
    fraction = Fraction(width).limit_denominator(200)
    share = f"L/{fraction.denominator}" if fraction.numerator == 1 else f"{width:g}\\,L"
    note = f"Bands are drawn ${share}$ wide."
    if len(states) < len({s.name for s in slice_.states}):
        note = f"Drawn are the {len(states)} states of the longest ranges. {note}"
    if any(s.contact for s in states):
        note = f"A band $L/{1 / slice_.settings.model.width:.0f}$ wide touches itself where its line is dotted. {note}"
    if any(s.name.endswith("+-") for s in states):
        note = f"Of a pair ±, the member + is drawn; − is its {' or '.join(pairing(slice_.settings.model))}. {note}"
    right = 1.0 - RIGHT / TWO_COLUMN
    fig.text(right, (5.0 + below) / page[1], note, ha="right", va="bottom", fontsize=NOTE_SIZE)
