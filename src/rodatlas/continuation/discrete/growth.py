"""How the error of a mesh that stays in place grows while the solution moves on, told without a linear solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.mesh import ACCEPTED, MeshControl

EARLY = 0.5  # of the error that is accepted: where this much is expected the mesh is looked at before its turn


@dataclass(frozen=True)
class LastLook:
    """An error estimated on a mesh, and the :func:`power` of the density that was wanted there."""

    error: float
    power: float

    @classmethod
    def at(cls, colloc: Collocation, error: float, density: np.ndarray) -> LastLook:
        """The look at a state whose error is known."""
        return cls(error, power(colloc, density))

    def is_over(self, colloc: Collocation, density: np.ndarray, control: MeshControl) -> bool:
        """Whether the error that a state on the same mesh must be expected to have is near what is accepted."""
        if control.is_fixed_size or not self.power > 0:
            return False
        return self.error * power(colloc, density) / self.power > EARLY * ACCEPTED * control.tolerance


def power(colloc: Collocation, density: np.ndarray) -> float:
    r"""Mean of :math:`(h\varrho)^{2m}` over the mesh, where :math:`\varrho^{m+1}` is a derivative of order m + 1.

    The error at mesh points is of order 2m. While the mesh stays in place it grows by no more than this mean does, up
    to a factor of about two: along loci of Bratu's problem in a strong wind, and of the elastic band.
    """
    h = colloc.step
    return float(h @ (h * density) ** (2 * colloc.scheme.points) / h.sum())
