"""What a slice is computed for; everything that decides its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

from rodatlas import __version__
from rodatlas.rods.band import bending_ratio, check_number, check_poisson, limiting_shear
from rodatlas.rods.ends import Ends

REFERENCE_ANGLE_DEG = 15.0
CARRIED_PARTS = (0.72, 0.86)  # parts of the limiting shear at which states are carried to another angle


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
    shear_max, shear_min : range of dD, inside the limiting shear.
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
        check_number("shear-min", self.shear_min, -below, 0.0, f"a number between -{limit:.6f} and 0 (included)")
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
        """The same settings at the reference angle."""
        return replace(self, angle_deg=self.reference_angle_deg)

    @property
    def carried_shears(self) -> tuple[float, ...]:
        """Shears at which states are carried from the reference angle: inside the range, where many states live."""
        shears = [part * limiting_shear(self.compression) for part in CARRIED_PARTS]
        return tuple(shear for shear in shears if shear < self.shear_max)

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values: the fields, and the version of this program."""
        return {"rodatlas": __version__, **asdict(self)}

    @classmethod
    def from_identity(cls, identity: Mapping[str, object]) -> SliceSettings:
        """The settings behind :meth:`identity`, of whatever version."""
        return cls(**{key: float(value) for key, value in identity.items() if key != "rodatlas"})  # type: ignore[arg-type]
