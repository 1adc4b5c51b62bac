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

from rodatlas.continuation.checks import shown


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

    def energy_density(self, strain: Sequence[Any], moment: Sequence[Any]) -> Any:
        """W [GJ/L^2] of a strain and its moment."""

    def energy_parts(self, strain: Sequence[Any], moment: Sequence[Any]) -> list[Any]:
        """What bending by k1 and by k2 and twisting store [GJ/L^2]; their sum is W."""

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        """Derivative (3, 3) of the strain by the moment [1/GJ], symmetric; zero in rows and columns of rigid ones."""


@dataclass(frozen=True)
class LinearLaw:
    r"""A rod that is straight without load and answers in proportion.

    .. math:: \kappa_1 = M_1/a, \quad \kappa_2 = c_2 M_2, \quad \tau = M_3, \qquad
              W = \tfrac12 (a\kappa_1^2 + M_2\kappa_2 + \tau^2)

    The twisting stiffness GJ is the unit. With c2 = 0, the default, it is the perfectly anisotropic rod: k2 = 0, and M2
    is a reaction. With c2 = 1/a the rod bends alike to all sides. Sources: G. Kirchhoff (1859), J. Reine Angew. Math.
    56, 285; for c2 = 0 T. Yu and J. A. Hanna, "Bifurcations of buckled, clamped anisotropic rods and thin bands under
    lateral end translations".

    Attributes
    ----------
    a : bending stiffness EI1/GJ of k1, about the width d1; a number or a symbol.
    c2 : compliance GJ/EI2 of k2, about the normal d2; a number or a symbol. The number 0 is rigid.

    Raises
    ------
    ValueError
        for an `a` that is not positive, or a negative `c2`.

    Examples
    --------
    >>> band = LinearLaw(0.625)
    >>> band.strain((1.25, 3.0, 0.5))
    [2.0, 0.0, 0.5]
    >>> band.moment((2.0, 0.0, 0.5), reaction=(0.0, 3.0, 0.0))
    [1.25, 3.0, 0.5]
    >>> LinearLaw(0.625, c2=0.1).strain((1.25, 3.0, 0.5))
    [2.0, 0.3, 0.5]
    """

    a: Any
    c2: Any = 0.0

    def __post_init__(self) -> None:
        for name, value in (("a", self.a), ("c2", self.c2)):
            if not hasattr(value, "__truediv__"):
                raise ValueError(f"{name}: expected a number or a symbol, got {shown(value)}")
        if _is_number(self.a) and not 0.0 < self.a < math.inf:
            raise ValueError(f"a: expected a positive stiffness in units of GJ, got {self.a}")
        if _is_number(self.c2) and not 0.0 <= self.c2 < math.inf:
            raise ValueError(f"c2: expected a compliance of at least 0 in units of 1/GJ, got {self.c2}")

    @property
    def rigid(self) -> tuple[bool, bool, bool]:
        return False, _is_number(self.c2) and self.c2 == 0.0, False

    @property
    def stiffness(self) -> tuple[Any, Any, Any]:
        """(EI1, EI2, GJ) [GJ]; infinite where rigid."""
        return self.a, math.inf if self.rigid[1] else 1.0 / self.c2, 1.0

    @property
    def softness(self) -> tuple[Any, Any, Any]:
        """(1/a, c2, 1) [1/GJ], the diagonal of the compliance."""
        return 1.0 / self.a, self.c2, 1.0

    def strain(self, moment: Sequence[Any]) -> list[Any]:
        m1, m2, m3 = moment
        return [m1 / self.a, self.c2 * m2, m3]

    def moment(self, strain: Sequence[Any], reaction: Sequence[Any]) -> list[Any]:
        k1, k2, tau = strain
        return [self.a * k1, reaction[1] if self.rigid[1] else k2 / self.c2, tau]

    def energy_density(self, strain: Sequence[Any], moment: Sequence[Any]) -> Any:
        k1, k2, tau = strain
        return (self.a * k1**2 + moment[1] * k2 + tau**2) / 2

    def energy_parts(self, strain: Sequence[Any], moment: Sequence[Any]) -> list[Any]:
        k1, k2, tau = strain
        return [self.a * k1**2 / 2, moment[1] * k2 / 2, tau**2 / 2]

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        c1, c2, c3 = self.softness
        return [[c1, 0.0, 0.0], [0.0, c2, 0.0], [0.0, 0.0, c3]]


@dataclass(frozen=True)
class Rested:
    r"""Another law whose rod is bent and twisted without load.

    .. math:: \kappa = \kappa^0 + \partial H/\partial M, \qquad W = W_{\text{law}}(\kappa - \kappa^0)

    Source: A. E. H. Love, "A treatise on the mathematical theory of elasticity" (4th ed., 1927), section 259: natural
    curvature and twist.

    Attributes
    ----------
    law : of the rod that is straight without load.
    rest : (k1, k2, tau) without load [1/L], numbers or symbols. A strain that is rigid keeps that value.

    Examples
    --------
    >>> Rested(LinearLaw(0.625), (1.0, 0.0, 0.0)).strain((1.25, 3.0, 0.5))
    [3.0, 0.0, 0.5]
    """

    law: Law
    rest: Sequence[Any]

    @property
    def rigid(self) -> tuple[bool, bool, bool]:
        return self.law.rigid

    def _change(self, strain: Sequence[Any]) -> list[Any]:
        return [now - then for now, then in zip(strain, self.rest, strict=True)]

    def strain(self, moment: Sequence[Any]) -> list[Any]:
        return [change + then for change, then in zip(self.law.strain(moment), self.rest, strict=True)]

    def moment(self, strain: Sequence[Any], reaction: Sequence[Any]) -> list[Any]:
        return self.law.moment(self._change(strain), reaction)

    def energy_density(self, strain: Sequence[Any], moment: Sequence[Any]) -> Any:
        return self.law.energy_density(self._change(strain), moment)

    def energy_parts(self, strain: Sequence[Any], moment: Sequence[Any]) -> list[Any]:
        return self.law.energy_parts(self._change(strain), moment)

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        return self.law.compliance(moment)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number)


def softness_of_band(law: Law) -> float:
    """1/a [1/GJ] of the perfectly anisotropic rod: all that compiled kernels know of a law.

    Raises
    ------
    ValueError
        for another law, of which they would compute something else.
    """
    if not (isinstance(law, LinearLaw) and law.rigid == (False, True, False)):
        raise ValueError(f"law: expected that of the perfectly anisotropic rod, LinearLaw(a), got {law!r}")
    return float(law.softness[0])
