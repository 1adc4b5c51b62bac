"""Loci from the file of a folder, or computed from slices and written there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rodatlas.atlas.loci.compute import KNOWN, compute_loci
from rodatlas.atlas.loci.result import Loci, LociSettings
from rodatlas.atlas.loci.store import stored_loci
from rodatlas.atlas.slices.follow import Progress
from rodatlas.atlas.slices.obtain import Say, obtain_slice, stem_of
from rodatlas.atlas.slices.result import Slice


def loci_stem_of(settings: LociSettings) -> str:
    """Name of the files of loci: what differs from dL = 1/2, nu = 1/4 and 80 degrees."""
    stem = stem_of(settings.slice_at(15.0)).removeprefix("slice-15")
    return f"loci{stem}" + (f"-to{settings.angle_max:g}" if settings.angle_max != 80.0 else "")


def obtain_loci(
    settings: LociSettings, folder: Path, numbers: Sequence[int] = (), progress: Progress | None = None, *,
    fresh: bool = False, say: Say | None = None,
) -> Loci:  # fmt: skip
    """The loci from their data file in a folder, or computed from slices and written there; the slices too.

    Parameters as those of :func:`rodatlas.atlas.compute_loci` and of
    :func:`rodatlas.atlas.slices.obtain.obtain_slice`.
    """
    data = folder / f"{loci_stem_of(settings)}.h5"
    known = None if fresh else stored_loci(data, settings, tuple(numbers) or KNOWN)
    if known is not None:
        if say is not None:
            say(f"read from {data} (--fresh computes everything again)")
        return known

    def slice_of(angle: float) -> Slice:
        return obtain_slice(settings.slice_at(angle), folder, progress, fresh=fresh, say=say)

    found = compute_loci(settings, slice_of, tuple(numbers) or KNOWN, progress)
    found.save(data)
    return found
