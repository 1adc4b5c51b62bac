"""Phase diagrams as tasks; their loci are tasks of their own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from rodatlas.atlas import results
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.phase.compute import compute_phase
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.study.kinds.base import BAND, Kind, Workplace, divided
from rodatlas.atlas.study.kinds.loci import LOCI
from rodatlas.atlas.study.kinds.slices import SLICE
from rodatlas.model import model_named


def _make(
    model: str = BAND, along: str = "", second: str = "", against: str = "", tolerance: float = 1e-8,
    **values: float | None,
) -> PhaseSettings:  # fmt: skip
    """Empty texts stand for the defaults; `values` as :func:`control_parameters` names them.

    Loci are followed in the usual range of the second control at least, which windows of one plane share.
    """
    found = model_named(model)
    controls = [found.control(along or found.plane[1], "along"), found.control(second or found.plane[0], "second")]
    fixed, [(low, high), (least, most)] = divided(found, controls, values)
    whole = PhaseSettings.of(
        found, along=controls[0].name, second=controls[1].name, low=low, high=high, against=against or None,
        tolerance=tolerance, **fixed,
    )  # fmt: skip
    least, most = (usual if given is None else given for given, usual in
                   ((least, whole.second_low), (most, whole.second_high)))  # fmt: skip
    shared = min(least, whole.second_low), max(most, whole.second_high)
    return replace(whole, second_low=least, second_high=most, loci_low=shared[0], loci_high=shared[1])


def _stem(settings: PhaseSettings) -> str:
    return settings.stem


def _requires(settings: PhaseSettings) -> tuple[LociSettings, ...]:
    return (settings.loci,)


def _compute(settings: PhaseSettings, work: Workplace) -> None:
    def slices(angles: Sequence[float]) -> Iterator[Slice]:
        for angle in angles:
            wanted = settings.slice_at(angle)
            yield obtain_slice(wanted, work.folder, work.progress, say=work.say, stem=SLICE.file_stem(wanted))

    loci = Loci.load(work.folder / f"{LOCI.file_stem(settings.loci)}.h5")
    compute_phase(settings, loci, slices, progress=work.progress).save(work.path)


PHASE = Kind(results.PHASE, "phases", PhaseSettings, _make, _stem, _requires, _compute, controls=True)
