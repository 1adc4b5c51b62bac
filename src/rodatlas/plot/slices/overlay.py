"""Measured ranges of stability on the diagram of a slice, and beside the computed ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.plot.look.placement import dense, to_points
from rodatlas.plot.look.protocols import SettingsLike
from rodatlas.plot.look.style import (
    FAINT,
    INK,
    MARKERS,
    STABLE_WIDTH,
    TWO_COLUMN,
    UNNAMED,
    color_of,
    colors_of,
    label_of,
    new_figure,
    styled,
)
from rodatlas.plot.slices.curves import slice_stretches
from rodatlas.plot.slices.inset import draw_insets
from rodatlas.plot.slices.panel import (
    NOTE_SIZE,
    NUMBER_SIZE,
    Drawn,
    draw_curves,
    draw_heading,
    label_events,
    label_states,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DIAGRAM = 3.5  # height of the diagram, in inches
ROW, GROUP = 0.105, 0.07  # height of a bar and of the gap between states, in inches
LEFT, RIGHT, BOTTOM, TOP, BETWEEN = 0.62, 0.06, 0.46, 0.26, 0.3
APART = 3.6  # distance of measured ranges from the curve and from each other, in points
STEEPEST = 0.4  # mean cosine of the slope below which a range lies nearer to its curve
# No disks: those are folds and branch points.
SYMBOLS = ("s", "^", "D", "v", "P", "X")
WIDTHS, SYMBOL_SIZE = 1.4, 3.6  # of measured ranges and their ends


def draw_overlay(slice_: Any, comparison: Any) -> Figure:
    """Draw measured ranges along the curves of a slice, and below that all ranges as bars.

    A band has a symbol of its own, at both ends of its ranges; whiskers are errors. Along a curve, the ranges of
    several bands lie beside each other; what is measured beyond the computed range goes on at the height of its end.

    Parameters
    ----------
    slice_ : a slice; see :mod:`rodatlas.plot.look.protocols` for what is read from it.
    comparison : a :class:`rodatlas.atlas.experiments.comparison.Comparison` with it.

    Returns
    -------
    a figure as wide as a page.
    """
    labels = list(dict.fromkeys(c.measurement.label for c in comparison.checks))
    groups = _groups(slice_, comparison)
    bars = ROW * sum(1 + len(measured) for _, _, measured in groups) + GROUP * (len(groups) + 1)
    inches = DIAGRAM + bars + BOTTOM + TOP + BETWEEN
    across = (LEFT / TWO_COLUMN, 1 - (LEFT + RIGHT) / TWO_COLUMN)
    with styled():
        fig = new_figure(TWO_COLUMN, inches)
        top = fig.add_axes((across[0], (BOTTOM + bars + BETWEEN) / inches, across[1], DIAGRAM / inches))
        low = fig.add_axes((across[0], BOTTOM / inches, across[1], bars / inches), sharex=top)
        drawn = draw_curves(slice_, top)
        _draw_along(slice_, comparison, labels, drawn, top)
        draw_heading(slice_.settings, drawn, top)
        label_events(drawn, top)
        draw_insets(drawn, top)
        label_states(drawn, top)
        _draw_bars(groups, comparison, labels, colors_of(slice_), low)
        _label_axis(slice_.settings, comparison, top, low)
        _draw_key(labels, low)
        fig.draw_without_rendering()
    return fig


def _groups(slice_: Any, comparison: Any) -> list[tuple[str, list[Any], list[Any]]]:
    """Name, computed ranges and measured ranges of each state, in the order of the slice; the others last."""
    names = list(dict.fromkeys([s.name for s in slice_.states]))
    names += [c.measurement.family or c.measurement.state for c in comparison.checks]
    out = []
    for name in dict.fromkeys(names):
        measured = [c for c in comparison.checks if (c.measurement.family or c.measurement.state) == name]
        out.append((name, [s for s in slice_.states if s.name == name], measured))
    return out


def _draw_along(slice_: Any, comparison: Any, labels: Sequence[str], drawn: Drawn, ax: Axes) -> None:
    """Ranges beside the curves of their states; labels keep clear of them."""
    stretches, colors, settings = slice_stretches(slice_), colors_of(slice_), slice_.settings
    for check in (c for c in comparison.checks if c.computed is not None):
        color, k = color_of(check.computed.name, colors), labels.index(check.measurement.label)
        curve = _curve(stretches, check.computed, settings)
        low, high = (end.measured * comparison.scale for end in (check.low, check.high))
        path = _shifted(ax, _between(curve, low, high), APART * (k + 1))
        ax.plot(*path.T, color=color, lw=WIDTHS, alpha=0.55, zorder=2.5, gid="measured", solid_capstyle="butt")
        for end, place in ((check.low, path[0]), (check.high, path[-1])):
            _draw_end(end, place, comparison.scale, color, SYMBOLS[k % len(SYMBOLS)], ax)
            drawn.obstacles.take(to_points(ax, place[None])[0], (SYMBOL_SIZE, SYMBOL_SIZE), 0.8)
        points = dense(to_points(ax, path))
        drawn.obstacles.points = np.concatenate([drawn.obstacles.points, points])
        if drawn.obstacles.weights is not None:
            drawn.obstacles.weights = np.concatenate([drawn.obstacles.weights, np.ones(len(points))])


def _draw_end(end: Any, place: np.ndarray, scale: float, color: str, symbol: str, ax: Axes) -> None:
    """The symbol of a band with a whisker."""
    if end.error is not None:
        reach = end.error * scale
        ax.plot([place[0] - reach, place[0] + reach], [place[1]] * 2, color=INK, lw=0.7, zorder=4.4, gid="error",
                marker="|", ms=3.0, mew=0.7)  # fmt: skip
    ax.plot(
        [place[0]], [place[1]], ls="none", marker=symbol, ms=SYMBOL_SIZE, mfc=color, mec="white", mew=0.4, zorder=4.5,
        gid="measured end",
    )  # fmt: skip


def _curve(stretches: Sequence[Any], state: Any, settings: SettingsLike) -> np.ndarray:
    """(n, 2) value and response along a named state, the value increasing."""
    parts = [s.xy for s in stretches if s.name == state.name and s.branch == state.branch]
    low, high = state.low.value - 1e-9, state.high.value + 1e-9
    places = [(settings.value(s), settings.response(s)) for s in state.solutions]
    every = np.concatenate(parts) if parts else np.array(places)
    every = every[(every[:, 0] >= low) & (every[:, 0] <= high)]
    return every[np.argsort(every[:, 0], kind="stable")]


def _between(curve: np.ndarray, low: float, high: float) -> np.ndarray:
    """The part of a curve between two values; beyond its ends it goes on at the response that it has there."""
    inner = curve[(curve[:, 0] > low) & (curve[:, 0] < high)]
    ends = np.array([low, high])
    responses = np.interp(ends, *curve.T)
    path = np.vstack([(low, responses[0]), inner, (high, responses[1])])
    beyond = [row for row in curve[[0, -1]] if low < row[0] < high]
    path = np.vstack([path, *beyond]) if beyond else path
    path = path[np.argsort(path[:, 0], kind="stable")]
    return path if high > low else path[:2]


def _shifted(ax: Axes, path: np.ndarray, distance: float) -> np.ndarray:
    """The path moved down so far that it keeps about a distance in points; its values stay."""
    points = to_points(ax, path)
    steps = np.abs(np.diff(points, axis=0))
    cosine = steps[:, 0].sum() / max(np.hypot(*steps.T).sum(), 1e-12)
    moved = points - [0.0, distance / max(cosine, STEEPEST)]
    return ax.transData.inverted().transform(moved * ax.figure.dpi / 72.0)


def _draw_bars(groups: Sequence[tuple[str, list[Any], list[Any]]], comparison: Any, labels: Sequence[str],
               colors: Mapping[str, str], ax: Axes) -> None:  # fmt: skip
    """A row for each computed state and below it one for each measured range."""
    y = 0.0
    ticks, names = [], []
    for name, computed, measured in groups:
        color = color_of(name, colors) if computed else UNNAMED
        y -= GROUP
        top = y
        y -= ROW
        for state in computed:
            ax.plot(state.span, [y, y], color=color, lw=STABLE_WIDTH, zorder=3, gid="computed", solid_capstyle="butt")
            _draw_computed_end(state.low, y, -1, ax)
            _draw_computed_end(state.high, y, 1, ax)
        for check in measured:
            y -= ROW
            k = labels.index(check.measurement.label)
            ends = [np.array([end.measured * comparison.scale, y]) for end in (check.low, check.high)]
            ax.plot(*np.array(ends).T, color=color, lw=WIDTHS, alpha=0.55, zorder=2.5, gid="measured bar")
            for end, place in zip((check.low, check.high), ends, strict=True):
                _draw_end(end, place, comparison.scale, color, SYMBOLS[k % len(SYMBOLS)], ax)
            if check.measurement.state not in (name, name.removesuffix("+-")):
                whisker = (check.high.error or 0.0) * comparison.scale
                ax.annotate(
                    label_of(check.measurement.state), xy=(ends[1][0] + whisker, y), xytext=(7.0, 0.0), color=color,
                    textcoords="offset points", va="center_baseline", fontsize=NOTE_SIZE,
                )  # fmt: skip
        ticks.append(0.5 * (top + y - 0.5 * ROW))
        names.append((label_of(name), color))
        ax.axhline(y - 0.5 * ROW - 0.5 * GROUP, color=FAINT, lw=0.5, zorder=0.5)
    ax.set_ylim(y - GROUP - 0.25 * ROW, 0.25 * ROW)
    ax.set_yticks(ticks, [text for text, _ in names])
    ax.tick_params(axis="y", length=0.0)
    for tick, (_, color) in zip(ax.get_yticklabels(), names, strict=True):
        tick.set_color(color)
    ax.set_ylabel("stable ranges")


def _draw_computed_end(end: Any, y: float, side: int, ax: Axes) -> None:
    """The disk of a bifurcation with its number beyond it; nothing where the range of the slice ends."""
    if end.kind == "range":
        return
    if end.kind == "smooth":
        ax.plot([end.value], [y], ls="none", marker="|", ms=5.0, color=INK, mew=0.8, zorder=4)
        return
    ax.plot([end.value], [y], zorder=4, **MARKERS["fold" if end.kind == "fold" else "branch point"])
    if end.number is not None:
        ax.annotate(
            str(end.number), xy=(end.value, y), xytext=(4.0 * side, 0.0), textcoords="offset points",
            ha="left" if side > 0 else "right", va="center_baseline", fontsize=NUMBER_SIZE - 0.5, color=INK, zorder=5,
        )  # fmt: skip


def _label_axis(settings: SettingsLike, comparison: Any, top: Axes, low: Axes) -> None:
    """One axis below both panels, in L or in parts of the limit of what varies."""
    top.set_xlabel("")
    top.tick_params(axis="x", labelbottom=False)
    if not comparison.normalized:
        low.set_xlabel(settings.control.label)
        return
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    name, symbol = settings.control.name, settings.control.symbol
    low.set_xlabel(rf"{name} over limiting {name}, ${symbol}/{symbol}_{{\mathrm{{max}}}}$")
    low.xaxis.set_major_locator(MultipleLocator(0.2 * comparison.limit))
    low.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x / comparison.limit:.1f}"))


def _draw_key(labels: Sequence[str], ax: Axes) -> None:
    """Symbols of the bands, above the bars."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=INK, lw=STABLE_WIDTH, label="computed")]
    for k, label in enumerate(labels):
        symbol: dict[str, Any] = {"marker": SYMBOLS[k % len(SYMBOLS)], "ms": SYMBOL_SIZE, "mec": "white", "mew": 0.4}
        handles.append(Line2D([], [], color=UNNAMED, lw=WIDTHS, label=label, **symbol))
    ax.legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(handles), borderaxespad=0.2,
        handlelength=2.2, columnspacing=1.4, handletextpad=0.5,
    ).set_in_layout(False)  # fmt: skip
