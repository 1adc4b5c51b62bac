r"""An extremum of an observable as a fold of the problem in which the value of the observable is the parameter.

With one more parameter :math:`\gamma` and one more condition,

.. math:: F(X) = 0, \qquad g(X) - \gamma = 0,

the branch is the same curve, along which :math:`\gamma` is the value of g. Its folds in :math:`\gamma` are the extrema
of g; all that is known about folds serves: the augmented system, its mesh, the locus in two parameters and what is
met on it (Doedel's way to optima, AUTO-07p). For a free parameter in the place of g nothing is added; it only becomes
the first of the free ones, and the folds in the continuation parameter itself are the case in which it already is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row, Scale
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.bvp import BVP

KIND = "extremum of "


@lru_cache(maxsize=32)
def _with_value(bvp: BVP, observable: str) -> tuple[BVP, str]:
    """The problem with the value of an observable as parameter, and the name of that."""
    name = f"value_of_{observable}"
    while name in (*bvp.parameters, *bvp.unknowns, *bvp.observables):
        name += "_"
    return bvp.with_value_of(observable, name), name


@dataclass(frozen=True)
class ValueView:
    """A problem with the value of an observable, or of one of its parameters, as first parameter.

    Attributes
    ----------
    bvp, name : the problem and the observable or parameter.
    inside : the problem in which its value is a parameter; value : name of that.
    """

    bvp: BVP
    name: str
    inside: BVP
    value: str

    @classmethod
    def of(cls, bvp: BVP, name: str) -> ValueView:
        """The view of an observable or parameter."""
        inside, value = _with_value(bvp, name) if name in bvp.observables else (bvp, name)
        return cls(bvp, name, inside, value)

    @property
    def adds(self) -> bool:
        """Whether the value is a parameter that the problem does not have."""
        return self.inside is not self.bvp

    def free(self, names: Sequence[str], at: int = 0) -> tuple[str, ...]:
        """Names of the free parameters of the view: the value, the `at` ones after the first, and all others."""
        others = [n for n in (*names[1 : 1 + at], names[0], *names[1 + at :]) if n != self.value]
        return (self.value, *others)

    def scale(self, scale: Scale, value: float) -> Scale:
        """Units of the view; the value's is its size, or one."""
        if not self.adds:
            return scale
        return Scale(scale.unknowns, self.parameters(scale.parameters, max(1.0, abs(value))))

    def parameters(self, values: np.ndarray, value: float) -> np.ndarray:
        """Numbers of all parameters with one of the value, which stands behind the user's."""
        return np.insert(values, len(self.bvp.own_parameters), value)

    def solution(self, solution: Solution) -> Solution:
        """A solution of the problem as one of the view."""
        if not self.adds:
            return solution
        names = (*solution.parameter_names, self.value)
        return replace(solution, parameter_names=names, parameters=np.append(solution.parameters, solution[self.name]))

    def original(self, solution: Solution) -> Solution:
        """A solution of the view as one of the problem."""
        if not self.adds:
            return solution
        names = solution.parameter_names[:-1]
        return replace(solution, parameter_names=names, parameters=solution.parameters[:-1])


class Lift:
    """States and tangents of a branch on one discretisation, seen from the view, and back."""

    def __init__(self, view: ValueView, colloc: Collocation, x: Columns):
        names = [colloc.bvp.parameter_names[i] for i in colloc.free]
        self.view, self.outside = view, colloc
        value, _ = colloc.observable_row(view.name, x)
        scale = view.scale(colloc.scale, value)
        free = view.free(names)
        base = view.parameters(colloc.base, value) if view.adds else colloc.base
        index = [view.inside.parameter_index(n) for n in free]
        points, backend = colloc.scheme.points, colloc.backend
        self.colloc = Collocation(view.inside, colloc.mesh, points, base, index, scale, backend)
        self.unit = float(scale.parameters[index[0]])
        self._order = [names.index(n) for n in free if n in names]
        self._back = [free.index(n) for n in names]

    def state(self, x: Columns) -> Columns:
        """A state of the branch with the value of the observable."""
        value = self.outside.observable_row(self.view.name, x)[0] / self.unit
        return self._with(x, value)

    def tangent(self, x: Columns, t: Columns) -> Columns:
        """A tangent at x with the slope of the observable, of length one."""
        lifted = self._with(t, slope_along(self.outside, self.view.name, x, t) / self.unit)
        return scaled(lifted, 1.0 / self.colloc.norm(lifted))

    def _with(self, v: Columns, value: float) -> Columns:
        rest = v.scalars[self._order]
        return Columns(v.stage, v.mesh, np.append(value, rest) if self.view.adds else rest)

    def back(self, v: Columns) -> Columns:
        """What the view adds, taken away."""
        return Columns(v.stage, v.mesh, v.scalars[self._back])


def slope_along(colloc: Collocation, name: str, x: Columns, t: Columns) -> float:
    """Derivative of an observable or free parameter along a tangent."""
    return colloc.observable_row(name, x)[1].dot(t)


def size_of(row: Row, colloc: Collocation) -> float:
    """Size of a gradient in the norm of functions: what an observable changes by along a unit vector, at most."""
    total = float(row.scalars @ row.scalars)
    if row.stage is not None:
        per_length = (colloc.step[:, None] * colloc.scheme.weights)[..., None]
        total += float(np.sum(row.stage**2 / per_length))
    if row.ends is not None:
        total += float(sum(end @ end for end in row.ends))
    return float(np.sqrt(total))
