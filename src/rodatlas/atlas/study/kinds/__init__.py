"""Kinds of tasks. A new one is a module with a :class:`Kind` and a line in `KINDS`."""

from __future__ import annotations

from rodatlas.atlas.study.kinds.base import Kind, Progress, Settings, Workplace, digest
from rodatlas.atlas.study.kinds.slices import SLICE

KINDS = (SLICE,)

__all__ = ["KINDS", "Kind", "Progress", "Settings", "Workplace", "digest", "kind_of"]


def kind_of(settings: Settings) -> Kind:
    """The kind of task that has such settings."""
    for kind in KINDS:
        if type(settings) is kind.settings:
            return kind
    known = ", ".join(kind.settings.__name__ for kind in KINDS)
    raise ValueError(f"settings: expected one of {known}, got {type(settings).__name__}")
