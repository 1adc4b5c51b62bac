"""What a slice is computed for; everything that decides its numbers."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

from rodatlas.rods.band import bending_ratio, check_number, check_poisson, limiting_shear
from rodatlas.rods.ends import Ends

REFERENCE_ANGLE_DEG = 15.0


def default_shear_max(compression: float) -> float:
    """0.82 at dL = 1/2, and the same fraction of the limiting shear at other compressions."""
    if not 0.0 < compression < 1.0:
        return 0.82  # the compression is reported where it is checked
    return round(0.82 * limiting_shear(compression) / limiting_shear(0.5), 9)


@dataclass(frozen=True)
class SliceSettings:
    """A slice of the atlas: shear varies, all else is fixed.

    Attributes
    ----------
    angle_deg : clamp angle psi0 in degrees, 0 <= psi0 < 90.
    compression : dL, between 0 and 1.
    poisson : Poisson's ratio, -1 < nu <= 0.5.
    shear_min, shear_max : range of dD, inside the limiting shear.
    tolerance : largest error of a solution at its mesh points, relative to the scale of each unknown.
    """

    angle_deg: float
    compression: float = 0.5
    poisson: float = 0.25
    shear_max: float = 0.82
    shear_min: float = -0.05
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        check_number("angle", self.angle_deg, 0.0, 89.999999, "degrees with 0 <= angle < 90")
        Ends(self.angle_deg, self.compression)
        check_poisson(self.poisson)
        limit = limiting_shear(self.compression)
        below = math.nextafter(limit, 0.0)
        check_number(
            "shear-max", self.shear_max, 1e-3, below,
            f"a number from 0.001 to below {limit:.6f}, the limiting shear for compression {self.compression:g}",
        )  # fmt: skip
        check_number("shear-min", self.shear_min, -below, 0.0, f"a number between -{limit:.6f} and 0")
        check_number("tol", self.tolerance, 1e-10, 1e-3, "a number between 1e-10 and 0.001")

    @property
    def angle(self) -> float:
        """psi0 in radians."""
        return math.radians(self.angle_deg)

    @property
    def a(self) -> float:
        """EI1/GJ."""
        return bending_ratio(self.poisson)

    @property
    def reference_angle_deg(self) -> float:
        """Angle from which states that are not connected within the slice are carried over."""
        return REFERENCE_ANGLE_DEG

    def at_reference(self) -> SliceSettings:
        return replace(self, angle_deg=self.reference_angle_deg)

    @property
    def carried_shears(self) -> tuple[float, ...]:
        """Shears at which states are carried from the reference angle: inside the range, where many states live."""
        return tuple(f * limiting_shear(self.compression) for f in (0.72, 0.86) if f * limiting_shear(self.compression)
                     < self.shear_max)  # fmt: skip

    def as_dict(self) -> dict[str, float]:
        return asdict(self)
