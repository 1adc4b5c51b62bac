"""Kinds of tasks. A new one is a module with a :class:`Kind` and its name in `KINDS`."""

from __future__ import annotations

from rodatlas.atlas.study.kinds.base import Kind, Progress, Settings, Workplace
from rodatlas.atlas.study.kinds.loci import LOCI
from rodatlas.atlas.study.kinds.phase import PHASE
from rodatlas.atlas.study.kinds.slices import SLICE
from rodatlas.atlas.study.kinds.states import STATES, StatesSettings

KINDS = (SLICE, STATES, LOCI, PHASE)

__all__ = ["KINDS", "Kind", "Progress", "Settings", "StatesSettings", "Workplace", "kind_of"]


def kind_of(settings: Settings) -> Kind:
    """The kind of task that has such settings."""
    for kind in KINDS:
        if type(settings) is kind.settings:
            return kind
    known = ", ".join(kind.settings.__name__ for kind in KINDS)
    raise ValueError(f"settings: expected one of {known}, got {type(settings).__name__}")
