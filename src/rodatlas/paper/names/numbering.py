"""The numbers 0 to 18 of bifurcations in the paper, given by what each one does.

A number follows from the named state that ends at the bifurcation, or from the place of the bifurcation next to a
numbered one on the same branch: see the table below and :func:`number_neighbors`. Bifurcations of states that the
paper does not number have none.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.continuation import SpecialPoint
from rodatlas.model.nomenclature import LocusTables

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

# number -> (kind, Morse indices on the two sides or None, number) of the next bifurcations on the unstable side
NEIGHBORS: dict[int, list[tuple[str, tuple[int, int] | None, int]]] = {
    3: [("fold", (1, 2), 14)],  # once 8 and 10 have annihilated, between them
    6: [("branch point", (1, 2), 8)],
    14: [("branch point", (1, 2), 8), ("branch point", (2, 3), 0)],
    8: [("branch point", (2, 3), 0)],  # where highly twisted states leave the branch of the third mode
    7: [("branch point", None, 9), ("fold", None, 18)],
    9: [("fold", None, 7)],
    11: [("fold", None, 13)],
    15: [("fold", None, 16)],
}
BARRIERS = {3, 4, 10, 11}  # numbers past which no neighbor is looked for

LOCI = LocusTables(  # in angle and shear
    known=tuple(range(19)),
    starts=(15.0, 55.0, 60.0),
    elsewhere={16: 55.0, 17: 60.0},
    successors={
        (4, ("extremum",)): 9,  # the two pitchforks of U vanish together
        (11, ("extremum",)): 15,  # those that bound uUu, too
        (6, ("cusp",)): 7,  # the folds that bound w
        (7, ("cusp",)): 18,  # 7 vanishes with one of the two folds born when w touches U
        (7, ("cusp", "extremum")): 13,  # the other one
        (6, ("cusp", "extremum")): 14,  # born when U-w meets uUui
    },
    born={3: 5, 4: 12},
    shared={10: 8},  # the two annihilate
    roles={
        number: frozenset((state, side) for (state, side, _), n in ENDS.items() if n == number)
        for number in sorted(set(ENDS.values()))
    },
)


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
        for kind, indices, given in NEIGHBORS.get(numbers[at], []):
            found = _next(special, at, step, (kind, indices), numbers, closed) if step else None
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
    special: Sequence[SpecialPoint], at: int, step: int, wanted: tuple[str, tuple[int, int] | None],
    numbers: dict[int, int], closed: bool,
) -> int | None:  # fmt: skip
    """Position of the first special point of a kind and indices, at most two away and not past another numbered end."""
    for place in range(at + step, at + 3 * step, step):
        i = place % len(special) if closed else place
        if not 0 <= i < len(special) or numbers.get(i) in BARRIERS:
            return None
        if i not in numbers and _is(special[i], *wanted):
            return i
    return None


def _is(special: SpecialPoint, kind: str, indices: tuple[int, int] | None) -> bool:
    """Whether a special point is of a kind, and lies between parts of a branch with these indices, in either order."""
    return special.kind == kind and (indices is None or sorted(i for i in special.index if i is not None) == [*indices])


def number_without_states(special: Sequence[SpecialPoint], closed: bool) -> dict[int, int]:
    """Numbers on a symmetric branch that holds no stable state, by the Morse index on both sides.

    On the branch of the third mode at psi0 = 0, where w has not been born yet: branch points 0, 8 and 9, at which the
    index goes from 3 to 2, to 1, and to 2 again. On the closed branch that uUu has left: folds 13 and 16, at the ends
    of the stretch of index one, in order of shear.
    """
    branch_points = [i for i, x in enumerate(special) if x.kind == "branch point"]
    kinds = [sorted(n for n in special[i].index if n is not None) for i in branch_points]
    if not closed and kinds == [[2, 3], [1, 2], [1, 2]]:
        return dict(zip(branch_points, (0, 8, 9), strict=True))
    folds = [i for i, x in enumerate(special) if _is(x, "fold", (1, 2))]
    if closed and len(folds) == 2:
        low, high = sorted(folds, key=lambda i: special[i].solution["dD"])
        return {low: 13, high: 16}
    return {}
