"""Branches of a slice as far as they are known, what the symmetries of their setting say, and what is left to do."""

from __future__ import annotations

from dataclasses import dataclass, field

from rodatlas.atlas.slices.branches.search import Found
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Branch, EndReason, Solution, SpecialPoint
from rodatlas.model import Model
from rodatlas.model.orbit import group, own_symmetries, same_state

EARLY = (EndReason.MIN_STEP, EndReason.MESH_LIMIT, EndReason.POINT_LIMIT, EndReason.UNREFINED, EndReason.ROUND_OFF)
"""Ends of branches that a reader should know of."""


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
