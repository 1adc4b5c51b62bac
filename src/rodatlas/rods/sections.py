r"""Cross-sections: the stiffnesses of a homogeneous rod from its shape and Poisson's ratio.

With Young's modulus E = 2 G (1 + nu), second moments I1 (about the width d1) and I2 (about the normal d2) and the
torsion constant J, the stiffnesses in units of GJ are

.. math:: a = \frac{EI_1}{GJ} = 2(1+\nu)\frac{I_1}{J}, \qquad b = \frac{EI_2}{GJ} = 2(1+\nu)\frac{I_2}{J}.

A shape has one proportion, thickness over width t/D from 0, where b is infinite, to 1. All functions take numbers and
symbols alike, so that the proportion can be a parameter of a problem.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

TERMS = 40  # of the series of Saint-Venant: the n-th falls as n^-5, and as n^-4 where a square makes it slowest
THINNEST_SERIES = 0.02  # t/D below which tanh(n pi D / (2 t)) is 1 to the last digit


@dataclass(frozen=True)
class Section:
    """The shape of a cross-section, whose proportion may vary.

    Attributes
    ----------
    name : 'rectangle', 'ellipse' or 'circle', which a tube is like.
    shape : function of t/D, a number or a symbol, that gives I1/J and J/I2; the latter is 0 at t/D = 0.
    proportion : name of the parameter that is t/D; '' for what is round. Other names for other shapes: by its
        parameters it is told what a solution is of.
    """

    name: str
    shape: Callable[[Any], tuple[Any, Any]]
    proportion: str = ""

    def stiffness(self, poisson: Any, thickness: Any = 1.0) -> tuple[Any, Any]:
        """EI1/GJ [-] and GJ/EI2 [-], the latter 0 where the section does not bend about its normal.

        Parameters
        ----------
        poisson : nu. thickness : t/D, 0 to 1.

        Examples
        --------
        >>> a, c2 = RECTANGLE.stiffness(0.25, 1 / 23.6)
        >>> round(a, 8), round(1 / c2, 4)
        (0.64214888, 357.6512)
        """
        over, under = self.shape(thickness)
        modulus = 2 * (1 + poisson)  # E/G
        return modulus * over, under / modulus


def torsion_factor_of(thickness: Any) -> Any:
    r"""Torsion constant over D t^3 of a rectangle, as a smooth function of t/D from 0 to 1, a number or a symbol.

    .. math:: \lambda = \frac13\Big(1 - \frac{192}{\pi^5}\frac{t}{D}
              \sum_{n=1,3,\dots}\frac{1}{n^5}\tanh\frac{n\pi D}{2t}\Big)

    The sum over all odd n of n^-5 is 31 zeta(5)/32; what tanh lacks to 1 is summed by `TERMS` terms. Sources:
    A. J. C. B. de Saint-Venant (1855); S. P. Timoshenko and J. N. Goodier, "Theory of elasticity" (1970), section 109.

    >>> round(torsion_factor_of(1.0), 10), round(torsion_factor_of(0.0), 10)
    (0.1405770150, 0.3333333333)
    """
    ratio = 1 / np.fmax(thickness, THINNEST_SERIES)  # below, the terms underflow: so do their derivatives
    small = [(n, np.exp(-n * math.pi * ratio)) for n in range(1, 2 * TERMS, 2)]
    lacking = sum(2 * e / (n**5 * (1 + e)) for n, e in small)
    return (1 - 192 / math.pi**5 * thickness * (31 * ZETA_5 / 32 - lacking)) / 3


ZETA_5 = 1.0369277551433699


def _rectangle(thickness: Any) -> tuple[Any, Any]:
    """I1 = D t^3/12, I2 = t D^3/12, J = lambda D t^3."""
    factor = torsion_factor_of(thickness)
    return 1 / (12 * factor), 12 * factor * thickness**2


def _ellipse(thickness: Any) -> tuple[Any, Any]:
    """With half axes A >= B: I1 = pi A B^3/4, I2 = pi A^3 B/4, J = pi A^3 B^3/(A^2 + B^2)."""
    return (1 + thickness**2) / 4, 4 * thickness**2 / (1 + thickness**2)


def _round(thickness: Any) -> tuple[Any, Any]:
    """J = I1 + I2 of a circle and of a circular tube of any wall."""
    return 0.5, 2.0


RECTANGLE, ELLIPSE = Section("rectangle", _rectangle, "thickness"), Section("ellipse", _ellipse, "flatness")
CIRCLE_SECTION = Section("circle", _round)  # and of a circular tube
