"""Named states of a slice against searches that know nothing of branches: each must have been met."""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.atlas.slices.coexisting import solve_state
from rodatlas.atlas.slices.match import same_state
from rodatlas.atlas.slices.result import State
from rodatlas.atlas.slices.search import Search, found_states
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.rods.band import limiting_shear
from rodatlas.states.winding import is_wound

MARGIN = 0.01  # of the limiting shear: nearer to its ends a state attracts hardly any start
AGAIN = 4  # times as many starts in the second search, made where the first one missed a known state
Called = tuple[str, Solution]
"""A state and its name."""


def missed_states(searches: Sequence[Search], states: Sequence[State], settings: SliceSettings) -> list[str]:
    """Warnings for the named states of a slice that neither the search at a shear nor a longer one has met."""
    warnings = []
    margin = MARGIN * limiting_shear(settings.compression)
    for search in searches:
        here = [s for s in states if s.low.shear + margin < search.shear < s.high.shear - margin]
        solved = [(s.name, solve_state(s, search.shear, settings)) for s in here]
        # wound-up bands are not searched for
        wanted = [(name, s) for name, s in solved if s is not None and not is_wound(s, "+")]
        missed = _without(wanted, search.states)
        if missed:
            missed = _without(missed, found_states(search.shear, settings, AGAIN * settings.search, 2))
        if missed:
            names = ", ".join(name for name, _ in missed)
            warnings.append(f"the search at shear {search.shear:g} did not meet {names}: raise its number of starts")
    return warnings


def _without(wanted: Sequence[Called], found: Sequence[Solution]) -> list[Called]:
    """Those of some states that are not among others, up to reversal."""
    return [(name, state) for name, state in wanted if not any(same_state(state, other) for other in found)]


def empty_searches(searches: Sequence[Search]) -> list[str]:
    """Warnings for the searches of a slice that found no state at all: nothing isolated would have been seen there."""
    return [
        f"search: no stable state found at shear {s.shear:g}: raise the number of starts" for s in searches
        if not s.states
    ]  # fmt: skip
