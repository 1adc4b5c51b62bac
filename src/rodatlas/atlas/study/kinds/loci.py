"""Loci as tasks; the slices on which they start are tasks of their own."""

from __future__ import annotations

from rodatlas.atlas import results
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.study.kinds.base import BAND, Kind, Workplace, divided
from rodatlas.atlas.study.kinds.slices import SLICE
from rodatlas.model import model_named


def _make(
    model: str = BAND, along: str = "", second: str = "", against: str = "", tolerance: float = 1e-8,
    **values: float | None,
) -> LociSettings:  # fmt: skip
    """Empty texts stand for the defaults; `values` as :func:`control_parameters` names them."""
    found = model_named(model)
    controls = [found.control(along or found.plane[1], "along"), found.control(second or found.plane[0], "second")]
    fixed, [(low, high), (least, most)] = divided(found, controls, values)
    return LociSettings.of(
        found, along=controls[0].name, second=controls[1].name, low=low, high=high, second_low=least, second_high=most,
        against=against or None, tolerance=tolerance, **fixed,
    )  # fmt: skip


def _stem(settings: LociSettings) -> str:
    return settings.stem()


def _requires(settings: LociSettings) -> tuple[SliceSettings, ...]:
    there = (x for x in settings.starts if settings.second_low <= x <= settings.second_high)
    return tuple(settings.slice_at(second) for second in there)


def _compute(settings: LociSettings, work: Workplace) -> None:
    obtain_loci(
        settings, work.folder, (), work.progress, fresh=work.fresh, say=work.say, stem=work.stem,
        slice_stem=SLICE.file_stem,
    )  # fmt: skip


LOCI = Kind(results.LOCI, "loci", LociSettings, _make, _stem, _requires, _compute, controls=True)
