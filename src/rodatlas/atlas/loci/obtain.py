"""Loci from the file of a folder, or computed from slices and written there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rodatlas.atlas.loci.cache import LocusFolder
from rodatlas.atlas.loci.compute import KNOWN, compute_loci
from rodatlas.atlas.loci.result import Loci, LociSettings
from rodatlas.atlas.loci.store import stored_loci
from rodatlas.atlas.slices.cache import remove_partials
from rodatlas.atlas.slices.follow import Progress
from rodatlas.atlas.slices.obtain import Say, obtain_slice, stem_of
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation.checks import as_path, check_type


def loci_stem_of(settings: LociSettings) -> str:
    """Name of the files of loci: what differs from dL = 1/2, nu = 1/4 and 80 degrees."""
    stem = stem_of(settings.slice_at(15.0)).removeprefix("slice-15")
    return f"loci{stem}" + (f"-to{settings.angle_max:g}" if settings.angle_max != 80.0 else "")


def obtain_loci(
    settings: LociSettings, folder: Path, numbers: Sequence[int] = (), progress: Progress | None = None, *,
    fresh: bool = False, say: Say | None = None, stem: str | None = None,
    slice_stem: Callable[[SliceSettings], str] = stem_of,
) -> Loci:  # fmt: skip
    """The loci from their data file in a folder, or computed from slices and written there; the slices too.

    Loci that an interrupted run has finished are used; they lie in a folder beside the file until it is complete.
    Parameters as those of :func:`rodatlas.atlas.compute_loci` and of
    :func:`rodatlas.atlas.slices.obtain.obtain_slice`; `slice_stem` names the files of the slices.
    """
    folder = as_path("folder", folder)
    check_type("settings", settings, LociSettings, "LociSettings such as LociSettings()")
    say = say or (lambda line: None)
    data = folder / f"{stem or loci_stem_of(settings)}.h5"
    known = None if fresh else stored_loci(data, settings, tuple(numbers) or KNOWN)
    if known is not None:
        say(f"read from {data} (--fresh computes everything again)")
        return known

    def slice_of(angle: float) -> Slice:
        wanted = settings.slice_at(angle)
        return obtain_slice(wanted, folder, progress, fresh=fresh, say=say, stem=slice_stem(wanted))

    remove_partials(folder, name=data.name)
    cache = LocusFolder(folder / data.stem, settings, fresh)
    if len(cache):
        say(f"resuming: {len(cache)} finished loci in {cache.folder}")
    try:
        found = compute_loci(settings, slice_of, tuple(numbers) or KNOWN, progress, cache)
    except KeyboardInterrupt:
        say(f"interrupted: {len(cache)} finished loci are kept in {cache.folder}; the same command resumes")
        raise
    found.save(data)
    cache.clear()
    return found
