"""Where the drawings around a diagram go, and which point of the curve each one shows."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.diagram import Drawn
from rodatlas.plot.placement import dense, to_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rodatlas.continuation import Solution

MOST = 5  # drawings in a strip
TRIAD = 36.0  # width of the corner that is left for the directions of x, y and z, in points


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


class Layout:
    """Cells of the strips, and the price of leading a line from a cell to a place in the diagram.

    Parameters
    ----------
    strips : whether there is a strip below and one above. height : of a strip, in points.
    """

    def __init__(self, ax: Axes, drawn: Drawn, strips: tuple[bool, bool], height: float):
        self.height = height
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
        right = self.right - (TRIAD if slot.strip == self.triad_strip else 0.0)
        width = (right - self.left) / slot.columns
        bottom = self.high - self.height if slot.strip > 0 else self.low
        return self.left + slot.column * width, bottom, width, self.height

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


def arrange(layout: Layout, shown: list[Shown]) -> tuple[list[Slot], list[int]]:
    """A slot for each state, and which of its solutions is drawn there."""
    middle = [len(one.solutions) // 2 for one in shown]
    trials = []
    for sides in itertools.product((1, -1) if layout.strips[0] else (1,), repeat=len(shown)):
        if max(sides.count(1), sides.count(-1)) > max(MOST, (len(shown) + 1) // 2):
            continue
        slots = _in_order(shown, middle, sides)
        trials.append((_total(layout, shown, slots, middle) + 0.6 * _imbalance(sides), slots))
    trials.sort(key=lambda t: t[0])
    best: tuple[float, list[Slot], list[int]] | None = None
    for _, first in trials[:6]:
        price, slots, chosen = _descend(layout, shown, first, list(middle))
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


def _total(layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]) -> float:
    """Price of all lines, and of those that cross each other."""
    ends = [one.places[k] for one, k in zip(shown, chosen, strict=True)]
    starts = [layout.start(slot) for slot in slots]
    price = sum(layout.price(slot, end) for slot, end in zip(slots, ends, strict=True))
    for i, j in itertools.combinations(range(len(slots)), 2):
        if crosses(starts[i], ends[i], starts[j][None], ends[j][None])[0]:
            price += 20.0
        price += 4.0 * (np.hypot(*(ends[i] - ends[j])) < 12.0)
    return float(price)


def _descend(
    layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]
) -> tuple[float, list[Slot], list[int]]:
    """Improve the choice of solutions, one state after the other, then swap neighbouring drawings while that helps."""
    price, chosen = _settle(layout, shown, slots, chosen)
    improved = True
    while improved:
        improved = False
        for i, j in itertools.combinations(range(len(slots)), 2):
            if slots[i].strip != slots[j].strip or abs(slots[i].column - slots[j].column) != 1:
                continue
            trial = list(slots)
            trial[i], trial[j] = slots[j], slots[i]
            new_price, new_chosen = _settle(layout, shown, trial, list(chosen))
            if new_price < price - 1e-9:
                price, slots, chosen, improved = new_price, trial, new_chosen, True
    return price, slots, chosen


def _settle(layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int]) -> tuple[float, list[int]]:
    """Choose each state's solution in turn, the others held; near the middle of the range is better."""

    def price(trial: list[int]) -> float:
        off = sum(abs(k / max(len(one.solutions) - 1, 1) - 0.5) for one, k in zip(shown, trial, strict=True))
        return _total(layout, shown, slots, trial) + off

    for _ in range(2):
        for i, one in enumerate(shown):
            trials = [[*chosen[:i], k, *chosen[i + 1 :]] for k in range(len(one.solutions))]
            chosen = min(trials, key=price)
    return price(chosen), chosen
