"""Loci from the file of a folder, or computed from slices and written there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rodatlas.atlas.cache import FolderCache
from rodatlas.atlas.loci.compute import compute_loci
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.loci.store import SCHEMA, read_loci
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.atlas.stored import made_folder, peek, stored
from rodatlas.atlas.unfinished import Say, silent
from rodatlas.continuation.checks import check_type
from rodatlas.files import claimed
from rodatlas.progress import Progress, tells


@dataclass(frozen=True)
class _Wanted:
    """Some loci at some settings."""

    settings: LociSettings
    numbers: tuple[int, ...]

    def identity(self) -> dict[str, object]:
        return self.settings.identity_of(self.numbers)


@tells("loci")
def obtain_loci(
    settings: LociSettings, folder: Path, numbers: Sequence[int] = (), progress: Progress | None = None, *,
    fresh: bool = False, say: Say = silent, stem: str | None = None,
    slice_stem: Callable[[SliceSettings], str] | None = None,
) -> Loci:  # fmt: skip
    """The loci from their data file in a folder, or computed from slices and written there; the slices too.

    Some loci are taken from the file of all where it is there. Loci that an interrupted run has finished are used;
    they lie in a folder beside the file until it is complete. While another process computes the same loci there, it
    is waited for. Parameters as those of :func:`rodatlas.atlas.compute_loci` and of
    :func:`rodatlas.atlas.slices.obtain.obtain_slice`; `slice_stem` names the files of the slices.
    """
    check_type("settings", settings, LociSettings, "LociSettings, see LociSettings.of")
    folder = made_folder(folder)
    wanted = _Wanted(settings, tuple(sorted(set(numbers or settings.tables.known))))
    data = folder / f"{stem or settings.stem(numbers)}.h5"
    whole = folder / f"{settings.stem()}.h5"
    if not fresh and data != whole and (known := peek(whole, SCHEMA, settings, read_loci)) is not None:
        say(f"read from {whole} (--fresh computes everything again)")
        return known
    with claimed(data, say):
        known = stored(data, SCHEMA, wanted, read_loci, say, fresh)
        if known is not None:
            say(f"read from {data} (--fresh computes everything again)")
            return known

        def slice_of(second: float) -> Slice:
            at = settings.slice_at(second)
            name = None if slice_stem is None else slice_stem(at)
            return obtain_slice(at, folder, progress, fresh=fresh, say=say, stem=name)

        cache = FolderCache(folder / data.stem, wanted, fresh, say)
        if len(cache):
            say(f"resuming: {len(cache)} finished loci in {cache.folder}")
        try:
            found = compute_loci(settings, slice_of, wanted.numbers, progress, cache)
        except KeyboardInterrupt:
            say(f"interrupted: {len(cache)} finished loci are kept in {cache.folder}; the same command resumes")
            raise
        found.save(data)
        cache.clear()
        return found
