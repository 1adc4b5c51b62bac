"""Studies: slices of the atlas, loci of bifurcations, their stores, and how a named state is reached.

`slices/`: all equilibria at one setting as the shear varies. `loci/`: bifurcations in clamp angle and shear. `phase/`:
the plane of both, cut by loci into regions of stability.
"""

from rodatlas.atlas.loci.compute import compute_loci
from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.loci.result import Loci, LociSettings, Piece
from rodatlas.atlas.phase.compute import compute_phase
from rodatlas.atlas.phase.result import PhaseDiagram, Region
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.cache import BranchCache, FolderCache
from rodatlas.atlas.slices.coexisting import coexisting_states, richest_shear, solve_state
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.follow import Followed
from rodatlas.atlas.slices.reach import reach
from rodatlas.atlas.slices.result import Event, Slice, SliceBranch, State, StateEnd
from rodatlas.atlas.slices.settings import SliceSettings

__all__ = [
    "BranchCache", "Event", "FolderCache", "Followed", "Loci", "LociSettings", "PhaseDiagram", "PhaseSettings", "Piece",
    "PlaneEvent", "Region", "Slice", "SliceBranch", "SliceSettings", "State", "StateEnd", "coexisting_states",
    "compute_loci", "compute_phase", "compute_slice", "reach", "richest_shear", "solve_state",
]  # fmt: skip
