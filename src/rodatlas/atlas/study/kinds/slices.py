"""Slices as tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.store import SCHEMA
from rodatlas.atlas.study.kinds.base import (
    BAND,
    Kind,
    Workplace,
    divided,
    nothing_required,
)
from rodatlas.model import model_named

if TYPE_CHECKING:
    import h5py


def _make(
    model: str = BAND, along: str = "", against: str = "", tolerance: float = 1e-8, search: int = SliceSettings.search,
    **values: float | None,
) -> SliceSettings:  # fmt: skip
    """Empty texts stand for the defaults; `values` as :func:`control_parameters` names them."""
    found = model_named(model)
    control = found.control(along or found.plane[1], "along")
    fixed, [(low, high)] = divided(found, [control], values)
    return SliceSettings.of(
        found, along=control.name, low=low, high=high, against=against or None, tolerance=tolerance, search=search,
        **fixed,
    )  # fmt: skip


def _stem(settings: SliceSettings) -> str:
    return settings.stem


def _compute(settings: SliceSettings, work: Workplace) -> None:
    obtain_slice(settings, work.folder, work.progress, fresh=work.fresh, say=work.say, stem=work.stem)


def _contents(file: h5py.File) -> str:
    states, branches = (len(file[name]) if name in file else 0 for name in ("states", "branches"))
    return f"{states} states, {branches} branches"


SLICE = Kind(
    "slice", "slices", SCHEMA, SliceSettings, _make, _stem, nothing_required, _compute, _contents,
    controls=True,
)  # fmt: skip
