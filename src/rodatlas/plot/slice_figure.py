"""The bifurcation diagram of a slice with small drawings of the band, each led to the point of the curve it shows."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.diagram import NAME_SIZE, NOTE_SIZE, Drawn, draw_curves, draw_heading, height_range, label_events
from rodatlas.plot.placement import dense, text_size, to_points
from rodatlas.plot.protocols import SliceLike, StateLike
from rodatlas.plot.render import DISPLAY_WIDTH, draw_triad, render_band
from rodatlas.plot.style import TWO_COLUMN, color_of, label_of, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution

DIAGRAM, STRIP = 3.15, 1.32  # heights in inches: of the diagram itself, and of a strip of drawings
LEFT, RIGHT, BOTTOM, TOP = 0.62, 0.06, 0.44, 0.26
MOST = 5  # drawings in a strip
CAPTION = 13.0  # height of the line under or over a drawing, in points


@dataclass(frozen=True, eq=False)
class Shown:
    """A state to be drawn: its name, the solutions to choose from, and their places in the diagram (n, 2), points."""

    name: str
    solutions: list[Solution]
    places: np.ndarray


@dataclass(frozen=True)
class Slot:
    """Where a drawing goes: strip (+1 above, -1 below), column, columns in the strip."""

    strip: int
    column: int
    columns: int


def draw_slice_figure(slice_: SliceLike, width: float = DISPLAY_WIDTH) -> Figure:
    """Draw the bifurcation diagram with a drawing of the band in every named state.

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
    states = _one_of_each(slice_.states)
    strips = _strips_needed(states)
    inches = DIAGRAM + STRIP * sum(strips) + BOTTOM + TOP
    with styled():
        fig = new_figure(TWO_COLUMN, inches)
        box = (LEFT / TWO_COLUMN, BOTTOM / inches, 1 - (LEFT + RIGHT) / TWO_COLUMN, 1 - (BOTTOM + TOP) / inches)
        ax = fig.add_axes(box)
        drawn = _draw_diagram(slice_, ax, strips)
        draw_heading(slice_.settings, ax)
        label_events(drawn, ax)
        shown = [_choices(ax, state) for state in states]
        slots, chosen = _arrange(ax, drawn, shown, strips)
        scale = _common_scale(ax, shown, slots, chosen, width)
        for one, slot, k in zip(shown, slots, chosen, strict=True):
            _draw_band(ax, one, slot, k, scale, width)
        _draw_notes(ax, width)
        fig.draw_without_rendering()
    return fig


def plus_member(solution: Solution) -> Solution:
    """The member of a +/- pair with more bending energy in the half s > 1/2: the solution or its reversal."""
    from rodatlas.rods.symmetry import reverse

    k1 = solution.stages[..., solution.unknowns.index("k1")]
    return solution if solution.mean((solution.gauss_points() - 0.5) * k1**2) >= 0 else reverse(solution)


def _one_of_each(states: Sequence[StateLike]) -> list[StateLike]:
    """For each name the state with the longest range of shear."""
    longest: dict[str, StateLike] = {}
    for state in states:
        known = longest.get(state.name)
        if known is None or _shear_span(state) > _shear_span(known):
            longest[state.name] = state
    return list(longest.values())


def _shear_span(state: StateLike) -> float:
    return abs(state.solutions[-1]["dD"] - state.solutions[0]["dD"])


def _strips_needed(states: Sequence[StateLike]) -> tuple[bool, bool]:
    """Whether there are strips of drawings below and above: below for states under the line of zero height."""
    below = any(s.solutions[len(s.solutions) // 2]["height"] < 0 for s in states) or len(states) > MOST
    return below, bool(states)


def _draw_diagram(slice_: SliceLike, ax: Axes, strips: tuple[bool, bool]) -> Drawn:
    """The diagram, with room for the strips."""
    total = DIAGRAM + STRIP * sum(strips)
    below, above = (STRIP * strip / total for strip in strips)
    drawn = draw_curves(slice_, ax, (below, above))
    middle = below + 0.5 * DIAGRAM / total
    ax.yaxis.set_label_coords(-0.42 / (TWO_COLUMN - LEFT - RIGHT) * 1.0, middle)
    return drawn


def _choices(ax: Axes, state: StateLike) -> Shown:
    """Computed solutions in the middle part of a stable range, by the length of its curve, at most a dozen."""
    solutions = list(state.solutions)
    places = to_points(ax, np.array([(s["dD"], s["height"]) for s in solutions]))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    part = along / max(along[-1], 1e-12)
    inner = [i for i in range(1, len(solutions) - 1) if 0.2 <= part[i] <= 0.8]
    inner = inner or [len(solutions) // 2]
    kept = [inner[i] for i in np.unique(np.linspace(0, len(inner) - 1, min(12, len(inner))).astype(int))]
    return Shown(state.name, [solutions[i] for i in kept], places[kept])


class _Layout:
    """Cells of the strips, and the price of leading a line from a cell to a place in the diagram."""

    def __init__(self, ax: Axes, drawn: Drawn, strips: tuple[bool, bool]):
        box = ax.get_window_extent()
        per_point = 72.0 / ax.figure.dpi
        self.left, self.right = box.x0 * per_point + 4.0, box.x1 * per_point - 12.0
        self.low, self.high = box.y0 * per_point, box.y1 * per_point
        self.strips = strips
        curves = [dense(to_points(ax, s.xy), 4.0) for s in drawn.stretches]
        self._one = np.concatenate([c[:-1] for c in curves])
        self._two = np.concatenate([c[1:] for c in curves])
        self._weight = np.concatenate(
            [np.full(len(c) - 1, 2.0 if s.stable else 1.0) for c, s in zip(curves, drawn.stretches, strict=True)]
        )
        self._boxes = np.array([[0.5 * (b[0] + b[2]), 0.5 * (b[1] + b[3])] for b in drawn.obstacles.boxes
                                if b[3] - b[1] < 60.0]).reshape(-1, 2)  # fmt: skip
        self._known: dict[tuple[Slot, float, float], float] = {}

    def cell(self, slot: Slot) -> tuple[float, float, float, float]:
        """(left, bottom, width, height) of a drawing with its caption, in points."""
        right = self.right - (34.0 if slot.strip == self.triad_strip else 0.0)
        width = (right - self.left) / slot.columns
        height = STRIP * 72.0
        bottom = self.high - height if slot.strip > 0 else self.low
        return self.left + slot.column * width, bottom, width, height

    @property
    def triad_strip(self) -> int:
        """The strip that leaves a corner for the triad of directions."""
        return -1 if self.strips[0] else 1

    def start(self, slot: Slot) -> np.ndarray:
        """Where the line from a drawing starts: at the side of its caption that faces the diagram."""
        left, bottom, width, height = self.cell(slot)
        return np.array([left + 0.5 * width, bottom + 2.0 if slot.strip > 0 else bottom + height - 2.0])

    def price(self, slot: Slot, place: np.ndarray) -> float:
        key = (slot, float(place[0]), float(place[1]))
        if key not in self._known:
            self._known[key] = self._price(self.start(slot), place)
        return self._known[key]

    def _price(self, start: np.ndarray, place: np.ndarray) -> float:
        way = place - start
        length = float(np.hypot(*way))
        end = place - way / max(length, 1e-9) * 2.5
        crossed = float(self._weight[crosses(start, end, self._one, self._two)].sum())
        near = 0.0
        if len(self._boxes):
            part = np.clip((self._boxes - start) @ way / max(length, 1e-9) ** 2, 0.0, 1.0)
            near = float((np.hypot(*(self._boxes - start - part[:, None] * way).T) < 5.0).sum())
        return 0.012 * length + 0.008 * abs(way[0]) + crossed + 4.0 * near


def crosses(start: np.ndarray, end: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Whether the segment from start to end crosses each of the segments one[i] to two[i]."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    return (side(start, end, one) * side(start, end, two) < 0) & (side(one, two, start) * side(one, two, end) < 0)


def _arrange(ax: Axes, drawn: Drawn, shown: list[Shown], strips: tuple[bool, bool]) -> tuple[list[Slot], list[int]]:
    """A slot for each state, and which of its solutions is drawn there."""
    layout = _Layout(ax, drawn, strips)
    middle = [len(one.solutions) // 2 for one in shown]
    trials = []
    for sides in itertools.product((1, -1) if strips[0] else (1,), repeat=len(shown)):
        if max(sides.count(1), sides.count(-1)) > max(MOST, (len(shown) + 1) // 2):
            continue
        slots = _in_order(shown, middle, sides)
        trials.append((_total(layout, shown, slots, middle) + 0.6 * _imbalance(sides), slots))
    trials.sort(key=lambda t: t[0])
    best: tuple[float, list[Slot], list[int]] | None = None
    for _, slots in trials[:8]:
        price, chosen = _descend(layout, shown, slots, list(middle))
        price += 0.6 * _imbalance(tuple(s.strip for s in slots))
        if best is None or price < best[0]:
            best = price, slots, chosen
    return (best[1], best[2]) if best else ([], [])


def _imbalance(sides: Sequence[int]) -> int:
    return max(abs(sum(sides)) - 1, 0)


def _in_order(shown: list[Shown], chosen: list[int], sides: Sequence[int]) -> list[Slot]:
    """Slots in the order of the places from left to right, strip by strip."""
    slots: dict[int, Slot] = {}
    for strip in (1, -1):
        mine = [i for i, side in enumerate(sides) if side == strip]
        mine.sort(key=lambda i: float(shown[i].places[chosen[i], 0]))
        slots |= {i: Slot(strip, column, len(mine)) for column, i in enumerate(mine)}
    return [slots[i] for i in range(len(shown))]


def _total(layout: _Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]) -> float:
    """Price of all lines, and of those that cross each other."""
    ends = [one.places[k] for one, k in zip(shown, chosen, strict=True)]
    starts = [layout.start(slot) for slot in slots]
    price = sum(layout.price(slot, end) for slot, end in zip(slots, ends, strict=True))
    for i, j in itertools.combinations(range(len(slots)), 2):
        if crosses(starts[i], ends[i], starts[j][None], ends[j][None])[0]:
            price += 20.0
        price += 4.0 * (np.hypot(*(ends[i] - ends[j])) < 12.0)
    return float(price)


def _descend(layout: _Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]) -> tuple[float, list[int]]:
    """Improve the choice of solutions, one state after the other; near the middle of the range is better."""

    def price(trial: list[int]) -> float:
        off = sum(
            abs(k / max(len(one.solutions) - 1, 1) - 0.5) for one, k in zip(shown, trial, strict=True)
        )
        return _total(layout, shown, slots, trial) + 1.0 * off

    for _ in range(3):
        for i, one in enumerate(shown):
            chosen[i] = min(range(len(one.solutions)), key=lambda k: price([*chosen[:i], k, *chosen[i + 1 :]]))
    return price(chosen), chosen
