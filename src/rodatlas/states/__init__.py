"""States at one setting: discovery of all of them, and their names."""

from rodatlas.states.discover import Discovery, FoundState, find_states
from rodatlas.states.names import NAMES, Part, middle_curvature, name_parts

__all__ = ["NAMES", "Discovery", "FoundState", "Part", "find_states", "middle_curvature", "name_parts"]
