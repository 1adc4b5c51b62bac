r"""Constitutive laws: how the strain of a cross-section follows from its moment, and what energy it stores.

A law is hyperelastic: with the energy W of the strain per length, M_i = dW/dk_i. A strain that cannot change is rigid;
its moment is a reaction, which no law knows and the balance of moments decides. Everything that needs a law asks one of
these values: the differential equations, the readers of their solutions, stability, searches and figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np


class Law(Protocol):
    """What is asked of a law.

    A vector is a sequence of its three body components (along d1, d2, d3), each of them a number, an array over the
    length, or a symbol of a problem: a law is written once for all of them.
    """

    @property
    def rigid(self) -> tuple[bool, bool, bool]:
        """Which of (k1, k2, tau) cannot change."""

    def strain(self, moment: Sequence[Any]) -> list[Any]:
        """(k1, k2, tau) [1/L] of a moment (M1, M2, M3) [GJ/L]; rigid ones are 0."""

    def moment(self, strain: Sequence[Any], reaction: Sequence[Any]) -> list[Any]:
        """(M1, M2, M3) of a strain; where the strain is rigid the component of `reaction`."""

    def energy_density(self, strain: Sequence[Any]) -> Any:
        """W [GJ/L^2]."""

    def energy_parts(self, strain: Sequence[Any]) -> list[Any]:
        """What bending by k1 and by k2 and twisting store [GJ/L^2]; their sum is W."""

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        """Derivative (3, 3) of the strain by the moment [1/GJ], symmetric; zero in rows and columns of rigid ones."""


@dataclass(frozen=True)
class LinearLaw:
    r"""A rod that is straight without load and answers in proportion: M = (a k1, b k2, tau).

    .. math:: W = \tfrac12 (a\kappa_1^2 + b\kappa_2^2 + \tau^2),
              \qquad \kappa_1 = M_1/a, \quad \kappa_2 = M_2/b, \quad \tau = M_3

    The twisting stiffness GJ is the unit. With b infinite, the default, it is the perfectly anisotropic rod: k2 = 0,
    and M2 is a reaction. Source: G. Kirchhoff (1859), J. Reine Angew. Math. 56, 285; for infinite b T. Yu and
    J. A. Hanna, "Bifurcations of buckled, clamped anisotropic rods and thin bands under lateral end translations".

    Attributes
    ----------
    a, b : bending stiffnesses EI1/GJ of k1 (about the width d1) and EI2/GJ of k2 (about the normal d2), numbers or
        symbols.

    Raises
    ------
    ValueError
        for a number that is not positive.

    Examples
    --------
    >>> band = LinearLaw(0.625)
    >>> band.strain((1.25, 3.0, 0.5))
    [2.0, 0.0, 0.5]
    >>> band.moment((2.0, 0.0, 0.5), reaction=(0.0, 3.0, 0.0))
    [1.25, 3.0, 0.5]
    >>> LinearLaw(0.625, 10.0).energy_density((2.0, 0.3, 0.5))
    1.825
    """

    a: Any
    b: Any = math.inf

    def __post_init__(self) -> None:
        for name, value in (("a", self.a), ("b", self.b)):
            if isinstance(value, int | float | np.number) and not value > 0:
                raise ValueError(f"{name}: expected a positive stiffness in units of GJ, got {value}")

    @property
    def rigid(self) -> tuple[bool, bool, bool]:
        return False, isinstance(self.b, int | float | np.number) and math.isinf(self.b), False

    @property
    def stiffness(self) -> tuple[Any, Any, Any]:
        """(a, b, 1) [GJ]."""
        return self.a, self.b, 1.0

    @property
    def softness(self) -> tuple[Any, Any, Any]:
        """(1/a, 1/b, 1) [1/GJ], the diagonal of the compliance; 0 where rigid."""
        return 1.0 / self.a, 0.0 if self.rigid[1] else 1.0 / self.b, 1.0

    def strain(self, moment: Sequence[Any]) -> list[Any]:
        m1, m2, m3 = moment
        return [m1 / self.a, 0.0 * m2 if self.rigid[1] else m2 / self.b, m3]

    def moment(self, strain: Sequence[Any], reaction: Sequence[Any]) -> list[Any]:
        k1, k2, tau = strain
        return [self.a * k1, reaction[1] if self.rigid[1] else self.b * k2, tau]

    def energy_parts(self, strain: Sequence[Any]) -> list[Any]:
        k1, k2, tau = strain
        return [self.a * k1**2 / 2, 0.0 * k2 if self.rigid[1] else self.b * k2**2 / 2, tau**2 / 2]

    def energy_density(self, strain: Sequence[Any]) -> Any:
        k1, k2, tau = strain
        return (self.a * k1**2 + (0.0 if self.rigid[1] else self.b * k2**2) + tau**2) / 2

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        c1, c2, c3 = self.softness
        return [[c1, 0.0, 0.0], [0.0, c2, 0.0], [0.0, 0.0, c3]]
