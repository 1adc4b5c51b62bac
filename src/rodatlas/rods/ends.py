"""How the rod is held: two clamps, compressed, tilted and sheared against each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rodatlas.rods.band import check_number, limiting_shear


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
        number = check_number("compression", self.compression, 0.0, 1.0, "a number between 0 and 1 (exclusive)")
        if number in (0.0, 1.0):
            raise ValueError(f"compression: expected a number between 0 and 1 (exclusive), got {self.compression}")
        limit = limiting_shear(self.compression)
        check_number(
            "shear", self.shear, -math.nextafter(limit, 0.0), math.nextafter(limit, 0.0),
            f"a number of size below {limit:.6f}, the limit for compression {self.compression:g}",
        )  # fmt: skip

    @property
    def angle(self) -> float:
        """psi0 in radians."""
        return math.radians(self.angle_deg)

    @property
    def parameters(self) -> dict[str, float]:
        """Values by the names that the boundary value problems use."""
        return {"psi0": self.angle, "dL": self.compression, "dD": self.shear}


def clamp_quaternions(psi0: float) -> tuple[np.ndarray, np.ndarray]:
    """Quaternions (q0, q1, q2, q3) of the clamps at s = 0 and s = 1."""
    c, s = math.cos(psi0 / 2) / math.sqrt(2), math.sin(psi0 / 2) / math.sqrt(2)
    return np.array([c, -s, c, s]), np.array([c, s, c, -s])
