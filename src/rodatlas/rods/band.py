"""What the rod is made of: dimensions, Poisson's ratio, and the stiffness ratio that enters the equations."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rodatlas.continuation.checks import WrongInput
from rodatlas.continuation.checks import check_between as check_between
from rodatlas.continuation.checks import check_number as check_number
from rodatlas.continuation.checks import check_whole as check_whole

LENGTHS = (1e-6, 1e9)  # of a band, in any unit: in mm from a nanometer to a thousand kilometers
THINNEST = 1e-9  # thickness over length
EDGE = 1e-6  # how near a compression may come to 0 and to 1: nearer, round-off decides the clamps
WIDEST = 1.0  # width over length
NARROW = 1.0 / 80.0
"""Width over length of the narrow band of Yu and Hanna: that of drawings and of the test for self-contact."""


def check_poisson(value: object) -> float:
    """Poisson's ratio of an isotropic solid, -1 < nu <= 1/2."""
    return check_number("poisson", value, math.nextafter(-1.0, 0.0), 0.5, "a number with -1 < nu <= 0.5")


def check_compression(value: object) -> float:
    """Compression dL, between 0 and 1."""
    what = f"a number between 0 and 1 (from {EDGE:g} to {1.0 - EDGE:g})"
    return check_number("compression", value, EDGE, 1.0 - EDGE, what)


def number_from_text(text: str) -> float:
    """A number as everybody writes it: not 1_000, nor digits of other scripts, both of which Python reads.

    Raises
    ------
    ValueError
        without a message of its own.
    """
    if not text.isascii() or "_" in text:
        raise ValueError
    return float(text)


def ratio_from_text(text: str, field: str = "width") -> float:
    """Width over length from '1/80' or '0.0125'."""
    what = f"the width over the length, at most {WIDEST:g}, such as 1/80 or 0.0125"
    top, bar, bottom = text.partition("/")
    try:
        value = number_from_text(top) / (number_from_text(bottom) if bar else 1.0)
    except (ValueError, ZeroDivisionError):
        raise WrongInput(field, f"expected {what}, got '{text}'") from None
    return check_number(field, value, THINNEST, WIDEST, what)


@dataclass(frozen=True)
class Band:
    """A thin straight band.

    Attributes
    ----------
    length, width, thickness : in one unit of length, any; only their ratios enter. The thickness is at most the width,
        and the width at most the length.
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
        least, most = LENGTHS
        check_number("band length", self.length, least, most, f"a positive length from {least:g} to {most:g}")
        widest, thinnest = WIDEST * self.length, THINNEST * self.length
        for field, high, of in (("width", widest, "length"), ("thickness", self.width, "width")):
            what = f"a positive length from {thinnest:g} to the {of}, {high:g}"
            check_number(f"band {field}", getattr(self, field), thinnest, high, what)
        check_poisson(self.poisson)

    @property
    def aspect(self) -> float:
        """Width over length, w = D/L."""
        return self.width / self.length

    @classmethod
    def from_text(cls, text: str, poisson: float = 0.25, field: str = "band") -> Band:
        """A band from '240x3x0.127': length, width and thickness."""
        parts = text.strip().lower().replace("×", "x").removesuffix("mm").split("x")
        try:
            length, width, thickness = (number_from_text(part) for part in parts)
        except ValueError:
            what = "LENGTHxWIDTHxTHICKNESS in mm such as 240x3x0.127"
            raise WrongInput(field, f"expected {what}, got '{text}'") from None
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


def check_setting(a: object, angle: object, compression: object) -> None:
    """Raise ValueError unless a > 0, psi0 is finite (radians) and 0 < dL < 1."""
    check_between("a", a, 0.0, math.inf, "a positive EI1/GJ")
    check_number("angle", angle, -math.inf, math.inf, "a finite number of radians")
    check_between("compression", compression, 0.0, 1.0, "a number between 0 and 1 (exclusive)")


def limiting_shear(compression: float, aspect: float = 0.0, offset: float = 0.0) -> float:
    r"""Largest shear without stretching, :math:`\sqrt{1 + w^2 - (1-\Delta L)^2 - \Delta Y^2} - w` with w = D/L.

    There a diagonal of the flat band is straight between opposite corners of the clamps. Of a rod (w = 0) it is the
    shear at which the ends are a length apart.

    Parameters
    ----------
    compression : dL. aspect : w; 0 for a rod. offset : dY, of the right clamp along y.

    Raises
    ------
    ValueError
        unless 0 <= dL <= 1, w >= 0, and the offset alone does not stretch the band.
    """
    check_number("compression", compression, 0.0, 1.0, "a number from 0 to 1")
    check_number("aspect", aspect, 0.0, math.inf, "a number of at least 0")
    most = limiting_offset(compression)
    check_number("offset", offset, -most, most, f"a number of size up to {most:.6f}, where the band is straight")
    return math.sqrt(max(0.0, 1.0 + aspect**2 - (1.0 - compression) ** 2 - offset**2)) - aspect  # 0: round-off


def limiting_offset(compression: float) -> float:
    r"""Largest offset dY without stretching and without shear, :math:`\sqrt{1 - (1-\Delta L)^2}`."""
    return math.sqrt(1.0 - (1.0 - compression) ** 2)


NEAR_LIMIT = 0.95
"""Part of the limiting shear beyond which results want care. |N| grows as 1/slack^2 and passes 2500 [GJ/L^2] there (30
degrees, dL = 0.3 and 0.5). Of 128 bands that a search starts at dL = 0.5, 80 still converge at 0.95 of the limit, but
at 0.96 collocation no longer confirms US+-, at 0.98 no state at all, and at 0.99 none converges. The default range of a
slice ends at 0.947."""


def part_of_limit(shear: float, compression: float, offset: float = 0.0) -> float:
    """Size of the displacement across x, shear and offset together, as a part of that at which the band is straight."""
    return math.hypot(shear, offset) / limiting_shear(compression)


def near_limit(shear: float, compression: float, offset: float = 0.0) -> str:
    """A warning for a shear, or shear and offset, beyond `NEAR_LIMIT` of what is possible; '' for any other."""
    limit, part = limiting_shear(compression), part_of_limit(shear, compression, offset)
    if part <= NEAR_LIMIT:
        return ""
    what = f"{shear:g}" if offset == 0.0 else f"{shear:g} with the offset {offset:g}"
    return (
        f"limiting shear: {what} is {part:.3f} of the limiting shear {limit:.6f}; beyond {NEAR_LIMIT:g} of it "
        "forces grow without bound, searches miss states, and what is followed is ill-conditioned"
    )
