"""Where the ends of a rod are held, and how they are turned there: two poses, for numbers and symbols alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rodatlas.continuation.checks import shown
from rodatlas.rods.kinematics import POSE, POSITION, QUATERNION, clamp_residual, director_components

UNIT = 1e-9  # by which the length of a unit quaternion may differ from 1


@dataclass(frozen=True)
class Pose:
    """Place and rotation of a cross-section.

    Attributes
    ----------
    quaternion : (4,) unit quaternion of the directors; it and its negative are one rotation.
    position : (3,) of the center line [L].

    Raises
    ------
    ValueError
        for another number of components, or numbers of a quaternion whose length is not 1.
    """

    quaternion: Sequence[Any]
    position: Sequence[Any]

    def __post_init__(self) -> None:
        for field, values, size in (("quaternion", self.quaternion, 4), ("position", self.position, 3)):
            if not isinstance(values, Sequence | np.ndarray) or isinstance(values, str):
                raise ValueError(f"{field}: expected {size} components, got {shown(values)}")
            if len(values) != size:
                raise ValueError(f"{field}: expected {size} components, got {len(values)}")
        if all(isinstance(q, int | float | np.number) for q in self.quaternion):
            length = math.hypot(*self.quaternion)
            if not abs(length - 1.0) < UNIT:
                raise ValueError(f"quaternion: expected one of length 1, got {tuple(self.quaternion)} of {length:g}")

    @classmethod
    def tilted(cls, angle: Any, position: Sequence[Any]) -> Pose:
        r"""A clamp parallel to the width, which is -z, whose tangent makes an angle psi with the x axis, toward y.

        .. math:: q = (c, -s, c, s)/\sqrt2, \qquad c = \cos(\psi/2), \quad s = \sin(\psi/2)

        Parameters
        ----------
        angle : psi [rad], a number or a symbol, as are the components of the position.

        """
        c, s = np.cos(angle / 2) / np.sqrt(2.0), np.sin(angle / 2) / np.sqrt(2.0)
        return cls((c, -s, c, s), tuple(position))

    def twisted(self, angle: Any) -> Pose:
        r"""The same clamp turned about its own tangent, in the sense of a positive twist.

        .. math:: q \to q\,(\cos(\phi/2), 0, 0, \sin(\phi/2))

        Parameters
        ----------
        angle : phi [rad], a number or a symbol. A full turn leads to -q, and so to the other class.
        """
        c, s = np.cos(angle / 2), np.sin(angle / 2)
        q0, q1, q2, q3 = self.quaternion
        return replace(self, quaternion=(q0 * c - q3 * s, q1 * c + q2 * s, q2 * c - q1 * s, q3 * c + q0 * s))

    def moved(self, offset: Sequence[Any]) -> Pose:
        """The same clamp elsewhere: its position changed by an offset (3,) [L]."""
        return replace(self, position=tuple(x + d for x, d in zip(self.position, offset, strict=True)))

    @property
    def numbers(self) -> np.ndarray:
        """(7,) quaternion and position, in the order of :data:`rodatlas.rods.kinematics.POSE`."""
        return np.array([*self.quaternion, *self.position], dtype=float)

    @property
    def directors(self) -> np.ndarray:
        """(3, 3) rows d1 (width), d2 (normal), d3 (tangent), in space."""
        return np.array(director_components(*self.quaternion), dtype=float)

    def of_class(self, sign: int) -> Pose:
        """The same pose reached at -q where the sign is negative: with half a full turn of link more or less."""
        return replace(self, quaternion=tuple(sign * q for q in self.quaternion))


@dataclass(frozen=True)
class Clamps:
    """Both ends of a rod held: their poses at s = 0 and at s = 1.

    Examples
    --------
    Unequal angles, of 20 and 35 degrees, at dL = 1/2, the right clamp turned about its tangent by half a turn:

    >>> left = Pose.tilted(math.radians(20.0), (0.0, 0.0, 0.0))
    >>> Clamps(left, Pose.tilted(-math.radians(35.0), (0.5, 0.0, 0.0)).twisted(math.pi))
    """

    left: Pose
    right: Pose

    @classmethod
    def symmetric(cls, angle: Any, compression: Any, shear: Any) -> Clamps:
        """Two clamps parallel to the width, tilted alike, as those of Yu and Hanna.

        Parameters
        ----------
        angle : psi0 [rad]: the tangent leaves at +psi0 and arrives at -psi0 with respect to x.
        compression : dL; the distance along x is 1 - dL.
        shear : dD, relative displacement of the ends along z, the width direction.
        """
        return cls(Pose.tilted(angle, (0.0, 0.0, -shear)), Pose.tilted(-angle, (1 - compression, 0.0, 0.0)))

    @classmethod
    def changed(
        cls, angle: Any, compression: Any, shear: Any, offset: Any, turn_left: Any, turn_right: Any, twist_left: Any,
        twist_right: Any,
    ) -> Clamps:  # fmt: skip
        """The clamps of :meth:`symmetric`, each turned further in the plane of the clamps and about its own tangent.

        Numbers or symbols alike; where all the further arguments are 0, these are the clamps of :meth:`symmetric`, bit
        for bit.

        Parameters
        ----------
        angle, compression, shear : as for :meth:`symmetric`.
        offset : dY, what the right clamp is displaced along y.
        turn_left, turn_right : added to the angle at which the tangent leaves, and to that at which it arrives [rad].
        twist_left, twist_right : by which each clamp is turned about its own tangent [rad].
        """
        left = Pose.tilted(angle + turn_left, (0.0, 0.0, -shear)).twisted(twist_left)
        right = Pose.tilted(-(angle + turn_right), (1 - compression, 0.0, 0.0)).moved((0.0, offset, 0.0))
        return cls(left, right.twisted(twist_right))

    def residual(self, left: Any, right: Any) -> list[Any]:
        """Thirteen boundary conditions that hold the unknowns by name at both ends in these poses.

        The left quaternion is given with its sign, since the equations keep its length; of the right one three
        conditions are independent, which q and -q satisfy.
        """
        target = (*self.left.quaternion, *self.left.position)
        start = [getattr(left, name) - value for name, value in zip(POSE, target, strict=True)]
        shift = [getattr(right, name) - value for name, value in zip(POSITION, self.right.position, strict=True)]
        return [*start, *shift, *clamp_residual([getattr(right, name) for name in QUATERNION], self.right.quaternion)]
