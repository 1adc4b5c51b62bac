"""Images of found states under the symmetries of their setting, which a search need not meet by itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodatlas.continuation import Solution, image
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import has_partner, pair_member, reverse, symmetries_at
from rodatlas.states.result import FoundState

SAME = 1e-5  # relative difference of energy, height, force and moment at s = 0 below which two states are one


def with_images(found: Sequence[Sequence[FoundState]]) -> list[list[FoundState]]:
    """States of one class at one setting, and the images of each that are not among them.

    The mirrors of planar clamps, say, make another state of each one that is not planar. What they make of a state is
    one as well, of the same index, and is listed beside it as often as it was met.

    Parameters
    ----------
    found : groups of states, those of one group counted once; the reversal of each is there already.
    """
    out = [list(group) for group in found]
    first = next((group[0].solution for group in out if group), None)
    names = [name for name in symmetries_at(first) if name != "reversal"] if first is not None else []
    if not names:
        return out
    known = [(s.solution["energy"], _marks(s.solution)) for group in out for s in group]
    for group in out:
        for name in names:
            new = image(rod_problem(), name, group[0].solution)
            if _is_known(new, known):
                continue
            pair = has_partner(new)
            for one in (new, reverse(new)) if pair else (new,):
                group.append(replace(group[0], solution=one, pair=pair_member(one) if pair else None))
                known.append((one["energy"], _marks(one)))
    return out


def _marks(solution: Solution) -> np.ndarray:
    """(7,) height, and force and moment at s = 0 in space: no two states share them."""
    rod = RodState(solution)
    return np.concatenate([[rod.height], rod.force[0], rod.moment[0]])


def _is_known(solution: Solution, known: Sequence[tuple[float, np.ndarray]]) -> bool:
    energy, marks = solution["energy"], _marks(solution)
    size = SAME * (1.0 + np.array([0.0, *[np.linalg.norm(marks[1:4])] * 3, *[np.linalg.norm(marks[4:])] * 3]))
    return any(
        abs(energy - other) <= SAME * (1.0 + energy) and bool((np.abs(marks - theirs) <= size).all())
        for other, theirs in known
    )
