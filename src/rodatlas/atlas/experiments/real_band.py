"""A real band in mm: what it is for the rod model, how exact the conversion is, and whether the model fits it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rodatlas.atlas.experiments.sensitivity import Sensitivity, sensitivity
from rodatlas.continuation import MeshControl, Solution, Status, TraceOptions, trace
from rodatlas.continuation.checks import check_type
from rodatlas.progress import Progress, silent, tells
from rodatlas.rods.band import check_number, limiting_shear
from rodatlas.rods.ends import Ends
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.reach import NotReached, state_at
from rodatlas.rods.stability import index_of
from rodatlas.rods.state import RodState
from rodatlas.rods.units import BandUnits, ClampErrors
from rodatlas.rods.width import width_effect

SCHEMA = "rodatlas/band/1"
HOLDS, ROUGHLY = 0.05, 0.25  # largest part of the energy that the width adds: the rod holds, or holds roughly
PART = 0.5  # of the limiting shear: a second state at which the width is judged


@dataclass(frozen=True)
class WidthCheck:
    """A state of the rod and what the width would add.

    Attributes
    ----------
    shear : dD [L]. added : energy that the width adds, as a part of the energy.
    strain : largest bending strain at the faces, t max|kappa1|/2.
    force : size of the force in the rod [GJ/L^2].
    """

    shear: float
    added: float
    strain: float
    force: float


@dataclass(frozen=True)
class BandReport:
    """A real band at one clamp angle, see :func:`band_report`.

    Attributes
    ----------
    units : the band, compression and modulus.
    errors : how well the clamps are set.
    angle_deg : clamp angle at which the numbers below hold.
    checks : states at which the width is judged, of the branch of U.
    bifurcation : shear [L] at which U loses stability, None when it does not below the limiting shear.
    slopes : how that shear depends on angle and compression.
    """

    units: BandUnits
    errors: ClampErrors
    angle_deg: float
    checks: tuple[WidthCheck, ...]
    bifurcation: float | None
    slopes: Sensitivity | None

    @property
    def verdict(self) -> str:
        """Whether the narrow-band model is expected to hold, by the largest part of the energy that width adds."""
        worst = max(c.added for c in self.checks)
        return "holds" if worst < HOLDS else "holds roughly" if worst < ROUGHLY else "does not hold"

    @property
    def bifurcation_error(self) -> float | None:
        """Standard error [L] of that shear as these clamps would measure it."""
        return None if self.slopes is None else self.slopes.error(self.errors, self.units)

    def to_json(self) -> dict[str, Any]:
        """The object that `rodatlas band --json` prints; lengths in L unless their name ends in _mm."""
        u, band = self.units, self.units.band
        out: dict[str, Any] = {
            "schema": SCHEMA,
            "length_mm": band.length,
            "width_mm": band.width,
            "thickness_mm": band.thickness,
            "poisson": band.poisson,
            "compression": u.compression,
            "aspect": band.aspect,
            "width_parameter": band.width_parameter,
            "bending_ratio": {"thin": band.a, "of_section": band.a / (3.0 * band.torsion_factor)},
            "limiting_shear": u.limit,
            "limiting_shear_mm": u.limit_mm,
            "limiting_shear_of_rod": limiting_shear(u.compression),
            "clamp_errors": {
                "angle_deg": self.errors.angle_deg,
                "displacement_mm": self.errors.displacement,
                "shear": self.errors.of_shear(u),
                "limiting_shear": self.errors.of_limit(u),
                "normalized_at_limit": self.errors.of_normalized(u, u.limit),
            },
            "angle_deg": self.angle_deg,
            "first_bifurcation": None if self.bifurcation is None else {
                "shear": self.bifurcation, "shear_mm": u.to_mm(self.bifurcation),
                "per_degree": self.slopes and self.slopes.angle,
                "per_compression": self.slopes and self.slopes.compression,
                "error": self.bifurcation_error,
            },
            "width_checks": [
                {"shear": c.shear, "added_energy": c.added, "strain": c.strain, "force": c.force} for c in self.checks
            ],
            "narrow_band_model": self.verdict,
        }  # fmt: skip
        if u.young is not None:
            out |= {"modulus_GPa": u.young, "force_N": u.force, "moment_Nmm": u.moment, "energy_mJ": u.moment}
        if u.density is not None:
            out |= {"density_kg_m3": u.density, "weight_N": u.weight_newton}
        if u.young is not None and u.density is not None:
            out |= {"weight": u.weight, "weight_over_force": u.weight / self.checks[0].force}
        return out


@tells("band")
def band_report(
    units: BandUnits, errors: ClampErrors, angle_deg: float = 15.0, progress: Progress | None = None
) -> BandReport:
    """Convert a real band, and judge the narrow-band model by what width adds to the energy of U, unsheared and on
    its branch at half the limiting shear.

    Parameters
    ----------
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.

    Raises
    ------
    NotReached
        when the branch of U does not reach so far at this setting.
    ValueError
        when the clamps' error exceeds the length.
    """
    check_type("units", units, BandUnits, "BandUnits such as BandUnits(Band(240.0, 3.0, 0.127))")
    check_type("errors", errors, ClampErrors, "ClampErrors such as ClampErrors(1.0, 0.5)")
    check_errors(units, errors)
    tell = progress or silent
    ends = [Ends(angle_deg, units.compression, shear) for shear in (0.0, PART * units.limit)]
    states = []
    for done, e in enumerate(ends):
        tell(f"U at shear {e.shear:.4f}", done, 3 - done)
        try:
            states.append(state_at(e, "U", units.band))
        except NotReached as error:
            raise NotReached(f"U, by which the width is judged: {error}") from None
    tell("first bifurcation of U", 2, 1)
    checks = tuple(_check(s, units) for s in states)
    shear, slopes = _first_bifurcation(states[0], units)
    return BandReport(units, errors, angle_deg, checks, shear, slopes)


def check_errors(units: BandUnits, errors: ClampErrors) -> None:
    """ValueError where the clamps' displacement is less certain than the length of the band."""
    longest = units.band.length
    what = f"a length in mm from 0 to that of the band, {longest:g}"
    check_number("displacement error", errors.displacement, 0.0, longest, what)


def _check(solution: Solution, units: BandUnits) -> WidthCheck:
    """The width's part in the energy of a state, its largest strain, and its force."""
    state = RodState(solution)
    kappa = float(np.abs(state.at_gauss_points().k1).max())
    strain = 0.5 * units.from_mm(units.band.thickness) * kappa
    force = float(np.linalg.norm(state.force_body[0]))
    return WidthCheck(solution["dD"], width_effect(solution, units.band), strain, force)


def _first_bifurcation(start: Solution, units: BandUnits) -> tuple[float | None, Sensitivity | None]:
    """Where the branch of U first loses its stability with rising shear."""
    if index_of(start).index != 0:
        return None, None
    options = TraceOptions(
        mesh=MeshControl(tolerance=1e-8), bounds={"dD": (0.0, 0.94 * limiting_shear(units.compression))},
        max_folds=0, stop_at=lambda special, last: True,
    )  # fmt: skip
    branch = trace(rod_problem(), start, ("dD",), options, both=False)
    located = [s for s in branch.special if s.status is Status.CONVERGED]
    return (located[0].solution["dD"], sensitivity(located[0])) if located else (None, None)
