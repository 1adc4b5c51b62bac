"""Parts of a bifurcation diagram: curves, markers, guides, numbers and names."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.plot.look.heading import setting_text
from rodatlas.plot.look.placement import Obstacles, around, axes_box, best_place, dense, text_size, to_points, uncovered
from rodatlas.plot.look.protocols import SettingsLike, SliceLike
from rodatlas.plot.look.style import (
    FAINT,
    INK,
    MARKER_SIZE,
    MARKERS,
    STABLE_WIDTH,
    TOUCHING,
    UNSTABLE,
    UNSTABLE_DASHES,
    UNSTABLE_WIDTH,
    label_of,
)
from rodatlas.plot.slices.curves import Mark, Stretch, slice_stretches, unique_events
from rodatlas.plot.slices.overlaps import draw_overlaps, overlaps_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NUMBER_SIZE, NAME_SIZE, NOTE_SIZE = 7.5, 9.0, 7.0
NEAR_LIMIT = 0.08  # a limit of what varies is shown when the range ends this near to it, as a part of the limit
ZERO = 0.5  # of the extent of all responses: the line of zero is shown where it is no farther from them
BACK = -0.9  # cosine of the turn between two steps of a curve that goes back on itself
GUTTER = 0.0138  # of the range, at both sides of it
ROOMY = 6.0  # axes of so many inches have room for the whole legend beside the setting
ROW: dict[str, Any] = {
    "borderaxespad": 0.1, "handlelength": 1.7, "columnspacing": 1.0, "handletextpad": 0.35, "borderpad": 0.3,
}  # fmt: skip
DOUBT, CLOSE = 8.0, 16.0  # largest price of a name near another state's curve, and how near that is in points


@dataclass(frozen=True)
class Drawn:
    """What a diagram consists of, for those who add to it."""

    stretches: list[Stretch]
    events: list[Mark]
    obstacles: Obstacles

    @property
    def touching(self) -> bool:
        """Whether some band touches itself."""
        return any(s.touching for s in self.stretches)


def draw_curves(slice_: SliceLike, ax: Axes, *, free: tuple[float, float] = (0.0, 0.0)) -> Drawn:
    """Curves, markers, guides and axis labels.

    Parameters
    ----------
    free : parts of the axes' height that are left free of the diagram, below and above it.
    """
    settings, stretches, events = slice_.settings, slice_stretches(slice_), unique_events(slice_)
    low, high, limit = value_view(settings)
    bottom, top = response_range(stretches)
    full = (top - bottom) / (1.0 - sum(free))
    ax.set_xlim(low, high)
    ax.set_ylim(bottom - free[0] * full, top + free[1] * full)
    ax.set_yticks([t for t in ax.get_yticks() if bottom <= t <= top])
    if bottom < 0.0 < top:
        ax.plot([low, high], [0.0, 0.0], color=FAINT, lw=0.5, zorder=0.5)
    if low < 0.0 < high:
        ax.plot([0.0, 0.0], [bottom, top], color=FAINT, lw=0.5, zorder=0.5)
    ax.set_xlabel(settings.control.label)
    ax.set_ylabel(settings.model.quantity(settings.against).label)
    drawn = _draw(stretches, events, (bottom, top), ax)
    if limit is not None:
        _draw_limit(limit, f"limiting {settings.control.name}", (bottom, top), drawn.obstacles, ax)
    return drawn


def draw_window(slice_: SliceLike, values: tuple[float, float], responses: tuple[float, float], ax: Axes) -> Drawn:
    """Curves and markers inside a window of value and response."""
    ax.set_xlim(*values)
    ax.set_ylim(*responses)
    ax.plot(values, [0.0, 0.0], color=FAINT, lw=0.5, zorder=0.5)
    window = (values, responses)
    inside = [
        e for e in unique_events(slice_) if all(a < x < b for x, (a, b) in zip(e.place, window, strict=True))
    ]  # fmt: skip
    return _draw(slice_stretches(slice_), inside, responses, ax)


def draw_part(
    stretches: list[Stretch], values: tuple[float, float], responses: tuple[float, float], ax: Axes
) -> Drawn:  # fmt: skip
    """Given curves inside a window of value and response, without markers."""
    ax.set_xlim(*values)
    ax.set_ylim(*responses)
    return _draw(stretches, [], responses, ax)


def _draw(stretches: list[Stretch], events: list[Mark], responses: tuple[float, float], ax: Axes) -> Drawn:
    """Curves and markers on axes that have their limits, and what labels must not cover."""
    _draw_stretches(stretches, ax)
    for event in events:
        _draw_event(event, ax)
    points = [dense(to_points(ax, s.xy)) for s in stretches]
    weights = [np.full(len(p), 1.5 if s.stable else 1.0) for p, s in zip(points, stretches, strict=True)]
    left, _, right, _ = axes_box(ax)
    (_, lowest), (_, highest) = to_points(ax, np.array([[ax.get_xlim()[0], r] for r in responses]))
    border = (left, lowest + 2.0, right, highest - 2.0)
    samples, weight = (np.concatenate(points), np.concatenate(weights)) if points else (np.empty((0, 2)), np.empty(0))
    obstacles = Obstacles(samples, border, weights=weight)
    for place in _places(ax, events):
        obstacles.take(place, (MARKER_SIZE, MARKER_SIZE), 0.8)
    return Drawn(stretches, events, obstacles)


def value_view(settings: SettingsLike) -> tuple[float, float, float | None]:
    """Range of the axis of what varies, and the limit of that if it lies within."""
    limit = settings.control.limits(settings.setting).high
    gutter = GUTTER * (settings.high - settings.low)
    low = settings.low - gutter
    if math.isfinite(limit) and limit - settings.high <= NEAR_LIMIT * abs(limit):
        return low, limit + 1.5 * gutter, limit
    return low, settings.high + gutter, None


def draw_heading(settings: SettingsLike, drawn: Drawn, ax: Axes) -> None:
    """The setting on the left and the legend on the right, above the axes; its last entry below narrow ones."""
    setting = setting_text(settings.model.controls, settings.setting)
    ax.set_title(setting, loc="left", pad=5.0)
    narrow = ax.get_window_extent().width < ROOMY * ax.figure.dpi
    if drawn.touching and narrow:
        ax.add_artist(ax.legend(handles=_handles(True)[-1:], loc="upper right", bbox_to_anchor=(1.0, -0.07), **ROW))
    draw_legend((1.0, 1.0), "lower right", on=ax, touching=drawn.touching and not narrow)


def draw_legend(
    corner: tuple[float, float], place: Any = "upper right", *, on: Axes | Figure, touching: bool = False
) -> None:
    """What lines and markers mean, in one row; `place` of the legend's box is put at the corner.

    Parameters
    ----------
    touching : whether some of the stable states touch themselves.
    """
    handles = _handles(touching)
    on.legend(handles=handles, loc=place, bbox_to_anchor=corner, ncols=len(handles), **ROW)


def _handles(touching: bool) -> list[Artist]:
    """Samples of lines and markers."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=INK, lw=STABLE_WIDTH, label="stable"),
        Line2D([], [], color=UNSTABLE, lw=UNSTABLE_WIDTH, dashes=UNSTABLE_DASHES, label="unstable"),
        Line2D([], [], label="fold", **MARKERS["fold"]),
        Line2D([], [], label="branch point", **MARKERS["branch point"]),
        *([Line2D([], [], color=INK, label="stable, touches itself", **TOUCHING)] if touching else []),
    ]


def label_events(drawn: Drawn, ax: Axes) -> None:
    """Numbers next to the numbered special points, the crowded ones first; a thin line leads to a distant one."""
    numbered = [e for e in drawn.events if e.number is not None]
    places, every = _places(ax, numbered), _places(ax, drawn.events)
    crowd = [int((np.hypot(*(places - p).T) < 15.0).sum()) for p in places]
    for i in sorted(range(len(numbered)), key=lambda i: (-crowd[i], numbered[i].number or 0)):
        text = str(numbered[i].number)
        size = text_size(text, NUMBER_SIZE)
        others = every[np.hypot(*(every - places[i]).T) > 0.5]
        candidates = [
            (center, penalty + (6.0 if _nearer(center, size, others, places[i]) else 0.0))
            for center, penalty in around(places[i], size, (3.2, 4.5, 6.0, 8.0, 11.0, 15.0, 20.0))
        ]
        place, _ = best_place(drawn.obstacles, size, candidates)
        _write(text, places[i], place, size, NUMBER_SIZE, INK, ax)
        drawn.obstacles.take(place, size)


def _nearer(center: np.ndarray, size: tuple[float, float], others: np.ndarray, own: np.ndarray) -> bool:
    """Whether a label would be nearer to another marker than to its own, or nearly so."""

    def gap(markers: np.ndarray) -> np.ndarray:
        return np.hypot(*np.maximum(np.abs(markers - center) - 0.5 * np.asarray(size), 0.0).T)

    return bool(len(others)) and float(gap(others).min()) < 1.3 * float(gap(own[None])[0])


def label_states(drawn: Drawn, ax: Axes) -> None:
    """One name for each stretch of a stable state, beside the curve, the short stretches first."""
    named = [(s, to_points(ax, s.xy)) for s in whole_states(drawn.stretches) if s.name]
    named = [(s, p) for s, p in named if np.hypot(*np.diff(p, axis=0).T).sum() > 1.0]
    for stretch, points in sorted(named, key=lambda pair: len(dense(pair[1]))):
        text = label_of(stretch.name or "")
        size = text_size(text, NAME_SIZE)
        places, anchors = _beside(points, size)
        others = [dense(p, 3.0) for s, p in named if s.name != stretch.name]
        places = [(c, p + q) for (c, p), q in zip(places, _doubt(places, others), strict=True)]
        place, at = best_place(drawn.obstacles, size, places)
        _write(text, anchors[at], place, size, NAME_SIZE, stretch.color, ax, lead=14.0)
        drawn.obstacles.take(place, size)


def whole_states(stretches: list[Stretch]) -> list[Stretch]:
    """The stretches with those of one state put together, whether its band touches itself or not."""
    out: list[Stretch] = []
    for s in stretches:
        if out and (out[-1].name, out[-1].branch) == (s.name, s.branch) and np.array_equal(out[-1].xy[-1], s.xy[0]):
            out[-1] = replace(s, xy=np.concatenate([out[-1].xy, s.xy[1:]]))
        else:
            out.append(s)
    return out


def _doubt(places: list[tuple[np.ndarray, float]], others: list[np.ndarray]) -> np.ndarray:
    """(n,) price of places for a name near the curves of other states."""
    from scipy.spatial import KDTree

    if not others:
        return np.zeros(len(places))
    gap = KDTree(np.concatenate(others)).query(np.array([center for center, _ in places]))[0]
    return DOUBT * np.maximum(1.0 - gap / CLOSE, 0.0)


def _beside(points: np.ndarray, size: tuple[float, float]) -> tuple[list[tuple[np.ndarray, float]], list[np.ndarray]]:
    """Places on both sides of a curve, and the point of the curve next to each; the middle is preferred."""
    even = dense(points, 6.0)
    ways = np.gradient(even, axis=0) if len(even) > 1 else np.array([[1.0, 0.0]])
    ways /= np.maximum(np.hypot(*ways.T), 1e-12)[:, None]
    places, anchors = [], []
    for i, (anchor, way) in enumerate(zip(even, ways, strict=True)):
        off_middle = abs(i / max(len(even) - 1, 1) - 0.45)
        for side in (1.0, -1.0):
            normal = side * np.array([-way[1], way[0]])
            reach = 0.5 * (abs(normal[0]) * size[0] + abs(normal[1]) * size[1])
            for gap in (3.2, 5.0, 8.0, 13.0, 20.0, 28.0):
                places.append((anchor + normal * (reach + gap), 0.5 * gap + 4.0 * off_middle))
                anchors.append(anchor)
    return places, anchors


def _write(
    text: str, anchor: np.ndarray, center: np.ndarray, extent: tuple[float, float], size: float, color: str, ax: Axes,
    *, lead: float = 6.0,
) -> None:  # fmt: skip
    """Text centered at a place given in points, with a thin line to its anchor when that is far."""
    data = ax.transData.inverted().transform(anchor * ax.figure.dpi / 72.0)
    offset = center - anchor
    distance = np.hypot(*np.maximum(np.abs(offset) - 0.5 * np.asarray(extent), 0.0))
    arrow = {"arrowstyle": "-", "lw": 0.4, "color": color, "shrinkA": 0.5, "shrinkB": 2.0} if distance > lead else None
    ax.annotate(
        text, xy=(data[0], data[1]), xytext=(offset[0], offset[1]), textcoords="offset points", ha="center",
        va="center_baseline" if text.isdigit() else "center", fontsize=size, color=color, arrowprops=arrow, zorder=5,
    )  # fmt: skip


def _draw_stretches(stretches: list[Stretch], ax: Axes) -> None:
    """Stable stretches solid, or dotted where the band touches itself, unstable ones dashed.

    Of dashed curves on top of each other only the first is drawn: two patterns of dashes together look like a solid
    line. Where stable ones coincide, their colors alternate.
    """
    drawn, overlaps = np.empty((0, 2)), overlaps_of(stretches, ax)
    for stretch in stretches:
        if stretch.touching:
            ax.plot(*stretch.xy.T, color=stretch.color, zorder=3, gid="touching", **TOUCHING)
            continue
        if stretch.stable:
            ax.plot(*stretch.xy.T, color=stretch.color, lw=STABLE_WIDTH, zorder=3, gid="stable")
            draw_overlaps([o for o in overlaps if o.top is stretch], ax)
            continue
        for way in _ways(stretch.xy, ax):
            for piece in uncovered(way, to_points(ax, way), drawn):
                ax.plot(*piece.T, color=UNSTABLE, lw=UNSTABLE_WIDTH, dashes=UNSTABLE_DASHES, zorder=2, gid="unstable")
            drawn = np.concatenate([drawn, dense(to_points(ax, way), 0.5)])


def _ways(xy: np.ndarray, ax: Axes) -> list[np.ndarray]:
    """A curve cut where it goes straight back, as one that passes a pitchfork between images of one response."""
    steps = np.diff(to_points(ax, xy), axis=0)
    cosine = np.einsum("ij,ij->i", steps[1:], steps[:-1]) / np.maximum(
        np.hypot(*steps[1:].T) * np.hypot(*steps[:-1].T), 1e-300
    )
    cuts = [0, *(np.flatnonzero(cosine < BACK) + 1).tolist(), len(xy) - 1]
    return [xy[a : b + 1] for a, b in pairwise(cuts)]


def _draw_event(event: Mark, ax: Axes) -> None:
    kind = "fold" if event.kind == "fold" else "branch point"
    zorder = 4.0 if kind == "fold" else 4.1
    ax.plot(*([x] for x in event.place), zorder=zorder, gid=kind, **MARKERS[kind])


def _draw_limit(
    limit: float, text: str, responses: tuple[float, float], obstacles: Obstacles, ax: Axes
) -> None:  # fmt: skip
    """The limit of what varies as a thin line, its name along it."""
    ax.plot([limit, limit], responses, color=INK, lw=0.5, zorder=1, gid="limit")
    ax.annotate(
        text, xy=(limit, responses[1]), xytext=(-2.0, -5.0), textcoords="offset points", rotation=90, ha="right",
        va="top", fontsize=NOTE_SIZE, color=INK,
    )  # fmt: skip
    length, thick = text_size(text, NOTE_SIZE)
    (x, low), (_, high) = to_points(ax, np.array([[limit, responses[0]], [limit, responses[1]]]))
    obstacles.take(np.array([x - 2.0 - 0.7 * thick, high - 5.0 - 0.5 * length]), (1.5 * thick, length))
    obstacles.take(np.array([x, 0.5 * (low + high)]), (1.0, high - low))


def _places(ax: Axes, events: list[Mark]) -> np.ndarray:
    """(n, 2) places of events in points."""
    return to_points(ax, np.array([e.place for e in events])) if events else np.empty((0, 2))


def response_range(stretches: list[Stretch]) -> tuple[float, float]:
    """Range of the axis of responses: all curves, and the line of zero where that is near them, with some air."""
    every = np.concatenate([s.xy[:, 1] for s in stretches] or [np.zeros(1)])
    low, high = float(every.min()), float(every.max())
    reach = ZERO * (high - low)
    low, high = (0.0 if 0.0 < low < reach else low), (0.0 if -reach < high < 0.0 else high)
    air = 0.09 * ((high - low) or 1.0)
    return low - air, high + air
