"""Studies: the slice of the atlas at one setting, its store, and how a named state is reached.

In the order of the work: `settings`; `seeds` (where branches start), `follow` (all that is connected to them), `cache`
(finished branches of a run under way), `match` (is this the same state?); `segments`, `cuts`, `numbering` and `compute`
(stable stretches, their names, the paper's numbers); `slice` (the result) and `store` (its file); `coexisting` and
`reach` (single states of a slice). Bifurcations in angle and shear: `loci` (the result), `loci_compute`,
`loci_numbering`, `loci_store`.
"""

from rodatlas.atlas.cache import BranchCache, FolderCache
from rodatlas.atlas.coexisting import coexisting_states, richest_shear, solve_state
from rodatlas.atlas.compute import compute_slice
from rodatlas.atlas.follow import Followed
from rodatlas.atlas.loci import Loci, LociSettings, Piece
from rodatlas.atlas.loci_compute import compute_loci
from rodatlas.atlas.reach import reach
from rodatlas.atlas.settings import SliceSettings
from rodatlas.atlas.slice import Event, Slice, SliceBranch, State, StateEnd

__all__ = [
    "BranchCache", "Event", "FolderCache", "Followed", "Loci", "LociSettings", "Piece", "Slice", "SliceBranch",
    "SliceSettings", "State", "StateEnd", "coexisting_states", "compute_loci", "compute_slice", "reach",
    "richest_shear", "solve_state",
]  # fmt: skip
