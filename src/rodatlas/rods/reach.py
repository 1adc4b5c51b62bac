"""From the circle to a state at any angle, compression and shear, without a script."""

from __future__ import annotations

import math
from numbers import Real

from rodatlas.continuation import EndReason, MeshControl, Solution, TraceOptions, trace
from rodatlas.continuation.checks import check_type
from rodatlas.failures import Failure
from rodatlas.rods.band import Band, bending_ratio
from rodatlas.rods.ends import ENDS, Ends
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.planar import PLANAR, planar_states


class NotReached(Failure, ValueError):
    """A state that is not on its branch at a setting, or that the branch does not lead to."""


def state_at(ends: Ends, family: str = "U", band: Band | float = 0.25, tolerance: float = 1e-8) -> Solution:
    """The state on the branch of U, W or the third mode at a setting.

    The planar state at dD = 0 is sheared; pitchforks on the way are passed on the symmetric branch, whatever its
    stability (see :func:`rodatlas.rods.stability.index_of`).

    Parameters
    ----------
    ends : Ends
        with 0 <= angle < 180 degrees.
    family : 'U', 'W' or 'third mode'.
    band : Band, or Poisson's ratio of a thin band.

    Raises
    ------
    NotReached
        a ValueError, when the family does not exist at the angle, or its branch turns back before the shear.
    ValueError
        for another family.
    """
    check_type("ends", ends, Ends, ENDS)
    check_type("band", band, (Band, Real), "a Band, or Poisson's ratio")
    if family not in PLANAR:
        raise ValueError(f"family: expected one of {', '.join(PLANAR)}, got '{family}'")
    a = band.a if isinstance(band, Band) else bending_ratio(band)
    states, missing = planar_states(a, ends.angle, ends.compression, tolerance)
    if family not in states:
        raise NotReached(f"angle: expected one at which {family} exists, got {ends.angle_deg:g} ({missing})")
    start = states[family]
    if ends.shear == 0.0:
        return start
    options = TraceOptions(
        mesh=MeshControl(tolerance=tolerance), locate=("fold",), max_folds=0,
        bounds={"dD": (min(0.0, ends.shear), max(0.0, ends.shear))},
    )  # fmt: skip
    branch = trace(rod_problem(), start, ("dD",), options, both=False, direction=math.copysign(1.0, ends.shear))
    end = branch.points[-1].solution
    if branch.ends[1] is not EndReason.RANGE:
        folds = branch.of_kind("fold")
        limit = folds[0].solution["dD"] if folds else end["dD"]
        why = "turns back at a fold" if folds else f"ends ({branch.ends[1].value})"
        raise NotReached(
            f"shear: expected a value short of {limit:.6g}, where the branch of {family} {why}, got {ends.shear:g}"
        )
    return end
