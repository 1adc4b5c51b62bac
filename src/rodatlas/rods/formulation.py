"""How the unknowns of a boundary value problem are read as cross-sections of a rod, and written from them.

Which unknown is what is known to the module that states the differential equation: it declares a :class:`Formulation`,
and :class:`rodatlas.rods.state.RodState` reads any solution through it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.rods.kinematics import POSITION, QUATERNION, directors
from rodatlas.rods.law import Law
from rodatlas.rods.poses import Clamps

Columns = Mapping[str, np.ndarray]
Parameters = Mapping[str, float]


class Sections(NamedTuple):
    """Cross-sections of a rod: loads and strain in body components, pose in space. Leading axes are those of s.

    Attributes
    ----------
    force : (..., 3) N [GJ/L^2]; moment : (..., 3) M [GJ/L]; strain : (..., 3) (k1, k2, tau) [1/L].
    quaternion : (..., 4); position : (..., 3) center line [L].
    """

    force: np.ndarray
    moment: np.ndarray
    strain: np.ndarray
    quaternion: np.ndarray
    position: np.ndarray

    @classmethod
    def loaded(
        cls, law: Law, force: np.ndarray, moment: np.ndarray, quaternion: np.ndarray, position: np.ndarray
    ) -> Sections:
        """With the strain that a law gives the moment."""
        strain = np.stack(law.strain(components(moment)), axis=-1)
        return cls(force, moment, strain, quaternion, position)


def held_by(
    law: Law, force: np.ndarray, moment: np.ndarray, quaternion: np.ndarray, position: np.ndarray, origin: np.ndarray
) -> Sections:
    r"""Cross-sections (...) in balance without load: the force is constant in space, the moment that about X(s).

    .. math:: m(s) = m(0) - (X(s) - X(0)) \times n

    Parameters
    ----------
    force, moment : (3,) n and m(0), in space. quaternion (..., 4), position (..., 3) : poses. origin : (3,) X(0).
    """
    frame = np.moveaxis(np.array(directors(quaternion)), 0, -2)
    here = moment - np.cross(position - origin, force)
    return Sections.loaded(law, frame @ force, np.einsum("...da,...a->...d", frame, here), quaternion, position)


def components(vector: np.ndarray) -> list[np.ndarray]:
    """The components (...) of a field of vectors (..., k)."""
    return [vector[..., i] for i in range(vector.shape[-1])]


def by_name(names: Sequence[str], vector: np.ndarray) -> dict[str, np.ndarray]:
    """Columns (...) with names from a field of vectors (..., k)."""
    return dict(zip(names, components(vector), strict=True))


def stacked(columns: Columns, names: Sequence[str]) -> np.ndarray:
    """A field of vectors (..., k) from columns (...) by name."""
    return np.stack([columns[name] for name in names], axis=-1)


def pose_columns(sections: Sections) -> dict[str, np.ndarray]:
    """The columns that every rod problem has: quaternion and position by name."""
    return {**by_name(QUATERNION, sections.quaternion), **by_name(POSITION, sections.position)}


@dataclass(frozen=True, eq=False)
class Formulation:
    """The unknowns and parameters of a problem by what they mean.

    Attributes
    ----------
    unknowns : names, in the order of the problem.
    parameters : names of those that the reader needs.
    law : the law at given parameters; clamps : the poses of its ends at them.
    read : cross-sections from columns (...) by name and parameters.
    write : columns by name from cross-sections and parameters, every unknown among them.
    load : (3,) dead load per length at given parameters, in space [GJ/L^3].
    """

    unknowns: tuple[str, ...]
    parameters: tuple[str, ...]
    law: Callable[[Parameters], Law]
    clamps: Callable[[Parameters], Clamps]
    read: Callable[[Columns, Parameters], Sections]
    write: Callable[[Sections, Parameters], Columns]
    load: Callable[[Parameters], np.ndarray] = lambda p: np.zeros(3)

    def __repr__(self) -> str:
        return f"Formulation({', '.join(self.unknowns)})"

    def missing(self, solution: Solution) -> list[str]:
        """The unknowns and parameters that a solution does not have."""
        known = {*solution.unknowns, *solution.parameter_names}
        return [name for name in (*self.unknowns, *self.parameters) if name not in known]

    def check(self, solution: object) -> None:
        """Raise ValueError for what is no solution of this formulation."""
        check_names(solution, (*self.unknowns, *self.parameters))

    def sections(self, solution: Solution, values: np.ndarray) -> Sections:
        """Cross-sections of unknowns (..., n) of a solution."""
        return self.read(by_name(solution.unknowns, values), parameters_of(solution))

    def values(self, sections: Sections, parameters: Parameters) -> np.ndarray:
        """Unknowns (..., n) that mean these cross-sections."""
        columns = self.write(sections, parameters)
        return np.stack([columns[name] for name in self.unknowns], axis=-1)

    def guess(self, s: np.ndarray, sections: Sections, parameters: Parameters) -> Solution:
        """Cross-sections at increasing s (K,) as a first guess for the problem."""
        return Solution.from_values(s, self.values(sections, parameters), self.unknowns, parameters)

    def rewritten(self, solution: Solution, other: Formulation, parameters: Parameters) -> Solution:
        """A solution of this formulation as one of another, on the same mesh, with the parameters of that."""
        values, stages = (
            other.values(self.sections(solution, array), parameters) for array in (solution.values, solution.stages)
        )
        return replace(
            solution, unknowns=other.unknowns, parameter_names=tuple(parameters),
            parameters=np.array(list(parameters.values())), values=values, stages=stages,
        )  # fmt: skip


def parameters_of(solution: Solution) -> dict[str, float]:
    """Parameters of a solution by name."""
    return dict(zip(solution.parameter_names, solution.parameters.tolist(), strict=True))


def check_names(solution: object, names: tuple[str, ...]) -> None:
    """Raise ValueError for what is no solution with some unknowns and parameters."""
    check_type("solution", solution, Solution, "a Solution such as state_at(Ends(15.0))")
    assert isinstance(solution, Solution)
    if not {*names} <= {*solution.unknowns, *solution.parameter_names}:
        raise ValueError(f"solution: expected one with {', '.join(names)}, got one with {', '.join(solution.unknowns)}")
