"""A slice from the file of a folder, or computed and written there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rodatlas.atlas.slices.cache import FolderCache, remove_partials
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.follow import Progress, Reference, planar_branches
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.store import stored_slice
from rodatlas.continuation import Branch
from rodatlas.continuation.checks import as_path, check_type

Say = Callable[[str], None]
"""Told in one line what is read, resumed or kept."""


def stem_of(settings: SliceSettings) -> str:
    """Name of the files of a slice: the angle, and what differs from dL = 1/2 and nu = 1/4."""
    other = f"-dL{settings.compression:g}" if settings.compression != 0.5 else ""
    other += f"-nu{settings.poisson:g}" if settings.poisson != 0.25 else ""
    return f"slice-{settings.angle_deg:g}{other}"


def obtain_slice(
    settings: SliceSettings, folder: Path, progress: Progress | None = None, *, fresh: bool = False,
    say: Say | None = None, stem: str | None = None,
) -> Slice:  # fmt: skip
    """The slice from its data file in a folder, or computed and written there.

    Branches that an interrupted run has finished are used; they lie in a folder beside the file until it is complete.
    The slice at 15 degrees, from which others carry states, is used if the folder has it.

    Parameters
    ----------
    progress : called as the work goes on.
    fresh : compute everything again.
    say : told what is read, resumed or kept.
    stem : name of the files without suffix, :func:`stem_of` when left out.
    """
    folder = as_path("folder", folder)
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    say = say or (lambda line: None)
    data = folder / f"{stem or stem_of(settings)}.h5"
    known = None if fresh else stored_slice(data, settings)
    if known is not None:
        say(f"read from {data} (--fresh computes everything again)")
        return known
    remove_partials(folder, name=data.name)
    cache = FolderCache(folder / data.stem, settings, fresh)
    if len(cache):
        say(f"resuming: {len(cache)} finished branches in {cache.folder}")
    try:
        found = compute_slice(settings, cache, progress, reference=_stored_reference(folder))
    except KeyboardInterrupt:
        say(f"interrupted: {len(cache)} finished branches are kept in {cache.folder}; the same command resumes")
        raise
    found.save(data)
    cache.clear()
    return found


def _stored_reference(folder: Path) -> Reference:
    """Branches of reference slices in files of a folder."""

    def branches(settings: SliceSettings) -> list[tuple[str, Branch]] | None:
        try:
            known = stored_slice(folder / f"{stem_of(settings)}.h5", settings)
        except ValueError:
            return None  # a damaged file is reported when that slice itself is wanted
        return None if known is None else planar_branches(b.followed for b in known.branches)

    return branches
