"""A slice of the atlas as a result: branches, named stable states, numbered bifurcations; tables, JSON and file."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import Solution, SpecialPoint
from rodatlas.continuation.checks import check_number, check_type

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
    value, response : of what varies along the slice, and of the quantity that it is seen by, in the user's units.
    number : that a nomenclature gives, or None.
    criticality : 'super', 'sub' or None, of pitchforks whose side branch was followed.
    """

    kind: str
    special: SpecialPoint
    value: float
    response: float
    number: int | None = None
    criticality: str | None = None

    @classmethod
    def at(
        cls, settings: SliceSettings, kind: str, special: SpecialPoint, number: int | None = None,
        criticality: str | None = None,
    ) -> Event:  # fmt: skip
        """With value and response as a slice sees them."""
        solution = special.solution
        return cls(kind, special, settings.value(solution), settings.response(solution), number, criticality)

    def __repr__(self) -> str:
        name = self.kind if self.number is None else f"{self.kind} {self.number}"
        before, after = self.special.index
        return f"Event({name}: at {self.value:.6g}, {self.response:.6g}, index {before} to {after})"


@dataclass(frozen=True)
class StateEnd:
    """Where a stable state ends, and whether it snaps there.

    Attributes
    ----------
    kind : 'fold', 'pitchfork', 'branch point', 'range' (the range that was looked at ends first) or 'smooth' (the state
        becomes the next named one without a bifurcation).
    solution : the state at this end.
    value, response : of what varies along the slice, and of the quantity that it is seen by.
    number : that a nomenclature gives to the bifurcation, or None.
    snap : whether the state is left at once when the control goes on.
    """

    kind: str
    solution: Solution
    value: float
    response: float
    number: int | None = None
    snap: bool = False

    @classmethod
    def at(
        cls, settings: SliceSettings, kind: str, solution: Solution, number: int | None = None, snap: bool = False
    ) -> StateEnd:
        """With value and response as a slice sees them."""
        return cls(kind, solution, settings.value(solution), settings.response(solution), number, snap)

    @property
    def text(self) -> str:
        """In words: 'fold 6, snaps', 'pitchfork 4, no snap', 'range', 'smooth'."""
        if self.kind in ("range", "smooth"):
            return self.kind
        number = f" {self.number}" if self.number is not None else ""
        return f"{self.kind}{number}, {'snaps' if self.snap else 'no snap'}"

    def __repr__(self) -> str:
        return f"StateEnd({self.text}: at {self.value:.6g}, {self.response:.6g})"


@dataclass(frozen=True)
class State:
    """A named stable state over a range of what varies.

    Attributes
    ----------
    name : of the nomenclature of the model, or one made of what is seen; of a +/- pair, both members ('S+-').
    branch : id of the branch it lies on.
    pair : whether an image of it under the symmetries of the setting is another state.
    path : names of all parts of the stable segment that it belongs to, 'U-w' say.
    solutions : in order of increasing value, both ends included.
    low, high : the ends.
    contact : ranges in which a band of the width of the model touches itself, in order.
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
    def span(self) -> tuple[float, float]:
        """Least and largest value of what varies."""
        return self.low.value, self.high.value

    def __repr__(self) -> str:
        return (
            f"State({self.name}: {self.low.value:.6g} ({self.low.text}) to {self.high.value:.6g} "
            f"({self.high.text}), on branch {self.branch})"
        )


@dataclass(frozen=True)
class SliceBranch:
    """A followed branch with its events, one for each special point that is a fold or branch point, in order.

    Attributes
    ----------
    mirror : where a further symmetry leaves the setting alone, as between level clamps: the id of the branch
        that it makes of this one (or of another member of it); its own where it maps to itself. Otherwise None.
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
            f"Slice({s.place_text}; {s.along} {s.low:g} to {s.high:g}: {len(self.branches)} branches; stable: {names})"
        )

    @property
    def known_names(self) -> tuple[str, ...]:
        """Names that a state of this slice can have, in the order of lists."""
        known = self.settings.model.nomenclature
        own = tuple(dict.fromkeys(s.name for s in self.states))
        return (*known.names, known.other) if known is not None and self.settings.named else own

    def states_at(self, value: float, name: str = "") -> tuple[State, ...]:
        """All stable states at a value of what varies, or all of one name, which may be several; in order of `states`.

        Raises
        ------
        ValueError
            for a name that no state can have, and a value that is no number.
        """
        check_number(self.settings.along, value, -math.inf, math.inf, "a number")
        if name and name not in self.known_names:
            raise ValueError(f"name: expected one of {', '.join(self.known_names)}, got '{name}'")
        there = (s for s in self.states if s.span[0] <= value <= s.span[1])
        return tuple(s for s in there if not name or s.name == name)

    def state(self, name: str, value: float) -> State | None:
        """The stable state of a name at a value of what varies; None where there is none.

        Parameters
        ----------
        name : such as 'U' or 'S+-', or 'W:2' where several states are called W (:mod:`rodatlas.states.labels`).

        Raises
        ------
        ValueError
            for a name that no state can have, and where several have it and no number tells which is meant.
        """
        from rodatlas.atlas.slices.states.coexisting import numbered_state, wanted_in_slice

        check_type("name", name, str, "the name of a state such as S+-")
        wanted = wanted_in_slice(name, self)
        there = self.states_at(value, wanted.name)
        if len(there) == 1 and wanted.number is None:
            return there[0]
        found = numbered_state(self, wanted, value)
        return None if found is None else found.state

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the slice should know: the warnings, and what is to be said of its range."""
        care = self.settings.care
        return (*self.warnings, care) if care else self.warnings

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
        settings = self.settings
        if of == "events":
            return Table([{"branch": b.id, **_event_json(e, settings)} for b in self.branches for e in b.events])
        rows = []
        for s in self.states:
            row: dict[str, Any] = {"name": s.name, "pair": s.pair, "branch": s.branch, "path": s.path}
            for side, end in (("low", s.low), ("high", s.high)):
                row |= {f"{key}_{side}": value for key, value in _end_json(end, settings).items()}
            rows.append(row | {"contact": s.contact})
        return Table(rows)

    def to_json(self) -> dict[str, Any]:
        """The object that `rodatlas slice --json` prints."""
        s = self.settings
        return {
            "schema": SCHEMA,
            **s.model.head_json(s.setting, s.along, s.against),
            f"{s.control.key}_range": [s.low, s.high],
            "tolerance": s.tolerance,
            "seconds": round(self.seconds, 3),
            "warnings": list(self.remarks),
            "states": [_state_json(x, s) for x in self.states],
            "branches": [_branch_json(x, s) for x in self.branches],
        }


def _state_json(state: State, settings: SliceSettings) -> dict[str, Any]:
    """A state with what its ends have, (low, high): quantities, and the loads at s = 0 in space."""
    low, high = (settings.model.reading_json(end.solution) for end in (state.low, state.high))
    return {
        "name": state.name,
        "pair": state.pair,
        "path": state.path,
        "branch": state.branch,
        settings.control.key: list(state.span),
        **{name: [low[name], high[name]] for name in low},
        settings.against: [state.low.response, state.high.response],
        "ends": [_end_json(e, settings) for e in (state.low, state.high)],
        "contact": [list(span) for span in state.contact],
    }


def _end_json(end: StateEnd, settings: SliceSettings) -> dict[str, Any]:
    return {
        "kind": end.kind, "number": end.number, settings.control.key: end.value, settings.against: end.response,
        "snap": end.snap,
    }  # fmt: skip


def _branch_json(b: SliceBranch, settings: SliceSettings) -> dict[str, Any]:
    branch = b.followed.branch
    return {
        "id": b.id,
        "points": len(branch),
        "symmetric": b.followed.symmetric,
        "symmetries": sorted(b.followed.symmetries),
        "pair": b.followed.pair,
        "mirror": b.mirror,
        "closed": branch.closed,
        "end_reasons": [reason.name.lower() for reason in branch.ends],
        "special": [_event_json(e, settings) for e in b.events],
    }


def _event_json(event: Event, settings: SliceSettings) -> dict[str, Any]:
    return {
        "kind": event.kind,
        "number": event.number,
        settings.control.key: event.value,
        settings.against: event.response,
        "index": list(event.special.index),
        "criticality": event.criticality,
        "status": event.special.status.value,
    }
