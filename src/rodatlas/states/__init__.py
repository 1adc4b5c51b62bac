"""States at one setting: their names."""

from rodatlas.states.names import NAMES, member, name_parts

__all__ = ["NAMES", "member", "name_parts"]
