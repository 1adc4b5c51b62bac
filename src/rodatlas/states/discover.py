"""All equilibria of the clamped band at one setting, or all stable ones, as far as a search can tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rodatlas.continuation import NotConverged, Solution
from rodatlas.continuation.checks import check_type
from rodatlas.model.registry import model_named
from rodatlas.progress import Progress, tells
from rodatlas.rods.band import bending_ratio, check_between, check_whole, near_limit, part_of_limit
from rodatlas.rods.ends import ENDS, Ends
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import setting, settled
from rodatlas.rods.stability import index_of
from rodatlas.rods.symmetry import fixes, has_partner, pair_member, reverse
from rodatlas.states.census import FEW, invariants, species, unseen
from rodatlas.states.deflate import deflated
from rodatlas.states.images import with_images
from rodatlas.states.result import Discovery, FoundState
from rodatlas.states.search import default_threads, hunt
from rodatlas.states.shooting import Shots, all_shots, as_guess

CLASSES = {"+": (1,), "-": (-1,), "both": (1, -1)}
STARTS = 4096  # of a search for all states, for each class
FIRST_ROUND, MOST_STARTS = 1024, 8192  # of a search for stable states, which doubles until it looks complete:
UNSEEN, CHANCE = 0.5, 0.001  # bounds of the estimated number of states not met, and of the probability of a new one
FORCE_RANGE = 200.0
FORCES_PART = 0.25  # of the starts: random forces, which seldom converge but reach states of high index


@dataclass
class _Census:
    """Search of one class: all shots so far, and what collocation made of each species, by its first row."""

    ends: Ends
    law: LinearLaw
    sign: int
    tolerance: float
    shots: Shots | None = None
    states: dict[int, list[FoundState]] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    limit: float = np.inf

    @cached_property
    def pairs(self) -> bool:
        """Whether the reversal maps the states at this setting to one another."""
        return fixes("reversal", setting(self.law, self.ends))

    def add(self, more: Shots, report: Callable[[int, int], None]) -> None:
        """Count the species again with more shots, and confirm new ones."""
        self.shots = all_shots([self.shots, more]) if self.shots else more
        force = np.linalg.norm(np.where(self.shots.converged[:, None], self.shots.constants[:, :3], np.inf), axis=1)
        rows = np.flatnonzero(self.shots.converged & (force <= self.limit))
        first, met = np.unique(species(invariants(self.shots, rows, self.pairs)), return_counts=True)
        self.counts = {int(row): int(count) for row, count in zip(rows[first], met, strict=True)}
        new = [row for row in self.counts if row not in self.states]
        for done, row in enumerate(new):
            report(done, len(new) - done)
            self.states[row] = _confirmed(self.shots, row, self.law, self.ends, self.sign, self.tolerance)

    def deflate(self, attempts: int) -> None:
        """Add what deflation finds as species of negative rows, which no start met."""
        known = [s.solution for states in self.states.values() for s in states]
        for number, new in enumerate(deflated(known, attempts, self.tolerance, self.limit), 1):
            self.states[-number], self.counts[-number] = _members(new, self.sign), 0

    def kept(self, stable_only: bool, wound: bool) -> dict[int, list[FoundState]]:
        """States that are listed, by species."""
        return {
            row: [replace(s, count=self.counts[row]) for s in states] for row, states in self.states.items()
            if states and (states[0].stable or not stable_only) and (wound or not states[0].wound)
        }  # fmt: skip

    def wound(self, stable_only: bool) -> int:
        return sum(bool(s) and s[0].wound and (s[0].stable or not stable_only) for s in self.states.values())


@tells("states")
def find_states(
    ends: Ends, poisson: float = 0.25, classes: str = "both", starts: int | None = None, *,
    stable_only: bool = False, wound: bool = False, tolerance: float = 1e-8, force_range: float | None = None,
    deflate: int = 0, seed: int = 1, threads: int | None = None, progress: Progress | None = None,
) -> Discovery:  # fmt: skip
    """Search for equilibria at one setting, between any two clamps.

    Names are given between clamps tilted alike only (:attr:`rodatlas.rods.Ends.alike`), and a state has a partner only
    where the reversal leaves the clamps alone.

    Parameters
    ----------
    classes : '+', '-' or 'both': the right clamp reached at +q or -q.
    starts : for each class. By default a search for all states has `STARTS`; one for stable states begins with
        `FIRST_ROUND` and doubles them until the estimates of what it missed are below `UNSEEN` and `CHANCE`, or it has
        `MOST_STARTS`.
    stable_only : relax all starts to minima of the energy and keep stable states only.
    wound : list wound-up states too (:func:`rodatlas.states.winding.is_wound`), of which there is no end.
    force_range : states with a larger |N| are left out [GJ/L^2]; by default 200, or twice the least |N| that a relaxed
        band has where that is more: there is no end of unstable ones. It does not apply with `stable_only`.
    deflate : attempts by deflation for each class when the starts are done (:mod:`rodatlas.states.deflate`). More
        starts find more in the same time.
    seed : of the quasi-random starts; another one makes an independent search.
    threads : by default as many as there are processors; they do not change the result.
    progress : called as the work goes on; by default a line in a terminal or notebook, `rodatlas.progress.silent`
        for none.

    Raises
    ------
    ValueError
        when an argument is out of range.
    """
    check_type("ends", ends, Ends, ENDS)
    if classes not in CLASSES:
        raise ValueError(f"class: expected +, - or both, got '{classes}'")
    check_whole("deflate", deflate, 0, "a whole number of at least 0")
    for name, number in (("starts", starts), ("threads", threads)):
        if number is not None:
            check_whole(name, number, 1, "a whole number of at least 1")
    threads = default_threads() if threads is None else threads
    if force_range is not None:
        check_between("force range", force_range, 0.0, np.inf, "a positive number")
    law = LinearLaw(bending_ratio(poisson))
    parts, rounds, limits = [], [], []
    for sign in CLASSES[classes]:
        census = _Census(ends, law, sign, tolerance)

        def report(done: int, pending: int, cls: str = "+" if sign > 0 else "-") -> None:
            if progress:
                progress(f"class {cls}: state", done, pending)

        if stable_only:
            rounds.append(_stable(census, starts, wound, seed, threads, report))
        else:
            limits.append(_all(census, starts or STARTS, force_range, seed, threads, report))
            rounds.append([starts or STARTS])
        if deflate:
            census.deflate(deflate)
        parts.append(census)
    found = _collected(ends, poisson, parts, stable_only, wound, rounds, max(limits, default=None))
    added = sum(row < 0 for c in parts for row in c.kept(stable_only, wound))
    return replace(found, deflated=(added, deflate * len(parts))) if deflate else found


def _stable(
    census: _Census, starts: int | None, wound: bool, seed: int, threads: int, report: Callable[[int, int], None]
) -> list[int]:
    """Rounds of a search for stable states; returns the starts after each."""
    done, rounds = 0, []
    goal = starts or FIRST_ROUND
    while True:
        report(0, 0)
        census.add(hunt(census.ends, census.law, census.sign, "relaxed", range(done, goal), seed=seed, threads=threads),
                   report)  # fmt: skip
        done = goal
        rounds.append(done)
        number, chance = _unseen(census, True, wound)
        if starts or done >= MOST_STARTS or (number <= UNSEEN and chance <= CHANCE):
            return rounds
        if not any(census.states.values()):
            return rounds  # as many starts again would find nothing either
        goal = 2 * done


def _all(
    census: _Census, starts: int, force_range: float | None, seed: int, threads: int,
    report: Callable[[int, int], None],
) -> float:  # fmt: skip
    """Search for states of every index; returns the force range."""
    forces = int(FORCES_PART * starts)
    report(0, 0)
    shots = hunt(census.ends, census.law, census.sign, "partly relaxed", range(starts - forces), seed=seed,
                 threads=threads)  # fmt: skip
    if force_range is None:
        force = np.linalg.norm(shots.constants[shots.converged, :3], axis=1)
        force_range = max(FORCE_RANGE, 2.0 * float(force.min())) if len(force) else FORCE_RANGE
    census.limit = force_range
    if forces:
        more = hunt(census.ends, census.law, census.sign, "forces", range(forces), seed=seed,
                    force=min(force_range, FORCE_RANGE), threads=threads)  # fmt: skip
        shots = all_shots([shots, more])
    census.add(shots, report)
    return force_range


def _unseen(census: _Census, stable_only: bool, wound: bool) -> tuple[float, float]:
    return unseen(np.array([census.counts[row] for row in census.kept(stable_only, wound)], dtype=int))


def _collected(
    ends: Ends, poisson: float, parts: list[_Census], stable_only: bool, wound: bool, rounds: list[list[int]],
    limit: float | None,
) -> Discovery:  # fmt: skip
    """One result of the searches of all classes."""
    kept = [
        states for census in parts for states in with_images([*census.kept(stable_only, wound).values()])
    ]  # fmt: skip
    found = sorted((s for states in kept for s in states), key=lambda s: (s.cls, s.solution["energy"], s.pair or ""))
    told = [(s.solution, s.cls, s.index, s.pair or "") for s in found]
    known = model_named("band").nomenclature
    names = known.names_at(told) if known is not None and ends.alike else [None] * len(found)
    found = [replace(s, name=name) for s, name in zip(found, names, strict=True)]
    counts = np.array([states[0].count for states in kept], dtype=int)
    number, chance = unseen(counts) if counts.sum() >= FEW else (None, None)
    return Discovery(
        ends, tuple(found), poisson=poisson, starts=sum(r[-1] for r in rounds),
        converged=sum(sum(c.counts.values()) for c in parts), distinct=len(kept),
        unseen_estimate=number, unseen_probability=chance, force_range=limit,
        rounds=max((tuple(r) for r in rounds), key=lambda r: r[-1]),
        wound_left_out=0 if wound else sum(c.wound(stable_only) for c in parts),
        dropped=sum(not s for c in parts for s in c.states.values()),
        warnings=_doubts(ends, parts, rounds, counts, [len(c.kept(stable_only, wound)) for c in parts]),
    )  # fmt: skip


def _doubts(ends: Ends, parts: list[_Census], rounds: list[list[int]], counts: np.ndarray,
            listed: list[int]) -> tuple[str, ...]:  # fmt: skip
    """What makes a list of states doubtful, in words.

    Parameters
    ----------
    rounds : of each class.
    counts : how often each state that is listed was met.
    listed : number of states of each class that are listed, a +/- pair counted once.
    """
    found = []
    for census, done, shown in zip(parts, rounds, listed, strict=True):
        cls, met = "+" if census.sign > 0 else "-", sum(census.counts.values())
        lost = sum(not s for s in census.states.values())
        if lost and lost == len(census.states):
            said = f"class {cls}: none of {lost} different solutions of {done[-1]} starts was confirmed by collocation"
            found.append(f"search: {said}: {_advice(ends)}")
        elif not met:
            found.append(f"search: class {cls}: none of {done[-1]} starts converged: {_advice(ends)}")
        elif not shown:
            found.append(f"search: class {cls}: all that {done[-1]} starts met is wound up or not stable, so that no "
                         "state of it is listed: raise the number of starts")  # fmt: skip
        elif lost:
            found.append(f"search: class {cls}: {lost} of {len(census.states)} different solutions were not confirmed "
                         "by collocation and are missing from the list")  # fmt: skip
    total = int(counts.sum())
    if total < FEW and any(census.counts for census in parts):
        found.append(f"search: the states listed were met {total} times in all, too few to tell how many were not met: "
                     "raise the number of starts")  # fmt: skip
    near = near_limit(ends.shear, ends.compression, ends.offset)
    return (*found, near) if near else tuple(found)


def _advice(ends: Ends) -> str:
    """What to do about a search that found nothing."""
    part = part_of_limit(ends.shear, ends.compression, ends.offset)
    what = "shear" if ends.offset == 0.0 else "shear and offset together"
    return f"raise the number of starts, or keep away from the limiting shear (this {what} is {part:.3f} of it)"


def _confirmed(shots: Shots, row: int, law: LinearLaw, ends: Ends, sign: int, tolerance: float) -> list[FoundState]:
    """The state of a shot, and its partner where it has one, solved by collocation; empty when that fails."""
    guess = as_guess(shots, row, law, ends)
    try:
        solution = settled(guess, tolerance)
    except NotConverged:
        return []
    if abs(solution["energy"] - shots.energy[row]) > 1e-4 * (1.0 + shots.energy[row]):
        return []  # collocation left for another solution
    return _members(solution, sign)


def _members(solution: Solution, sign: int) -> list[FoundState]:
    """A state, and its partner where it has one."""
    index, cls = index_of(solution).index, "+" if sign > 0 else "-"
    if not has_partner(solution):
        return [FoundState(solution, cls, None, index, None, 0)]
    return [FoundState(member, cls, None, index, pair_member(member), 0) for member in (solution, reverse(solution))]
