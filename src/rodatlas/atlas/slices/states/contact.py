"""Where along a named state the band touches itself, as ranges of what varies."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rodatlas.atlas.slices.result import Slice, State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.coexisting import solve_state
from rodatlas.continuation import Solution
from rodatlas.rods.contact import SECTIONS, may_touch, meeting, sections_of, self_contact, width_text
from rodatlas.rods.kinematics import ribbon

SPACING = 0.5  # of the width: how far the band moves between states that are looked at; strands pass within a width
SLACK = 0.25  # of the width, added to it where a state is only interpolated
ACCURACY = 5e-5  # of the ends, in units of the parameter
MOST = 20  # solutions to locate one end; two or three are usual
COARSE = 61  # cross-sections at which most interpolated ribbons show that they are far from themselves

Range = tuple[float, float]


def with_contact(states: Iterable[State], settings: SliceSettings) -> list[State]:
    """The states with the ranges in which their bands touch themselves; a model without width has none."""
    if not settings.model.width:
        return list(states)
    return [replace(state, contact=contact_ranges(state, settings)) for state in states]


def contact_ranges(state: State, settings: SliceSettings, width: float | None = None) -> tuple[Range, ...]:
    """Ranges of what varies in which the band of a state meets itself.

    The computed solutions are tested, and between them, half a width of motion apart, states whose interpolated ribbon
    nearly meets itself. The ends of the ranges lie where the ribbon between two solutions that are close to each other
    begins to meet itself.

    Parameters
    ----------
    width : w, in units of the length; that of the model by default.

    Returns
    -------
    (low, high) in order; the first may start and the last may end with the state itself.

    Raises
    ------
    ValueError
        when the width is not between 0 and 10.
    """
    width = settings.model.width if width is None else width
    tested = _Tested(state, settings, width)
    name = settings.parameter
    for one, two in pairwise(state.solutions):
        if not (tested.touches(one[name]) and tested.touches(two[name])):
            for place in _close_calls(one, two, name, width):
                tested.touches(place)
    places = tested.places
    edges = [tested.change(*pair) for pair in pairwise(places) if tested.touches(pair[0]) != tested.touches(pair[1])]
    if tested.touches(places[0]):
        edges.insert(0, places[0])
    if tested.touches(places[-1]):
        edges.append(places[-1])
    values = sorted(settings.value_at(edge) for edge in edges)
    return tuple(zip(values[::2], values[1::2], strict=True))


class _Tested:
    """Solutions of a state at some places, and whether the band meets itself there; more are solved for when asked.

    A place is the parameter of the problem that varies: shears are lengths, angles are radians, both about as large as
    what the band moves by.
    """

    def __init__(self, state: State, settings: SliceSettings, width: float):
        self._state, self._settings, self._width = state, settings, width
        self._known = {s[settings.parameter]: s for s in state.solutions}
        self._answers = {place: self_contact(s, width) is not None for place, s in self._known.items()}

    @property
    def places(self) -> list[float]:
        return sorted(self._known)

    def touches(self, place: float) -> bool | None:
        """None where no state can be solved for."""
        if place not in self._known:
            near = replace(self._state, solutions=tuple(self._known.values()))
            solution = solve_state(near, self._settings.value_at(place), self._settings)
            if solution is None:
                return None
            self._known[place] = solution
            self._answers[place] = self_contact(solution, self._width) is not None
        return self._answers[place]

    def change(self, low: float, high: float) -> float:
        """The place between two with different answers at which the band begins or ceases to meet itself.

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
        between = _Between(self._known[low], self._known[high], self._settings.parameter, SECTIONS)
        first, at, end = self._answers[low], low, high
        while end - at > 0.2 * ACCURACY:
            middle = 0.5 * (at + end)
            here = meeting(*between(middle), self._width) is not None
            at, end = (middle, end) if here == first else (at, middle)
        return 0.5 * (at + end)


class _Between:
    """The ribbon between two solutions, interpolated in what varies."""

    def __init__(self, one: Solution, two: Solution, name: str, sections: int):
        self._places = one[name], two[name]
        self._s = sections_of(one, sections)
        self._one, self._two = ribbon(one, self._s), ribbon(two, self._s)

    def __call__(self, place: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cross-sections, center line and directors."""
        low, high = self._places
        part = (place - low) / (high - low)
        center, frame = ((1.0 - part) * a + part * b for a, b in zip(self._one, self._two, strict=True))
        return self._s, center, frame


def _close_calls(one: Solution, two: Solution, name: str, width: float) -> list[float]:
    """Places between two neighboring solutions at which the ribbon between them nearly meets itself."""
    low, high = one[name], two[name]
    count = math.ceil(abs(high - low) / (SPACING * width))
    places = np.linspace(low, high, count + 1)[1:-1].tolist()
    wide = (1.0 + SLACK) * width
    coarse = _Between(one, two, name, COARSE)
    near = [place for place in places if may_touch(*coarse(place), wide)]
    if not near:
        return []
    fine = _Between(one, two, name, SECTIONS)
    return [place for place in near if meeting(*fine(place), wide) is not None]


def contact_of_slices(slices: Sequence[Slice], second: str) -> list[str]:
    """A sentence for each name whose bands touch themselves in some of several slices.

    Parameters
    ----------
    second : the control by which the slices differ.
    """
    found: dict[str, dict[float, list[Range]]] = {}
    for one in slices:
        for s in one.states:
            if s.contact:
                found.setdefault(s.name, {}).setdefault(one.settings.setting[second], []).extend(s.contact)
    warnings = []
    for name, at in found.items():
        low, high = min(a for spans in at.values() for a, _ in spans), max(b for spans in at.values() for _, b in spans)
        settings = slices[0].settings
        warnings.append(
            f"{name}: a band {width_text(settings.model.width)} wide passes through itself at {settings.along} within "
            f"{low:.5f} to {high:.5f}, in the slices at {second} {', '.join(f'{value:g}' for value in at)}; forces of "
            "contact are not modeled"
        )
    return warnings


def ranges_text(ranges: Iterable[Range]) -> str:
    """Ranges in words: '-0.01200 to 0.01200, 0.30000 to 0.40000'."""
    return ", ".join(f"{low:.5f} to {high:.5f}" for low, high in ranges)


def contact_warnings(states: Iterable[State], settings: SliceSettings) -> list[str]:
    """A sentence for each state whose band touches itself somewhere."""
    return [
        f"{s.name}: a band {width_text(settings.model.width)} wide passes through itself at {settings.along} "
        f"{ranges_text(s.contact)}; forces of contact are not modeled"
        for s in states if s.contact
    ]  # fmt: skip
