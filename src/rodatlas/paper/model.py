"""The band of the paper as the atlas is given it: the clamped band, its search, and the paper's names and numbers."""

from __future__ import annotations

import math
from dataclasses import replace

from rodatlas.atlas.loci.settings import LociSettings
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_number
from rodatlas.model import Model, Setting, register
from rodatlas.paper.names.yu_hanna import EQUAL, YuHanna
from rodatlas.progress import Progress, silent
from rodatlas.rods.ends import Ends
from rodatlas.rods.model import REFERENCE_ANGLE_DEG, REFERENCE_COMPRESSION, clamped_band, shear_limits, usual_shears
from rodatlas.states.discover import find_states
from rodatlas.states.result import Discovery
from rodatlas.states.winding import is_wound, twist

WOUND = math.pi  # a band with more twist, int tau ds [rad], belongs to the families of wound-up states
LEAST_SHEAR_MAX = 1e-3  # at dL = 1/2 and above; the same part of the limiting shear below


def ends_at(setting: Setting) -> Ends:
    """The ends of a setting of the band."""
    left, right = (setting["angle"] + setting.get(name, 0.0) for name in ("turn-left", "turn-right"))
    others = (setting[name] for name in ("compression", "shear"))
    further = (setting.get(name, 0.0) for name in ("offset", "twist"))
    if left == right:
        return Ends(left, *others, *further)
    return Ends.unequal(left, right, *others, *further)


class BandSearch:
    """Stable states of the first class, by relaxed random bands and shooting."""

    names = True

    def stable_states(self, setting: Setting, starts: int, seed: int, tolerance: float) -> tuple[Solution, ...]:
        """The member + of each pair."""
        found = self.discover(setting, starts, tolerance, silent, seed).states
        return tuple(s.solution for s in found if s.stable and s.pair != "-")

    def discover(
        self, setting: Setting, starts: int | None, tolerance: float, progress: Progress | None, seed: int = 1
    ) -> Discovery:
        """Stable states with their names; without `starts` until the search looks complete."""
        found = find_states(
            ends_at(setting), setting["poisson"], "+", starts, stable_only=True, tolerance=tolerance, seed=seed,
            progress=progress,
        )  # fmt: skip
        # the same clamps may be told by other parameters: those of the setting are wanted
        wanted = band().parameters(setting)
        return replace(found, states=tuple(
            replace(s, solution=s.solution.with_parameters(**wanted)) for s in found.states
        ))  # fmt: skip

    def starts_branch(self, solution: Solution) -> bool:
        """Unless it is wound up."""
        return abs(twist(solution)) < WOUND

    def meets(self, solution: Solution) -> bool:
        """Unless it is wound up."""
        return not is_wound(solution, "+")


def _references(setting: Setting, along: str) -> list[Setting]:
    """At 15 degrees, at this compression and at 1/2: there everything that the paper names is connected."""
    if along != "shear" or any(setting.get(name, 0.0) != 0.0 for name in EQUAL):
        return []
    at_angle = setting.replace(angle=REFERENCE_ANGLE_DEG)
    return [at_angle, at_angle.replace(compression=REFERENCE_COMPRESSION)]


@register
def band() -> Model:
    """The model 'band': all that the atlas knows of the band of Yu and Hanna."""
    bare = clamped_band()
    return replace(bare, name="band", references=_references, search=BandSearch(), nomenclature=YuHanna(bare))


def band_slice(
    angle_deg: float, compression: float = 0.5, poisson: float = 0.25, shear_max: float | None = None,
    shear_min: float | None = None, tolerance: float = 1e-8, search: int = 256,
) -> SliceSettings:  # fmt: skip
    """Settings of a slice of the band of the paper: the shear varies, all else is fixed.

    Parameters
    ----------
    angle_deg : clamp angle psi0 in degrees, 0 <= psi0 < 90.
    compression : dL, between 0 and 1.
    poisson : Poisson's ratio, -1 < nu <= 0.5.
    shear_max, shear_min : range of dD, around 0 and inside the limiting shear; by default 0.9469 and -0.0577 of that.
    tolerance, search : as for :class:`rodatlas.atlas.SliceSettings`.

    Examples
    --------
    >>> found = compute_slice(band_slice(15.0))
    """
    fixed = band().setting(poisson=poisson, compression=compression, angle=angle_deg)
    low, high = shear_range(fixed, shear_max, shear_min)
    return SliceSettings.of(band(), low=low, high=high, tolerance=tolerance, search=search, poisson=poisson,
                            compression=compression, angle=angle_deg)  # fmt: skip


def shear_range(
    setting: Setting, shear_max: float | None = None, shear_min: float | None = None
) -> tuple[float, float]:  # fmt: skip
    """Least and largest shear of a slice around zero, inside the limiting shear; the usual ones by default.

    Raises
    ------
    ValueError
        for an end on the wrong side of zero, or beyond the limiting shear.
    """
    compression = setting["compression"]
    limit, usual = shear_limits(setting).high, usual_shears(setting)
    below, least = math.nextafter(limit, 0.0), LEAST_SHEAR_MAX * min(1.0, limit / math.sqrt(0.75))
    if shear_max is not None:
        check_number(
            "shear-max", shear_max, least, below,
            f"a number from {least:g} to below {limit:.6f}, the limiting shear for compression {compression:g}",
        )  # fmt: skip
    if shear_min is not None:
        check_number("shear-min", shear_min, -below, 0.0, f"a number between -{limit:.6f} and 0 (included)")
    return (usual[0] if shear_min is None else shear_min), (usual[1] if shear_max is None else shear_max)


def band_loci(
    compression: float = 0.5, poisson: float = 0.25, angle_max: float = 80.0, tolerance: float = 1e-8
) -> LociSettings:
    """Settings of the loci of the band of the paper, in angle and shear.

    Parameters
    ----------
    compression, poisson, tolerance : as for :func:`band_slice`.
    angle_max : largest clamp angle in degrees; the smallest is zero.
    """
    check_angle_max(angle_max)
    return LociSettings.of(band(), second_high=angle_max, compression=compression, poisson=poisson, tolerance=tolerance)


def check_angle_max(angle_max: float) -> None:
    """ValueError for a largest clamp angle of loci that the first slice, at 15 degrees, lies beyond."""
    check_number("angle-max", angle_max, REFERENCE_ANGLE_DEG, 89.999999, "degrees with 15 <= angle-max < 90")


def band_phase(
    compression: float = 0.5, poisson: float = 0.25, angle_min: float = 0.0, angle_max: float = 80.0,
    tolerance: float = 1e-8,
) -> PhaseSettings:  # fmt: skip
    """Settings of the plane of angle and shear of the band of the paper, or of a window of it.

    Parameters
    ----------
    compression, poisson, tolerance : as for :func:`band_slice`.
    angle_min, angle_max : range of the clamp angle in degrees; loci are followed from 0 to 80 degrees at least.
    """
    whole = PhaseSettings.of(band(), compression=compression, poisson=poisson, tolerance=tolerance)
    return angle_window(whole, angle_min, angle_max)


def angle_window(whole: PhaseSettings, angle_min: float | None, angle_max: float | None) -> PhaseSettings:
    """A part of a plane of the clamp angle, or one that goes on to larger angles than the usual 80 degrees.

    Parameters
    ----------
    whole : the plane over the usual angles. angle_min, angle_max : in degrees; None for those of the plane.
    """
    low = whole.second_low if angle_min is None else angle_min
    check_number("angle-min", low, 0.0, 89.0, "degrees with 0 <= angle-min <= 89")
    high, least = whole.second_high if angle_max is None else angle_max, low + 0.01
    check_number("angle-max", high, least, 89.999999, f"degrees with {least:g} <= angle-max < 90")
    return replace(whole, second_low=low, second_high=high, loci_high=max(high, whole.second_high))
