"""A slice from the file of a folder, or computed and written there."""

from __future__ import annotations

import json
from pathlib import Path

from rodatlas.atlas.slices.cache import FolderCache
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.follow import Reference, planar_branches
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings, default_shear_max, default_shear_min
from rodatlas.atlas.slices.store import SCHEMA, read_slice
from rodatlas.atlas.stored import made_folder, peek, stored
from rodatlas.atlas.unfinished import Say, silent
from rodatlas.continuation import Branch
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.store.hdf5 import checked_hdf5
from rodatlas.files import claimed, exact
from rodatlas.progress import Progress, tells

SAME_BAND = ("angle_deg", "compression", "poisson")


def stem_of(settings: SliceSettings) -> str:
    """Name of the files of a slice, other for all other settings: the angle, and what differs from the defaults.

    'slice-15', 'slice-15-dL0.4-nu0.3', 'slice-15-dD-0.1to0.86-search0'.
    """
    s, usual = settings, SliceSettings
    parts = [f"slice-{exact(s.angle_deg)}"]
    if s.compression != usual.compression:
        parts.append(f"dL{exact(s.compression)}")
    if s.poisson != usual.poisson:
        parts.append(f"nu{exact(s.poisson)}")
    if (s.shear_min, s.shear_max) != (default_shear_min(s.compression), default_shear_max(s.compression)):
        parts.append(f"dD{exact(s.shear_min)}to{exact(s.shear_max)}")
    if s.tolerance != usual.tolerance:
        parts.append(f"tol{exact(s.tolerance)}")
    if s.search != usual.search:
        parts.append(f"search{s.search}")
    return "-".join(parts)


def stored_slice(folder: Path, settings: SliceSettings) -> Slice | None:
    """The slice of some settings that a folder holds; None when it has none that can be used."""
    return peek(folder / f"{stem_of(settings)}.h5", SCHEMA, settings, read_slice)


def related_slices(folder: Path, settings: SliceSettings) -> list[Slice]:
    """Slices of the same band and clamps in a folder, whatever their shears; those of another version left out."""
    stem = stem_of(SliceSettings(settings.angle_deg, settings.compression, settings.poisson))
    found = []
    for path in sorted(folder.glob(f"{stem}*.h5")):
        try:
            with checked_hdf5(path, SCHEMA) as file:
                one = read_slice(file)
                current = json.loads(file.attrs["identity"]) == one.settings.identity()
        except (OSError, ValueError, KeyError):
            continue
        alike = (getattr(one.settings, name) == getattr(settings, name) for name in SAME_BAND)
        found += [one] if current and all(alike) else []
    return found


@tells("slice")
def obtain_slice(
    settings: SliceSettings, folder: Path, progress: Progress | None = None, *, fresh: bool = False,
    say: Say = silent, stem: str | None = None,
) -> Slice:  # fmt: skip
    """The slice from its data file in a folder, or computed and written there.

    Branches that an interrupted run has finished are used; they lie in a folder beside the file until it is complete.
    The slice at 15 degrees, from which others carry states, is used if the folder has it. A file that is damaged or of
    another version is kept under another name. While another process computes the same slice there, it is waited for.

    Parameters
    ----------
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    fresh : compute everything again.
    say : told what is read, resumed, kept or set aside.
    stem : name of the files without suffix, :func:`stem_of` when left out.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings such as SliceSettings(15.0)")
    folder = made_folder(folder)
    data = folder / f"{stem or stem_of(settings)}.h5"
    with claimed(data, say):
        known = stored(data, SCHEMA, settings, read_slice, say, fresh)
        if known is not None:
            say(f"read from {data} (--fresh computes everything again)")
            return known
        cache = FolderCache(folder / data.stem, settings, fresh, say)
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
        known = stored_slice(folder, settings)
        return None if known is None else planar_branches(b.followed for b in known.branches)

    return branches
