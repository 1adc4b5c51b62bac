"""The error along a walk: when it is looked at, and the stretches whose points may miss the tolerance all the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.growth import LastLook
from rodatlas.continuation.discrete.mesh import MeshControl
from rodatlas.continuation.discrete.solution import Solution


@dataclass(frozen=True)
class Doubt:
    """Arclengths between two estimates of the error, of which the second is more than accepted."""

    low: float
    high: float
    error: float


class ErrorWatch:
    """Looks at the error every few steps, or before its turn where the density of the mesh tells that it has grown.

    Parameters
    ----------
    colloc, error, density : discretization of the start, its error, and what :func:`monitor` wants there.
    arclength : of the start.
    """

    def __init__(self, control: MeshControl, colloc: Collocation, error: float, density: np.ndarray, arclength: float):
        self.control = control
        self.doubts: list[Doubt] = []
        self._since, self._count = arclength, 0
        self.moved(colloc, error, density)

    def moved(self, colloc: Collocation, error: float, density: np.ndarray) -> None:
        """Go on from a mesh whose error is known."""
        self._look = LastLook.at(colloc, error, density)

    def stepped(self) -> None:
        """One more point was reached."""
        self._count += 1

    def is_due(self, colloc: Collocation, density: np.ndarray) -> bool:
        """Whether it is time to look at the error, and to let the mesh follow."""
        if self._count == 0:
            return False
        return self._count % self.control.every == 0 or self._look.is_over(colloc, density, self.control)

    def is_behind(self, arclength: float) -> bool:
        """Whether points up to there have not been looked at, on a mesh that adapts."""
        return self._since < arclength and not self.control.is_fixed_size

    def measured(self, error: float, arclength: float) -> None:
        """Keep in mind where points may be wrong: since they were looked at last."""
        if not self.control.accepts(error):
            self.doubts.append(Doubt(self._since, arclength, error))
        self._since = arclength


def marked(solution: Solution, arclength: float, doubts: Sequence[Doubt]) -> Solution:
    """The solution with the largest error (NaN: unknown) that was found after it, where one was."""
    errors = [d.error for d in doubts if d.low <= arclength <= d.high]
    return replace(solution, error=max(errors, key=_rank)) if errors else solution


def _rank(error: float) -> float:
    return error if error == error else float("inf")
