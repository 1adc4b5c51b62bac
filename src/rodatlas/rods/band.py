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


def ratio_from_text(text: str, field: str = "width") -> float:
    """Width over length from '1/80' or '0.0125'."""
    what = "the width over the length, such as 1/80 or 0.0125"
    top, bar, bottom = text.partition("/")
    try:
        value = float(top) / (float(bottom) if bar else 1.0)
    except (ValueError, ZeroDivisionError):
        raise ValueError(f"{field}: expected {what}, got '{text}'") from None
    return check_between(field, value, 0.0, 10.0, what)


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

    @classmethod
    def from_text(cls, text: str, poisson: float = 0.25, field: str = "band") -> Band:
        """A band from '240x3x0.127': length, width and thickness."""
        parts = text.lower().replace("×", "x").removesuffix("mm").split("x")
        try:
            length, width, thickness = (float(part) for part in parts)
        except ValueError:
            what = "LENGTHxWIDTHxTHICKNESS in mm such as 240x3x0.127"
            raise ValueError(f"{field}: expected {what}, got '{text}'") from None
        return cls(length, width, thickness, poisson)

    @property
    def width_parameter(self) -> float:
        """beta = D^2/(t L): the width over the length sqrt(t L) across which bending curls an edge, squared."""
        return self.width**2 / (self.thickness * self.length)

    @property
    def torsion_factor(self) -> float:
        """lambda(D/t) of the rectangular section, see :func:`torsion_factor`."""
        return torsion_factor(self.width / self.thickness)

    @property
    def a(self) -> float:
        """Bending over twisting stiffness EI1/GJ of the thin band, (1 + nu)/2."""
        return bending_ratio(self.poisson)


def torsion_factor(ratio: float) -> float:
    r"""Torsion constant over D t^3 of a rectangle with sides D and t, ratio = D/t.

    .. math:: \lambda = \frac13\Big(1 - \frac{192}{\pi^5}\frac{t}{D}
              \sum_{n=1,3,\dots}\frac{1}{n^5}\tanh\frac{n\pi D}{2t}\Big)

    1/3 for a thin section, 0.1406 for a square (Saint-Venant 1855; Timoshenko & Goodier 1970, section 109).
    """
    terms = (math.tanh(0.5 * n * math.pi * ratio) / n**5 for n in range(1, 400, 2))
    return (1.0 - 192.0 / (math.pi**5 * ratio) * math.fsum(terms)) / 3.0


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


NEAR_LIMIT = 0.95
"""Part of the limiting shear beyond which results want care. |N| grows as 1/slack^2 and passes 2500 [GJ/L^2] there (30
degrees, dL = 0.3 and 0.5). Of 128 bands that a search starts at dL = 0.5, 80 still converge at 0.95 of the limit, but
at 0.96 collocation no longer confirms US+-, at 0.98 no state at all, and at 0.99 none converges. The default range of a
slice ends at 0.947."""


def near_limit(shear: float, compression: float) -> str:
    """A warning for a shear beyond `NEAR_LIMIT` of the limiting shear; '' for any other."""
    limit = limiting_shear(compression)
    part = abs(shear) / limit
    if part <= NEAR_LIMIT:
        return ""
    return (
        f"limiting shear: {shear:g} is {part:.3f} of the limiting shear {limit:.6f}; beyond {NEAR_LIMIT:g} of it "
        "forces grow without bound, searches miss states, and what is followed is ill-conditioned"
    )
