"""Where figures take their results from: slices and loci of a folder, computed and kept there when missing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rodatlas.atlas.unfinished import Say
from rodatlas.atlas.unfinished import silent as told_nobody
from rodatlas.progress import Progress, silent

if TYPE_CHECKING:
    from rodatlas.atlas import Loci, Slice, SliceSettings
    from rodatlas.atlas.phase.result import PhaseDiagram


class Sources:
    """Results at dL = 1/2 and nu = 1/4, each read or computed once.

    Parameters
    ----------
    folder : where the data files lie, named as those of `rodatlas slice` and `rodatlas loci`.
    workers : processes that compute slices. fresh : compute everything again, even what the folder has.
    report : called as the work goes on. say : told in one line what happens to files.
    """

    def __init__(
        self, folder: Path, workers: int = 1, report: Progress | None = None, say: Say = told_nobody,
        *, fresh: bool = False,
    ):  # fmt: skip
        self.folder, self.workers, self.report = folder, workers, report or silent
        self._say, self._fresh = say, fresh
        self._slices: dict[SliceSettings, Slice] = {}
        self._loci: Loci | None = None

    def __repr__(self) -> str:
        return f"Sources({self.folder}, {len(self._slices)} slices)"

    def slice_at(self, angle_deg: float, shear_max: float | None = None) -> Slice:
        """The slice at a clamp angle, up to 0.82 in shear or further."""
        settings = slice_settings(angle_deg, shear_max)
        self.prepare([settings])
        return self._slices[settings]

    def slices_at(self, angles_deg: Iterable[float]) -> list[Slice]:
        """Slices at several clamp angles, those that are missing computed by several processes."""
        settings = [slice_settings(angle) for angle in angles_deg]
        self.prepare(settings)
        return [self._slices[s] for s in settings]

    def prepare(self, settings: Iterable[SliceSettings]) -> None:
        """Read or compute slices."""
        missing = [one for one in dict.fromkeys(settings) if one not in self._slices]
        if missing:
            from rodatlas.atlas.study import obtain_slices

            found = obtain_slices(missing, self.folder, self.workers, self.report, fresh=self._fresh, say=self._say)
            self._slices |= dict(zip(missing, found, strict=True))

    def loci(self) -> Loci:
        """The loci of bifurcations 0 to 18."""
        if self._loci is None:
            from rodatlas.atlas.loci.obtain import obtain_loci
            from rodatlas.paper.model import band_loci

            fresh = self._fresh
            self._loci = obtain_loci(band_loci(), self.folder, (), self.report, fresh=fresh, say=self._say)
        return self._loci

    def phase(self) -> PhaseDiagram:
        """The phase diagram over all angles; its slices lie in a folder of their own."""
        from rodatlas.atlas.phase.obtain import obtain_phase
        from rodatlas.paper.model import band_phase

        return obtain_phase(
            band_phase(), self.folder, self.report, workers=self.workers, fresh=self._fresh, say=self._say
        )


def slice_settings(angle_deg: float, shear_max: float | None = None) -> SliceSettings:
    """Settings of a slice of the paper."""
    from rodatlas.paper.model import band_slice

    return band_slice(angle_deg, shear_max=shear_max)
