"""How much the width of a band matters for a state of the rod, which knows no width."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import check_type
from rodatlas.rods.band import Band
from rodatlas.rods.perfectly_anisotropic import check_rod
from rodatlas.rods.state import RodState

SMALL = 0.4  # below it the series of phi is good to 1e-10, above it the closed form loses three digits at most


def width_function(mu: np.ndarray) -> np.ndarray:
    r"""Share of a width that stiffens when a band is bent and twisted.

    .. math:: \varphi(\mu) = 1 - \frac{\cosh 2\mu - \cos 2\mu}{\mu(\sinh 2\mu + \sin 2\mu)}
              = \mu^4\left(\frac{4}{45} - \frac{32}{2835}\mu^4 + \frac{184256}{127702575}\mu^8 - \dots\right)

    Source: B. Audoly & S. Neukirch 2021, J. Mech. Phys. Solids 153, 104456.
    """
    mu = np.asarray(mu, dtype=float)
    m = np.maximum(mu, SMALL)
    decay = np.exp(-2.0 * m)  # both fractions are multiplied by it, so that nothing overflows
    above = 0.5 * (1.0 + decay**2) - decay * np.cos(2.0 * m)
    below = 0.5 * (1.0 - decay**2) + decay * np.sin(2.0 * m)
    power = np.minimum(mu, SMALL) ** 4
    series = power * (4 / 45 + power * (-32 / 2835 + power * 184256 / 127702575))
    return np.where(mu < SMALL, series, 1.0 - above / (m * below))


def width_energy(kappa: np.ndarray, tau: np.ndarray, beta: float, poisson: float) -> np.ndarray:
    r"""What the width adds to the energy density of the rod [GJ/L^2], in the ribbon model of Audoly & Neukirch.

    .. math:: \frac{(\tau^2 + \nu\kappa^2)^2}{4(1-\nu)\,\kappa^2}\,\varphi(\mu), \qquad
              \mu^4 = \tfrac{3}{16}(1-\nu^2)\,\beta^2\kappa^2

    Parameters
    ----------
    kappa, tau : curvature and twist [1/L], of one shape.
    beta : D^2/(t L).
    """
    square = np.maximum(np.asarray(kappa, dtype=float) ** 2, 1e-18)  # the ratio phi/kappa^2 has a limit
    mu = (3.0 / 16.0 * (1.0 - poisson**2) * beta**2 * square) ** 0.25
    return (np.asarray(tau) ** 2 + poisson * square) ** 2 * width_function(mu) / (4.0 * (1.0 - poisson) * square)


def width_effect(solution: Solution, band: Band) -> float:
    """Energy that the width adds to a state, as a part of its energy.

    An equilibrium is stationary, so the added energy at the rod's own shape is right to first order in the width
    parameter.

    Parameters
    ----------
    solution : a state of the rod.
    band : of the same Poisson's ratio.
    """
    check_rod(solution)
    check_type("band", band, Band, "a Band such as Band(240.0, 3.0, 0.127)")
    state = RodState(solution).at_gauss_points()
    added = width_energy(state.k1, state.tau, band.width_parameter, band.poisson)
    return solution.mean(added) / solution.mean(state.energy_density)
