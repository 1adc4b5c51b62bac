"""A phase diagram from the file of a folder, or computed from slices and loci and written there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rodatlas.atlas.loci.compute import compute_loci
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.store import SCHEMA as LOCI_SCHEMA
from rodatlas.atlas.loci.store import read_loci
from rodatlas.atlas.phase.compute import Slices, compute_phase
from rodatlas.atlas.phase.result import PhaseDiagram
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.phase.store import SCHEMA, read_phase
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.stored import made_folder, stored
from rodatlas.atlas.study.many import obtain_slices
from rodatlas.atlas.unfinished import Say, silent
from rodatlas.continuation.checks import check_type
from rodatlas.files import claimed
from rodatlas.progress import Progress, tells

SLICES = "phase-slices"  # folder of the slices, which reach further than those of `rodatlas slice`


@tells("phase diagram")
def obtain_phase(
    settings: PhaseSettings, folder: Path, progress: Progress | None = None, *, workers: int = 2, fresh: bool = False,
    say: Say = silent,
) -> PhaseDiagram:  # fmt: skip
    """The phase diagram from its data file in a folder, or computed and written there; loci and slices too.

    Whatever is finished stays: the loci, every slice, every branch of a slice that is under way. A later call goes on.
    While another process computes the same diagram there, it is waited for.

    Parameters
    ----------
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.
    workers : number of processes that compute slices.
    fresh : compute everything again.
    say : told what is read, resumed or kept.
    """
    check_type("settings", settings, PhaseSettings, "PhaseSettings, see PhaseSettings.of")
    folder = made_folder(folder)
    data = folder / f"{settings.stem}.h5"
    with claimed(data, say):
        known = stored(data, SCHEMA, settings, read_phase, say, fresh)
        if known is not None:
            say(f"read from {data} (--fresh computes everything again)")
            return known
        slices = _slices(settings, folder / SLICES, None if progress is None else _gathered(progress), workers, fresh,
                         say)  # fmt: skip
        loci = settings.loci
        given = [a for a in loci.starts if loci.second_low <= a <= loci.second_high]
        slices(given[:1])  # first and alone: others may carry states from it
        curves = _loci(settings, folder, slices, given, progress, fresh, say)
        found = compute_phase(settings, curves, slices, given, progress)
        found.save(data)
        return found


def _slices(
    settings: PhaseSettings, folder: Path, report: Progress | None, workers: int, fresh: bool, say: Say
) -> Callable[[Sequence[float]], list[Slice]]:
    """Gives slices at some places from a folder, each computed once."""
    folder.mkdir(parents=True, exist_ok=True)
    renewed: set[float] = set()

    def slices(places: Sequence[float]) -> list[Slice]:
        again = [a for a in places if fresh and a not in renewed]
        renewed.update(again)
        rest = [a for a in places if a not in again]
        found: list[Slice] = []
        for part, anew in ((again, True), (rest, False)):
            wanted = [settings.slice_at(a) for a in part]
            found += obtain_slices(wanted, folder, workers, report, fresh=anew, say=say) if wanted else []
        return found

    return slices


def _loci(
    settings: PhaseSettings, folder: Path, slices: Slices, given: Sequence[float], progress: Progress | None,
    fresh: bool, say: Say,
) -> Loci:  # fmt: skip
    """The loci from their file, or followed from the slices of the phase diagram and written."""
    data = folder / f"{settings.loci.stem()}.h5"
    with claimed(data, say):
        known = stored(data, LOCI_SCHEMA, settings.loci, read_loci, say, fresh)
        if known is not None:
            return known
        at = {s.settings.setting[settings.second]: s for s in slices(given)}
        found = compute_loci(settings.loci, lambda second: at[second], progress=progress)
        found.save(data)
        return found


def _gathered(progress: Progress) -> Progress:
    """Progress of several slices at once, which is told as one piece of work."""
    return lambda message, done, pending: progress(f"slices: {message}", done, pending)
