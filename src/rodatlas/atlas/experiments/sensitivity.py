"""How far a bifurcation moves when the clamps are set a little wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rodatlas.continuation import MeshControl, NotConverged, SpecialPoint, TraceOptions, follow_locus
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.units import BandUnits, ClampErrors

TINY = 1e-12


@dataclass(frozen=True)
class Sensitivity:
    """Slopes of the shear of a bifurcation.

    Attributes
    ----------
    angle : derivative of its shear with respect to the clamp angle [L per degree].
    compression : derivative with respect to the compression dL.
    """

    angle: float
    compression: float

    def error(self, errors: ClampErrors, units: BandUnits) -> float:
        """Standard error of the measured shear [L]: of angle, compression and shear, independent of each other."""
        moved = units.from_mm(errors.displacement)
        return math.hypot(self.angle * errors.angle_deg, self.compression * moved, moved)


def sensitivity(special: SpecialPoint, tolerance: float = 1e-8) -> Sensitivity | None:
    """Slopes at a located fold or branch point, from the tangents of its loci; None where a locus is vertical there,
    or cannot be started."""
    slopes = (_slope(special, name, tolerance) for name in ("psi0", "dL"))
    angle, compression = slopes
    if angle is None or compression is None:
        return None
    return Sensitivity(math.radians(angle), compression)


def _slope(special: SpecialPoint, name: str, tolerance: float) -> float | None:
    """d(dD)/d(name) along the locus: the tangent where it starts, in the units of its arclength."""
    options = TraceOptions(mesh=MeshControl(tolerance=tolerance), max_points=1)
    try:
        locus = follow_locus(rod_problem(), special, ("dD", name), options, both=False)
    except (NotConverged, ValueError):
        return None
    scales = [locus.scale.parameters[rod_problem().parameter_index(p)] for p in ("dD", name)]
    shear, other = locus.points[0].tangent[:2] * scales
    size = math.hypot(shear, other)
    return float(shear / other) if size > 0 and abs(other) > TINY * size else None
