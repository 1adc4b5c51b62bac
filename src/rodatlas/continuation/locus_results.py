"""What following a locus returns: points, special points, the locus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.results import EndReason, Status
from rodatlas.continuation.solution import Solution

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class LocusPoint:
    """One point of a locus: the solution there, arclength, and the tangent (k+1,) of the free parameters, scaled."""

    solution: Solution
    arclength: float
    tangent: np.ndarray
    tests: dict[str, float]
    iterations: int = 0


@dataclass(frozen=True, eq=False)
class LocusEvent:
    """A special point of a locus.

    Attributes
    ----------
    kind : 'cusp' (two folds meet), 'criticality' (a pitchfork changes between super- and subcritical; a locus of folds
        ends there), or 'extremum' (the locus turns back in `parameter`: two points meet and vanish, or, on a locus of
        folds that is no cusp, two branches touch).
    parameter : name of the parameter that is extreme, or ''.
    status : CONVERGED when the test function was brought to zero, else BRACKETED.
    bracket : arclengths between which it lies; test : value of the test function at the solution.
    """

    kind: str
    parameter: str
    solution: Solution
    arclength: float
    status: Status
    bracket: tuple[float, float]
    test: float

    def __repr__(self) -> str:
        of = f" in {self.parameter}" if self.parameter else ""
        return f"LocusEvent({self.kind}{of}, {self.status.value}, {self.solution!r})"


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of folds or branch points in the plane of two parameters, in order of arclength.

    kind : 'fold' or 'branch point'; free : names of the free parameters, the two of the plane first.
    """

    kind: str
    free: tuple[str, ...]
    points: tuple[LocusPoint, ...]
    events: tuple[LocusEvent, ...]
    ends: tuple[EndReason, EndReason]

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        spans = ", ".join(f"{n} in [{self.column(n).min():.6g}, {self.column(n).max():.6g}]" for n in self.free[:2])
        return f"Locus({self.kind}: {len(self)} points, {spans}, {len(self.events)} events)"

    @property
    def closed(self) -> bool:
        return EndReason.CLOSED in self.ends

    def column(self, name: str) -> np.ndarray:
        """A parameter or observable at all points."""
        return np.array([p.solution[name] for p in self.points])

    def to_frame(self) -> pd.DataFrame:
        """One row per point: arclength, parameters, observables, error."""
        import pandas as pd

        rows = []
        for p in self.points:
            parameters = dict(zip(p.solution.parameter_names, p.solution.parameters.tolist(), strict=True))
            row = {"arclength": p.arclength} | parameters | dict(p.solution.observables)
            rows.append(row | {"error": p.solution.error})
        return pd.DataFrame(rows)
