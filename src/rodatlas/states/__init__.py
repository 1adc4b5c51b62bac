"""States at one setting: their names."""

from rodatlas.states.names import NAMES, Part, middle_curvature, name_parts

__all__ = ["NAMES", "Part", "middle_curvature", "name_parts"]
