"""Named states of a slice against searches that know nothing of branches: each must have been met."""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.atlas.slices.branches.search import Found
from rodatlas.atlas.slices.result import State
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.states.coexisting import solve_state
from rodatlas.continuation import Solution
from rodatlas.model import Model
from rodatlas.model.orbit import same_state

MARGIN = 0.01  # of the reach of what varies: nearer to its ends a state attracts hardly any start
AGAIN = 4  # times as many starts in the second search, made where the first one missed a known state
Called = tuple[str, Solution]
"""A state and its name."""


def missed_states(searches: Sequence[Found], states: Sequence[State], settings: SliceSettings) -> list[str]:
    """Warnings for the named states of a slice that neither the search at a place nor a longer one has met."""
    warnings = []
    margin, search, model = MARGIN * settings.reach, settings.model.search, settings.local
    for found in searches:
        here = [s for s in states if s.low.value + margin < found.value < s.high.value - margin]
        solved = [(s.name, solve_state(s, found.value, settings)) for s in here]
        wanted = [(name, s) for name, s in solved if s is not None and search is not None and search.meets(s)]
        missed = _without(model, wanted, found.states)
        if missed and search is not None:
            at = settings.whole_setting(found.value)
            again = search.stable_states(at, AGAIN * settings.search, 2, settings.tolerance)
            missed = _without(model, missed, again)
        if missed:
            names = ", ".join(name for name, _ in missed)
            warnings.append(
                f"the search at {settings.along} {found.value:g} did not meet {names}: raise its number of starts"
            )
    return warnings


def _without(model: Model, wanted: Sequence[Called], found: Sequence[Solution]) -> list[Called]:
    """Those of some states that are not among others, up to the symmetries of the setting."""
    return [(name, state) for name, state in wanted if not any(same_state(model, state, other) for other in found)]


def empty_searches(searches: Sequence[Found], settings: SliceSettings) -> list[str]:
    """Warnings for the searches of a slice that found no state at all: nothing isolated would have been seen there."""
    return [
        f"search: no stable state found at {settings.along} {s.value:g}: raise the number of starts" for s in searches
        if not s.states
    ]  # fmt: skip
