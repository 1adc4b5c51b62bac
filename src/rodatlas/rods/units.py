"""A real band in millimeters: its limiting shear, and what the units of force, moment and energy are for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rodatlas.continuation.checks import check_type
from rodatlas.rods.band import LENGTHS, Band, check_compression, check_number, limiting_shear

STANDARD_GRAVITY = 9.80665  # m/s^2
MODULI = (1e-9, 1e6)  # GPa; gels have 1e-6, diamond has 1.2e3
DENSITIES = (1e-3, 1e5)  # kg/m^3; aerogels have 1, osmium has 2.3e4


@dataclass(frozen=True)
class BandUnits:
    r"""Conversions between a band in mm and the units of the program.

    Lengths are divided by L, forces by GJ/L^2, moments and energies by GJ/L, with

    .. math:: GJ = \lambda\, \mu\, D\, t^3, \qquad \mu = \frac{Y}{2(1+\nu)},

    Young's modulus Y, shear modulus mu, and lambda(D/t) of the rectangular section
    (:func:`rodatlas.rods.band.torsion_factor`). With Y in GPa = 1000 N/mm^2, forces come in N, moments in N mm,
    energies in mJ = N mm.

    Attributes
    ----------
    band : length, width and thickness in mm.
    compression : dL.
    young : Young's modulus in GPa; None when only lengths matter.
    density : in kg/m^3; None when weight does not matter.
    """

    band: Band
    compression: float = 0.5
    young: float | None = None
    density: float | None = None

    def __post_init__(self) -> None:
        check_type("band", self.band, Band, "a Band such as Band(240.0, 3.0, 0.127)")
        check_compression(self.compression)
        if self.young is not None:
            what = f"a positive Young's modulus in GPa, from {MODULI[0]:g} to {MODULI[1]:g}"
            check_number("modulus", self.young, *MODULI, what)
        if self.density is not None:
            what = f"a positive density in kg/m^3, from {DENSITIES[0]:g} to {DENSITIES[1]:g}"
            check_number("density", self.density, *DENSITIES, what)

    @property
    def limit(self) -> float:
        """Limiting shear [L] of a band of this width."""
        return limiting_shear(self.compression, self.band.aspect)

    @property
    def limit_mm(self) -> float:
        """Limiting shear [mm]."""
        return self.to_mm(self.limit)

    def to_mm(self, length: float) -> float:
        """A length in L as mm."""
        return length * self.band.length

    def from_mm(self, length: float) -> float:
        """A length in mm as a multiple of L."""
        return length / self.band.length

    @property
    def twisting_stiffness(self) -> float:
        """GJ [N mm^2]."""
        if self.young is None:
            raise ValueError("modulus: expected Young's modulus in GPa, which forces and moments need, got none")
        shear_modulus = 1000.0 * self.young / (2.0 * (1.0 + self.band.poisson))
        return self.band.torsion_factor * shear_modulus * self.band.width * self.band.thickness**3

    @property
    def force(self) -> float:
        """GJ/L^2 [N]: a force of the program times this is in N."""
        return self.twisting_stiffness / self.band.length**2

    @property
    def moment(self) -> float:
        """GJ/L [N mm]: a moment or an energy of the program times this is in N mm or mJ."""
        return self.twisting_stiffness / self.band.length

    @property
    def weight_newton(self) -> float:
        """Weight of the band between the clamps [N]."""
        if self.density is None:
            raise ValueError("density: expected kg/m^3, which the weight needs, got none")
        band = self.band
        return 1e-9 * self.density * STANDARD_GRAVITY * band.length * band.width * band.thickness

    @property
    def weight(self) -> float:
        r"""Weight in the unit of the program's forces, :math:`\rho g D t L^3/GJ` [GJ/L^2]: where it is not small
        against the forces of a state, gravity matters."""
        return self.weight_newton / self.force


@dataclass(frozen=True)
class ClampErrors:
    """How well clamps are set: angle in degrees, displacements in mm."""

    angle_deg: float = 1.0
    displacement: float = 0.5

    def __post_init__(self) -> None:
        below = math.nextafter(90.0, 0.0)
        check_number("angle error", self.angle_deg, 0.0, below, "degrees of at least 0 and below 90")
        check_number("displacement error", self.displacement, 0.0, LENGTHS[1], "a length in mm of at least 0")

    def of_shear(self, units: BandUnits) -> float:
        """Error of a measured shear [L]: that of the displacement."""
        return units.from_mm(self.displacement)

    def of_limit(self, units: BandUnits) -> float:
        r"""Error of the limiting shear [L] from that of the compression.

        .. math:: \left|\frac{\partial\Delta D_{max}}{\partial\Delta L}\right| = \frac{1-\Delta L}{\Delta D_{max} + w}
        """
        return units.from_mm(self.displacement) * (1.0 - units.compression) / (units.limit + units.band.aspect)

    def of_normalized(self, units: BandUnits, shear: float) -> float:
        """Error of shear/limiting shear, for a shear in L: both errors, independent of each other."""
        return math.hypot(self.of_shear(units), shear / units.limit * self.of_limit(units)) / units.limit
