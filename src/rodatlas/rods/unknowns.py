"""What the unknowns of all rods between two clamps have in common: names, scales, symmetries, the force in space."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rodatlas.continuation.problem.symmetry import Symmetry
from rodatlas.rods.kinematics import QUATERNION, in_space
from rodatlas.rods.poses import Clamps

FORCE = ("N1", "N2", "N3")
FORCE_SCALE, MOMENT_SCALE = 300.0, 60.0  # [GJ/L^2, GJ/L]
CLAMPS = ("psi0", "dL", "dD", "dY", "turn_left", "turn_right", "twist_left", "twist_right")
"""Parameters of two clamps, in the order of the arguments of :meth:`rodatlas.rods.Clamps.changed`."""
CIRCLE = dict(zip(CLAMPS, (math.pi, 1.0, *(0.0,) * 6), strict=True))
"""Those of the closed circle, the defaults of all rod problems."""


GRAVITY = ("gravity_x", "gravity_y", "gravity_z")
"""Weight of the whole rod as a vector in space [GJ/L^2]: the dead load per length, lengths being in units of L."""
REST = ("rest_k1", "rest_k2", "rest_tau")
"""Strain without load [1/L]."""


def symmetries_of(loads: Sequence[str], loaded: bool = False) -> tuple[Symmetry, ...]:
    """Reversal, both mirrors and the sign of the quaternion: of a rod between the clamps of `CLAMPS`.

    The energy is even in k2 and in (k1, tau). See :mod:`rodatlas.rods.symmetry` for the table.

    Parameters
    ----------
    loads : (3,) names of the unknowns of bending about d1, bending about d2 and twist: moments or strains, which change
        their signs together.
    loaded : whether the rod has the parameters `GRAVITY` and `REST`, which are turned and reflected like the rest.
    """
    one, two, twist = loads
    along, across = (({GRAVITY[0]: -1, GRAVITY[2]: -1, REST[1]: -1}, {GRAVITY[1]: -1, REST[0]: -1, REST[2]: -1})
                     if loaded else ({}, {}))  # fmt: skip
    aside = {GRAVITY[2]: -1, REST[1]: -1, REST[2]: -1} if loaded else {}
    # q and -q are one rotation: the reversal of a state whose right clamp is reached at -q starts at -q
    frame = {"q1": -1, "q3": -1}
    swapped = {"q0": "q2", "q1": "-q3", "q2": "q0", "q3": "-q1"}
    center = {"x": "1 - dL - x", "y": "y - dY", "z": "-dD - z"}
    exchanged: dict[str, float | str] = {
        "dY": -1, "turn_left": "turn_right", "turn_right": "turn_left", "twist_left": "-twist_right",
        "twist_right": "-twist_left",
    }  # fmt: skip
    untwisted = {"twist_left": -1, "twist_right": -1}
    turned = {"psi0": -1, "dY": -1, "turn_left": -1, "turn_right": -1}
    return (
        Symmetry("reversal", {"N2": -1, two: -1, **frame, **center}, exchanged | along, reverse=True),
        Symmetry("angle mirror", {"N2": -1, one: -1, twist: -1, **frame, "y": -1}, {**turned, **untwisted, **across}),
        Symmetry("shear mirror", {"N1": -1, two: -1, twist: -1, **swapped, "z": -1}, {"dD": -1, **untwisted, **aside}),
        Symmetry("quaternion sign", dict.fromkeys(QUATERNION, -1), gauge=True),
    )


def clamps_of(p: Any) -> Clamps:
    """The clamps at parameters by name, `CLAMPS` among them: attributes or items, numbers or symbols."""
    read = p.__getitem__ if isinstance(p, Mapping) else lambda name: getattr(p, name)
    return Clamps.changed(*(read(name) for name in CLAMPS))


def unit_length(u: Any, p: Any) -> Any:
    """q . q - 1, an identity of every solution."""
    return sum(getattr(u, k) ** 2 for k in QUATERNION) - 1


def space_force(end: Any) -> list[Any]:
    """Components in space of the force at an end, from its unknowns by name."""
    return in_space([getattr(end, k) for k in QUATERNION], [getattr(end, n) for n in FORCE])
