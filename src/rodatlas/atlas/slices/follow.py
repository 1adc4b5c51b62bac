"""Follow everything connected: branches in shear at one setting, through folds and branch points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from rodatlas.atlas.slices.cache import BranchCache, PrefixedCache
from rodatlas.atlas.slices.match import FREE, lies_on, same_state
from rodatlas.atlas.slices.search import Search, search_at, searched_shears
from rodatlas.atlas.slices.seeds import Seed, carried_seeds, planar_seeds, twisted_seeds
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import (
    Branch,
    EndReason,
    MeshControl,
    NotConverged,
    Point,
    SpecialPoint,
    Status,
    StepControl,
    TraceOptions,
    switch,
    trace,
)
from rodatlas.progress import Progress
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.stability import morse_index_of
from rodatlas.rods.symmetry import is_symmetric

Reference = Callable[[SliceSettings], list[tuple[str, Branch]] | None]
"""Gives names and branches of the slice with some settings from which states are carried, None when it has none."""

PLANAR = ("U", "W", "M3", "M3i")  # seeds of branches connected to planar states


@dataclass(frozen=True)
class Followed:
    """One branch with what the rod's symmetry says about it.

    Attributes
    ----------
    id : name of the branch: its seed, then the numbers of the branch points through which it was reached.
    symmetric : whether its states equal their reversals.
    origin : id and number (in that branch's list of special points) of the branch point at which it starts.
    """

    id: str
    branch: Branch
    symmetric: bool
    origin: tuple[str, int] | None = None

    @property
    def pair(self) -> bool:
        """Whether the reversed branch is another one."""
        return not self.symmetric

    @property
    def bifurcations(self) -> tuple[SpecialPoint, ...]:
        """Its folds and branch points, in order."""
        return tuple(x for x in self.branch.special if x.kind in ("fold", "branch point"))

    def __repr__(self) -> str:
        return f"Followed({self.id}, {'symmetric' if self.symmetric else 'one of a pair'}, {self.branch!r})"


@dataclass
class Frontier:
    """Branches and states found so far, branch points already used, warnings, and how many are left to use.

    `arrivals` are branch points of symmetric branches at which reversal-broken ones end: (id, number on that branch).
    """

    branches: list[Followed] = field(default_factory=list)
    used: list[SpecialPoint] = field(default_factory=list)
    arrivals: list[tuple[Followed, int]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    searches: list[Search] = field(default_factory=list)
    pending: int = 0

    def add(self, followed: Followed) -> None:
        """Take in a finished branch, and warn of what does not add up on it."""
        self.branches.append(followed)
        branch = followed.branch
        self.warnings += [f"branch {followed.id}: {d}" for d in branch.discrepancies]
        for number, special in enumerate(branch.special):
            if special.kind == "branch point" and not followed.symmetric and is_symmetric(special.solution):
                self.used.append(special)  # this branch is the side branch of that point
                self.arrivals.append((followed, number))
        unknown = [p.solution["dD"] for p in branch.points[1:] if p.index is None]
        if unknown:
            self.warnings.append(
                f"branch {followed.id}: stability not known at {len(unknown)} points, "
                f"shear {min(unknown):.5f} to {max(unknown):.5f}"
            )
        for reason in branch.ends:
            if reason in (EndReason.MIN_STEP, EndReason.MESH_LIMIT, EndReason.POINT_LIMIT):
                self.warnings.append(f"branch {followed.id} stops early: {reason.value}")

    def is_used(self, special: SpecialPoint) -> bool:
        """Whether the branches through a branch point have been followed."""
        return any(same_state(special.solution, other.solution) for other in self.used)

    def left_on(self, followed: Followed) -> int:
        """Branch points of a branch that are still to be used."""
        return sum(x.kind == "branch point" and not self.is_used(x) for x in followed.branch.special)


def follow_slice(
    settings: SliceSettings, cache: BranchCache | None = None, progress: Progress | None = None, carry: bool = True,
    reference: Reference | None = None,
) -> Frontier:  # fmt: skip
    """All branches in shear that are connected to U, W and the third mode, to TU and TW, and isolated ones.

    Branches that are not connected inside the shear range (uUu above 27.7 degrees, say) are reached by following
    states of reference slices in compression and angle, at fixed shear, and by a search for stable states at several
    shears, unless `carry` is off.

    Parameters
    ----------
    cache : asked for every branch before it is followed, and given it afterwards.
    progress : called as the work goes on.
    reference : branches of reference slices that are known already; they are followed where it gives None.
    """
    cache = BranchCache() if cache is None else cache
    frontier = Frontier()
    say = _Reporter(progress, frontier)
    _follow_planar(frontier, settings, cache, say)
    _follow_twisted(frontier, settings, cache, say)
    for start in settings.references() if carry else ():
        known = reference(start) if reference is not None else None
        if known is None:
            known = _followed_reference(start, frontier, cache, say)
        seeds, warnings = carried_seeds(known, start, settings, cache)
        frontier.warnings += warnings
        _follow_seeds(frontier, seeds, settings, cache, say)
        _follow_arrivals(frontier, settings, cache, say)
    if carry and settings.search:
        _follow_found(frontier, settings, cache, say)
    return frontier


def planar_branches(followed: Iterable[Followed]) -> list[tuple[str, Branch]]:
    """Of the branches of a slice, those that another slice carries states from: connected to planar states."""
    return [(f.id, f.branch) for f in followed if f.id.split(".")[0] in PLANAR]


def _followed_reference(
    start: SliceSettings, frontier: Frontier, cache: BranchCache, say: _Reporter
) -> list[tuple[str, Branch]]:
    """The branches of a reference slice that are connected to planar states."""
    say(f"reference slice at {start.angle_deg:g} degrees, dL = {start.compression:g}")
    found = Frontier()
    prefix = f"reference-{start.angle_deg:g}-{start.compression:g}-"
    _follow_planar(found, start, PrefixedCache(cache, prefix), say)
    frontier.warnings += [f"reference slice: {warning}" for warning in found.warnings]
    return [(f.id, f.branch) for f in found.branches]


def trace_options(settings: SliceSettings) -> TraceOptions:
    """Options of every branch of a slice."""
    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=20.0),
        bounds={"dD": (settings.shear_min, settings.shear_max)},
        index=morse_index_of,
        stop_at=_meets_symmetric,
    )


def _meets_symmetric(special: SpecialPoint, last: Point) -> bool:
    """A reversal-broken branch ends where it meets a symmetric one; beyond it is its own reversal."""
    return special.kind == "branch point" and is_symmetric(special.solution) and not is_symmetric(last.solution)


def _follow_planar(frontier: Frontier, settings: SliceSettings, cache: BranchCache, say: _Reporter) -> None:
    """All that is connected to the planar states."""
    say("planar states")
    seeds, warnings = planar_seeds(settings)
    frontier.warnings += warnings
    _follow_seeds(frontier, seeds, settings, cache, say)
    _follow_arrivals(frontier, settings, cache, say)


def _follow_twisted(frontier: Frontier, settings: SliceSettings, cache: BranchCache, say: _Reporter) -> None:
    """The loops of TU and TW, and all that is connected to them."""
    say("twisted states")
    seeds, warnings = twisted_seeds(settings, cache)
    frontier.warnings += warnings
    _follow_seeds(frontier, seeds, settings, cache, say)
    _follow_arrivals(frontier, settings, cache, say)


def _follow_found(frontier: Frontier, settings: SliceSettings, cache: BranchCache, say: _Reporter) -> None:
    """The branches of stable states that a search finds and that are on no branch yet, and all connected to them."""
    for shear in searched_shears(settings):
        say(f"search at shear {shear:g}")
        search = search_at(shear, settings, cache)
        frontier.searches.append(search)
        seeds = [(f"found@{shear:g}.{k}", state) for k, state in enumerate(search.seeds, 1)]
        _follow_seeds(frontier, seeds, settings, cache, say)
        _follow_arrivals(frontier, settings, cache, say)


def _follow_arrivals(frontier: Frontier, settings: SliceSettings, cache: BranchCache, say: _Reporter) -> None:
    """Symmetric branches that were met only where a reversal-broken one ends on them."""
    options = trace_options(settings)
    while frontier.arrivals:
        parent, number = frontier.arrivals.pop(0)
        special = parent.branch.special[number]
        symmetric = [f for f in frontier.branches if f.symmetric]
        met = [x.solution for f in symmetric for x in f.bifurcations if x.kind == "branch point"]
        met += [f.branch.points[0].solution for f in symmetric if f.origin is not None]
        if any(same_state(special.solution, other) for other in met):
            continue
        if any(lies_on(f.branch, special.solution, settings) for f in symmetric):
            frontier.warnings.append(f"branch {parent.id} ends at {special!r}, which no symmetric branch lists")
            continue
        first = len(frontier.branches)
        _follow_other(frontier, parent, number, options, cache, say)
        _follow_side_branches(frontier, first, options, cache, say)


def _follow_seeds(
    frontier: Frontier, seeds: Iterable[Seed], settings: SliceSettings, cache: BranchCache, say: _Reporter
) -> None:
    """The branches of seeds that are not on a known branch, and all that is connected to them."""
    options = trace_options(settings)
    for ident, seed in seeds:
        if any(lies_on(f.branch, seed, settings) for f in frontier.branches):
            continue
        branch = cache.get(ident)
        if branch is None:
            say(f"branch {ident}")
            try:
                branch = trace(rod_problem(), seed, FREE, replace(options, on_point=say.watch(ident)))
            except NotConverged as error:
                frontier.warnings.append(f"branch {ident}: {error}")
                continue
            cache.put(ident, branch)
        frontier.add(Followed(ident, branch, is_symmetric(seed)))
        _follow_side_branches(frontier, len(frontier.branches) - 1, options, cache, say)


def _follow_side_branches(
    frontier: Frontier, start: int, options: TraceOptions, cache: BranchCache, say: _Reporter
) -> None:
    """Switch at every unused branch point of the branches from `start` on; new branches join the end of the list."""
    at = start
    while at < len(frontier.branches):
        parent = frontier.branches[at]
        for number, special in enumerate(parent.branch.special):
            if special.kind != "branch point" or frontier.is_used(special):
                continue
            frontier.pending = sum(frontier.left_on(f) for f in frontier.branches[at:])
            frontier.used.append(special)
            if special.status is not Status.CONVERGED:
                frontier.warnings.append(f"branch {parent.id}: {special!r}: its side branch is missing")
                continue
            _follow_other(frontier, parent, number, options, cache, say)
        at += 1


def _follow_other(
    frontier: Frontier, parent: Followed, number: int, options: TraceOptions, cache: BranchCache, say: _Reporter
) -> None:
    """The other curve through a branch point: one side of it where the other is its reversal, else the whole curve."""
    special = parent.branch.special[number]
    ident = f"{parent.id}.{number + 1}"
    options = replace(options, on_point=say.watch(ident))
    branch = cache.get(ident)
    if branch is None:
        say(f"branch {ident}")
        branch = switch(rod_problem(), special, FREE, options)
        if branch is None:
            frontier.warnings.append(f"branch {parent.id}: no second branch found at {special!r}")
            return
        if not _is_half(branch, special) and len(branch) > 2:
            branch = trace(rod_problem(), branch.points[len(branch) // 2].solution, FREE, options)
        cache.put(ident, branch)
    symmetric = is_symmetric(branch.points[len(branch) // 2].solution)
    starts_there = same_state(branch.points[0].solution, special.solution)
    if not starts_there and not any(same_state(x.solution, special.solution) for x in branch.special):
        frontier.warnings.append(f"branch {ident} does not list the branch point that it was found at: {special!r}")
    frontier.add(Followed(ident, branch, symmetric, (parent.id, number) if starts_there else None))


def _is_half(branch: Branch, special: SpecialPoint) -> bool:
    """Whether a branch that starts at a branch point is continued beyond it by its own reversal."""
    return is_symmetric(special.solution) and not is_symmetric(branch.points[len(branch) // 2].solution)


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
