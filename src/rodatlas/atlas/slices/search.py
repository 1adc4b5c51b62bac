"""Stable states of a slice found by a search at several shears: seeds of isolated branches, and a check of the rest.

The search of :func:`rodatlas.states.find_states` knows nothing of branches. Each stable state that it finds, of the
first class and not wound up, must lie on a branch of the slice: one that does not starts a new branch. Conversely, see
:mod:`rodatlas.atlas.slices.crosscheck`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rodatlas.atlas.slices.cache import BranchCache
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.progress import silent
from rodatlas.rods.band import limiting_shear
from rodatlas.rods.ends import Ends
from rodatlas.states.discover import find_states
from rodatlas.states.winding import twist

PARTS = (0.0, 0.3, 0.5, 0.62, 0.72, 0.86)  # of the limiting shear
WOUND = math.pi  # a band with more twist, int tau ds [rad], belongs to the families of wound-up states


class Search(NamedTuple):
    """Stable states of the first class found at a shear, one of each +/- pair."""

    shear: float
    states: tuple[Solution, ...]

    @property
    def seeds(self) -> list[Solution]:
        """Those that are not wound up."""
        return [s for s in self.states if abs(twist(s)) < WOUND]


def searched_shears(settings: SliceSettings) -> tuple[float, ...]:
    """Shears at which a slice is searched: parts of the limiting shear, rounded, inside its range."""
    limit = limiting_shear(settings.compression)
    shears = (round(part * limit, 3) for part in PARTS)
    return tuple(shear for shear in shears if shear <= settings.shear_max)


def search_at(shear: float, settings: SliceSettings, cache: BranchCache) -> Search:
    """Search at one shear, unless the cache holds what was found."""
    key = f"search-{shear:g}"
    known = cache.get_states(key)
    if known is None:
        known = found_states(shear, settings, settings.search, 1)
        cache.put_states(key, known)
    return Search(shear, known)


def found_states(shear: float, settings: SliceSettings, starts: int, seed: int) -> tuple[Solution, ...]:
    """Stable states of the first class, the member + of each pair."""
    ends = Ends(settings.angle_deg, settings.compression, shear)
    found = find_states(
        ends,
        settings.poisson,
        "+",
        starts,
        stable_only=True,
        tolerance=settings.tolerance,
        seed=seed,
        progress=silent,
    ).states
    return tuple(s.solution for s in found if s.stable and s.pair != "-")
