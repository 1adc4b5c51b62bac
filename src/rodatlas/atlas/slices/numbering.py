"""The numbers 0 to 18 of bifurcations in the paper, given by what each one does.

A number follows from the named state that ends at the bifurcation, or from the place of the bifurcation next to a
numbered one on the same branch: see the table below and :func:`number_neighbors`. Bifurcations of states that the
paper does not number have none.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.continuation import SpecialPoint

# (name of the state, which end of it, kind of bifurcation) -> number
ENDS = {
    ("TW+-", "high", "fold"): 1,
    ("TW+-", "low", "fold"): 1,  # its image in the shear mirror
    ("TU+-", "high", "fold"): 2,
    ("TU+-", "low", "fold"): 2,
    ("W", "high", "pitchfork"): 3,
    ("U", "high", "pitchfork"): 4,
    ("WS+-", "high", "fold"): 5,
    ("w", "high", "fold"): 6,
    ("U", "high", "fold"): 6,
    ("w", "low", "fold"): 7,
    ("w", "low", "pitchfork"): 9,
    ("uUui", "low", "pitchfork"): 10,
    ("uUu", "low", "pitchfork"): 11,
    ("US+-", "low", "fold"): 12,
    ("uUui", "high", "fold"): 14,
    ("uUu", "high", "pitchfork"): 15,
    ("uUu", "high", "fold"): 16,
    ("US+-", "high", "fold"): 17,
}

# number -> what the next bifurcations on the unstable side are, by kind
NEIGHBORS = {
    6: {"branch point": 8},
    14: {"branch point": 8},
    8: {"branch point": 0},  # where highly twisted states leave the branch of the third mode
    7: {"branch point": 9, "fold": 18},
    9: {"fold": 7},
    11: {"fold": 13},
    15: {"fold": 16},
}
BARRIERS = {3, 4, 10, 11}  # numbers past which no neighbor is looked for


def number_neighbors(special: Sequence[SpecialPoint], known: dict[int, int], closed: bool = False) -> dict[int, int]:
    """Numbers of bifurcations that follow from their neighbors on the same branch.

    Parameters
    ----------
    special : folds and branch points of a branch, in order.
    known : position in `special` -> number, from the states that end there.
    closed : whether the branch goes on at its other end.

    Returns
    -------
    the same mapping with the neighbors added.
    """
    numbers = dict(known)
    queue = list(known)
    for at in queue:
        step = _unstable_side(special[at])
        for kind, given in NEIGHBORS.get(numbers[at], {}).items():
            found = _next(special, at, step, kind, numbers, closed) if step else None
            if found is not None and given not in numbers.values():
                numbers[found] = given
                queue.append(found)
    return numbers


def _unstable_side(special: SpecialPoint) -> int:
    """+1 or -1: the direction along the branch in which the index grows."""
    before, after = special.index
    if before is None or after is None or before == after:
        return 0
    return 1 if after > before else -1


def _next(
    special: Sequence[SpecialPoint], at: int, step: int, kind: str, numbers: dict[int, int], closed: bool
) -> int | None:
    """Position of the first special point of a kind, at most two away and not past another numbered end."""
    for place in range(at + step, at + 3 * step, step):
        i = place % len(special) if closed else place
        if not 0 <= i < len(special) or numbers.get(i) in BARRIERS:
            return None
        if special[i].kind == kind and i not in numbers:
            return i
    return None
