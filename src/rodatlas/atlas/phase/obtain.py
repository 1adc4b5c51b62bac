"""A phase diagram from the file of a folder, or computed from slices and loci and written there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rodatlas.atlas.loci.compute import ANGLES, KNOWN, compute_loci
from rodatlas.atlas.loci.obtain import loci_stem_of
from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.store import stored_loci
from rodatlas.atlas.phase.compute import Slices, compute_phase
from rodatlas.atlas.phase.result import PhaseDiagram
from rodatlas.atlas.phase.settings import PhaseSettings, phase_stem_of
from rodatlas.atlas.phase.store import stored_phase
from rodatlas.atlas.slices.follow import Progress
from rodatlas.atlas.slices.obtain import Say
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.settings import REFERENCE_ANGLE_DEG
from rodatlas.atlas.study.many import obtain_slices
from rodatlas.continuation.checks import as_path, check_type

SLICES = "phase-slices"  # folder of the slices, which reach further in shear than those of `rodatlas slice`


def obtain_phase(
    settings: PhaseSettings, folder: Path, progress: Progress | None = None, *, workers: int = 2, fresh: bool = False,
    say: Say | None = None,
) -> PhaseDiagram:  # fmt: skip
    """The phase diagram from its data file in a folder, or computed and written there; loci and slices too.

    Whatever is finished stays: the loci, every slice, every branch of a slice that is under way. A later call goes on.

    Parameters
    ----------
    progress : called as the work goes on.
    workers : number of processes that compute slices.
    fresh : compute everything again.
    say : told what is read, resumed or kept.
    """
    folder = as_path("folder", folder)
    check_type("settings", settings, PhaseSettings, "PhaseSettings such as PhaseSettings()")
    data = folder / f"{phase_stem_of(settings)}.h5"
    known = None if fresh else stored_phase(data, settings)
    if known is not None:
        if say is not None:
            say(f"read from {data} (--fresh computes everything again)")
        return known
    report = None if progress is None else _gathered(progress)
    inner = folder / SLICES
    inner.mkdir(parents=True, exist_ok=True)
    renewed: set[float] = set()

    def slices(angles: Sequence[float]) -> list[Slice]:
        again = [a for a in angles if fresh and a not in renewed]
        renewed.update(again)
        rest = [a for a in angles if a not in again]
        found: list[Slice] = []
        for part, anew in ((again, True), (rest, False)):
            wanted = [settings.slice_at(a) for a in part]
            found += obtain_slices(wanted, inner, workers, report, fresh=anew, say=say) if wanted else []
        return found

    slices([REFERENCE_ANGLE_DEG])  # first and alone: the others carry states from it
    given = (REFERENCE_ANGLE_DEG, *ANGLES.values())
    loci = _loci(settings, folder, slices, given, progress, fresh)
    found = compute_phase(settings, loci, slices, given, progress)
    found.save(data)
    return found


def _loci(
    settings: PhaseSettings, folder: Path, slices: Slices, given: Sequence[float], progress: Progress | None,
    fresh: bool,
) -> Loci:  # fmt: skip
    """The loci from their file, or followed from the slices of the phase diagram and written."""
    data = folder / f"{loci_stem_of(settings.loci)}.h5"
    known = None if fresh else stored_loci(data, settings.loci, KNOWN)
    if known is not None:
        return known
    at = {s.settings.angle_deg: s for s in slices(given)}
    found = compute_loci(settings.loci, lambda angle: at[angle], KNOWN, progress)
    found.save(data)
    return found


def _gathered(progress: Progress) -> Progress:
    """Progress of several slices at once, which is told as one piece of work."""
    return lambda message, done, pending: progress(f"slices: {message}", done, pending)
