"""Where the drawings around a diagram go, and which point of the curve each one shows."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.plot.look.placement import dense, to_points
from rodatlas.plot.slices.panel import Drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rodatlas.continuation import Solution

MOST = 5  # drawings in a strip
COLUMNS = 4.3  # the strip is at least this many drawings wide, so that four have some play
NEAR = 9.0  # points between a place and another curve within which it is not plain whose place it is
TRIAD = 36.0  # width of the corner that is left for the directions of x, y and z, in points


@dataclass(frozen=True, eq=False)
class Shown:
    """A state to be drawn: its name, the solutions to choose from, and their places in the diagram (n, 2), points."""

    name: str
    solutions: list[Solution]
    places: np.ndarray


@dataclass(frozen=True)
class Slot:
    """Where a drawing goes: strip (+1 above, -1 below), place in its order, and the middle in points."""

    strip: int
    column: int
    center: float


class Layout:
    """Cells of the strips, and the price of leading a line from a cell to a place in the diagram.

    Parameters
    ----------
    strips : whether there is a strip below and one above. height : of a strip, in points.
    """

    def __init__(self, ax: Axes, drawn: Drawn, strips: tuple[bool, bool], height: float):
        self.height = height
        from scipy.spatial import KDTree

        box = ax.get_window_extent()
        per_point = 72.0 / ax.figure.dpi
        self.left, self.right = box.x0 * per_point + 4.0, box.x1 * per_point - 12.0
        self.low, self.high = box.y0 * per_point, box.y1 * per_point
        self.strips = strips
        curves = [dense(to_points(ax, s.xy), 4.0) for s in drawn.stretches]
        self._one = np.concatenate([c[:-1] for c in curves])
        self._two = np.concatenate([c[1:] for c in curves])
        self._weight = np.concatenate(
            [np.full(len(c) - 1, 4.0 if s.stable else 1.0) for c, s in zip(curves, drawn.stretches, strict=True)]
        )
        self._names = np.concatenate(
            [np.full(len(c) - 1, s.name or "", dtype=object) for c, s in zip(curves, drawn.stretches, strict=True)]
        )
        self._boxes = np.array([[0.5 * (b[0] + b[2]), 0.5 * (b[1] + b[3])] for b in drawn.obstacles.boxes
                                if b[3] - b[1] < 60.0]).reshape(-1, 2)  # fmt: skip
        self._curves = KDTree(np.concatenate(curves))
        self._known: dict[tuple[Slot, float, float], float] = {}

    def cell(self, slot: Slot, columns: int) -> tuple[float, float, float, float]:
        """(left, bottom, width, height) of a drawing with its caption, in points."""
        width = self.cell_width(slot.strip, columns)
        bottom = self.high - self.height if slot.strip > 0 else self.low
        return slot.center - 0.5 * width, bottom, width, self.height

    def cell_width(self, strip: int, columns: int) -> float:
        return (self._right_of(strip) - self.left) / max(float(columns), COLUMNS)

    def slots(self, strip: int, wanted: np.ndarray) -> list[Slot]:
        """Cells side by side in the given order, their middles as near as possible to the wanted ones (n,)."""
        n = len(wanted)
        width = self.cell_width(strip, n)
        free = isotonic(wanted - width * np.arange(n))
        free = np.clip(free, self.left + 0.5 * width, self._right_of(strip) - width * (n - 0.5))
        return [Slot(strip, i, float(x)) for i, x in enumerate(free + width * np.arange(n))]

    def _right_of(self, strip: int) -> float:
        return self.right - (TRIAD if strip == self.triad_strip else 0.0)

    @property
    def triad_strip(self) -> int:
        """The strip that leaves a corner for the triad of directions."""
        return -1 if self.strips[0] else 1

    def start(self, slot: Slot) -> np.ndarray:
        """Where the line from a drawing starts: at the side of its caption that faces the diagram."""
        y = self.high - self.height + 2.0 if slot.strip > 0 else self.low + self.height - 2.0
        return np.array([slot.center, y])

    def ambiguity(self, name: str, place: np.ndarray) -> float:
        """Price of a place on a curve where another curve is near."""
        near = np.maximum(1.0 - np.hypot(*(self._one - place).T) / NEAR, 0.0)
        return float((self._weight * near * (self._names != name)).sum())

    def price(self, slot: Slot, place: np.ndarray) -> float:
        key = (slot, float(place[0]), float(place[1]))
        if key not in self._known:
            self._known[key] = self._price(self.start(slot), place)
        return self._known[key]

    def _price(self, start: np.ndarray, place: np.ndarray) -> float:
        way = place - start
        length = float(np.hypot(*way))
        end = place - way / max(length, 1e-9) * 2.5
        hit = crosses(start, end, self._one, self._two)
        crossed, crossings = float(self._weight[hit].sum()), int(hit.sum())
        near = 0.0
        if len(self._boxes):
            part = np.clip((self._boxes - start) @ way / max(length, 1e-9) ** 2, 0.0, 1.0)
            near = float((np.hypot(*(self._boxes - start - part[:, None] * way).T) < 5.0).sum())
        along = start + np.linspace(0.0, 1.0, max(int(length / 3.0), 2))[:, None] * (place - 4.0 * way / length - start)
        beside = float((self._curves.query(along, distance_upper_bound=4.0)[0] < 3.0).sum())
        return 0.02 * length + 0.01 * abs(way[0]) + crossed + 4.0 * near + 0.5 * max(beside - 3.0 * crossings, 0.0)


def crosses(start: np.ndarray, end: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Whether the segment from start to end crosses each of the segments one[i] to two[i]."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    return (side(start, end, one) * side(start, end, two) < 0) & (side(one, two, start) * side(one, two, end) < 0)


def isotonic(values: np.ndarray) -> np.ndarray:
    """The non-decreasing sequence nearest to the values, in the sense of least squares (pool adjacent violators)."""
    blocks: list[tuple[float, int]] = []
    for value in values:
        mean, count = float(value), 1
        while blocks and blocks[-1][0] > mean:
            other, more = blocks.pop()
            mean, count = (mean * count + other * more) / (count + more), count + more
        blocks.append((mean, count))
    return np.concatenate([np.full(count, mean) for mean, count in blocks]) if blocks else np.empty(0)


def arrange(layout: Layout, shown: list[Shown]) -> tuple[list[Slot], list[int]]:
    """A slot for each state, and which of its solutions is drawn there.

    The states are divided between the strips in every way, in the order of their places; the most promising divisions
    are improved by choosing other solutions and by changing the order.
    """
    own = []
    for one in shown:
        off_middle = np.abs(np.linspace(-0.5, 0.5, len(one.places))) if len(one.places) > 1 else np.zeros(1)
        own.append([layout.ambiguity(one.name, p) + float(d) for p, d in zip(one.places, off_middle, strict=True)])
    middle = [int(np.argmin(price)) for price in own]
    trials = []
    for sides in itertools.product((1, -1) if layout.strips[0] else (1,), repeat=len(shown)):
        if max(sides.count(1), sides.count(-1)) > max(MOST, (len(shown) + 1) // 2):
            continue
        orders = _orders(shown, middle, sides)
        slots = _slots(layout, shown, middle, orders)
        trials.append((_total(layout, shown, slots, middle, own), orders))
    trials.sort(key=lambda t: t[0])
    best: tuple[float, list[Slot], list[int]] | None = None
    for _, orders in trials[:3]:
        found = _improve(layout, shown, orders, middle, own)
        if best is None or found[0] < best[0]:
            best = found
    return (best[1], best[2]) if best else ([], [])


def _orders(shown: list[Shown], chosen: list[int], sides: Sequence[int]) -> dict[int, list[int]]:
    """For each strip its states from left to right."""
    return {
        strip: sorted(
            (i for i, side in enumerate(sides) if side == strip), key=lambda i: float(shown[i].places[chosen[i], 0])
        )
        for strip in (1, -1)
    }


def _slots(layout: Layout, shown: list[Shown], chosen: list[int], orders: dict[int, list[int]]) -> list[Slot]:
    slots: dict[int, Slot] = {}
    for strip, order in orders.items():
        wanted = np.array([shown[i].places[chosen[i], 0] for i in order])
        slots |= dict(zip(order, layout.slots(strip, wanted), strict=True))
    return [slots[i] for i in range(len(shown))]


def _total(layout: Layout, shown: list[Shown], slots: list[Slot], chosen: list[int], own: list[list[float]]) -> float:
    """Price of the chosen places, of all lines, and of those that cross each other."""
    ends = np.array([one.places[k] for one, k in zip(shown, chosen, strict=True)])
    starts = np.array([layout.start(slot) for slot in slots])
    price = sum(layout.price(slot, end) for slot, end in zip(slots, ends, strict=True))
    price += sum(prices[k] for prices, k in zip(own, chosen, strict=True))
    i, j = np.triu_indices(len(slots), 1)
    crossing = crosses(starts[i], ends[i], starts[j], ends[j]).sum()
    crowded = (np.hypot(*(ends[i] - ends[j]).T) < 12.0).sum()
    balance = max(abs(sum(slot.strip for slot in slots)) - 1, 0)
    return float(price + 20.0 * crossing + 4.0 * crowded + 0.6 * balance)


def _improve(
    layout: Layout, shown: list[Shown], orders: dict[int, list[int]], chosen: list[int], own: list[list[float]]
) -> tuple[float, list[Slot], list[int]]:
    """Choose the solutions anew, then change the order of the drawings while that helps."""
    best = _settle(layout, shown, orders, chosen, own)
    improved = True
    while improved:
        improved = False
        for trial in _neighbors(layout, orders):
            found = _settle(layout, shown, trial, best[2], own)
            if found[0] < best[0] - 1e-9:
                best, orders, improved = found, trial, True
                break
    return best


def _neighbors(layout: Layout, orders: dict[int, list[int]]) -> Iterator[dict[int, list[int]]]:
    """Orders in which two neighbors have changed places, or one drawing has moved to the other strip."""
    for strip, order in orders.items():
        for k in range(len(order) - 1):
            yield orders | {strip: [*order[:k], order[k + 1], order[k], *order[k + 2 :]]}
        other = orders[-strip]
        if not layout.strips[0] or len(other) >= MOST:
            continue
        for k, i in enumerate(order):
            for at in range(len(other) + 1):
                yield {strip: [*order[:k], *order[k + 1 :]], -strip: [*other[:at], i, *other[at:]]}


def _settle(
    layout: Layout, shown: list[Shown], orders: dict[int, list[int]], chosen: list[int], own: list[list[float]]
) -> tuple[float, list[Slot], list[int]]:
    """Choose each state's solution in turn, the others held; then let the drawings follow their places."""
    slots = _slots(layout, shown, chosen, orders)
    for _ in range(2):
        for i, one in enumerate(shown):
            trials = [[*chosen[:i], k, *chosen[i + 1 :]] for k in range(len(one.solutions))]
            chosen = min(trials, key=lambda trial: _total(layout, shown, slots, trial, own))
    moved = _slots(layout, shown, chosen, orders)
    before, after = (_total(layout, shown, x, chosen, own) for x in (slots, moved))
    return (after, moved, chosen) if after <= before else (before, slots, chosen)
