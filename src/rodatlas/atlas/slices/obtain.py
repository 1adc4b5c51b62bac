"""A slice from the file of a folder, or computed and written there."""

from __future__ import annotations

import json
from pathlib import Path

from rodatlas.atlas.cache import FolderCache
from rodatlas.atlas.slices.branches.follow import Reference, carried_from
from rodatlas.atlas.slices.compute import compute_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.slices.store import SCHEMA, read_slice
from rodatlas.atlas.stored import made_folder, peek, stored
from rodatlas.atlas.unfinished import Say, silent
from rodatlas.continuation import Branch
from rodatlas.continuation.checks import check_type
from rodatlas.continuation.store.hdf5 import checked_hdf5
from rodatlas.files import claimed
from rodatlas.progress import Progress, tells


def stored_slice(folder: Path, settings: SliceSettings) -> Slice | None:
    """The slice of some settings that a folder holds; None when it has none that can be used."""
    return peek(folder / f"{settings.stem}.h5", SCHEMA, settings, read_slice)


def related_slices(folder: Path, settings: SliceSettings) -> list[Slice]:
    """Slices at the same setting in a folder, whatever their ranges; those of another version left out."""
    start = "-".join(["slice", *settings.model.stem_parts(settings.setting)])
    found = []
    for path in sorted(folder.glob(f"{start}*.h5")):
        try:
            with checked_hdf5(path, SCHEMA) as file:
                one = read_slice(file)
                current = json.loads(file.attrs["identity"]) == one.settings.identity()
        except (OSError, ValueError, KeyError):
            continue
        same = (one.settings.model, one.settings.setting, one.settings.along)
        found += [one] if current and same == (settings.model, settings.setting, settings.along) else []
    return found


@tells("slice")
def obtain_slice(
    settings: SliceSettings, folder: Path, progress: Progress | None = None, *, fresh: bool = False,
    say: Say = silent, stem: str | None = None,
) -> Slice:  # fmt: skip
    """The slice from its data file in a folder, or computed and written there.

    Branches that an interrupted run has finished are used; they lie in a folder beside the file until it is complete.
    The slice from which others carry states is used if the folder has it. A file that is damaged or of
    another version is kept under another name. While another process computes the same slice there, it is waited for.

    Parameters
    ----------
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    fresh : compute everything again.
    say : told what is read, resumed, kept or set aside.
    stem : name of the files without suffix, that of the settings when left out.
    """
    check_type("settings", settings, SliceSettings, "SliceSettings, see SliceSettings.of")
    folder = made_folder(folder)
    data = folder / f"{stem or settings.stem}.h5"
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
        return None if known is None else carried_from(settings.model, (b.followed for b in known.branches))

    return branches
