"""States at one setting: discovery of all of them, and their names."""

from rodatlas.states.discover import find_states
from rodatlas.states.names import NAMES, OTHER, Part, middle_curvature, name_parts
from rodatlas.states.result import Discovery, FoundState

__all__ = ["NAMES", "OTHER", "Discovery", "FoundState", "Part", "find_states", "middle_curvature", "name_parts"]
