"""The clamped band as a model: what of it can vary, how its states are told apart, and where its branches start."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from rodatlas.continuation import BVP, NotConverged, Solution
from rodatlas.continuation.checks import check_type
from rodatlas.model import Control, Invariant, Model, Quantity, Seed, Setting
from rodatlas.model.control import Limits, Range
from rodatlas.model.model import Keep, Source
from rodatlas.rods.band import EDGE, NARROW, bending_ratio, limiting_shear, near_limit
from rodatlas.rods.elastic import ElasticRod
from rodatlas.rods.ends import MOST_TWIST

if TYPE_CHECKING:
    from rodatlas.rods.formulation import Formulation
    from rodatlas.rods.state import RodState

REFERENCE_ANGLE_DEG, REFERENCE_COMPRESSION, REFERENCE_POISSON = 15.0, 0.5, 0.25
"""Where the twisted states are looked for: there both exist."""
SLOPE = 5000.0  # a bifurcation that two branches locate has the slope of the energy to about 0.01, others are 1e-8
INVERTED_UP_TO_DEG = 10.0
STEEPEST = 89.999999  # degrees


# -- controls ---------------------------------------------------------------------------------------------------------


def _limiting_shear(setting: Mapping[str, float]) -> float:
    return limiting_shear(setting["compression"], offset=setting.get("offset", 0.0))


def shear_limits(setting: Mapping[str, float]) -> Limits:
    """The shear at which the band is straight from clamp to clamp."""
    limit = _limiting_shear(setting)
    what = f"a number of size below {limit:.6f}, the limiting shear for compression {setting['compression']:g}"
    return Limits(-limit, limit, what)


def usual_shears(setting: Mapping[str, float]) -> Range:
    """-0.05 to 0.82 at dL = 1/2, and the same parts of the limiting shear at other compressions."""
    part = _limiting_shear(setting) / limiting_shear(REFERENCE_COMPRESSION)
    return -round(0.05 * part, 9), round(0.82 * part, 9)


def wide_shears(setting: Mapping[str, float]) -> Range:
    """-0.1 to 0.86 at dL = 1/2, and the same parts of the limiting shear at other compressions."""
    part = _limiting_shear(setting) / limiting_shear(REFERENCE_COMPRESSION)
    return -0.1 * part, 0.86 * part


def _compressions(setting: Mapping[str, float]) -> Limits:
    """Between the straight band and one whose clamps meet."""
    aside = math.hypot(setting.get("shear", 0.0), setting.get("offset", 0.0))
    least = 1.0 - math.sqrt(1.0 - min(aside, 1.0) ** 2)
    low = max(EDGE, least)
    what = f"a number between {'0' if least <= EDGE else f'{least:.6f}, at which the band is straight,'} and 1"
    return Limits(math.nextafter(low, 0.0), math.nextafter(1.0 - EDGE, 1.0), f"{what} (from {low:g} to {1.0 - EDGE:g})")


def _angles(setting: Mapping[str, float]) -> Limits:
    return Limits(math.nextafter(0.0, -1.0), math.nextafter(STEEPEST, 90.0), "degrees with 0 <= angle < 90")


def _twists(setting: Mapping[str, float]) -> Limits:
    what = f"degrees between -{MOST_TWIST:g} and {MOST_TWIST:g} (exclusive)"
    return Limits(-MOST_TWIST, MOST_TWIST, what)


def _turns(setting: Mapping[str, float]) -> Limits:
    return Limits(-180.0, 180.0, "degrees between -180 and 180 (exclusive)")


def _ratios(setting: Mapping[str, float]) -> Limits:
    return Limits(-1.0, math.nextafter(0.5, 1.0), "a number with -1 < nu <= 0.5")


def _offsets(setting: Mapping[str, float]) -> Limits:
    limit = math.sqrt(max(limiting_shear(setting["compression"]) ** 2 - setting.get("shear", 0.0) ** 2, 0.0))
    return Limits(-limit, limit, f"a number of size below {limit:.6f}, at which the band is straight")


CONTROLS = (  # in the order in which a state is carried to another setting
    Control("poisson", "a", r"\nu", 0.25, scale=2.0, origin=-1.0, limits=_ratios, usual=lambda at: (-0.5, 0.5),
            what="Poisson's ratio", short="nu"),
    Control("compression", "dL", r"\Delta L", 0.5, of="L", limits=_compressions, usual=lambda at: (0.02, 0.95),
            what="compression", meaning="dL, the clamps are 1 - dL apart along x", short="dL"),
    Control("angle", "psi0", r"\psi_0", 15.0, "deg", limits=_angles, usual=lambda at: (0.0, 85.0),
            wide=lambda at: (0.0, 80.0), what="clamp angle", meaning="psi0 of both clamps", short=""),
    Control("turn-left", "turn_left", r"\delta_0", 0.0, "deg", limits=_turns, usual=lambda at: (-30.0, 30.0),
            what="turn of the left clamp", meaning="added to the clamp angle"),
    Control("turn-right", "turn_right", r"\delta_1", 0.0, "deg", limits=_turns, usual=lambda at: (-30.0, 30.0),
            what="turn of the right clamp", meaning="added to the clamp angle"),
    Control("offset", "dY", r"\Delta Y", 0.0, of="L", limits=_offsets, usual=lambda at: (-0.3, 0.3),
            what="offset of the clamps", meaning="dY, by which the right one lies higher along y"),
    Control("twist", "twist_right", r"\chi", 0.0, "deg", limits=_twists, usual=lambda at: (-90.0, 90.0),
            what="twist of the right clamp", meaning="its turn about its tangent"),
    Control("shear", "dD", r"\Delta D", 0.0, of="L", limits=shear_limits, usual=usual_shears, wide=wide_shears,
            care=lambda value, at: near_limit(value, at["compression"], at.get("offset", 0.0)), what="shear",
            meaning="dD, by which the right clamp lies further along z", short="dD"),
    Control("angle-left", "turn_left", r"\psi_0", 15.0, "deg", added=("psi0",), limits=_turns,
            usual=lambda at: (-30.0, 60.0), what="angle of the left clamp", meaning="at which the band leaves it",
            derived=True),
    Control("angle-right", "turn_right", r"\psi_1", 15.0, "deg", added=("psi0",), limits=_turns,
            usual=lambda at: (-30.0, 60.0), what="angle of the right clamp",
            meaning="at which the band arrives, downward", derived=True),
)  # fmt: skip


# -- any rod ----------------------------------------------------------------------------------------------------------


def rod_model(
    name: str, rod: ElasticRod, controls: Sequence[Control], sources: Sequence[Source], *,
    pairing: Sequence[str] | None = None, width: float = 0.0, **more: Any,
) -> Model:  # fmt: skip
    """A rod of any law between any two clamps as a model of the atlas.

    Its height, energy and loads can be diagrams' ordinates, its stability is counted by conjugate points, and its
    states are told apart by height, energy and end force.

    Parameters
    ----------
    name : under which it is known.
    rod : problem and how it is read, see :func:`rodatlas.rods.elastic_rod`.
    controls : of its parameters, in the order in which states are carried; the last one varies along slices by default.
    sources : where branches start.
    pairing : symmetries of the problem that pair states; those that change no parameter by default.
    width : over the length, for drawings and the test for self-contact.
    more : further fields of :class:`rodatlas.model.Model`.

    Examples
    --------
    See `examples/models/softening_rod.py`, which brings a law of its own.
    """
    check_type("rod", rod, ElasticRod, "an ElasticRod, see elastic_rod")
    pairs = None if pairing is None else tuple(pairing)
    problem, reader = rod
    return model_of_rod(
        name, lambda: problem, lambda: reader, tuple(controls), tuple(sources), pairing=pairs, width=width, **more
    )


def model_of_rod(
    name: str, build: Callable[[], BVP], reader: Callable[[], Formulation | None], controls: tuple[Control, ...],
    sources: tuple[Source, ...], **more: Any,
) -> Model:  # fmt: skip
    """A model of a rod whose problem and reader are made when they are needed."""

    def read(solution: Solution) -> RodState:
        from rodatlas.rods.state import RodState

        return RodState(solution, reader())

    def index(solution: Solution) -> int | None:
        from rodatlas.rods.stability import index_of

        count = index_of(solution, formulation=reader()).index
        return count if count >= 0 else None

    return Model(name, build, controls, _quantities(read), sources, index=index, invariants=INVARIANTS, ribbon=read,
                 order=("energy", "end_force_z"), **more)  # fmt: skip


def _quantities(read: Callable[[Solution], RodState]) -> tuple[Quantity, ...]:
    """What diagrams of a rod can be drawn against; loads are those at the clamp that is meant to move: the shear moves
    the left one, all else the right one. Without weight the force is the same in both."""

    def load(field: str, axis: int, end: int = -1) -> Callable[[Solution], float]:
        return lambda solution: float(getattr(read(solution), field)[end, axis])

    return (
        Quantity.of("height", r"h=\int y\,\mathrm{d}s", "L", "height"),
        Quantity.of("energy", "E", "GJ/L", "energy"),
        Quantity("force-x", "n_x", load("force", 0), "GJ/L^2", what="force along the chord", conjugate="compression",
                 work=-1.0),
        Quantity("force-y", "n_y", load("force", 1), "GJ/L^2", what="force across the clamp plane", conjugate="offset"),
        Quantity("force-z", "n_z", load("force", 2, 0), "GJ/L^2", what="lateral force at the left clamp",
                 conjugate="shear"),
        Quantity("moment-x", "m_x", load("moment", 0), "GJ/L", what="moment at the right clamp about x"),
        Quantity("moment-y", "m_y", load("moment", 1), "GJ/L", what="moment at the right clamp about y"),
        Quantity("moment-z", "m_z", load("moment", 2), "GJ/L", what="moment at the right clamp about z"),
    )


INVARIANTS = (Invariant("height"), Invariant("energy", relative=True), Invariant("end_force_z", SLOPE, relative=True))
"""The slope dE/d(dD) tells a state without shear from its image in the shear mirror, which has all else in common."""


def _band_problem() -> BVP:
    from rodatlas.rods.perfectly_anisotropic import rod_problem

    return rod_problem()


def _sign(solution: Solution) -> str:
    from rodatlas.rods.symmetry import pair_member

    return pair_member(solution)


# -- where branches start ---------------------------------------------------------------------------------------------


def planar_seeds(setting: Setting, tolerance: float, keep: Keep) -> tuple[list[Seed], list[str]]:
    """U, W and the third mode (M3) between equal clamps without shear, and a warning for what is missing.

    At psi0 = 0 the angle mirror maps the slice to itself: U to W, and the third mode to another one (M3i). Near it the
    branch of M3i still resembles that of M3 upside down, with wi for w; far from it nothing on it is stable.
    """
    return planar_seeds_of(bending_ratio(setting["poisson"]), setting, tolerance)


def planar_seeds_of(a: float, setting: Setting, tolerance: float) -> tuple[list[Seed], list[str]]:
    """Those seeds for a ratio a = EI1/GJ: planar states do not know how a rod bends about its normal."""
    from rodatlas.rods.planar import inverted_third_mode, planar_states

    angle = math.radians(setting["angle"])
    states, missing = planar_states(a, angle, setting["compression"], tolerance)
    names = {"U": "U", "W": "W", "third mode": "M3"}
    seeds = [Seed(names[family], solution) for family, solution in states.items()]
    if setting["angle"] <= INVERTED_UP_TO_DEG and "third mode" in states:
        inverted = inverted_third_mode(states["third mode"], tolerance)
        seeds += [Seed("M3i", inverted)] if inverted is not None else []
    return seeds, [f"planar states not reached: {missing}"] if missing else []


def twisted_seeds(setting: Setting, tolerance: float, keep: Keep) -> tuple[list[Seed], list[str]]:
    """States without shear on the closed loops of TU and TW, at a reference setting where both exist; and warnings.

    The loops are followed in shear to more states without shear.
    """
    from rodatlas.rods.loops import half_loop, without_shear
    from rodatlas.rods.twisted import twisted_states

    angle, a = math.radians(REFERENCE_ANGLE_DEG), bending_ratio(REFERENCE_POISSON)
    states, missing = twisted_states(a, angle, REFERENCE_COMPRESSION, tolerance)
    warnings = [f"twisted states not reached: {missing}"] if missing else []
    seeds: list[Seed] = []
    for name, state in states.items():
        try:
            loop = keep(f"loop-{name}", lambda state=state: half_loop(state))  # type: ignore[misc]
        except NotConverged as error:
            warnings.append(f"loop of {name}: {error}")
            continue
        on_loop = [state, *without_shear(loop, tolerance)]
        seeds += [Seed(name if k == 0 else f"{name}-{k + 1}", one) for k, one in enumerate(on_loop)]
    return seeds, warnings


@lru_cache(maxsize=1)
def clamped_band() -> Model:
    """The perfectly anisotropic rod between two clamps, without names for its states.

    Controls: Poisson's ratio, compression, clamp angle, turns of each clamp, offset, twist and shear. See
    :func:`rodatlas.rods.rod_problem` for the equations.

    Examples
    --------
    >>> clamped_band().setting(angle=20.0, compression=0.4)["shear"]
    0.0
    """
    return model_of_rod(
        "clamped band", _band_problem, lambda: None, CONTROLS,
        (Source("planar states", planar_seeds), Source("twisted states", twisted_seeds)),
        pairing=("reversal",), sign=_sign, width=NARROW,
    )  # fmt: skip
