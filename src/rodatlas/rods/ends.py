"""How the rod is held: two clamps, compressed, tilted, displaced and turned against each other."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rodatlas.rods.band import check_between, check_compression, check_number, limiting_offset, limiting_shear
from rodatlas.rods.poses import Clamps

ENDS = "Ends such as Ends(15.0)"  # what errors say of arguments that are none
MOST_TWIST = 720.0  # degrees, either way
DIGITS = 12  # decimals of an angle in degrees to which mean and half difference give it back
ROUND_OFF = 1e-9  # degrees, of half the sum of two angles and half their difference


@dataclass(frozen=True)
class Ends:
    """Two clamps, in degrees and lengths of the band.

    With the first three alone they are parallel to the width direction and tilted alike, as those of Yu and Hanna; the
    others turn and displace them further.

    Attributes
    ----------
    angle_deg : clamp angle psi0 in degrees: the tangent leaves at +psi0 and arrives at -psi0 with respect to x.
    compression : dL; the end-to-end distance along x is 1 - dL.
    shear : dD, relative displacement of the ends along z, the width direction, in units of the length.
    offset : dY, by which the right clamp lies higher along y, in units of the length.
    twist_deg : by which the right clamp is turned about its tangent in degrees, -720 to 720. A full turn leads to the
        same clamps: the states of one class are then those that were of the other.
    skew_deg : by which the left clamp is steeper than `angle_deg`, and the right one flatter, in degrees.

    Raises
    ------
    ValueError
        for a number out of range, or clamps that are a length or more apart.

    Examples
    --------
    >>> Ends.unequal(20.0, 35.0)
    Ends(angle_deg=27.5, compression=0.5, shear=0.0, offset=0.0, twist_deg=0.0, skew_deg=-7.5)
    >>> Ends(15.0, shear=0.2, twist_deg=90.0).clamps.right.directors.round(3) + 0.0
    """

    angle_deg: float
    compression: float = 0.5
    shear: float = 0.0
    offset: float = 0.0
    twist_deg: float = 0.0
    skew_deg: float = 0.0

    def __post_init__(self) -> None:
        check_number("angle", self.angle_deg, -180.0, 180.0, "degrees between -180 and 180")
        check_compression(self.compression)
        check_offset(self.offset, self.compression)
        check_shear(self.shear, self.compression, self.offset)
        what = f"degrees between -{MOST_TWIST:g} and {MOST_TWIST:g}"
        check_number("twist", self.twist_deg, -MOST_TWIST, MOST_TWIST, what)
        most = 180.0 - abs(self.angle_deg)
        what = f"degrees of size up to {most:g} at angle {self.angle_deg:g}"
        check_number("skew", self.skew_deg, -most - ROUND_OFF, most + ROUND_OFF, what)

    @classmethod
    def unequal(
        cls, left_deg: float, right_deg: float, compression: float = 0.5, shear: float = 0.0, offset: float = 0.0,
        twist_deg: float = 0.0,
    ) -> Ends:  # fmt: skip
        """Clamps of different angles: the tangent leaves at `left_deg` and arrives at minus `right_deg`, in degrees."""
        for side, value in (("left", left_deg), ("right", right_deg)):
            check_number(f"angle-{side}", value, -180.0, 180.0, "degrees between -180 and 180")
        mean = (left_deg + right_deg) / 2.0
        return cls(mean, compression, shear, offset, twist_deg, skew_deg=(left_deg - right_deg) / 2.0)

    @classmethod
    def from_setting(cls, setting: Mapping[str, float]) -> Ends:
        """The ends of a :attr:`setting`: by the names that a user gives.

        Raises
        ------
        ValueError
            for other names, none or all three of the angles, or numbers out of range.
        """
        angles = ("angle",) if "angle" in setting else ("angle_left", "angle_right")
        expected = {*angles, "compression", "shear", "offset", "twist"}
        if wrong := sorted(expected.symmetric_difference(setting)):
            raise ValueError(f"setting: expected {', '.join(sorted(expected))}, got {', '.join(setting)} ({wrong[0]})")
        others = (setting[name] for name in ("compression", "shear", "offset", "twist"))
        make = cls if "angle" in setting else cls.unequal
        return make(*(setting[name] for name in angles), *others)

    @property
    def left_deg(self) -> float:
        """Angle at which the tangent leaves the left clamp, in degrees."""
        return round(self.angle_deg + self.skew_deg, DIGITS)

    @property
    def right_deg(self) -> float:
        """Angle at which the tangent arrives at the right clamp, downward, in degrees."""
        return round(self.angle_deg - self.skew_deg, DIGITS)

    @property
    def angle(self) -> float:
        """psi0 in radians."""
        return math.radians(self.angle_deg)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the clamps in a rod problem, :data:`rodatlas.rods.unknowns.CLAMPS`, in radians."""
        skew = math.radians(self.skew_deg)
        return {
            "psi0": self.angle, "dL": self.compression, "dD": self.shear, "dY": self.offset, "turn_left": skew,
            "turn_right": 0.0 - skew, "twist_left": 0.0, "twist_right": math.radians(self.twist_deg),
        }  # fmt: skip

    @property
    def clamps(self) -> Clamps:
        """The poses of both ends."""
        return Clamps.changed(*self.parameters.values())

    @property
    def distance(self) -> float:
        """How far the ends are apart, below 1 [L]."""
        return float(np.hypot(np.hypot(1.0 - self.compression, self.shear), self.offset))

    @property
    def alike(self) -> bool:
        """Whether the clamps are parallel to the width, at one height and tilted alike: those of Yu and Hanna."""
        return self.offset == self.twist_deg == self.skew_deg == 0.0

    @property
    def setting(self) -> dict[str, float]:
        """By the names that a user gives on the command line; the angle, or both angles where they differ."""
        one = {"angle": self.angle_deg}
        both = {"angle_left": self.left_deg, "angle_right": self.right_deg}
        others = {"compression": self.compression, "shear": self.shear, "offset": self.offset, "twist": self.twist_deg}
        return (one if self.skew_deg == 0.0 else both) | others


def check_offset(offset: object, compression: float) -> None:
    """Raise ValueError unless an offset is within the limit at a compression."""
    limit = limiting_offset(compression)
    what = f"a number of size below {limit:.6f}, the limit for compression {compression:g}"
    check_between("offset", offset, -limit, limit, what)


def check_shear(shear: object, compression: float, offset: float = 0.0) -> None:
    """Raise ValueError unless a shear is within the limit at a compression and an offset."""
    limit = limiting_shear(compression, offset=offset)
    where = f"compression {compression:g}" if offset == 0.0 else f"compression {compression:g} and offset {offset:g}"
    check_between("shear", shear, -limit, limit, f"a number of size below {limit:.6f}, the limit for {where}")
