"""What a phase diagram is computed for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

from rodatlas.atlas.loci.result import LociSettings
from rodatlas.atlas.slices.obtain import stem_of
from rodatlas.atlas.slices.settings import REFERENCE_ANGLE_DEG, SliceSettings
from rodatlas.files import exact
from rodatlas.rods.band import check_between, check_number

REVISION = 1  # of the algorithm: a stored diagram of another one is computed again
LOCI_ANGLE = 80.0  # loci reach this angle at least, so that windows and the whole plane share their file


@dataclass(frozen=True)
class PhaseSettings:
    """The plane of clamp angle and shear of a band; all else is fixed.

    Attributes
    ----------
    compression, poisson, tolerance : as for a slice.
    angle_min, angle_max : range of the clamp angle in degrees.
    """

    compression: float = 0.5
    poisson: float = 0.25
    angle_min: float = 0.0
    angle_max: float = 80.0
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        check_between("compression", self.compression, 0.0, 1.0, "a number between 0 and 1 (exclusive)")
        check_number("angle-min", self.angle_min, 0.0, 89.0, "degrees with 0 <= angle-min <= 89")
        least = self.angle_min + 0.01
        check_number("angle-max", self.angle_max, least, 89.999999, f"degrees with {least:g} <= angle-max < 90")
        self.slice_at(REFERENCE_ANGLE_DEG)  # checks the others

    @property
    def loci(self) -> LociSettings:
        """Settings of the loci."""
        return LociSettings(self.compression, self.poisson, max(self.angle_max, LOCI_ANGLE), self.tolerance)

    @property
    def shears(self) -> tuple[float, float]:
        """Range of shear: that of the loci."""
        return self.loci.shears

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Smallest and largest angle (degrees), smallest and largest shear."""
        return (self.angle_min, self.angle_max, *self.shears)

    def slice_at(self, angle_deg: float) -> SliceSettings:
        """Settings of a slice over the whole range of shear.

        Without a search for states: what one slice misses shows in the comparison with the others.
        """
        low, high = self.shears
        return SliceSettings(angle_deg, self.compression, self.poisson, high, low, self.tolerance, search=0)

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values: those of its slices and loci, too."""
        of = {"loci": self.loci.identity(), "slices": self.slice_at(REFERENCE_ANGLE_DEG).identity()}
        return {"revision": REVISION, "shears": list(self.shears), **of, **asdict(self)}

    @classmethod
    def from_identity(cls, identity: Mapping[str, object]) -> PhaseSettings:
        """The settings behind :meth:`identity`."""
        return cls(**{f.name: float(identity[f.name]) for f in fields(cls)})  # type: ignore[arg-type]


def phase_stem_of(settings: PhaseSettings) -> str:
    """Name of the files of a phase diagram: what differs from dL = 1/2, nu = 1/4, 1e-8 and 0 to 80 degrees."""
    stem = "phase" + stem_of(settings.loci.slice_at(REFERENCE_ANGLE_DEG)).removeprefix("slice-15")
    whole = (settings.angle_min, settings.angle_max) == (0.0, 80.0)
    return stem if whole else f"{stem}-from{exact(settings.angle_min)}-to{exact(settings.angle_max)}"
