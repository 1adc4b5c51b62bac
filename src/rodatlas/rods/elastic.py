"""A rod of any law between any clamps as a boundary value problem, and the anisotropic rod as one of them.

Force and moment are unknowns, and the law gives the strain, so that a strain may be soft, stiff or rigid. (The
perfectly anisotropic rod has a formulation of its own, :func:`rodatlas.rods.rod_problem`, in which strains are unknowns
where they can change; the atlas uses it.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from rodatlas.continuation import BVP, end_value, integral_of
from rodatlas.continuation.problem.symmetry import Symmetry
from rodatlas.continuation.problem.tracing import Named
from rodatlas.rods.formulation import (
    Columns,
    Formulation,
    Parameters,
    Sections,
    by_name,
    pose_columns,
    stacked,
)
from rodatlas.rods.kinematics import POSE, POSITION, QUATERNION, balance, director_components, pose_of, quaternion_rate
from rodatlas.rods.law import Law, LinearLaw
from rodatlas.rods.poses import Clamps
from rodatlas.rods.unknowns import (
    CIRCLE,
    CLAMPS,
    FORCE,
    FORCE_SCALE,
    MOMENT_SCALE,
    clamps_of,
    space_force,
    symmetries_of,
    unit_length,
)

MOMENT = ("M1", "M2", "M3")
UNKNOWNS = (*FORCE, *MOMENT, *POSE)
SYMMETRIES = symmetries_of(MOMENT)
"""Of a rod whose energy is even in k2 and in (k1, tau); see :mod:`rodatlas.rods.symmetry`."""


class ElasticRod(NamedTuple):
    """A problem, and how its solutions are read: `RodState(solution, rod.formulation)`."""

    problem: BVP
    formulation: Formulation


def elastic_rod(
    law: Callable[[Any], Law], clamps: Callable[[Any], Clamps], parameters: Mapping[str, float], *,
    load: Callable[[Any], Sequence[Any]] | None = None, symmetries: Sequence[Symmetry] = (), name: str = "elastic rod",
) -> ElasticRod:  # fmt: skip
    r"""Thirteen equations for (N, M, q, X), body components of force and moment.

    .. math:: N' = N \times \omega - f, \quad M' = M \times \omega + N \times e_3, \quad X' = d_3,
              \qquad \omega = \partial H/\partial M

    Observables: height = int y ds, energy = int (W - f.X) ds, end_force_z = z component of the force in space at s = 0;
    with a load also potential = -int f.X ds, the part of the energy that is not of the strain.

    Parameters
    ----------
    law, clamps : functions of the parameters by name, numbers or symbols, as `p` below.
    parameters : names and default values of the parameters that these use.
    load : the same, a dead load f per length (3,), in space [GJ/L^3]; None for none.
    symmetries : of the problem, checked when it is made.

    Raises
    ------
    ValueError
        for a function of other parameters, or a symmetry that the problem does not have.

    Examples
    --------
    A rod of equal bending stiffnesses between clamps of unequal angles:

    >>> rod = elastic_rod(
    ...     lambda p: LinearLaw(p.a, 1 / p.a),
    ...     lambda p: Clamps(Pose.tilted(p.left, (0, 0, 0)), Pose.tilted(-p.right, (1 - p.dL, 0, 0))),
    ...     {"a": 1.25, "left": 0.3, "right": 0.6, "dL": 0.5},
    ... )
    """

    def strain_and_moment(u: Any, p: Any) -> tuple[list[Any], list[Any]]:
        moment = [getattr(u, m) for m in MOMENT]
        return law(p).strain(moment), moment

    def rhs(s: Any, u: Any, p: Any) -> list[Any]:
        strain, moment = strain_and_moment(u, p)
        force_rate, moment_rate = balance([getattr(u, n) for n in FORCE], moment, strain)
        q = [getattr(u, k) for k in QUATERNION]
        frame = director_components(*q)
        if load is not None:
            f = load(p)
            force_rate = [rate - sum(a * b for a, b in zip(d, f, strict=True))
                          for rate, d in zip(force_rate, frame, strict=True)]  # fmt: skip
        return [*force_rate, *moment_rate, *quaternion_rate(q, *strain), *frame[2]]

    def potential(s: Any, u: Any, p: Any) -> Any:
        return -sum(f * getattr(u, x) for f, x in zip(load(p), POSITION, strict=True)) if load is not None else 0.0

    def energy(s: Any, u: Any, p: Any) -> Any:
        return law(p).energy_density(*strain_and_moment(u, p)) + potential(s, u, p)

    problem = BVP(
        rhs, lambda left, right, p: clamps(p).residual(left, right), unknowns=UNKNOWNS, parameters=parameters,
        observables={
            "height": integral_of(lambda s, u, p: u.y),
            "energy": integral_of(energy),
            "end_force_z": end_value(lambda left, right, p: space_force(left)[2]),
            **({} if load is None else {"potential": integral_of(potential)}),
        },
        scales={**dict.fromkeys(FORCE, FORCE_SCALE), **dict.fromkeys(MOMENT, MOMENT_SCALE)},
        symmetries=symmetries, identities=unit_length, name=name,
    )  # fmt: skip
    return ElasticRod(problem, formulation_with(law, clamps, tuple(parameters), load))


def formulation_with(
    law: Callable[[Any], Law], clamps: Callable[[Any], Clamps], parameters: tuple[str, ...],
    load: Callable[[Any], Sequence[Any]] | None = None,
) -> Formulation:  # fmt: skip
    """How solutions of :func:`elastic_rod` are read, with the same arguments; the problem itself is not needed."""

    def law_at(p: Parameters) -> Law:
        return law(_named(p))

    def read(u: Columns, p: Parameters) -> Sections:
        return Sections.loaded(law_at(p), stacked(u, FORCE), stacked(u, MOMENT), *pose_of(u))

    def write(x: Sections, p: Parameters) -> Columns:
        return {**by_name(FORCE, x.force), **by_name(MOMENT, x.moment), **pose_columns(x)}

    def load_at(p: Parameters) -> np.ndarray:
        return np.zeros(3) if load is None else np.array(load(_named(p)), dtype=float)

    return Formulation(UNKNOWNS, parameters, law_at, lambda p: clamps(_named(p)), read, write, load_at)


def _named(p: Parameters) -> Named:
    return Named(tuple(p), tuple(p.values()))


def _linear(p: Any) -> LinearLaw:
    return LinearLaw(p.a, p.c2)


ANISOTROPIC = formulation_with(_linear, clamps_of, ("a", "c2", *CLAMPS))
"""How solutions of :func:`anisotropic_rod` are read."""


@lru_cache(maxsize=1)
def anisotropic_rod() -> ElasticRod:
    """The rod that bends to both sides, k2 = c2 M2, between the clamps of :class:`rodatlas.rods.Ends`.

    Parameters: a = EI1/GJ, c2 = GJ/EI2, and those of the clamps, :data:`rodatlas.rods.unknowns.CLAMPS`. With c2 = 0 its
    states are those of :func:`rodatlas.rods.rod_problem`; a rectangular section D x t has c2 = (t/D)^2/a.

    Examples
    --------
    >>> rod = anisotropic_rod()
    >>> start = RodState(state_at(Ends(45.0))).rewritten(rod.formulation, c2=0.0)
    >>> branch = trace(rod.problem, start, ("c2",), TraceOptions(bounds={"c2": (0.0, 1.6)}))
    """
    parameters = {"a": 0.625, "c2": 0.0, **CIRCLE}
    rod = elastic_rod(_linear, clamps_of, parameters, symmetries=SYMMETRIES, name="anisotropic rod")
    return ElasticRod(rod.problem, ANISOTROPIC)
