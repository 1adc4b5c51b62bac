"""What the rod is made of: dimensions, Poisson's ratio, and the stiffness ratio that enters the equations."""

from __future__ import annotations

import math
from dataclasses import dataclass


def check_number(field: str, value: object, low: float, high: float, what: str) -> float:
    """A finite float in [low, high], or a ValueError that names the field, what was expected and what came."""
    try:
        number = math.nan if isinstance(value, str) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and low <= number <= high):
        raise ValueError(f"{field}: expected {what}, got {repr(value) if isinstance(value, str) else value}")
    return number


def check_between(field: str, value: object, low: float, high: float, what: str) -> float:
    """As :func:`check_number`, with the bounds themselves left out."""
    return check_number(field, value, math.nextafter(low, high), math.nextafter(high, low), what)


def check_poisson(value: object) -> float:
    """Poisson's ratio of an isotropic solid, -1 < nu <= 1/2."""
    return check_number("poisson", value, math.nextafter(-1.0, 0.0), 0.5, "a number with -1 < nu <= 0.5")


@dataclass(frozen=True)
class Band:
    """A thin straight band.

    Attributes
    ----------
    length, width, thickness : in one unit of length, any; only their ratios enter.
    poisson : Poisson's ratio.

    Notes
    -----
    Everywhere else lengths are in units of the length L, moments in GJ/L, forces in GJ/L^2, energies in GJ/L.
    """

    length: float = 240.0
    width: float = 3.0
    thickness: float = 0.127
    poisson: float = 0.25

    def __post_init__(self) -> None:
        for field in ("length", "width", "thickness"):
            check_between(f"band {field}", getattr(self, field), 0.0, math.inf, "a positive length")
        check_poisson(self.poisson)

    @property
    def aspect(self) -> float:
        """Width over length, w = D/L."""
        return self.width / self.length

    @property
    def a(self) -> float:
        """Bending over twisting stiffness EI1/GJ of the thin band, (1 + nu)/2."""
        return bending_ratio(self.poisson)


def bending_ratio(poisson: float) -> float:
    r"""EI1/GJ = (1 + nu)/(6 lambda) with lambda = 1/3, the thin limit of the torsion constant
    (Saint-Venant 1855; Timoshenko & Goodier 1970, section 109): (1 + nu)/2."""
    return (1.0 + check_poisson(poisson)) / 2.0


def limiting_shear(compression: float, aspect: float = 0.0) -> float:
    r"""Largest shear without stretching, :math:`\sqrt{1 + w^2 - (1-\Delta L)^2} - w` with w = D/L.

    There a diagonal of the flat band is straight between opposite corners of the clamps.

    Parameters
    ----------
    compression : dL. aspect : w; 0 for a rod.
    """
    return math.sqrt(1.0 + aspect**2 - (1.0 - compression) ** 2) - aspect
