"""Energy densities before and after the jump from US+ at fold 17, 60 degrees: figure 17 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.names.yu_hanna import COLORS

if TYPE_CHECKING:
    from rodatlas.atlas import Slice
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources

ANGLE_DEG, FOLD = 60.0, 17
PUSH = 0.02  # how far the band is moved along the mode of the fold [L]
RELEASED = 0.01  # part of the energy that a descent must release to count as a jump
END = 0.15  # of the length, near s = 1


class Jump(NamedTuple):
    """A stable state at a fold, and the state in which the band ends: its name and solution."""

    before: Solution
    name: str
    after: Solution


def draw(sources: Sources) -> Drawn:
    """Both states and where they store their energy."""
    from rodatlas.plot.shapes.energies import draw_energies

    jump = snap_at_fold(sources.slice_at(ANGLE_DEG))
    caption = (
        f"Energy densities (doubled) at fold {FOLD} at {ANGLE_DEG:g} degrees, before and after the jump: US+ at the "
        f"fold, and {jump.name} on the path U-w-uUui, where the descent of the energy ends that starts there along the "
        "mode of the fold."
    )
    figure = draw_energies({"US+": jump.before, jump.name: jump.after}, COLORS)
    return Drawn(figure, caption, numbers_of(jump), remarks_on(jump))


def snap_at_fold(found: Slice) -> Jump:
    """The jump from the state US+ at fold 17, decided by descent of the energy.

    Raises
    ------
    ValueError
        when the slice has no such fold, or no descent leaves it.
    """
    from rodatlas.rods import critical_mode, plus_member
    from rodatlas.states.descent import descend

    ends = [s.high.solution for s in found.states if s.name == "US+-" and s.high.number == FOLD]
    if not ends:
        raise ValueError(f"slice: expected a state US+- that ends at fold {FOLD}, got {found!r}")
    before = plus_member(ends[0])
    mode = critical_mode(before)
    ended = [descend(mode.moved(push), tolerance=found.settings.tolerance) for push in (PUSH, -PUSH)]
    left = [s for s in ended if s is not None and s["energy"] < (1.0 - RELEASED) * before["energy"]]
    if len(left) != 1:
        raise ValueError(f"fold: expected one direction in which the band leaves it, got {len(left)}")
    return Jump(before, name_of(left[0], found), left[0])


def name_of(solution: Solution, found: Slice) -> str:
    """Name of the stable state of a slice that a solution is."""
    from rodatlas.atlas.slices.states.coexisting import coexisting_states
    from rodatlas.model.orbit import same_state

    for name, state in coexisting_states(found, found.settings.value(solution)).items():
        if same_state(found.settings.model, state, solution):
            return name
    raise ValueError(f"solution: expected a stable state of the slice, got {solution!r}")


def numbers_of(jump: Jump) -> tuple[Number, ...]:
    """Energies before and after, and the bending energy near s = 1."""
    numbers = [Number("shear of the jump", jump.before["dD"], "L")]
    for name, state in (("US+", jump.before), (jump.name, jump.after)):
        bending, twist = parts_of(state)
        numbers += [
            Number(f"energy of {name}", state["energy"], "GJ/L"),
            Number(f"bending energy of {name}", bending, "GJ/L"),
            Number(f"twisting energy of {name}", twist, "GJ/L"),
            Number(f"bending energy of {name} in s > {1 - END:g}", bending_near_end(state), "GJ/L"),
        ]
    return tuple(numbers)


def parts_of(state: Solution) -> tuple[float, float]:
    """Bending and twisting energy [GJ/L]."""
    from rodatlas.rods import RodState

    return RodState(state).energy_parts


def bending_near_end(state: Solution) -> float:
    """Bending energy of the last part of the length [GJ/L]."""
    from rodatlas.rods import RodState

    last = RodState(state).at(np.linspace(1.0 - END, 1.0, 2001))
    bending, _ = last.energy_density_parts
    return float(np.trapezoid(bending, last.s))


def remarks_on(jump: Jump) -> tuple[str, ...]:
    released = jump.before["energy"] - jump.after["energy"]
    near = bending_near_end(jump.before) - bending_near_end(jump.after)
    return (
        f"The jump releases {released / jump.before['energy']:.0%} of the energy; bending in s > {1 - END:g} falls by "
        f"{near:.4g} GJ/L of the {released:.4g} GJ/L released.",
    )
