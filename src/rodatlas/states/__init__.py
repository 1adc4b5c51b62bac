"""States at one setting: discovery of all of them, and their names."""

from rodatlas.states.discover import find_states
from rodatlas.states.names import NAMES, Part, middle_curvature, name_parts
from rodatlas.states.result import Discovery, FoundState

__all__ = ["NAMES", "Discovery", "FoundState", "Part", "find_states", "middle_curvature", "name_parts"]
