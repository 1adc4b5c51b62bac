"""From the circle to a state between any two clamps, without a script."""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Real

from rodatlas.continuation import EndReason, Solution
from rodatlas.continuation.checks import check_type
from rodatlas.failures import Failure
from rodatlas.rods.band import Band, bending_ratio
from rodatlas.rods.carry import carried
from rodatlas.rods.ends import ENDS, Ends
from rodatlas.rods.planar import PLANAR, planar_states

WAY = ("turn_left", "turn_right", "dY", "twist_right", "dD")
"""Parameters in the order in which a state between clamps tilted alike is brought to others."""


class NotReached(Failure, ValueError):
    """A state that is not on its branch at a setting, or that the branch does not lead to."""


def state_at(ends: Ends, family: str = "U", band: Band | float = 0.25, tolerance: float = 1e-8) -> Solution:
    """The state on the branch of U, W or the third mode at a setting.

    The planar state between clamps that are tilted alike, at dD = 0, is followed as these are turned to their own
    angles, the left one first, then displaced and twisted, and sheared at last; pitchforks on the way are passed on the
    same branch, whatever its stability (see :func:`rodatlas.rods.stability.index_of`).

    Parameters
    ----------
    ends : Ends
        with 0 <= angle < 180 degrees.
    family : 'U', 'W' or 'third mode'.
    band : Band, or Poisson's ratio of a thin band.

    Raises
    ------
    NotReached
        a ValueError, when the family does not exist at the angle, or its branch turns back on the way.
    ValueError
        for another family.

    Examples
    --------
    >>> state_at(Ends.unequal(20.0, 35.0, twist_deg=45.0), "W")
    """
    check_type("ends", ends, Ends, ENDS)
    check_type("band", band, (Band, Real), "a Band, or Poisson's ratio")
    if family not in PLANAR:
        raise ValueError(f"family: expected one of {', '.join(PLANAR)}, got '{family}'")
    a = band.a if isinstance(band, Band) else bending_ratio(band)
    states, missing = planar_states(a, ends.angle, ends.compression, tolerance)
    if family not in states:
        mean = f"{ends.angle_deg:g}" + (", the mean of both" if ends.skew_deg else "")
        raise NotReached(f"angle: expected one at which {family} exists, got {mean} ({missing})")
    goal = ends.parameters
    end = carried(states[family], {name: goal[name] for name in WAY}, tolerance)
    if end.arrived or end.limit is None or end.end is None:
        return end.solution
    field, wanted, unit = _asked(ends)[end.parameter]
    why = "turns back at a fold" if end.end is EndReason.FOLD_LIMIT else f"ends ({end.end.value})"
    raise NotReached(
        f"{field}: expected a value short of {unit(end.limit):.6g}, where the branch of {family} {why}, got {wanted:g}"
    )


def _asked(ends: Ends) -> dict[str, tuple[str, float, Callable[[float], float]]]:
    """What a user calls each parameter on the way, what was asked for, and a value of the parameter in these terms."""
    return {
        "turn_left": ("angle-left", ends.left_deg, lambda turn: ends.angle_deg + math.degrees(turn)),
        "turn_right": ("angle-right", ends.right_deg, lambda turn: ends.angle_deg + math.degrees(turn)),
        "dY": ("offset", ends.offset, float),
        "twist_right": ("twist", ends.twist_deg, math.degrees),
        "dD": ("shear", ends.shear, float),
    }
