"""Which solutions are one state: images under the symmetries that a setting has.

A declared symmetry acts on parameters too. At a setting it is there when it leaves all parameters as they are; so one
list serves a band between equal clamps, which has the reversal, and one between unequal clamps, which has not.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rodatlas.continuation import Solution, image, isotropy
from rodatlas.continuation.discrete.collocation import Scale
from rodatlas.model.model import Model

FIXED = 1e-12  # by which a symmetry may change a parameter, relative to 1 + its size, through round-off
SAME = 1e-4  # distance of two solutions of one state, located by different branches, in the scaled norm


def fixing(model: Model, parameters: Sequence[float] | np.ndarray) -> tuple[str, ...]:
    """Names of the declared symmetries that leave parameters (np,) of the problem alone."""
    p = np.asarray(parameters, dtype=float)
    size = FIXED * (1.0 + np.abs(p))
    return tuple(name for name, x in model.problem.symmetries.items() if (np.abs(x.parameters(p) - p) <= size).all())


def pairing(model: Model) -> tuple[str, ...]:
    """Symmetries whose images are members of one state."""
    if model.pairing is not None:
        return model.pairing
    n = model.problem.size
    return tuple(
        name for name, x in model.problem.symmetries.items()
        if np.array_equal(x.matrix[n:-1], np.eye(len(x.matrix))[n:-1])
    )  # fmt: skip


def group(model: Model, solution: Solution) -> tuple[str, ...]:
    """The pairing symmetries that the setting of a solution has."""
    there = fixing(model, solution.parameters)
    return tuple(name for name in pairing(model) if name in there)


def own_symmetries(model: Model, solution: Solution) -> frozenset[str]:
    """The pairing symmetries that a state has itself: its isotropy in :func:`group`."""
    there = group(model, solution)
    return frozenset(isotropy(model.problem, solution, among=there)) if there else frozenset()


def is_alone(model: Model, solution: Solution) -> bool:
    """Whether a state is its only member: it has every pairing symmetry of its setting."""
    there = group(model, solution)
    return not there or len(isotropy(model.problem, solution, among=there)) == len(there)


def members(model: Model, solution: Solution) -> list[Solution]:
    """A state and its images under the pairing symmetries of its setting, each once."""
    return images(model, solution, group(model, solution))


def images(model: Model, solution: Solution, names: Iterable[str]) -> list[Solution]:
    """A state and all its images under some declared symmetries, each once."""
    found = [solution]
    for one in found:  # grows while it is walked over
        for name in names:
            new = image(model.problem, name, one)
            if not any(distance(model, new, other) < SAME for other in found):
                found.append(new)
    return found


def same_state(model: Model, one: Solution, two: Solution, tolerance: float = 1e-5) -> bool:
    """Whether two solutions are one state: equal controls, and equal invariants or nearly equal members.

    Parameters
    ----------
    tolerance : of the controls, in units of the parameter, and of the invariants.
    """
    if any(abs(one.parameter(c.parameter) - two.parameter(c.parameter)) >= tolerance for c in model.controls):
        return False
    if any(x.differs(one, two, tolerance) for x in model.invariants):
        return False
    if model.invariants and model.decisive:
        return True
    return any(distance(model, one, member) < SAME for member in members(model, two))


def distance(model: Model, one: Solution, two: Solution) -> float:
    """Distance of the unknowns of two solutions, in the scaled norm of continuation."""
    scale = Scale.of(model.problem, one).unknowns
    s = np.union1d(one.mesh, two.mesh)
    difference = (one(s) - two(s)) / scale
    square = np.mean(difference**2, axis=1)
    return float(np.sqrt(np.trapezoid(square, s)))


def sign_by_unknowns(model: Model, solution: Solution) -> str:
    """'+' or '-' of a member of a pair, by the first unknown whose mean, weighted toward the end, differs from that of
    the image: + has the larger one."""
    there = group(model, solution)
    scale = Scale.of(model.problem, solution).unknowns
    own = _means(solution) / scale
    for name in there:
        other = _means(image(model.problem, name, solution)) / scale
        told = np.flatnonzero(np.abs(own - other) > SAME)
        if len(told):
            return "+" if own[told[0]] > other[told[0]] else "-"
    return "+"


def _means(solution: Solution) -> np.ndarray:
    """int (s + 1) u ds of each unknown."""
    s = np.linspace(0.0, 1.0, 201)
    return np.asarray(np.trapezoid((s + 1.0)[:, None] * solution(s), s, axis=0))
