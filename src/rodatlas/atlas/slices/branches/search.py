"""Stable states of a slice found by a search at several places: seeds of isolated branches, and a check of the rest.

The search of a model knows nothing of branches. Each stable state that it finds, and that does not belong to families
without an end, must lie on a branch of the slice: one that does not starts a new branch. Conversely, see
:mod:`rodatlas.atlas.slices.states.crosscheck`.
"""

from __future__ import annotations

from typing import NamedTuple

from rodatlas.atlas.cache import SOLUTIONS, Cache
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution

SHARES = (0.0, 0.3, 0.5, 0.62, 0.72, 0.86)  # of the reach of what varies
OF_RANGE, FEWEST = (0.04, 0.22, 0.41, 0.59, 0.78, 0.96), 4


class Found(NamedTuple):
    """Stable states found at a value of what varies, one of each orbit, and those of them that may start a branch."""

    value: float
    states: tuple[Solution, ...]
    seeds: tuple[Solution, ...]


def searched_values(settings: SliceSettings) -> tuple[float, ...]:
    """Where a slice is searched: shares of the reach, rounded, inside its range.

    Where fewer than `FEWEST` of these lie in the range, and no nomenclature says what there is, shares of the range.
    """
    values = (round(settings.part(share), 3) for share in SHARES)
    inside = tuple(value for value in values if settings.low <= value <= settings.high)
    if len(inside) >= FEWEST or (inside and settings.named):
        return inside
    length = settings.high - settings.low
    return tuple(float(f"{settings.low + share * length:.6g}") for share in OF_RANGE)


def search_at(value: float, settings: SliceSettings, cache: Cache) -> Found:
    """Search at one place, unless the cache holds what was found."""
    key = f"search-{value:g}"
    known = cache.get(key, SOLUTIONS)
    search = settings.model.search
    assert search is not None
    if known is None:
        known = search.stable_states(settings.whole_setting(value), settings.search, 1, settings.tolerance)
        cache.put(key, known, SOLUTIONS)
    return Found(value, known, tuple(s for s in known if search.starts_branch(s)))
