"""Follow everything connected: branches along one control, through folds and branch points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from rodatlas.atlas.cache import BRANCH, Cache, MemoryCache, PrefixedCache
from rodatlas.atlas.slices.branches.match import lies_on
from rodatlas.atlas.slices.branches.search import Found, search_at, searched_values
from rodatlas.atlas.slices.branches.seeds import carried_seeds, seeds_of
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import (
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
    image,
    switch,
    switch_all,
    trace,
)
from rodatlas.model import Model, Seed
from rodatlas.model.model import Source
from rodatlas.model.orbit import group, own_symmetries, pairing, same_state
from rodatlas.progress import Progress

SHARES = (0.3, 0.55, 0.8)  # of a branch, at which it is compared with others: one may lie at a bifurcation
EARLY = (EndReason.MIN_STEP, EndReason.MESH_LIMIT, EndReason.POINT_LIMIT, EndReason.UNREFINED, EndReason.ROUND_OFF)
"""Ends of branches that a reader should know of."""
Reference = Callable[[SliceSettings], list[tuple[str, Branch]] | None]
"""Gives names and branches of the slice with some settings from which states are carried, None when it has none."""


@dataclass(frozen=True)
class Followed:
    """One branch with what the symmetries of its setting say about it.

    Attributes
    ----------
    id : name of the branch: its seed, then the numbers of the branch points through which it was reached.
    symmetries : which of the pairing symmetries of the setting (see :mod:`rodatlas.model.orbit`) its states have.
    pair : whether they lack one, so that the images of the branch are further branches.
    origin : id and number (in that branch's list of special points) of the branch point at which it starts.
    source : the source of the seed that it is connected to, 'carried' or 'search'.
    """

    id: str
    branch: Branch
    symmetries: frozenset[str]
    pair: bool
    origin: tuple[str, int] | None = None
    source: str = ""

    @classmethod
    def by(
        cls, model: Model, ident: str, branch: Branch, state: Solution, origin: tuple[str, int] | None = None,
        source: str = "",
    ) -> Followed:  # fmt: skip
        """With the symmetries of one of its states, that is no branch point."""
        own = own_symmetries(model, state)
        return cls(ident, branch, own, len(own) < len(group(model, state)), origin, source)

    @property
    def symmetric(self) -> bool:
        """Whether its states have all the symmetries that their setting has."""
        return not self.pair

    @property
    def bifurcations(self) -> tuple[SpecialPoint, ...]:
        """Its folds and branch points, in order."""
        return tuple(x for x in self.branch.special if x.kind in ("fold", "branch point"))

    def __repr__(self) -> str:
        return f"Followed({self.id}, {'one of a pair' if self.pair else 'symmetric'}, {self.branch!r})"


@dataclass
class Frontier:
    """Branches and states found so far, branch points already used, warnings, and how many are left to use.

    `arrivals` are branch points of branches at which others with fewer symmetries end: (branch, number on it).
    """

    settings: SliceSettings
    branches: list[Followed] = field(default_factory=list)
    used: list[SpecialPoint] = field(default_factory=list)
    arrivals: list[tuple[Followed, int]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    searches: list[Found] = field(default_factory=list)
    pending: int = 0

    def add(self, followed: Followed) -> None:
        """Take in a finished branch, and warn of what does not add up on it."""
        self.branches.append(followed)
        branch = followed.branch
        self.warnings += [f"branch {followed.id}: {d}" for d in branch.discrepancies]
        for number, special in enumerate(branch.special):
            if special.kind == "branch point" and self._has_more(special.solution, followed.symmetries):
                self.used.append(special)  # this branch is the side branch of that point
                self.arrivals.append((followed, number))
        counted = self.settings.model.index is not None
        unknown = [self.settings.value(p.solution) for p in branch.points[1:] if p.index is None and counted]
        if unknown:
            self.warnings.append(
                f"branch {followed.id}: stability not known at {len(unknown)} points, "
                f"{self.settings.along} {min(unknown):.5f} to {max(unknown):.5f}"
            )
        for reason in branch.ends:
            if reason in EARLY:
                self.warnings.append(f"branch {followed.id} stops early: {reason.value}")

    def _has_more(self, solution: Solution, symmetries: frozenset[str]) -> bool:
        """Whether a solution has these symmetries and others besides."""
        return own_symmetries(self.settings.local, solution) > symmetries

    def is_used(self, special: SpecialPoint) -> bool:
        """Whether the branches through a branch point have been followed."""
        return any(same_state(self.settings.local, special.solution, other.solution) for other in self.used)

    def has_both(self, special: SpecialPoint) -> bool:
        """Whether both curves through a simple branch point are known: two branches list it, neither ends there."""
        model, simple = self.settings.local, len(special.rays) <= 4
        through = sum(
            any(x.kind == "branch point" and same_state(model, x.solution, special.solution) for x in f.branch.special)
            for f in self.branches
        )
        return simple and through > 1

    def left_on(self, followed: Followed) -> int:
        """Branch points of a branch that are still to be used."""
        return sum(x.kind == "branch point" and not self.is_used(x) for x in followed.branch.special)


def follow_slice(
    settings: SliceSettings, cache: Cache | None = None, progress: Progress | None = None, carry: bool = True,
    reference: Reference | None = None,
) -> Frontier:  # fmt: skip
    """All branches along a control that are connected to the seeds of the model, and isolated ones.

    Branches that are not connected inside the range (uUu of the band above 27.7 degrees, say) are reached by following
    states of reference slices to the setting, at fixed values of what varies, and by a search for stable states at
    several values, unless `carry` is off.

    Parameters
    ----------
    cache : asked for every branch before it is followed, and given it afterwards.
    progress : called as the work goes on.
    reference : branches of reference slices that are known already; they are followed where it gives None.
    """
    cache = MemoryCache() if cache is None else cache
    frontier = Frontier(settings)
    say = _Reporter(progress, frontier)
    for source in settings.model.sources:
        _follow_source(frontier, source, cache, say)
    for start in settings.references() if carry else ():
        known = reference(start) if reference is not None else None
        if known is None:
            known = _followed_reference(start, frontier, cache, say)
        seeds, warnings = carried_seeds(known, start, settings, cache)
        frontier.warnings += warnings
        _follow_all(frontier, seeds, "carried", cache, say)
    if carry and settings.search and settings.model.search is not None:
        _follow_found(frontier, cache, say)
    _follow_images(frontier, cache, say)
    if not frontier.branches:
        frontier.warnings.append(
            "no branch: no start of the model could be followed to this setting, perhaps since a fold lies on the way; "
            "other values of the fixed controls, or a search, may find one"
        )
    return frontier


def carried_from(model: Model, followed: Iterable[Followed]) -> list[tuple[str, Branch]]:
    """Of the branches of a slice, those that another slice carries states from: connected to the first seeds."""
    return [(f.id, f.branch) for f in followed if f.source == model.sources[0].name]


def _followed_reference(
    start: SliceSettings, frontier: Frontier, cache: Cache, say: _Reporter
) -> list[tuple[str, Branch]]:
    """The branches of a reference slice that are connected to the first seeds of the model."""
    say(f"reference slice at {start.place_text}")
    found = Frontier(start)
    _follow_source(found, start.model.sources[0], PrefixedCache(cache, f"reference-{start.stem}-"), say)
    frontier.warnings += [f"reference slice: {warning}" for warning in found.warnings]
    return [(f.id, f.branch) for f in found.branches]


def trace_options(settings: SliceSettings) -> TraceOptions:
    """Options of every branch of a slice."""
    model = settings.local

    def meets_symmetric(special: SpecialPoint, last: Point) -> bool:
        """A branch ends where it meets one with more symmetries; beyond it is its own image."""
        if special.kind != "branch point":
            return False
        return own_symmetries(model, special.solution) > own_symmetries(model, last.solution)

    return TraceOptions(
        mesh=MeshControl(tolerance=settings.tolerance),
        step=StepControl(maximum=20.0),
        bounds=settings.bounds,
        index=model.index,
        stop_at=meets_symmetric,
    )


def _follow_source(frontier: Frontier, source: Source, cache: Cache, say: _Reporter) -> None:
    """All that is connected to the seeds of one source."""
    say(source.name)
    seeds, warnings = seeds_of(source, frontier.settings, cache)
    frontier.warnings += warnings
    _follow_all(frontier, seeds, source.name, cache, say)


def _follow_found(frontier: Frontier, cache: Cache, say: _Reporter) -> None:
    """The branches of stable states that a search finds and that are on no branch yet, and all connected to them."""
    settings = frontier.settings
    for value in searched_values(settings):
        say(f"search at {settings.along} {value:g}")
        found = search_at(value, settings, cache)
        frontier.searches.append(found)
        seeds = [Seed(f"found@{value:g}.{k}", state) for k, state in enumerate(found.seeds, 1)]
        _follow_all(frontier, seeds, "search", cache, say)


def _follow_images(frontier: Frontier, cache: Cache, say: _Reporter) -> None:
    """Images of branches under further symmetries of the slice, where they are on no branch yet.

    Without shear, say, the shear mirror makes another branch of each one that is not its own image, along any control
    but the shear; starts need not have met both.
    """
    settings = frontier.settings
    problem = settings.model.problem
    for symmetry in (name for name in settings.symmetries if name not in pairing(settings.model)):
        seeds = []
        for f in frontier.branches:
            states = [f.branch.points[int(share * len(f.branch))].solution for share in SHARES]
            new = [image(problem, symmetry, state) for state in states]
            if not any(lies_on(g.branch, state, settings) for state in new for g in frontier.branches):
                seeds.append(Seed(f"{f.id}'", new[1]))
        _follow_all(frontier, seeds, symmetry, cache, say)


def _follow_all(frontier: Frontier, seeds: Iterable[Seed], source: str, cache: Cache, say: _Reporter) -> None:
    """The branches of some seeds and all that is connected to them."""
    _follow_seeds(frontier, seeds, source, cache, say)
    _follow_arrivals(frontier, cache, say)


def _follow_arrivals(frontier: Frontier, cache: Cache, say: _Reporter) -> None:
    """Symmetric branches that were met only where one with fewer symmetries ends on them."""
    settings = frontier.settings
    model, options = settings.local, trace_options(settings)
    while frontier.arrivals:
        parent, number = frontier.arrivals.pop(0)
        special = parent.branch.special[number]
        own = own_symmetries(model, special.solution)
        symmetric = [f for f in frontier.branches if f.symmetries == own]
        met = [x.solution for f in symmetric for x in f.bifurcations if x.kind == "branch point"]
        met += [f.branch.points[0].solution for f in symmetric if f.origin is not None]
        if any(same_state(model, special.solution, other) for other in met):
            continue
        if any(lies_on(f.branch, special.solution, settings) for f in symmetric):
            frontier.warnings.append(f"branch {parent.id} ends at {special!r}, which no symmetric branch lists")
            continue
        first = len(frontier.branches)
        _follow_other(frontier, parent, number, options, cache, say)
        _follow_side_branches(frontier, first, options, cache, say)


def _follow_seeds(frontier: Frontier, seeds: Iterable[Seed], source: str, cache: Cache, say: _Reporter) -> None:
    """The branches of seeds that are not on a known branch, and all that is connected to them."""
    settings = frontier.settings
    model, options = settings.local, trace_options(settings)
    for ident, seed in seeds:
        if any(lies_on(f.branch, seed, settings) for f in frontier.branches):
            continue
        branch = cache.get(ident, BRANCH)
        if branch is None:
            say(f"branch {ident}")
            try:
                watched = replace(options, on_point=say.watch(ident))
                branch = trace(model.problem, seed, settings.free, watched)
            except NotConverged as error:
                frontier.warnings.append(f"branch {ident}: {error}")
                continue
            cache.put(ident, branch, BRANCH)
        frontier.add(Followed.by(model, ident, branch, seed, source=source))
        _follow_side_branches(frontier, len(frontier.branches) - 1, options, cache, say)


def _follow_side_branches(frontier: Frontier, start: int, options: TraceOptions, cache: Cache, say: _Reporter) -> None:
    """Switch at every unused branch point of the branches from `start` on; new branches join the end of the list."""
    at = start
    while at < len(frontier.branches):
        parent = frontier.branches[at]
        for number, special in enumerate(parent.branch.special):
            if special.kind != "branch point" or frontier.is_used(special):
                continue
            if frontier.has_both(special):
                frontier.used.append(special)
                continue
            frontier.pending = sum(frontier.left_on(f) for f in frontier.branches[at:])
            frontier.used.append(special)
            if special.status is not Status.CONVERGED:
                frontier.warnings.append(f"branch {parent.id}: {special!r}: its side branch is missing")
                continue
            _follow_other(frontier, parent, number, options, cache, say)
            if special.multiplicity > 1:
                _follow_rays(frontier, parent, number, options, say)
        at += 1


def _follow_rays(frontier: Frontier, parent: Followed, number: int, options: TraceOptions, say: _Reporter) -> None:
    """The further curves through a multiple branch point that are on no branch yet, by all rays that leave it."""
    settings = frontier.settings
    special = parent.branch.special[number]
    say(f"branches at a multiple branch point of {parent.id}")
    for k, branch in enumerate(switch_all(settings.model.problem, special, settings.free, options)):
        middle = branch.points[len(branch) // 2].solution
        known = len(branch) < 3 or any(lies_on(f.branch, middle, settings) for f in frontier.branches)
        if not known:
            ident = f"{parent.id}.{number + 1}-{k + 1}"
            origin = (parent.id, number)
            frontier.add(Followed.by(settings.local, ident, branch, middle, origin, parent.source))


def _follow_other(
    frontier: Frontier, parent: Followed, number: int, options: TraceOptions, cache: Cache, say: _Reporter
) -> None:
    """The other curve through a branch point: one side of it where the other is its reversal, else the whole curve."""
    model, free = frontier.settings.local, frontier.settings.free
    special = parent.branch.special[number]
    ident = f"{parent.id}.{number + 1}"
    options = replace(options, on_point=say.watch(ident))
    branch = cache.get(ident, BRANCH)
    if branch is None:
        say(f"branch {ident}")
        branch = switch(model.problem, special, free, options)
        if branch is None:
            frontier.warnings.append(f"branch {parent.id}: no second branch found at {special!r}")
            return
        if not _is_half(model, branch, special) and len(branch) > 2:
            branch = trace(model.problem, branch.points[len(branch) // 2].solution, free, options)
        cache.put(ident, branch, BRANCH)
    middle = branch.points[len(branch) // 2].solution
    starts_there = same_state(model, branch.points[0].solution, special.solution)
    if not starts_there and not any(same_state(model, x.solution, special.solution) for x in branch.special):
        frontier.warnings.append(f"branch {ident} does not list the branch point that it was found at: {special!r}")
    origin = (parent.id, number) if starts_there else None
    frontier.add(Followed.by(model, ident, branch, middle, origin, parent.source))


def _is_half(model: Model, branch: Branch, special: SpecialPoint) -> bool:
    """Whether a branch that starts at a branch point is continued beyond it by an image of its own."""
    middle = branch.points[len(branch) // 2].solution
    return own_symmetries(model, special.solution) > own_symmetries(model, middle)


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
            value = self._frontier.settings.value(point.solution)
            self(f"branch {name}: {count} points, {self._frontier.settings.along} {value:.4f}")

        return on_point
