"""Studies: the slice of the atlas at one setting, its store, and how a named state is reached."""

from rodatlas.atlas.reach import reach
from rodatlas.atlas.settings import SliceSettings
from rodatlas.atlas.slice import Slice, State, compute_slice

__all__ = ["Slice", "SliceSettings", "State", "compute_slice", "reach"]
