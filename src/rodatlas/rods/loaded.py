r"""The rod of a section, with its weight and with curvature and twist that it has without load.

.. math:: \kappa_1 = \kappa_1^0 + M_1/a, \quad \kappa_2 = \kappa_2^0 + c_2 M_2, \quad \tau = \tau^0 + M_3,
          \qquad n' = -f

The weight is a dead load f per length, a vector in space; lengths are in units of the length of the rod, so that it is
also the weight of the whole [GJ/L^2]. The clamps are those of all rods, :class:`rodatlas.rods.Ends`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rodatlas.continuation.checks import check_type
from rodatlas.rods.elastic import MOMENT, ElasticRod, elastic_rod
from rodatlas.rods.law import LinearLaw, Rested
from rodatlas.rods.sections import Section
from rodatlas.rods.unknowns import CIRCLE, GRAVITY, REST, clamps_of, symmetries_of


def loaded_rod(section: Section | None = None) -> ElasticRod:
    """A rod between two clamps with a section, a weight, and natural curvature and twist.

    Parameters
    ----------
    section : tells the stiffnesses from the parameters nu and thickness (t/D); of a round one from nu alone. None:
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
    if section is None:
        own: dict[str, float] = {"a": 0.625, "c2": 0.0}
    else:
        own = {"nu": 0.25, "thickness": 0.0} if section.proportions else {"nu": 0.25}

    def law(p: Any) -> Rested:
        if section is None:
            stiffness = (p.a, p.c2)
        else:
            stiffness = section.stiffness(p.nu, p.thickness) if section.proportions else section.stiffness(p.nu)
        return Rested(LinearLaw(*stiffness), [getattr(p, name) for name in REST])

    parameters = {**own, **dict.fromkeys(GRAVITY + REST, 0.0), **CIRCLE}
    return elastic_rod(
        law, clamps_of, parameters, load=lambda p: [getattr(p, name) for name in GRAVITY],
        symmetries=symmetries_of(MOMENT, loaded=True), name=f"{section.name if section else 'given'} rod",
    )  # fmt: skip
