"""Slices as tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.atlas.slices.obtain import obtain_slice, stem_of
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.store import SCHEMA
from rodatlas.atlas.study.kinds.base import Kind, Workplace, nothing_required

if TYPE_CHECKING:
    import h5py


def _make(
    angle: float, compression: float = 0.5, poisson: float = 0.25, shear_max: float | None = None,
    shear_min: float | None = None, tolerance: float = 1e-8, search: int = SliceSettings.search,
) -> SliceSettings:  # fmt: skip
    return SliceSettings(angle, compression, poisson, shear_max, shear_min, tolerance, search)  # type: ignore[arg-type]


def _compute(settings: SliceSettings, work: Workplace) -> None:
    obtain_slice(settings, work.folder, work.progress, fresh=work.fresh, say=work.say, stem=work.stem)


def _contents(file: h5py.File) -> str:
    states, branches = (len(file[name]) if name in file else 0 for name in ("states", "branches"))
    return f"{states} states, {branches} branches"


SLICE = Kind("slice", "slices", SCHEMA, SliceSettings, _make, stem_of, nothing_required, _compute, _contents)
