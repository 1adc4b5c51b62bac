"""Follow everything connected: branches along one control, through folds and branch points."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from rodatlas.atlas.cache import BRANCH, SOLUTIONS, Cache, MemoryCache, PrefixedCache
from rodatlas.atlas.slices.branches.frontier import Followed, Frontier
from rodatlas.atlas.slices.branches.match import crossings, lies_on
from rodatlas.atlas.slices.branches.search import search_at, searched_values
from rodatlas.atlas.slices.branches.seeds import carried_seeds, seeds_of
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import (
    Branch,
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
from rodatlas.model.orbit import own_symmetries, pairing, same_state
from rodatlas.progress import Progress

ANY = 1000  # no limit to an index
PASSED = (0.02, 0.25, 0.5, 0.75, 0.98)  # of a range, where branches of a longer slice are met: folds may lie between
SHARES = (0.3, 0.55, 0.8)  # of a branch, at which it is compared with others: one may lie at a bifurcation
NO_BRANCH = (
    "no branch: no start of the model could be followed to this setting, perhaps since a fold lies on the way; other "
    "values of the fixed controls, or a search, may find one"
)
Reference = Callable[[SliceSettings], list[tuple[str, Branch]] | None]
"""Gives names and branches of the slice with some settings from which states are carried, None when it has none."""


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
    whole = _whole(settings)
    if whole is not None:
        say(f"the longer slice, {settings.along} {whole.low:g} to {whole.high:g}")
        wide = follow_slice(whole, PrefixedCache(cache, f"whole-{whole.stem}-"), progress, carry, reference)
        frontier.warnings += [f"from {whole.low:g} to {whole.high:g}: {w}" for w in wide.warnings if w != NO_BRANCH]
        for followed in wide.branches:
            _follow_all(frontier, _seeds_inside(followed, settings), followed.source, cache, say)
    for source in settings.model.sources if whole is None else ():
        _follow_source(frontier, source, cache, say)
    for start in settings.references() if carry and whole is None else ():
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
        frontier.warnings.append(NO_BRANCH)
    return frontier


def _whole(settings: SliceSettings) -> SliceSettings | None:
    """The longer slice from which branches of this one come, if this one is too short to be alone.

    It holds the default of what varies, where starts are: what is connected to them beyond a pitchfork or a fold on the
    way would be missed otherwise. Without a search it has the usual range too, since nothing else finds what is
    connected outside only.
    """
    control = settings.control
    least, most, _ = control.limits(settings.setting)
    values = [settings.low, settings.high]
    if least < control.default < most:
        values.append(control.default)
    if settings.model.search is None:
        values += control.usual_within(settings.setting) or ()
    low, high = min(values), max(values)
    return None if (low, high) == (settings.low, settings.high) else replace(settings, low=low, high=high, search=0)


def _seeds_inside(followed: Followed, settings: SliceSettings) -> list[Seed]:
    """A state of each part of a branch that lies inside the range, and where it passes some values of it."""
    inside: list[list[Solution]] = [[]]
    for point in followed.branch.points:
        if settings.low < settings.value(point.solution) < settings.high:
            inside[-1].append(point.solution)
        elif inside[-1]:
            inside.append([])
    states = [run[len(run) // 2] for run in inside if run]
    values = [settings.low + share * (settings.high - settings.low) for share in PASSED]
    states += crossings(followed.branch, values, settings, most=ANY)
    return [Seed(f"{followed.id}@{k}", state) for k, state in enumerate(states, 1)]


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
                _follow_rays(frontier, parent, number, options, cache, say)
        at += 1


def _follow_rays(
    frontier: Frontier, parent: Followed, number: int, options: TraceOptions, cache: Cache, say: _Reporter
) -> None:
    """The further curves through a multiple branch point that are on no branch yet, by all rays that leave it."""
    settings = frontier.settings
    special = parent.branch.special[number]
    place = f"{parent.id}.{number + 1}"
    for k, branch in enumerate(_all_rays(settings, special, f"rays-{place}", options, cache, say), 1):
        if len(branch) < 2:
            frontier.warnings.append(f"branch {parent.id}: ray {k} of {special!r} could not be followed")
            continue
        middle = branch.points[len(branch) // 2].solution
        if not any(lies_on(f.branch, middle, settings) for f in frontier.branches):
            origin = (parent.id, number)
            frontier.add(Followed.by(settings.local, f"{place}-{k}", branch, middle, origin, parent.source))


def _all_rays(
    settings: SliceSettings, special: SpecialPoint, key: str, options: TraceOptions, cache: Cache, say: _Reporter
) -> Sequence[Branch]:
    """The branches on all rays that leave a branch point; the cache has all of them or none."""
    count = cache.get(key, SOLUTIONS)
    known = [cache.get(f"{key}-{k}", BRANCH) for k in range(len(count or ()))]
    if count is not None and all(branch is not None for branch in known):
        return [branch for branch in known if branch is not None]
    say(f"branches at a multiple branch point, {key}")
    found = switch_all(settings.model.problem, special, settings.free, options)
    for k, branch in enumerate(found):
        cache.put(f"{key}-{k}", branch, BRANCH)
    cache.put(key, tuple(branch.points[0].solution for branch in found), SOLUTIONS)
    return found


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
