"""Rods of a section between two clamps as models: with a weight, and with curvature and twist at rest.

Their branches start at the planar states, which every section has, and at the twisted ones of the thin band, from where
they are carried control by control to a setting.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import WrongInput
from rodatlas.model import Control, Model, Seed, Setting, Source
from rodatlas.model.control import Limits
from rodatlas.model.model import Keep
from rodatlas.rods.band import NARROW, number_from_text
from rodatlas.rods.elastic import ElasticRod
from rodatlas.rods.loaded import loaded_rod
from rodatlas.rods.model import (
    CONTROLS,
    REFERENCE_ANGLE_DEG,
    REFERENCE_COMPRESSION,
    model_of_rod,
    planar_seeds_of,
    twisted_seeds,
)
from rodatlas.rods.sections import CIRCLE_SECTION, ELLIPSE, RECTANGLE, Section
from rodatlas.rods.unknowns import GRAVITY, REST

MOST_WEIGHT, MOST_REST = 1e4, 1e3
SOFTEST, STIFFEST = 1e-3, 1e9  # of stiffnesses in units of GJ
ALIKE = 1e-9  # of a c2 = EI1/EI2, from 1
CONTINUUM = (
    "planar states: between clamps at angle 0 a rod that bends alike to all sides is turned about the chord at will "
    "where it has no shear and no load; nothing is started from this continuum yet: take another angle"
)
STRAIGHT = ("turn-left", "turn-right", "offset", "twist")
WEIGHT = ("gravity-x", "gravity-y", "gravity-z")
AT_REST = ("rest-k1", "rest-k2", "rest-twist")


def _thicknesses(setting: Mapping[str, float]) -> Limits:
    return Limits(math.nextafter(0.0, -1.0), math.nextafter(1.0, 2.0), "a number from 0, the thin band, to 1")


def _weights(setting: Mapping[str, float]) -> Limits:
    return Limits(-MOST_WEIGHT, MOST_WEIGHT, f"a number of size below {MOST_WEIGHT:g}")


def _rests(setting: Mapping[str, float]) -> Limits:
    return Limits(-MOST_REST, MOST_REST, f"a number of size below {MOST_REST:g}")


def _positive(setting: Mapping[str, float]) -> Limits:
    return Limits(0.0, math.inf, "a positive number")


def _not_negative(setting: Mapping[str, float]) -> Limits:
    return Limits(math.nextafter(0.0, -1.0), math.inf, "0, for a band that bends one way only, or a positive number")


POISSON = replace(CONTROLS[0], parameter="nu", scale=1.0, origin=0.0)
THICKNESS = Control("thickness", "thickness", "t/D", 0.0, limits=_thicknesses, usual=lambda at: (0.0, 1.0),
                    what="thickness over width", short="tD")  # fmt: skip
GIVEN = (
    Control("a", "a", "a", 0.625, limits=_positive, usual=lambda at: (0.5, 1.5), what="bending over twisting stiffness",
            meaning="EI1/GJ about the width", short="a"),
    Control("c2", "c2", "c_2", 0.0, limits=_not_negative, usual=lambda at: (0.0, 1.0),
            what="twisting over bending stiffness", meaning="GJ/EI2 about the normal", short="c2"),
)  # fmt: skip
LOADS = (
    *(Control(name, parameter, f"g_{name[-1]}", 0.0, limits=_weights, usual=lambda at: (-20.0, 20.0),
              what=f"weight along {name[-1]}", meaning="of the whole rod [GJ/L^2]")
      for name, parameter in zip(WEIGHT, GRAVITY, strict=True)),
    *(Control(name, parameter, symbol, 0.0, limits=_rests, usual=lambda at: (-5.0, 5.0), what=what,
              meaning="without load [1/L]")
      for name, parameter, symbol, what in zip(
          AT_REST, REST, (r"\kappa_1^0", r"\kappa_2^0", r"\tau^0"),
          ("curvature about the width", "curvature about the normal", "twist"), strict=True)),
)  # fmt: skip


def _model(name: str, section: Section | None, own: Sequence[Control]) -> Model:
    """A rod whose stiffnesses follow from the controls `own`."""
    held = {c.name: c for c in CONTROLS}
    clamps = [c for c in CONTROLS if c.name not in ("poisson", "shear") and not c.derived]
    controls = (*own, *clamps, *LOADS, held["shear"], *(c for c in CONTROLS if c.derived))
    bare = {c.name: 0.0 for c in (*LOADS, held["shear"])} | dict.fromkeys(STRAIGHT, 0.0)

    def rewritten(seeds: Sequence[Seed], setting: Mapping[str, float]) -> list[Seed]:
        """States of the thin band in the unknowns of the rod, at a setting."""
        return [Seed(seed.name, _rewritten(seed.solution, loaded_rod(section), own, setting)) for seed in seeds]

    def planar(setting: Setting, tolerance: float, keep: Keep) -> tuple[list[Seed], list[str]]:
        at = setting.replace(**bare)
        raw = {c.parameter: c.raw(at[c.name], {}) for c in own}
        a, c2 = (raw["a"], raw["c2"]) if section is None else section.stiffness(*raw.values())
        if abs(a * c2 - 1.0) < ALIKE and at["angle"] == 0.0:
            return [], [CONTINUUM]
        seeds, warnings = planar_seeds_of(float(a), at, tolerance)
        return rewritten(seeds, at), warnings

    def twisted(setting: Setting, tolerance: float, keep: Keep) -> tuple[list[Seed], list[str]]:
        seeds, warnings = twisted_seeds(setting, tolerance, keep)
        return rewritten(seeds, {c.name: c.default for c in own}), warnings

    def references(setting: Setting, along: str) -> list[Setting]:
        """The clamps of the paper and no load, at this angle and at that where twisted states are known."""
        if along != "shear":
            return []
        plain = setting.replace(**{name: value for name, value in bare.items() if name in setting})
        at_angle = plain.replace(angle=REFERENCE_ANGLE_DEG)
        return [plain, at_angle, at_angle.replace(compression=REFERENCE_COMPRESSION)]

    sources = [Source("planar states", planar)]
    if section is None or section.proportion:
        sources.append(Source("twisted states", twisted))
    return model_of_rod(
        name, lambda: loaded_rod(section).problem, lambda: loaded_rod(section).formulation, controls, tuple(sources),
        pairing=("reversal",), width=NARROW, references=references, groups={"gravity": WEIGHT, "rest": AT_REST},
    )  # fmt: skip


def _rewritten(state: Solution, rod: ElasticRod, own: Sequence[Control], setting: Mapping[str, float]) -> Solution:
    from rodatlas.rods.state import RodState

    there = dict(rod.problem.parameters) | {c.parameter: c.raw(setting[c.name], {}) for c in own}
    there |= {name: state[name] for name in ("psi0", "dL", "dD")}
    return RodState(state).rewritten(rod.formulation, **there)


SECTIONS = "rectangle:D/t, square, ellipse:D/t, circle, tube, a:NUMBER or a:NUMBER,b:NUMBER"


def model_of_section(text: str) -> tuple[str, dict[str, float]]:
    """The name of a model, and the values of its controls, from a section in words.

    Parameters
    ----------
    text : 'rectangle:23.6' and 'ellipse:3' with width over thickness, at least 1; 'square', 'circle', 'tube'; 'a:0.7'
        and 'a:0.7,b:18' with EI1/GJ and EI2/GJ, the latter infinite where it is left out.

    Raises
    ------
    ValueError
        for other words or numbers.

    Examples
    --------
    >>> model_of_section("rectangle:4")
    ('rod', {'thickness': 0.25})
    """
    wrong = WrongInput("section", f"expected {SECTIONS}, got '{text[:100]}'")
    kind, colon, rest = text.strip().partition(":")
    if kind in ("square", "circle", "tube") and not colon:
        return ("rod", {"thickness": 1.0}) if kind == "square" else ("round-rod", {})
    try:
        if kind in ("rectangle", "ellipse"):
            ratio = number_from_text(rest)
            if not 1.0 <= ratio < math.inf:
                raise wrong
            return ("rod" if kind == "rectangle" else "elliptic-rod"), {"thickness": 1.0 / ratio}
        pairs = [part.partition(":") for part in text.strip().split(",")]
        given = {name.strip(): number_from_text(value) for name, _, value in pairs}
    except ValueError:
        raise wrong from None
    if not {"a"} <= set(given) <= {"a", "b"} or len(given) < len(pairs):
        raise wrong
    if not all(SOFTEST <= value <= STIFFEST for value in given.values()):
        raise WrongInput("section", f"expected a and b from {SOFTEST:g} to {STIFFEST:g}, got '{text[:100]}'")
    return "given-rod", {"a": given["a"], "c2": 1.0 / given["b"] if "b" in given else 0.0}


@lru_cache(maxsize=1)
def rectangular_rod() -> Model:
    """The model 'rod': a rectangle, D wide and t thick; the thin band where t/D is 0.

    Examples
    --------
    >>> SliceSettings.of(model_named("rod"), thickness=1 / 23.6, angle=15.0)
    """
    return _model("rod", RECTANGLE, (POISSON, THICKNESS))


@lru_cache(maxsize=1)
def elliptic_rod() -> Model:
    """The model 'elliptic-rod'."""
    return _model("elliptic-rod", ELLIPSE, (POISSON, replace(THICKNESS, parameter="flatness")))


@lru_cache(maxsize=1)
def round_rod() -> Model:
    """The model 'round-rod': a circle or a circular tube, a = b = 1 + nu."""
    return _model("round-rod", CIRCLE_SECTION, (POISSON,))


@lru_cache(maxsize=1)
def given_rod() -> Model:
    """The model 'given-rod': stiffnesses as they are given."""
    return _model("given-rod", None, GIVEN)
