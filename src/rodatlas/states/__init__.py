"""States at one setting: their names."""

from rodatlas.states.names import NAMES, name_parts

__all__ = ["NAMES", "name_parts"]
