"""Follow everything connected: branches in shear at one setting, through folds and branch points."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from rodatlas.atlas.settings import SliceSettings
from rodatlas.continuation import (
    BVP,
    Branch,
    EndReason,
    MeshControl,
    NotConverged,
    Point,
    Solution,
    SpecialPoint,
    Status,
    StepControl,
    TraceOptions,
    solve,
    switch,
    trace,
)
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.planar import planar_states
from rodatlas.rods.stability import morse_index_of
from rodatlas.rods.symmetry import is_symmetric, mirror_angle

Progress = Callable[[str, int, int], None]
"""Called with (what is being done, branches finished, pieces of work known to be left)."""
FREE = ("dD",)


@dataclass(frozen=True)
class Followed:
    """One branch with what the rod's symmetry says about it.

    Attributes
    ----------
    id : name of the branch: its seed, then the numbers of the branch points through which it was reached.
    symmetric : whether its states equal their reversals; pair : whether the reversed branch is another one.
    origin : id and number (in that branch's list of special points) of the branch point at which it starts.
    """

    id: str
    branch: Branch
    symmetric: bool
    pair: bool
    origin: tuple[str, int] | None = None


@dataclass
class Frontier:
    """Branches found so far, branch points already used, and what is left to do."""

    branches: list[Followed] = field(default_factory=list)
    used: list[SpecialPoint] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    pending: int = 0


class BranchCache:
    """Keeps finished branches; this one forgets them at once (see :mod:`rodatlas.atlas.store` for files)."""

    def get(self, key: str) -> Branch | None:
        return None

    def put(self, key: str, branch: Branch) -> None:
        pass


def follow_slice(
    settings: SliceSettings, cache: BranchCache | None = None, progress: Progress | None = None, carry: bool = True
) -> Frontier:
    """All branches in shear that are connected to U, W and the third mode, and those carried over in angle.

    Branches that are not connected inside the shear range (uUu above 27.7 degrees, say) are reached by following
    the stable and once-unstable states of a reference angle in the angle, at fixed shear, unless `carry` is off.
    """
    cache = BranchCache() if cache is None else cache
    frontier = Frontier()
    say = _Reporter(progress, frontier)
    _follow_seeds(frontier, planar_seeds(settings, say, frontier), settings, cache, say)
    if carry and abs(settings.angle_deg - settings.reference_angle_deg) > 1e-9:
        say(f"reference slice at {settings.reference_angle_deg:g} degrees")
        seeds = carried_seeds(settings, cache, say, frontier)
        _follow_seeds(frontier, seeds, settings, cache, say)
    return frontier


def planar_seeds(settings: SliceSettings, say: _Reporter, frontier: Frontier) -> Iterator[tuple[str, Solution]]:
    """U, W and the third mode at dD = 0; what is missing is said in the warnings."""
    say("planar states from the circle")
    states, missing = planar_states(settings.a, settings.angle, settings.compression, settings.tolerance)
    if missing:
        frontier.warnings.append(f"planar states not reached: {missing}")
    for name, ident in (("U", "U"), ("W", "W"), ("third mode", "M3")):
        if name in states:
            yield ident, states[name]
    if settings.angle == 0.0 and "third mode" in states:
        yield "M3i", mirror_angle(states["third mode"])  # the angle mirror maps the slice to itself


def carried_seeds(
    settings: SliceSettings, cache: BranchCache, say: _Reporter, frontier: Frontier
) -> Iterator[tuple[str, Solution]]:
    """States of the reference angle with index 0 or 1, followed in the angle at fixed shears."""
    reference = settings.at_reference()
    base = Frontier()
    _follow_seeds(base, planar_seeds(reference, say, base), reference, _Prefixed(cache, "reference-"), say)
    options = trace_options(settings, stop=False, bounds={"psi0": _span(reference.angle, settings.angle)})
    options = _quiet(options)
    direction = math.copysign(1.0, settings.angle - reference.angle)
    for followed in base.branches:
        for k, start in enumerate(crossings(followed.branch, settings.carried_shears, settings)):
            name = f"{followed.id}@{reference.angle_deg:g}.{k + 1}"
            known = cache.get(f"angle-{name}")
            if known is None:
                try:
                    known = trace(rod_problem(), start, ("psi0",), options, both=False, direction=direction)
                except NotConverged:
                    continue
                cache.put(f"angle-{name}", known)
            end = known.points[-1].solution
            if known.ends[1] is EndReason.RANGE and abs(end["psi0"] - settings.angle) < 1e-9:
                yield name, end


def crossings(branch: Branch, shears: tuple[float, ...], settings: SliceSettings, most: int = 1) -> list[Solution]:
    """Solutions of a branch exactly at given shears, where its index is at most `most`."""
    found = []
    for one, two in zip(branch.points[:-1], branch.points[1:], strict=True):
        for shear in shears:
            a, b = one.solution["dD"] - shear, two.solution["dD"] - shear
            if a * b < 0 and (two.index if two.index is not None else 0) <= most:
                near = one.solution if abs(a) < abs(b) else two.solution
                state = state_at_shear(near, shear, settings)
                if state is not None:
                    found.append(state)
    return found


def lies_on(branch: Branch, solution: Solution, settings: SliceSettings) -> bool:
    """Whether a solution (or its reversal, which has the same height and energy) is on a branch."""
    shear = solution["dD"]
    for one, two in zip(branch.points[:-1], branch.points[1:], strict=True):
        a, b = one.solution["dD"] - shear, two.solution["dD"] - shear
        if a * b > 0 or not _between(one, two, solution):
            continue
        near = one.solution if abs(a) < abs(b) else two.solution
        state = near if near["dD"] == shear else state_at_shear(near, shear, settings)
        if state is not None and same_state(state, solution):
            return True
    return False


def same_state(one: Solution, two: Solution, tolerance: float = 1e-5) -> bool:
    """Whether two solutions at one setting are equal up to reversal: same shear, height and energy."""
    return (
        abs(one["dD"] - two["dD"]) < tolerance
        and abs(one["height"] - two["height"]) < tolerance
        and abs(one["energy"] - two["energy"]) < tolerance * max(1.0, abs(one["energy"]))
    )


def state_at_shear(near: Solution, shear: float, settings: SliceSettings) -> Solution | None:
    """Newton from a neighbouring solution to an exact shear; None when it does not converge."""
    options = TraceOptions(mesh=MeshControl(tolerance=settings.tolerance))
    try:
        return solve(rod_problem(), near.with_parameters(dD=shear), FREE, options)
    except NotConverged:
        return None


def trace_options(
    settings: SliceSettings, stop: bool = True, bounds: dict[str, tuple[float, float]] | None = None
) -> TraceOptions:
    """Options of every branch of a slice."""
    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=2.0),
        bounds=bounds or {"dD": (settings.shear_min, settings.shear_max)},
        index=morse_index_of,
        stop_at=_meets_symmetric if stop else None,
    )


def _follow_seeds(
    frontier: Frontier, seeds: Iterator[tuple[str, Solution]], settings: SliceSettings, cache: BranchCache,
    say: _Reporter,
) -> None:  # fmt: skip
    bvp, options = rod_problem(), trace_options(settings)
    for ident, seed in seeds:
        if any(lies_on(f.branch, seed, settings) for f in frontier.branches):
            continue
        branch = cache.get(ident)
        if branch is None:
            say(f"branch {ident}")
            try:
                branch = trace(bvp, seed, FREE, replace(options, on_point=say.watch(ident)))
            except NotConverged as error:
                frontier.warnings.append(f"branch {ident}: {error}")
                continue
            cache.put(ident, branch)
        symmetric = is_symmetric(seed)
        _add(frontier, Followed(ident, branch, symmetric, not symmetric))
        _follow_side_branches(frontier, len(frontier.branches) - 1, bvp, settings, cache, say)


def _follow_side_branches(
    frontier: Frontier, start: int, bvp: BVP, settings: SliceSettings, cache: BranchCache, say: _Reporter
) -> None:
    """Switch at every unused branch point of the branches from `start` on; new branches join the end of the list."""
    options = trace_options(settings)
    at = start
    while at < len(frontier.branches):
        parent = frontier.branches[at]
        at += 1
        for number, special in enumerate(parent.branch.special):
            if special.kind != "branch point" or _is_used(frontier, special):
                continue
            frontier.pending = sum(_left(frontier, f) for f in frontier.branches[at - 1 :])
            frontier.used.append(special)
            base_symmetric = is_symmetric(special.solution)
            if special.status is not Status.CONVERGED:
                frontier.warnings.append(f"branch {parent.id}: {special!r}: its side branch is missing")
                continue
            for side in (1, -1):
                ident = f"{parent.id}.{number + 1}{'' if side == 1 else 'b'}"
                branch = cache.get(ident)
                if branch is None:
                    say(f"branch {ident}")
                    watched = replace(options, on_point=say.watch(ident))
                    branch = switch(bvp, special, FREE, watched, side=side)
                    if branch is None:
                        frontier.warnings.append(f"branch {parent.id}: no second branch found at {special!r}")
                        break
                    cache.put(ident, branch)
                symmetric = is_symmetric(branch.points[len(branch) // 2].solution)
                _add(frontier, Followed(ident, branch, symmetric, not symmetric, (parent.id, number)))
                if base_symmetric and not symmetric:
                    break  # the other side is the reversed branch


def _left(frontier: Frontier, followed: Followed) -> int:
    """Branch points of a branch that are still to be used."""
    return sum(x.kind == "branch point" and not _is_used(frontier, x) for x in followed.branch.special)


def _add(frontier: Frontier, followed: Followed) -> None:
    frontier.branches.append(followed)
    branch = followed.branch
    frontier.warnings += [f"branch {followed.id}: {d}" for d in branch.discrepancies]
    for special in branch.special:
        if special.kind == "branch point" and not followed.symmetric and is_symmetric(special.solution):
            frontier.used.append(special)  # this branch is the side branch of that point
    for reason in branch.ends:
        if reason in (EndReason.MIN_STEP, EndReason.MESH_LIMIT, EndReason.POINT_LIMIT):
            frontier.warnings.append(f"branch {followed.id} stops early: {reason.value}")


def _is_used(frontier: Frontier, special: SpecialPoint) -> bool:
    return any(same_state(special.solution, other.solution) for other in frontier.used)


def _meets_symmetric(special: SpecialPoint, last: Point) -> bool:
    """A reversal-broken branch ends where it meets a symmetric one; beyond it is its own reversal."""
    return special.kind == "branch point" and is_symmetric(special.solution) and not is_symmetric(last.solution)


def _between(one: Point, two: Point, solution: Solution) -> bool:
    """Cheap filter: height and energy lie near the segment between two points."""
    for name, slack in (("height", 0.01), ("energy", 1.0)):
        low, high = sorted((one.solution[name], two.solution[name]))
        if not low - slack <= solution[name] <= high + slack:
            return False
    return True


def _span(a: float, b: float) -> tuple[float, float]:
    return (min(a, b), max(a, b))


def _quiet(options: TraceOptions) -> TraceOptions:
    """No events and no index: the branch only carries a state somewhere; it must not pass a fold."""
    return replace(options, index=None, locate=("fold",), max_folds=0, stop_at=None)


class _Reporter:
    """Tells a progress callback what is being done; `watch` makes a branch report its points."""

    def __init__(self, progress: Progress | None, frontier: Frontier):
        self._progress, self._frontier = progress, frontier

    def __call__(self, message: str) -> None:
        if self._progress is not None:
            self._progress(message, len(self._frontier.branches), self._frontier.pending)

    def watch(self, name: str) -> Callable[[Point], None]:
        count = 0

        def on_point(point: Point) -> None:
            nonlocal count
            count += 1
            self(f"branch {name}: {count} points, shear {point.solution['dD']:.4f}")

        return on_point


class _Prefixed(BranchCache):
    """A cache whose keys carry a prefix."""

    def __init__(self, inner: BranchCache, prefix: str):
        self._inner, self._prefix = inner, prefix

    def get(self, key: str) -> Branch | None:
        return self._inner.get(self._prefix + key)

    def put(self, key: str, branch: Branch) -> None:
        self._inner.put(self._prefix + key, branch)
