"""A slice of the atlas as a result: branches, named stable states, numbered bifurcations; tables, JSON and file."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.slices.follow import Followed
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution, SpecialPoint
from rodatlas.continuation.checks import check_type
from rodatlas.rods.band import check_number
from rodatlas.states.names import NAMES, OTHER

if TYPE_CHECKING:
    from rodatlas.continuation.table import Table

SCHEMA = "rodatlas/slice/1"


@dataclass(frozen=True)
class Event:
    """A fold or branch point of a slice, as a user reads it.

    Attributes
    ----------
    kind : 'fold', 'pitchfork' or 'branch point'.
    special : the located point, with its record.
    number : the paper's number or None.
    criticality : 'super', 'sub' or None, of pitchforks whose side branch was followed.
    """

    kind: str
    special: SpecialPoint
    number: int | None = None
    criticality: str | None = None

    @property
    def shear(self) -> float:
        return self.special.solution["dD"]

    @property
    def height(self) -> float:
        return self.special.solution["height"]

    def __repr__(self) -> str:
        name = self.kind if self.number is None else f"{self.kind} {self.number}"
        before, after = self.special.index
        return f"Event({name}: shear {self.shear:.6g}, height {self.height:.6g}, index {before} to {after})"


@dataclass(frozen=True)
class StateEnd:
    """Where a stable state ends, and whether it snaps there.

    Attributes
    ----------
    kind : 'fold', 'pitchfork', 'branch point', 'range' (the shear range ends first) or 'smooth' (the state becomes
        the next named one without a bifurcation).
    solution : the state at this end.
    number : the paper's number of the bifurcation or None.
    snap : whether the band leaves the state at once when the shear goes on.
    """

    kind: str
    solution: Solution
    number: int | None = None
    snap: bool = False

    @property
    def shear(self) -> float:
        return self.solution["dD"]

    @property
    def height(self) -> float:
        return self.solution["height"]

    @property
    def text(self) -> str:
        """In words: 'fold 6, snaps', 'pitchfork 4, no snap', 'range', 'smooth'."""
        if self.kind in ("range", "smooth"):
            return self.kind
        number = f" {self.number}" if self.number is not None else ""
        return f"{self.kind}{number}, {'snaps' if self.snap else 'no snap'}"

    def __repr__(self) -> str:
        return f"StateEnd({self.text}: shear {self.shear:.6g}, height {self.height:.6g})"


@dataclass(frozen=True)
class State:
    """A named stable state over a range of shear.

    Attributes
    ----------
    name : one of :data:`rodatlas.states.NAMES`, or 'other'; of a +/- pair, both members ('US+-').
    branch : id of the branch it lies on.
    pair : whether its reversal is another state.
    path : names of all parts of the stable segment that it belongs to, 'U-w' say.
    solutions : in order of increasing shear, both ends included.
    low, high : the ends.
    contact : ranges of shear in which a band of width :data:`rodatlas.rods.band.NARROW` touches itself, in order.
    """

    name: str
    branch: str
    pair: bool
    path: str
    solutions: tuple[Solution, ...]
    low: StateEnd
    high: StateEnd
    contact: tuple[tuple[float, float], ...] = ()

    @property
    def shear(self) -> tuple[float, float]:
        """Least and largest shear."""
        return self.low.shear, self.high.shear

    def __repr__(self) -> str:
        return (
            f"State({self.name}: shear {self.low.shear:.6g} ({self.low.text}) to {self.high.shear:.6g} "
            f"({self.high.text}), on branch {self.branch})"
        )


@dataclass(frozen=True)
class SliceBranch:
    """A followed branch with its events, one for each special point that is a fold or branch point, in order.

    Attributes
    ----------
    mirror : at psi0 = 0, the id of the branch that the angle mirror makes of this one (or of its reversal); its own
        where it maps to itself. None at other angles.
    """

    followed: Followed
    events: tuple[Event, ...]
    mirror: str | None = None

    @property
    def id(self) -> str:
        return self.followed.id

    def __repr__(self) -> str:
        return f"SliceBranch({self.id}: {len(self.followed.branch)} points, {len(self.events)} events)"


@dataclass(frozen=True)
class Slice:
    """All that was found at one setting; see :func:`rodatlas.atlas.compute_slice`.

    Attributes
    ----------
    settings : what it was computed for.
    branches : all curves of equilibria, each +/- pair once.
    states : named stable states, by name and shear.
    warnings : what could not be followed or does not add up; empty when all is well.
    seconds : time that the computation took.
    """

    settings: SliceSettings
    branches: tuple[SliceBranch, ...]
    states: tuple[State, ...]
    warnings: tuple[str, ...]
    seconds: float

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(s.name for s in self.states))
        s = self.settings
        return (
            f"Slice(angle {s.angle_deg:g} deg, dL {s.compression:g}, dD {s.shear_min:g} to {s.shear_max:g}: "
            f"{len(self.branches)} branches; stable: {names})"
        )

    def states_at(self, shear: float, name: str = "") -> tuple[State, ...]:
        """All stable states at a shear, or all of one name, which may be several; in the order of `states`.

        Raises
        ------
        ValueError
            for a name that no state can have, and a shear that is no number.
        """
        check_number("shear", shear, -math.inf, math.inf, "a number")
        if name and name not in (*NAMES, OTHER):
            raise ValueError(f"name: expected one of {', '.join((*NAMES, OTHER))}, got '{name}'")
        there = (s for s in self.states if s.shear[0] <= shear <= s.shear[1])
        return tuple(s for s in there if not name or s.name == name)

    def state(self, name: str, shear: float) -> State | None:
        """The stable state of a name at a shear; None where there is none.

        Parameters
        ----------
        name : such as 'U' or 'US+-', or 'W:2' where several states are called W (:mod:`rodatlas.states.labels`).

        Raises
        ------
        ValueError
            for a name that no state can have, and where several have it and no number tells which is meant.
        """
        from rodatlas.atlas.slices.coexisting import numbered_state, wanted_in_slice

        check_type("name", name, str, "the name of a state such as US+-")
        wanted = wanted_in_slice(name)
        there = self.states_at(shear, wanted.name)
        if len(there) == 1 and wanted.number is None:
            return there[0]
        found = numbered_state(self, wanted, shear)
        return None if found is None else found.state

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the slice should know: the warnings, and whether it reaches near the limiting shear."""
        near = self.settings.near_limit
        return (*self.warnings, near) if near else self.warnings

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file. It replaces any file of that name, once it is complete."""
        from rodatlas.atlas.slices.store import save_slice

        save_slice(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Slice:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.atlas.slices.store import load_slice

        return load_slice(path)

    def to_frame(self, of: str = "states") -> Table:
        """A table with one row for each stable state (`of='states'`) or each event of each branch (`of='events'`)."""
        from rodatlas.continuation.table import Table

        if of not in ("states", "events"):
            raise ValueError(f"of: expected 'states' or 'events', got '{of}'")
        if of == "events":
            return Table([{"branch": b.id, **_event_json(e)} for b in self.branches for e in b.events])
        rows = []
        for s in self.states:
            row: dict[str, Any] = {"name": s.name, "pair": s.pair, "branch": s.branch, "path": s.path}
            for side, end in (("low", s.low), ("high", s.high)):
                row |= {f"{key}_{side}": value for key, value in _end_json(end).items()}
            rows.append(row | {"contact": s.contact})
        return Table(rows)

    def to_json(self) -> dict[str, Any]:
        """The object that `rodatlas slice --json` prints."""
        s = self.settings
        return {
            "schema": SCHEMA,
            "angle_deg": s.angle_deg,
            "compression": s.compression,
            "poisson": s.poisson,
            "shear_range": [s.shear_min, s.shear_max],
            "tolerance": s.tolerance,
            "seconds": round(self.seconds, 3),
            "warnings": list(self.remarks),
            "states": [_state_json(x) for x in self.states],
            "branches": [_branch_json(x) for x in self.branches],
        }


def _state_json(state: State) -> dict[str, Any]:
    return {
        "name": state.name,
        "pair": state.pair,
        "path": state.path,
        "branch": state.branch,
        "shear": list(state.shear),
        "height": [state.low.height, state.high.height],
        "ends": [_end_json(e) for e in (state.low, state.high)],
        "contact": [list(span) for span in state.contact],
    }


def _end_json(end: StateEnd) -> dict[str, Any]:
    return {"kind": end.kind, "number": end.number, "shear": end.shear, "height": end.height, "snap": end.snap}


def _branch_json(b: SliceBranch) -> dict[str, Any]:
    branch = b.followed.branch
    return {
        "id": b.id,
        "points": len(branch),
        "symmetric": b.followed.symmetric,
        "pair": b.followed.pair,
        "mirror": b.mirror,
        "closed": branch.closed,
        "end_reasons": [reason.name.lower() for reason in branch.ends],
        "special": [_event_json(e) for e in b.events],
    }


def _event_json(event: Event) -> dict[str, Any]:
    return {
        "kind": event.kind,
        "number": event.number,
        "shear": event.shear,
        "height": event.height,
        "index": list(event.special.index),
        "criticality": event.criticality,
        "status": event.special.status.value,
    }
