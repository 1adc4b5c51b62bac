"""Where along a named state the band touches itself, as ranges of shear."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.rods.band import NARROW
from rodatlas.rods.contact import SECTIONS, may_touch, meeting, sections_of, self_contact, width_text
from rodatlas.rods.kinematics import ribbon

SPACING = 0.5  # of the width: how far apart in shear states are looked at; strands pass each other within a width
SLACK = 0.25  # of the width, added to it where a state is only interpolated
ACCURACY = 5e-5  # of the ends, in shear
MOST = 20  # solutions to locate one end; two or three are usual
COARSE = 61  # cross-sections at which most interpolated ribbons show that they are far from themselves

Range = tuple[float, float]


def with_contact(states: Iterable[State], settings: SliceSettings) -> list[State]:
    """The states with the ranges of shear in which their bands touch themselves."""
    return [replace(state, contact=contact_ranges(state, settings)) for state in states]


def contact_ranges(state: State, settings: SliceSettings, width: float = NARROW) -> tuple[Range, ...]:
    """Ranges of shear in which the band of a state meets itself.

    The computed solutions are tested, and between them, half a width apart in shear, states whose interpolated ribbon
    nearly meets itself. The ends of the ranges lie where the ribbon between two solutions that are close to each other
    begins to meet itself.

    Parameters
    ----------
    width : w, in units of the length.

    Returns
    -------
    (low, high) in order; the first may start and the last may end with the state itself.

    Raises
    ------
    ValueError
        when the width is not between 0 and 10.
    """
    tested = _Tested(state, settings, width)
    for one, two in pairwise(state.solutions):
        if not (tested.touches(one["dD"]) and tested.touches(two["dD"])):
            for shear in _close_calls(one, two, width):
                tested.touches(shear)
    places = tested.shears
    edges = [tested.change(*pair) for pair in pairwise(places) if tested.touches(pair[0]) != tested.touches(pair[1])]
    if tested.touches(places[0]):
        edges.insert(0, places[0])
    if tested.touches(places[-1]):
        edges.append(places[-1])
    return tuple(zip(edges[::2], edges[1::2], strict=True))


class _Tested:
    """Solutions of a state at some shears, and whether the band meets itself there; more are solved for when asked."""

    def __init__(self, state: State, settings: SliceSettings, width: float):
        self._state, self._settings, self._width = state, settings, width
        self._known = {s["dD"]: s for s in state.solutions}
        self._answers = {shear: self_contact(s, width) is not None for shear, s in self._known.items()}

    @property
    def shears(self) -> list[float]:
        return sorted(self._known)

    def touches(self, shear: float) -> bool | None:
        """None where no state can be solved for."""
        if shear not in self._known:
            near = replace(self._state, solutions=tuple(self._known.values()))
            solution = solve_state(near, shear, self._settings)
            if solution is None:
                return None
            self._known[shear] = solution
            self._answers[shear] = self_contact(solution, self._width) is not None
        return self._answers[shear]

    def change(self, low: float, high: float) -> float:
        """The shear between two with different answers at which the band begins or ceases to meet itself.

        That of the ribbon between the two is solved at, which leaves a smaller interval, until it stays.
        """
        last = math.inf
        for _ in range(MOST):
            guess = self._interpolated_change(low, high)
            if abs(guess - last) < ACCURACY or high - low < ACCURACY:
                break
            last, here = guess, self.touches(guess)
            if here is None:
                break
            low, high = (guess, high) if here == self.touches(low) else (low, guess)
        return guess

    def _interpolated_change(self, low: float, high: float) -> float:
        between = _Between(self._known[low], self._known[high], SECTIONS)
        first, at, end = self._answers[low], low, high
        while end - at > 0.2 * ACCURACY:
            middle = 0.5 * (at + end)
            here = meeting(*between(middle), self._width) is not None
            at, end = (middle, end) if here == first else (at, middle)
        return 0.5 * (at + end)


class _Between:
    """The ribbon between two solutions, interpolated in shear."""

    def __init__(self, one: Solution, two: Solution, sections: int):
        self._shears = one["dD"], two["dD"]
        self._s = sections_of(one, sections)
        self._one, self._two = ribbon(one, self._s), ribbon(two, self._s)

    def __call__(self, shear: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cross-sections, center line and directors."""
        low, high = self._shears
        part = (shear - low) / (high - low)
        center, frame = ((1.0 - part) * a + part * b for a, b in zip(self._one, self._two, strict=True))
        return self._s, center, frame


def _close_calls(one: Solution, two: Solution, width: float) -> list[float]:
    """Shears between two neighboring solutions at which the ribbon between them nearly meets itself."""
    low, high = one["dD"], two["dD"]
    count = math.ceil((high - low) / (SPACING * width))
    shears = np.linspace(low, high, count + 1)[1:-1].tolist()
    wide = (1.0 + SLACK) * width
    coarse = _Between(one, two, COARSE)
    near = [shear for shear in shears if may_touch(*coarse(shear), wide)]
    if not near:
        return []
    fine = _Between(one, two, SECTIONS)
    return [shear for shear in near if meeting(*fine(shear), wide) is not None]


def contact_of_slices(slices: Sequence[Slice]) -> list[str]:
    """A sentence for each name whose bands touch themselves in some of several slices."""
    found: dict[str, dict[float, list[Range]]] = {}
    for one in slices:
        for s in one.states:
            if s.contact:
                found.setdefault(s.name, {}).setdefault(one.settings.angle_deg, []).extend(s.contact)
    warnings = []
    for name, at in found.items():
        low, high = min(a for spans in at.values() for a, _ in spans), max(b for spans in at.values() for _, b in spans)
        angles = ", ".join(f"{angle:g}" for angle in at)
        warnings.append(
            f"{name}: a band {width_text(NARROW)} wide passes through itself at shears within {low:.5f} to {high:.5f}, "
            f"in the slices at {angles} deg; forces of contact are not modeled"
        )
    return warnings


def ranges_text(ranges: Iterable[Range]) -> str:
    """Ranges in words: '-0.01200 to 0.01200, 0.30000 to 0.40000'."""
    return ", ".join(f"{low:.5f} to {high:.5f}" for low, high in ranges)


def contact_warnings(states: Iterable[State]) -> list[str]:
    """A sentence for each state whose band touches itself somewhere."""
    return [
        f"{s.name}: a band {width_text(NARROW)} wide passes through itself at shear {ranges_text(s.contact)}; "
        "forces of contact are not modeled"
        for s in states if s.contact
    ]  # fmt: skip
