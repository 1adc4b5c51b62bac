"""Names of stable states at one setting, where their shapes decide; the others need their branches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import is_twisted
from rodatlas.states.names import ZERO_HEIGHT, middle_curvature

WOUND = np.pi  # more twist than this, int |tau| in one sense [rad], is no named state of high shear


def names_of(states: Sequence[tuple[Solution, str, int, str]]) -> list[str | None]:
    """Names of all states at one setting, given as (solution, class, index, '+', '-' or '' when symmetric).

    Reversal-broken ones are TU or TW when strongly twisted, and with three inflections of k1 US, WS or S, by height.
    Symmetric ones bent up in the middle
    are U with two and uUu with four; those bent down are W with two and negative height. With four they are w and uUui,
    of which the lower is uUui; a single one is named when it is below the clamps.
    """
    names: list[str | None] = []
    dimpled = []
    for i, (solution, cls, index, side) in enumerate(states):
        rod = RodState(solution)
        k1 = rod.inflections["k1"]
        wound = abs(solution.mean(solution.stages[..., solution.unknowns.index("tau")])) > WOUND
        names.append(None)
        if cls != "+" or index != 0 or wound:
            continue
        if side:
            if is_twisted(solution):
                names[-1] = ("TU" if rod.height > 0 else "TW") + side
            elif k1 == 3:
                names[-1] = ("S" if abs(rod.height) < ZERO_HEIGHT else "US" if rod.height > 0 else "WS") + side
        elif middle_curvature(solution) > 0:
            names[-1] = {2: "U", 4: "uUu"}.get(k1) if rod.height > 0 else None
        elif k1 == 2 and rod.height < 0:
            names[-1] = "W"
        elif k1 == 4:
            dimpled.append((rod.height, i))
    dimpled.sort()
    if dimpled and (len(dimpled) == 2 or dimpled[0][0] < 0):
        names[dimpled[0][1]] = "uUui"
    if len(dimpled) == 2:
        names[dimpled[1][1]] = "w"
    return names
