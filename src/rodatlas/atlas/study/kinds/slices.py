"""Slices as tasks."""

from __future__ import annotations

from rodatlas.atlas import results
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.study.kinds.base import (
    BAND,
    Kind,
    Workplace,
    divided,
    nothing_required,
)
from rodatlas.model import model_named


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


SLICE = Kind(results.SLICE, "slices", SliceSettings, _make, _stem, nothing_required, _compute, controls=True)
