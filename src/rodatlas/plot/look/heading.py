"""Words that figures share: labels of axes along a band, and the setting that stands above a figure."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

from rodatlas.model import Control
from rodatlas.model.model import parameters_of
from rodatlas.rods.model import CONTROLS

if TYPE_CHECKING:
    from rodatlas.continuation import Solution

ARCLENGTH_LABEL = r"arclength $s$  (units of $L$)"
CURVATURE_LABEL = r"curvature $\kappa_1$  ($1/L$)"
TWIST_LABEL = r"twist $\tau$  ($1/L$)"


def setting_text(controls: Sequence[Control], values: Mapping[str, float]) -> str:
    """Equations in one line, from the last control to the first; zeros are left out where zero is the default.

    Parameters
    ----------
    values : of some of the controls by name, in the user's units.
    """
    told = [c for c in reversed(controls) if c.name in values and (values[c.name] != 0.0 or c.default != 0.0)]
    return ",  ".join(f"${c.equation(values[c.name])}$" for c in told)


def setting_of(solution: Solution, without: Collection[str] = (), controls: Sequence[Control] = CONTROLS) -> str:
    """The setting of one solution.

    Parameters
    ----------
    without : names of controls that are left out.
    controls : of its problem, those of a band by default; what it has no parameter for is left out.
    """
    parameters = parameters_of(solution)
    held = [c for c in controls if not c.derived and c.name not in without and c.parameter in parameters]
    return setting_text(held, {c.name: c.value(parameters) for c in held})
