"""Phase diagrams as tasks; their loci are tasks of their own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rodatlas.atlas.loci.result import Loci, LociSettings
from rodatlas.atlas.phase.compute import compute_phase
from rodatlas.atlas.phase.settings import PhaseSettings, phase_stem_of
from rodatlas.atlas.phase.store import SCHEMA
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.study.kinds.base import Kind, Workplace
from rodatlas.atlas.study.kinds.loci import LOCI
from rodatlas.atlas.study.kinds.slices import SLICE

if TYPE_CHECKING:
    import h5py


def _make(
    compression: float = 0.5, poisson: float = 0.25, angle_min: float = 0.0, angle_max: float = 80.0,
    tolerance: float = 1e-8,
) -> PhaseSettings:  # fmt: skip
    return PhaseSettings(compression, poisson, angle_min, angle_max, tolerance)


def _requires(settings: PhaseSettings) -> tuple[LociSettings, ...]:
    return (settings.loci,)


def _compute(settings: PhaseSettings, work: Workplace) -> None:
    def slices(angles: Sequence[float]) -> Iterator[Slice]:
        for angle in angles:
            wanted = settings.slice_at(angle)
            yield obtain_slice(wanted, work.folder, work.progress, say=work.say, stem=SLICE.file_stem(wanted))

    loci = Loci.load(work.folder / f"{LOCI.file_stem(settings.loci)}.h5")
    compute_phase(settings, loci, slices, progress=work.progress).save(work.path)


def _contents(file: h5py.File) -> str:
    return f"{len(file['lines'])} lines, {len(file['faces'])} faces"


PHASE = Kind("phase", "phases", SCHEMA, PhaseSettings, _make, phase_stem_of, _requires, _compute, _contents)
