"""Studies: the slice of the atlas at one setting, its store, and how a named state is reached.

In the order of the work: `settings`; `seeds` (where branches start), `follow` (all that is connected to them), `cache`
(finished branches of a run under way), `match` (is this the same state?); `segments`, `cuts`, `numbering` and `compute`
(stable stretches, their names, the paper's numbers); `slice` (the result) and `store` (its file); `coexisting` and
`reach` (single states of a slice).
"""

from rodatlas.atlas.cache import BranchCache, FolderCache
from rodatlas.atlas.coexisting import coexisting_states, richest_shear, solve_state
from rodatlas.atlas.compute import compute_slice
from rodatlas.atlas.follow import Followed
from rodatlas.atlas.reach import reach
from rodatlas.atlas.settings import SliceSettings
from rodatlas.atlas.slice import Event, Slice, SliceBranch, State, StateEnd

__all__ = [
    "BranchCache", "Event", "FolderCache", "Followed", "Slice", "SliceBranch", "SliceSettings", "State", "StateEnd",
    "coexisting_states", "compute_slice", "reach", "richest_shear", "solve_state",
]  # fmt: skip
