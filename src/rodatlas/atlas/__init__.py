"""Diagrams of a model over one control and over two, and studies of many of them.

`slices/`: all equilibria at one setting as a control varies. `loci/`: bifurcations as two controls vary. `phase/`: the
plane of both, cut by loci into regions of stability.
"""

from __future__ import annotations

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodatlas.atlas.cache import Cache, FolderCache, MemoryCache
    from rodatlas.atlas.loci.compute import compute_loci
    from rodatlas.atlas.loci.events import PlaneEvent
    from rodatlas.atlas.loci.result import Loci, Piece
    from rodatlas.atlas.loci.settings import LociSettings
    from rodatlas.atlas.phase.compute import compute_phase
    from rodatlas.atlas.phase.result import PhaseDiagram, Region
    from rodatlas.atlas.phase.settings import PhaseSettings
    from rodatlas.atlas.slices.branches.frontier import Followed
    from rodatlas.atlas.slices.compute import compute_slice
    from rodatlas.atlas.slices.reach import reach
    from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
    from rodatlas.atlas.slices.settings import SliceSettings
    from rodatlas.atlas.slices.states.coexisting import coexisting_states, richest_value, solve_state

_HOME = {
    "Cache": "cache", "Event": "slices.result", "FolderCache": "cache", "Followed": "slices.branches.follow",
    "Loci": "loci.result", "LociSettings": "loci.settings", "MemoryCache": "cache", "PhaseDiagram": "phase.result",
    "PhaseSettings": "phase.settings", "Piece": "loci.result", "PlaneEvent": "loci.events", "Region": "phase.result",
    "Slice": "slices.result", "SliceBranch": "slices.result", "SliceSettings": "slices.settings",
    "State": "slices.result", "StateEnd": "slices.result", "coexisting_states": "slices.states.coexisting",
    "compute_loci": "loci.compute", "compute_phase": "phase.compute", "compute_slice": "slices.compute",
    "reach": "slices.reach", "richest_value": "slices.states.coexisting", "solve_state": "slices.states.coexisting",
}  # fmt: skip

__all__ = [
    "Cache", "Event", "FolderCache", "Followed", "Loci", "LociSettings", "MemoryCache", "PhaseDiagram", "PhaseSettings",
    "Piece", "PlaneEvent", "Region", "Slice", "SliceBranch", "SliceSettings", "State", "StateEnd", "coexisting_states",
    "compute_loci", "compute_phase", "compute_slice", "reach", "richest_value", "solve_state",
]  # fmt: skip

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """A name of the face, loaded when it is first asked for: a slice needs no loci."""
        if name not in _HOME:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name)
        value = globals()[name] = getattr(_import_module(f"{__name__}.{_HOME[name]}"), name)
        return value
