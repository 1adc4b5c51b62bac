"""What a slice is computed for; everything that decides its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace

from rodatlas import __version__
from rodatlas.rods.band import bending_ratio, check_number, check_poisson, check_whole, limiting_shear, near_limit
from rodatlas.rods.ends import Ends

ALGORITHM = 6  # raised with every change of the program after which a slice holds something else
REFERENCE_ANGLE_DEG = 15.0
REFERENCE_COMPRESSION = 0.5
REFERENCE_POISSON = 0.25  # for the twisted states, whose existence depends on it
LEAST_SHEAR_MAX = 1e-3  # at dL = 1/2 and above; the same part of the limiting shear below
MOST_STARTS = 1_000_000
CARRIED_PARTS = (0.35, 0.45, 0.55, 0.65)  # of the limiting shear
CARRIED_HIGH_PARTS = (0.72, 0.86)


def default_shear_max(compression: float) -> float:
    """0.82 at dL = 1/2, and the same fraction of the limiting shear at other compressions."""
    return round(0.82 * limiting_shear(compression) / limiting_shear(0.5), 9)


def default_shear_min(compression: float) -> float:
    """-0.05 at dL = 1/2, and the same fraction of the limiting shear at other compressions."""
    return -round(0.05 * limiting_shear(compression) / limiting_shear(0.5), 9)


@dataclass(frozen=True)
class SliceSettings:
    """A slice of the atlas: shear varies, all else is fixed.

    Attributes
    ----------
    angle_deg : clamp angle psi0 in degrees, 0 <= psi0 < 90.
    compression : dL, between 0 and 1.
    poisson : Poisson's ratio, -1 < nu <= 0.5.
    shear_max, shear_min : range of dD, inside the limiting shear; by default 0.9469 and -0.0577 of that.
    tolerance : largest error of a solution at its mesh points, relative to the scale of each unknown.
    search : starts of the search for stable states at each of some shears (see :mod:`rodatlas.atlas.slices.search`);
        0 for none.
    """

    angle_deg: float
    compression: float = 0.5
    poisson: float = 0.25
    shear_max: float = None  # type: ignore[assignment]  # None: the default for this compression
    shear_min: float = None  # type: ignore[assignment]
    tolerance: float = 1e-8
    search: int = 256

    def __post_init__(self) -> None:
        check_number("angle", self.angle_deg, 0.0, 89.999999, "degrees with 0 <= angle < 90")
        Ends(self.angle_deg, self.compression)
        check_poisson(self.poisson)
        if self.shear_max is None:
            object.__setattr__(self, "shear_max", default_shear_max(self.compression))
        if self.shear_min is None:
            object.__setattr__(self, "shear_min", default_shear_min(self.compression))
        limit = limiting_shear(self.compression)
        below = math.nextafter(limit, 0.0)
        least = LEAST_SHEAR_MAX * min(1.0, limit / limiting_shear(REFERENCE_COMPRESSION))
        check_number(
            "shear-max", self.shear_max, least, below,
            f"a number from {least:g} to below {limit:.6f}, the limiting shear for compression {self.compression:g}",
        )  # fmt: skip
        check_number("shear-min", self.shear_min, -below, 0.0, f"a number between -{limit:.6f} and 0 (included)")
        check_number("tol", self.tolerance, 1e-10, 1e-6, "a number between 1e-10 and 1e-06")
        what = f"a whole number from 0 to {MOST_STARTS}"
        check_number("search", check_whole("search", self.search, 0, what), 0, MOST_STARTS, what)

    @property
    def angle(self) -> float:
        """psi0 in radians."""
        return math.radians(self.angle_deg)

    @property
    def a(self) -> float:
        """EI1/GJ."""
        return bending_ratio(self.poisson)

    def references(self) -> list[SliceSettings]:
        """Settings from which states are carried over that are not connected within the slice: other than this one."""
        at_angle = replace(self, angle_deg=REFERENCE_ANGLE_DEG)
        usual = replace(at_angle, compression=REFERENCE_COMPRESSION, shear_max=default_shear_max(REFERENCE_COMPRESSION))
        distinct = {s.place: s for s in (usual, at_angle)}  # one at each place, if it can be with this range
        return [s for s in dict.fromkeys((at_angle, distinct[usual.place])) if s.place != self.place]

    @property
    def near_limit(self) -> str:
        """A warning when the range of shear reaches near the limiting shear, '' otherwise."""
        return near_limit(max(self.shear_max, -self.shear_min), self.compression)

    @property
    def place(self) -> tuple[float, float]:
        """Angle and compression."""
        return self.angle_deg, self.compression

    def carried_shears(self, start: SliceSettings) -> tuple[float, ...]:
        """Shears at which stable states are carried from another setting, inside both ranges."""
        return self._inside(CARRIED_PARTS, start)

    def carried_high_shears(self, start: SliceSettings) -> tuple[float, ...]:
        """Shears at which states of index one are carried too."""
        return self._inside(CARRIED_HIGH_PARTS, start)

    def _inside(self, parts: tuple[float, ...], start: SliceSettings) -> tuple[float, ...]:
        shears = (part * min(limiting_shear(s.compression) for s in (self, start)) for part in parts)
        return tuple(shear for shear in shears if shear < min(self.shear_max, start.shear_max))

    def identity(self) -> dict[str, object]:
        """Everything that decides the result, as plain values: the fields, and the version of program and algorithm."""
        return {"rodatlas": __version__, "algorithm": ALGORITHM, **asdict(self)}

    @classmethod
    def from_identity(cls, identity: Mapping[str, object]) -> SliceSettings:
        """The settings behind :meth:`identity`, of whatever version."""
        names = {f.name for f in fields(cls)}
        numbers = {key: float(value) for key, value in identity.items() if key in names}  # type: ignore[arg-type]
        search = int(numbers.pop("search", 0.0))
        return cls(**numbers, search=search)
