r"""The rod of a section, with its weight and with curvature and twist that it has without load.

.. math:: \kappa_1 = \kappa_1^0 + M_1/a, \quad \kappa_2 = \kappa_2^0 + c_2 M_2, \quad \tau = \tau^0 + M_3,
          \qquad n' = -f

The weight is a dead load f per length, a vector in space; lengths are in units of the length of the rod, so that it is
also the weight of the whole [GJ/L^2]. The clamps are those of all rods, :class:`rodatlas.rods.Ends`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from rodatlas.continuation.checks import check_type
from rodatlas.rods.elastic import MOMENT, ElasticRod, elastic_rod, formulation_with
from rodatlas.rods.formulation import Formulation
from rodatlas.rods.law import LinearLaw, Rested
from rodatlas.rods.sections import Section
from rodatlas.rods.unknowns import CIRCLE, GRAVITY, REST, clamps_of, symmetries_of


def loaded_rod(section: Section | None = None) -> ElasticRod:
    """A rod between two clamps with a section, a weight, and natural curvature and twist.

    Parameters
    ----------
    section : tells the stiffnesses from the parameters nu and its proportion t/D (`thickness`
        of a rectangle, `flatness` of an ellipse); of a round one from nu alone. None:
        they are parameters themselves, a = EI1/GJ and c2 = GJ/EI2.

    Further parameters: `gravity_x`, `gravity_y`, `gravity_z`, the weight as a vector [GJ/L^2]; `rest_k1`, `rest_k2`,
    `rest_tau`, the strain without load [1/L]; and those of the clamps. The energy holds the potential of the weight:
    dE/d(gravity_i) = -int X_i ds, dE/d(rest_i) = -int M_i ds.

    Examples
    --------
    A rectangular rod 24 times as wide as thick, and the U state between clamps of 15 degrees as a first guess:

    >>> rod = loaded_rod(RECTANGLE)
    >>> parameters = rod.problem.parameters | Ends(15.0).parameters
    >>> start = RodState(state_at(Ends(15.0))).rewritten(rod.formulation, **parameters)
    """
    check_type("section", section, (Section, type(None)), "a Section such as RECTANGLE, or None")
    return _made(section)


@lru_cache(maxsize=8)
def _made(section: Section | None) -> ElasticRod:
    """The problem, traced once for each section."""
    parameters = _parameters(section)
    rod = elastic_rod(
        _law(section), clamps_of, parameters, load=_load, symmetries=symmetries_of(MOMENT, loaded=True),
        name=f"{section.name if section else 'given'} rod",
    )  # fmt: skip
    return ElasticRod(rod.problem, formulation_of(section))


@lru_cache(maxsize=8)
def formulation_of(section: Section | None) -> Formulation:
    """How solutions of :func:`loaded_rod` are read; the problem itself is not needed."""
    return formulation_with(_law(section), clamps_of, tuple(_parameters(section)), _load)


def _parameters(section: Section | None) -> dict[str, float]:
    """Names and default values."""
    if section is None:
        own = {"a": 0.625, "c2": 0.0}
    else:
        own = {"nu": 0.25, **({section.proportion: 0.0} if section.proportion else {})}
    return {**own, **dict.fromkeys(GRAVITY + REST, 0.0), **CIRCLE}


def _law(section: Section | None) -> Callable[[Any], Rested]:
    """The law at parameters by name."""

    def law(p: Any) -> Rested:
        if section is None:
            stiffness = (p.a, p.c2)
        else:
            stiffness = section.stiffness(p.nu, *([getattr(p, section.proportion)] if section.proportion else []))
        return Rested(LinearLaw(*stiffness), [getattr(p, name) for name in REST])

    return law


def _load(p: Any) -> list[Any]:
    """The weight."""
    return [getattr(p, name) for name in GRAVITY]
