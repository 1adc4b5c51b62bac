"""All states of the band at one setting, between any two clamps."""

from rodatlas.states.discover import find_states
from rodatlas.states.result import Discovery, FoundState

__all__ = ["Discovery", "FoundState", "find_states"]
