"""Words that figures share: the labels of axes with their units, and the setting that stands above a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection

    from rodatlas.continuation import Solution

ANGLE_LABEL = r"clamp angle $\psi_0$  (degrees)"
SHEAR_LABEL = r"shear $\Delta D$  (units of $L$)"
HEIGHT_LABEL = r"height $h=\int y\,\mathrm{d}s$  (units of $L$)"
ARCLENGTH_LABEL = r"arclength $s$  (units of $L$)"
CURVATURE_LABEL = r"curvature $\kappa_1$  ($1/L$)"
TWIST_LABEL = r"twist $\tau$  ($1/L$)"

# symbol and unit of each quantity, in the order in which they stand above a figure
QUANTITIES = {
    "psi0": (r"\psi_0", r"^\circ"),
    "left": (r"\psi_\mathrm{left}", r"^\circ"),
    "right": (r"\psi_\mathrm{right}", r"^\circ"),
    "dL": (r"\Delta L", r"\,L"),
    "dY": (r"\Delta Y", r"\,L"),
    "twist_left": (r"\varphi_\mathrm{left}", r"^\circ"),
    "twist_right": (r"\varphi_\mathrm{right}", r"^\circ"),
    "dD": (r"\Delta D", r"\,L"),
    "nu": (r"\nu", ""),
    "a": (r"EI_1/GJ", ""),
}


def equation(name: str, value: float, digits: int = 6) -> str:
    """A quantity of `QUANTITIES` and its value: angles in degrees, dL, dY and dD in units of L, nu, or a = EI1/GJ."""
    symbol, unit = QUANTITIES[name]
    return rf"${symbol}={round(value, 9) + 0.0:.{digits}g}{unit}$"


def setting_text(**values: float) -> str:
    """Equations in one line, in the order of `QUANTITIES`.

    Parameters
    ----------
    values : angles in degrees, dL, dY and dD in units of L, nu, a.
    """
    return ",  ".join(equation(name, values[name]) for name in QUANTITIES if name in values)


def setting_of(solution: Solution, without: Collection[str] = ()) -> str:
    """The setting of one solution of a rod problem: what stands in its parameters, but for those left out.

    Both angles where they differ; offset and twists where there are any.
    """
    known = dict(zip(solution.parameter_names, solution.parameters.tolist(), strict=True))
    values = {name: known[name] for name in ("dL", "dD", "a")}
    turns = {"left": known.get("turn_left", 0.0), "right": known.get("turn_right", 0.0)}
    angles = {side: known["psi0"] + turn for side, turn in turns.items()} if any(turns.values()) else {}
    angles = angles or {"psi0": known["psi0"]}
    angles |= {name: known[name] for name in ("twist_left", "twist_right") if known.get(name)}
    values |= {name: float(np.degrees(angle)) for name, angle in angles.items()}
    values |= {"dY": known["dY"]} if known.get("dY") else {}
    return setting_text(**{name: value for name, value in values.items() if name not in without})
