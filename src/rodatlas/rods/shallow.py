r"""The first buckled state of a rod that is hardly compressed, from the linear theory of shallow arches.

Between level clamps (psi0 = 0) at a small compression dL the slope :math:`\theta` of the center line obeys

.. math:: a\,\theta'' + P\,\theta = 0, \qquad \theta(0) = \theta(1) = 0, \qquad \tfrac12\int_0^1 \theta^2\,ds = dL

so that :math:`\theta = 2\sqrt{dL}\,\sin 2\pi s` at Euler's load :math:`P = 4\pi^2 a` of a clamped column (Timoshenko &
Gere 1961, sections 2.1 and 7.1). The next order is smaller by dL, so this is a start wherever dL is small.
"""

from __future__ import annotations

import math

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.formulation import held_by
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import FULL, rod_problem
from rodatlas.rods.poses import Pose

SHALLOW = 0.05  # compression below which the linear theory is a good start


def first_mode(a: float, compression: float) -> Solution:
    """The planar state with one hump between level clamps, as a first guess.

    Parameters
    ----------
    a : EI1/GJ; compression : dL, small.
    """
    parameters = {**rod_problem().parameters, "a": a, "psi0": 0.0, "dL": compression}
    amplitude, wave = 2 * math.sqrt(compression), 2 * math.pi

    def fields(s: np.ndarray) -> np.ndarray:
        slope = amplitude * np.sin(wave * s)
        height = amplitude * (1 - np.cos(wave * s)) / wave
        # cos(slope) to second order, so that the right end lies at 1 - dL
        along = s - compression * (s - np.sin(2 * wave * s) / (2 * wave))
        quaternion = np.array([Pose.tilted(angle, (0.0, 0.0, 0.0)).quaternion for angle in slope])
        position = np.column_stack([along, height, 0 * s])
        law, thrust = LinearLaw(a), np.array([-a * wave**2, 0.0, 0.0])
        moment = np.array([0.0, 0.0, a * amplitude * wave])  # a theta' about z, toward which theta grows
        return FULL.values(held_by(law, thrust, moment, quaternion, position, np.zeros(3)), parameters)

    return Solution.from_function(fields, FULL.unknowns, parameters)
