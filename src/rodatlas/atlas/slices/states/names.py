"""Names for stable states that no nomenclature knows, made of what is seen: shape, symmetry, and order.

A letter says how often the state is inflected (A: k1 keeps its sign, B: it changes it once, ...; states that have no
shape are all A), '+-' that it is one of a pair, and a number counts states of one letter from the largest response
down. So a name stays where meshes are refined and settings change a little: the letter is a count halfway along a
stable stretch, and the number changes only where a state of the same kind comes or goes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from string import ascii_uppercase

from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.atlas.slices.result import Event
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.segments import Segment
from rodatlas.continuation import Solution, SpecialPoint
from rodatlas.model import Part
from rodatlas.model.nomenclature import LocusTables

ALONE, PAIR = "A", "A+-"
"""What stable states are called in a plane."""


class SeenNames:
    """A nomenclature for any model."""

    names: tuple[str, ...] = ()
    other = ""

    def __init__(self, settings: SliceSettings):
        self._settings = settings
        self.colors: Mapping[str, str] = {}

    def applies(self, setting: object, along: str, low: float, high: float) -> bool:
        """It knows every setting."""
        return True

    def parts(self, branches: Sequence[Followed], segments: Sequence[Segment]) -> list[list[Part]]:
        """One name for each segment."""
        middles = [_middle(s) for s in segments]
        letters = [self._letter(x) for x in middles]
        responses = [self._settings.response(x) for x in middles]
        found = []
        for i, segment in enumerate(segments):
            alike = [k for k, letter in enumerate(letters) if letter == letters[i]]
            number = 1 + sorted(alike, key=lambda k: (-responses[k], k)).index(i)
            name = f"{letters[i]}{number}{'+-' if segment.followed.pair else ''}"
            found.append([Part(name, 0, len(segment.solutions) - 1)])
        return found

    def cut(self, solutions: Sequence[Solution], parts: Sequence[Part], tolerance: float) -> list[list[Solution]]:
        """The whole segment."""
        return [list(solutions)]

    def numbers(
        self, branches: Sequence[Followed], named: Sequence[tuple[Segment, list[Part]]],
        event_at: Callable[[SpecialPoint], Event | None],
    ) -> list[dict[int, int]]:  # fmt: skip
        """All folds and branch points, each once, in order of the branches."""
        known: list[Event] = []
        found = []
        for followed in branches:
            numbers = {}
            for i, special in enumerate(followed.bifurcations):
                event = event_at(special)
                if event is not None:
                    if not any(event is other for other in known):
                        known.append(event)
                    numbers[i] = 1 + next(k for k, other in enumerate(known) if event is other)
            found.append(numbers)
        return found

    def names_at(self, states: Sequence[tuple[Solution, str, int, str]]) -> list[str | None]:
        """None: at one setting there are no stretches to be counted."""
        return [None] * len(states)

    def in_plane(self, name: str) -> str:
        """Whether it is one of a pair: letters and numbers may change where nothing happens to a state."""
        return PAIR if name.endswith("+-") else ALONE

    def tables(self, along: str, second: str) -> LocusTables:
        """Nothing is known."""
        return LocusTables()

    def change(self, before: str, after: str) -> None:
        """Names do not change smoothly."""
        return None

    def _letter(self, solution: Solution) -> str:
        read = self._settings.model.ribbon
        count = 0 if read is None else read(solution).inflections["k1"]
        return ascii_uppercase[min(count, len(ascii_uppercase) - 1)]


def _middle(segment: Segment) -> Solution:
    """The solution halfway along a segment, by number."""
    solutions = segment.solutions
    return solutions[len(solutions) // 2]
