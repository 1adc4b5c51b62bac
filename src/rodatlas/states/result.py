"""What a search for states found, as a result: states, counts, JSON."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rodatlas.continuation import Solution
from rodatlas.rods.band import NARROW
from rodatlas.rods.contact import Contact, self_contact, width_text
from rodatlas.rods.ends import Ends
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import is_symmetric
from rodatlas.states.labels import chosen, in_order, labels, look, parse_label, slope
from rodatlas.states.winding import is_wound, twist

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/states/1"
MODEL = "band"  # as JSON calls the model that is searched
VECTORS = ("N0", "M0", "force", "moment")  # fields of a state with three components


@dataclass(frozen=True)
class FoundState:
    """One equilibrium.

    Attributes
    ----------
    cls : '+' or '-', the class.
    name : None where nothing that is known at one setting decides (:func:`rodatlas.paper.names.at_setting.names_of`).
    index : Morse index, -1 if it could not be counted.
    pair : '+' or '-' of a state whose reversal is another one at the same setting, None of others.
    count : how often the search met it or its partner.
    """

    solution: Solution
    cls: str
    name: str | None
    index: int
    pair: str | None
    count: int

    def __repr__(self) -> str:
        name = self.name or "unnamed"
        return (
            f"FoundState({name}, class {self.cls}: energy {self.solution['energy']:.6g}, height "
            f"{self.solution['height']:.6g}, index {self.index}, {self.turns:.2f} turns)"
        )

    @property
    def stable(self) -> bool:
        return self.index == 0

    @property
    def twist(self) -> float:
        """int tau ds [rad]."""
        return twist(self.solution)

    @property
    def turns(self) -> float:
        """int tau ds / 2 pi."""
        return self.twist / (2.0 * math.pi)

    @property
    def wound(self) -> bool:
        """Whether the band is wound up (:func:`rodatlas.states.winding.is_wound`)."""
        return is_wound(self.solution, self.cls)

    @cached_property
    def contact(self) -> Contact | None:
        """Where a band of width :data:`rodatlas.rods.band.NARROW` passes through itself, None where it does not."""
        return self_contact(self.solution)

    def to_json(self) -> dict[str, Any]:
        """The state as in schema rodatlas/states/1; N0, M0 in body components at s = 0, force and moment in space."""
        rod = RodState(self.solution)
        return {
            "name": self.name, "class": self.cls, "stable": self.stable,
            "index": self.index if self.index >= 0 else None,
            "height": rod.height, "energy": rod.energy, "symmetric": is_symmetric(self.solution), "pair": self.pair,
            "force": rod.force[0].tolist(), "moment": rod.moment[0].tolist(),
            "N0": rod.force_body[0].tolist(), "M0": rod.moment_body[0].tolist(), "inflections": rod.inflections,
            "twist": self.twist, "turns": self.turns, "wound": self.wound, "met": self.count,
            "error": self.solution.error, "contact": self.contact is not None,
            "contact_at": list(self.contact.s) if self.contact else [],
        }  # fmt: skip


@dataclass(frozen=True)
class Discovery:
    """Result of a search: states in order of class, then energy, and what the search met.

    Attributes
    ----------
    starts, converged : numbers over all classes searched; the latter counts solutions within the force range.
    distinct : different states listed, a +/- pair counted once.
    unseen_estimate, unseen_probability : see :func:`rodatlas.states.census.unseen`, over the states listed; None where
        these were met fewer than :data:`rodatlas.states.census.FEW` times in all.
    force_range : states of larger |N| were left out, None when none was.
    dropped : solutions that collocation did not confirm.
    poisson : Poisson's ratio.
    rounds : starts for each class after each round of the search.
    wound_left_out : wound-up states that were met but are not listed, a pair counted once.
    deflated : states that deflation added (a pair counted once; each has count 0), and its attempts; None without it.
    warnings : what makes the list doubtful, 'search: ...' where the search itself did not do its work; empty when all
        is well.
    """

    ends: Ends
    states: tuple[FoundState, ...]
    starts: int
    converged: int
    distinct: int
    unseen_estimate: float | None
    unseen_probability: float | None
    force_range: float | None
    dropped: int = 0
    poisson: float = 0.25
    rounds: tuple[int, ...] = ()
    wound_left_out: int = 0
    deflated: tuple[int, int] | None = None
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        stable = sum(s.stable for s in self.states)
        return f"Discovery({len(self.states)} states, {stable} stable; {self.converged} of {self.starts} converged)"

    @property
    def failed(self) -> bool:
        """Whether the search found nothing at all: it says nothing about which states exist."""
        return not self.states and not self.wound_left_out

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the list should know: the warnings, stable states that pass through themselves, and names
        that several states have."""
        found = [*self.warnings]
        called = [label for label, s in zip(self.labels, self.states, strict=True) if s.stable and s.contact]
        if called:
            unnamed = called.count(None)
            names = [*(label for label in called if label), *([f"{unnamed} without a name"] if unnamed else [])]
            found.append(f"contact: a band {width_text(NARROW)} wide passes through itself in stable states "
                         f"({', '.join(names)}); forces of contact are not modeled")  # fmt: skip
        shared = Counter(s.name for s in self.states if s.name)
        found += [f"names: {n} states are called {name}, numbered in order of energy" for name, n in shared.items()
                  if n > 1]  # fmt: skip
        return tuple(found)

    @property
    def labels(self) -> tuple[str | None, ...]:
        """What each state is called: its name, numbered ('W:2') where others share it, see
        :mod:`rodatlas.states.labels`."""
        energies = [s.solution["energy"] for s in self.states]
        return tuple(labels([s.name for s in self.states], energies, [slope(s.solution) for s in self.states]))

    def all_named(self, name: str) -> tuple[FoundState, ...]:
        """All states of a name, in the order of their numbers; of 'US', 'US+' or 'US-' that member of each pair.

        Raises
        ------
        ValueError
            when there is no such name.
        """
        wanted = parse_label(name)
        fitting = [s for s in self.states if s.name == wanted.member]
        order = in_order([s.solution["energy"] for s in fitting], [slope(s.solution) for s in fitting])
        return tuple(fitting[i] for i in order)

    def named(self, name: str) -> FoundState | None:
        """The state that a label means, such as 'US+', or 'W:2' where several are called W; None when there is none.

        Raises
        ------
        ValueError
            when there is no such name, or several states have it and no number tells which is meant.
        """
        wanted = parse_label(name)
        return chosen(wanted, [(s, look(s.solution)) for s in self.all_named(wanted.member)])

    def to_json(self) -> dict[str, Any]:
        deflation = None if self.deflated is None else {"found": self.deflated[0], "attempts": self.deflated[1]}
        return {
            "schema": SCHEMA, "model": MODEL, "setting": self.ends.setting | {"poisson": self.poisson}, "along": None,
            "angle_deg": self.ends.angle_deg if self.ends.skew_deg == 0.0 else None, "shear": self.ends.shear,
            "compression": self.ends.compression, "poisson": self.poisson, "warnings": list(self.remarks),
            "states": [s.to_json() | {"label": label} for s, label in zip(self.states, self.labels, strict=True)],
            "search": {
                "starts": self.starts, "converged": self.converged, "distinct": self.distinct,
                "unseen_estimate": self.unseen_estimate, "unseen_probability": self.unseen_probability,
                "force_range": self.force_range, "rounds": list(self.rounds), "wound_left_out": self.wound_left_out,
                "dropped": self.dropped, "deflation": deflation,
            },
        }  # fmt: skip

    def to_frame(self) -> Table:
        """A table with one row for each state: what is in the JSON but for vectors. Lengths in L."""
        from rodatlas.continuation.table import Table

        rows = []
        for row in (state.to_json() for state in self.states):
            inflections = {f"inflections_{name}": count for name, count in row.pop("inflections").items()}
            rows.append({name: value for name, value in row.items() if name not in VECTORS} | inflections)
        return Table(rows)
