"""Stable stretches of branches and what bounds them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.continuation import Branch, EndReason, Point, Solution, SpecialPoint


@dataclass(frozen=True)
class Bound:
    """One end of a stable stretch: a special point of the branch, its origin, or the end of the range.

    `kind` is 'fold', 'branch point', 'range' or 'smooth'; `special` is None for the latter two.
    """

    kind: str
    solution: Solution
    arclength: float
    special: SpecialPoint | None = None


@dataclass(frozen=True)
class Segment:
    """A maximal stretch of a branch on which the index is zero, oriented so that what varies increases on the whole.

    `points` lie strictly inside; `low` and `high` are its ends.
    """

    followed: Followed
    points: tuple[Point, ...]
    low: Bound
    high: Bound

    @property
    def solutions(self) -> list[Solution]:
        """All solutions from end to end."""
        return [self.low.solution, *[p.solution for p in self.points], self.high.solution]


def stable_segments(
    followed: Followed, origin: SpecialPoint | None, value: Callable[[Solution], float]
) -> list[Segment]:
    """Stable segments of a branch in order.

    Parameters
    ----------
    origin : the branch point at which a side branch starts.
    value : of what varies.
    """
    branch = followed.branch
    runs: list[list[int]] = []
    for i, point in enumerate(branch.points):
        if point.index != 0:
            continue
        if runs and runs[-1][-1] == i - 1 and not _specials(branch, i - 1, i, inside=True):
            runs[-1].append(i)
        else:
            runs.append([i])
    last = len(branch) - 1
    if branch.closed and len(runs) > 1 and runs[0][0] == 0 and runs[-1][-1] == last:
        runs[0] = [*runs.pop(), *runs[0][1:]]
    return [_segment(followed, run, origin, value) for run in runs]


def _specials(branch: Branch, one: int, two: int, inside: bool = False) -> list[SpecialPoint]:
    """Folds and branch points between two points of a branch, or strictly between them."""
    low, high = sorted((branch.points[one].arclength, branch.points[two].arclength))
    if inside:
        low, high = low + 1e-12, high - 1e-12
    return [x for x in branch.special if low <= x.arclength <= high and x.kind in ("fold", "branch point")]


def _segment(
    followed: Followed, run: list[int], origin: SpecialPoint | None, value: Callable[[Solution], float]
) -> Segment:
    points = followed.branch.points
    before = _bound(followed.branch, run[0], -1, origin)
    after = _bound(followed.branch, run[-1], +1, origin)
    ends = (before.arclength, after.arclength)
    inner = [points[i] for i in run if not any(abs(points[i].arclength - end) < 1e-12 for end in ends)]
    if value(after.solution) < value(before.solution):
        return Segment(followed, tuple(reversed(inner)), after, before)
    return Segment(followed, tuple(inner), before, after)


def _bound(branch: Branch, at: int, side: int, origin: SpecialPoint | None) -> Bound:
    """What lies beyond point `at` in one direction (side -1 or +1)."""
    here = branch.points[at]
    beyond = at + side
    last = beyond if 0 <= beyond < len(branch.points) else at
    inside = _specials(branch, at, last)
    if inside:
        first = min(inside, key=lambda x: abs(x.arclength - here.arclength))
        return Bound(first.kind, first.solution, first.arclength, first)
    edge = branch.points[last]
    starts_at_origin = side < 0 and last == 0 and branch.ends[0] is EndReason.BRANCH_POINT
    if starts_at_origin and origin is not None:
        return Bound("branch point", origin.solution, edge.arclength, origin)
    return Bound("range", edge.solution, edge.arclength)


def with_chained_indices(specials: Sequence[SpecialPoint]) -> tuple[SpecialPoint, ...]:
    """The bifurcations of a branch; where two lie between neighboring points, the index between them is told.

    A fold and a simple branch point change the index by one each. Of two without a computed point between them, with a
    change by two in all, each has half of it; a change by none leaves the index between them open.
    """
    out = list(specials)
    for i in range(len(out) - 1):
        one, two = out[i], out[i + 1]
        (before, _), (_, after) = one.index, two.index
        together = one.bracket == two.bracket and (i + 2 == len(out) or out[i + 2].bracket != two.bracket)
        if together and before is not None and after is not None and abs(after - before) == 2:
            middle = (before + after) // 2
            out[i], out[i + 1] = replace(one, index=(before, middle)), replace(two, index=(middle, after))
    return tuple(out)
