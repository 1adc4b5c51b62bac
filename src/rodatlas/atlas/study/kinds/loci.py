"""Loci as tasks; the slices on which they start are tasks of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.atlas.loci.compute import ANGLES
from rodatlas.atlas.loci.obtain import loci_stem_of, obtain_loci
from rodatlas.atlas.loci.result import LociSettings
from rodatlas.atlas.loci.store import SCHEMA
from rodatlas.atlas.slices.settings import REFERENCE_ANGLE_DEG, SliceSettings
from rodatlas.atlas.study.kinds.base import Kind, Workplace
from rodatlas.atlas.study.kinds.slices import SLICE

if TYPE_CHECKING:
    import h5py


def _make(
    compression: float = 0.5, poisson: float = 0.25, angle_max: float = 80.0, tolerance: float = 1e-8
) -> LociSettings:
    return LociSettings(compression, poisson, angle_max, tolerance)


def _requires(settings: LociSettings) -> tuple[SliceSettings, ...]:
    angles = dict.fromkeys([REFERENCE_ANGLE_DEG, *ANGLES.values()])
    return tuple(settings.slice_at(angle) for angle in angles if angle <= settings.angle_max)


def _compute(settings: LociSettings, work: Workplace) -> None:
    obtain_loci(
        settings, work.folder, (), work.progress, fresh=work.fresh, say=work.say, stem=work.stem,
        slice_stem=SLICE.file_stem,
    )  # fmt: skip


def _contents(file: h5py.File) -> str:
    return f"{len(file['curves']) if 'curves' in file else 0} curves"


LOCI = Kind("loci", "loci", SCHEMA, LociSettings, _make, loci_stem_of, _requires, _compute, _contents)
