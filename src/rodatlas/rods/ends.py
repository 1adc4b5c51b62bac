"""How the rod is held: two clamps, compressed, tilted and sheared against each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rodatlas.rods.band import check_between, check_compression, check_number, limiting_shear
from rodatlas.rods.poses import Clamps

ENDS = "Ends such as Ends(15.0)"  # what errors say of arguments that are none


@dataclass(frozen=True)
class Ends:
    """Two clamps parallel to the width direction.

    Attributes
    ----------
    angle_deg : clamp angle psi0 in degrees: the tangent leaves at +psi0 and arrives at -psi0 with respect to x.
    compression : dL; the end-to-end distance along x is 1 - dL.
    shear : dD, relative displacement of the ends along z, the width direction, in units of the length.
    """

    angle_deg: float
    compression: float = 0.5
    shear: float = 0.0

    def __post_init__(self) -> None:
        check_number("angle", self.angle_deg, -180.0, 180.0, "degrees between -180 and 180")
        check_compression(self.compression)
        check_shear(self.shear, self.compression)

    @property
    def angle(self) -> float:
        """psi0 in radians."""
        return math.radians(self.angle_deg)

    @property
    def clamps(self) -> Clamps:
        """The poses of both ends."""
        return Clamps.symmetric(self.angle, self.compression, self.shear)


def check_shear(shear: object, compression: float) -> None:
    """Raise ValueError unless a shear is within the limit at a compression."""
    limit = limiting_shear(compression)
    what = f"a number of size below {limit:.6f}, the limit for compression {compression:g}"
    check_between("shear", shear, -limit, limit, what)
