"""All equilibria of the clamped band at one setting, or all stable ones, as far as a search can tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rodatlas.continuation import MeshControl, NotConverged, Solution, TraceOptions, solve
from rodatlas.rods.band import bending_ratio, check_between
from rodatlas.rods.ends import Ends
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.stability import index_of
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import pair_member, reverse
from rodatlas.states.census import invariants, species, unseen
from rodatlas.states.shooting import Shots, as_guess, refined, shoot
from rodatlas.states.single import names_of
from rodatlas.states.starts import joined, random_forces, relaxed

SCHEMA = "rodatlas/states/1"
CLASSES = {"+": (1,), "-": (-1,), "both": (1, -1)}
STARTS, STABLE_STARTS = 4096, 1024  # for each class
FORCE_RANGE = 200.0
Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class FoundState:
    """One equilibrium.

    Attributes
    ----------
    cls : '+' or '-', the class.
    name : None where the shape does not decide (:func:`rodatlas.states.single.names_of`).
    index : Morse index, -1 if it could not be counted.
    pair : '+' or '-' of a reversal-broken state, None of a symmetric one.
    count : how often the search met it or its partner.
    """

    solution: Solution
    cls: str
    name: str | None
    index: int
    pair: str | None
    count: int

    @property
    def stable(self) -> bool:
        return self.index == 0

    @property
    def twist(self) -> float:
        """int tau ds [rad]: beyond about 2 pi the band is wound up."""
        stages = self.solution.stages[..., self.solution.unknowns.index("tau")]
        return self.solution.mean(stages)

    def to_json(self) -> dict[str, Any]:
        """The state as in schema rodatlas/states/1; N0, M0 in body components at s = 0."""
        rod = RodState(self.solution)
        return {
            "name": self.name, "class": self.cls, "stable": self.stable,
            "index": self.index if self.index >= 0 else None,
            "height": rod.height, "energy": rod.energy, "symmetric": self.pair is None, "pair": self.pair,
            "N0": rod.force[0].tolist(), "M0": rod.moment[0].tolist(), "inflections": rod.inflections,
            "twist": self.twist,
        }  # fmt: skip


@dataclass(frozen=True)
class Discovery:
    """Result of a search: states in order of class, then energy, and what the search met.

    Attributes
    ----------
    starts, converged : numbers over all classes searched.
    distinct : different states among those, a +/- pair counted once.
    unseen_estimate, unseen_probability : see :func:`rodatlas.states.census.unseen`.
    force_range : states of larger |N| were left out, None when none was.
    dropped : solutions that collocation did not confirm.
    """

    ends: Ends
    states: tuple[FoundState, ...]
    starts: int
    converged: int
    distinct: int
    unseen_estimate: float
    unseen_probability: float
    force_range: float | None
    dropped: int = 0

    def __repr__(self) -> str:
        stable = sum(s.stable for s in self.states)
        return f"Discovery({len(self.states)} states, {stable} stable; {self.converged} of {self.starts} converged)"

    def to_json(self) -> dict[str, Any]:
        return {
            "schema": SCHEMA, "angle_deg": self.ends.angle_deg, "shear": self.ends.shear,
            "compression": self.ends.compression, "states": [s.to_json() for s in self.states],
            "search": {
                "starts": self.starts, "converged": self.converged, "distinct": self.distinct,
                "unseen_estimate": self.unseen_estimate, "unseen_probability": self.unseen_probability,
                "force_range": self.force_range, "dropped": self.dropped,
            },
        }  # fmt: skip


def find_states(
    ends: Ends, poisson: float = 0.25, classes: str = "both", starts: int | None = None, *,
    stable_only: bool = False, tolerance: float = 1e-8, force_range: float | None = None, seed: int = 1,
    progress: Report | None = None,
) -> Discovery:  # fmt: skip
    """Search for equilibria at one setting.

    Parameters
    ----------
    classes : '+', '-' or 'both': the right clamp reached at +q or -q.
    starts : for each class.
    stable_only : relax all starts to minima of the energy and keep stable states only.
    force_range : states with a larger |N| are left out [GJ/L^2], 200 by default: there is no end of unstable ones. It
        does not apply with `stable_only`.
    seed : of the quasi-random starts; another one makes an independent search.

    Raises
    ------
    ValueError
        when an argument is out of range.
    """
    if classes not in CLASSES:
        raise ValueError(f"class: expected +, - or both, got '{classes}'")
    starts = (STABLE_STARTS if stable_only else STARTS) if starts is None else starts
    if starts < 1:
        raise ValueError(f"starts: expected at least 1, got {starts}")
    limit = FORCE_RANGE if force_range is None else force_range
    check_between("force range", limit, 0.0, np.inf, "a positive number")
    a = bending_ratio(poisson)
    found: list[FoundState] = []
    total, counts, dropped = 0, np.empty(0, dtype=int), 0
    for sign in CLASSES[classes]:
        shots = _search(ends, a, sign, starts, stable_only, limit, seed)
        reach = np.inf if stable_only else limit
        force = np.linalg.norm(np.where(shots.converged[:, None], shots.constants[:, :3], np.inf), axis=1)
        rows = np.flatnonzero(shots.converged & (force <= reach))
        first, met = np.unique(species(invariants(shots, rows)), return_counts=True)
        total += len(rows)
        for done, (row, count) in enumerate(zip(rows[first], met, strict=True)):
            if progress:
                progress(f"class {'+' if sign > 0 else '-'}: state", done, len(first) - done)
            states = _confirmed(shots, int(row), a, ends, sign, int(count), tolerance)
            dropped += not states
            if states and (states[0].stable or not stable_only):
                counts = np.append(counts, int(count))
                found += states
    found.sort(key=lambda s: (s.cls, s.solution["energy"], s.pair or ""))
    names = names_of([(s.solution, s.cls, s.index, s.pair or "") for s in found])
    found = [replace(s, name=name) for s, name in zip(found, names, strict=True)]
    number, probability = unseen(counts)
    return Discovery(ends, tuple(found), starts * len(CLASSES[classes]), total, len(counts), number, probability,
                     None if stable_only else limit, dropped)  # fmt: skip


def _search(ends: Ends, a: float, sign: int, starts: int, stable_only: bool, force: float, seed: int) -> Shots:
    if stable_only:
        return shoot(relaxed(ends, a, sign, starts, partly=False, seed=seed), a)
    half = (starts + 1) // 2
    parts = [relaxed(ends, a, sign, half, partly=True, seed=seed)]
    if starts > half:
        parts.append(random_forces(ends, a, sign, starts - half, force, seed + 1))
    return shoot(joined(*parts), a)


def _confirmed(
    shots: Shots, row: int, a: float, ends: Ends, sign: int, count: int, tolerance: float
) -> list[FoundState]:
    """The state of a shot, and its partner where it has one, solved by collocation; empty when that fails."""
    fine = refined(shots.poses[row], shots.constants[row], a)
    best, at = (fine, 0) if fine.converged[0] else (shots, row)
    guess = as_guess(best.poses[at], best.constants[at], a, ends)
    try:
        solution = solve(rod_problem(), guess, ("dD",), TraceOptions(mesh=MeshControl(tolerance=tolerance)))
    except NotConverged:
        return []
    if abs(solution["energy"] - shots.energy[row]) > 1e-3 * (1.0 + shots.energy[row]):
        return []  # collocation left for another solution
    rod, index, cls = RodState(solution), index_of(solution).index, "+" if sign > 0 else "-"
    if rod.symmetric:
        return [FoundState(solution, cls, None, index, None, count)]
    out = []
    for member in (solution, reverse(solution)):
        side = pair_member(member)
        out.append(FoundState(member, cls, None, index, side, count))
    return out
