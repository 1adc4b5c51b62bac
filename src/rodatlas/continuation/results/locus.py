"""What following a locus returns: points, special points, the locus."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.results.branch import EndReason, Status, check_kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rodatlas.continuation.discrete.collocation import Scale
    from rodatlas.continuation.table import Table

KINDS = ("cusp", "criticality", "coalescence", "crossing", "pitchfork", "extremum")


class Effect(Enum):
    """What happens to the branches where a locus of folds turns back; the value is a sentence."""

    TOUCH = "two branches touch: they merge and split"
    APPEARS = "isola center: a closed branch appears as the parameter grows"
    VANISHES = "isola center: a closed branch vanishes as the parameter grows"


@dataclass(frozen=True, eq=False)
class LocusPoint:
    """One point of a locus.

    Attributes
    ----------
    solution : Solution
    arclength : float, signed distance along the locus from its start.
    tangent : (k+1,) derivative of the free parameters with respect to arclength, scaled.
    tests : values of the test functions by name, see `locus_system`.
    unfolding : on a locus of branch points, size of the perturbation that it needs: zero when it persists.
    iterations : Newton iterations spent.
    """

    solution: Solution
    arclength: float
    tangent: np.ndarray
    tests: Mapping[str, float]
    unfolding: float = 0.0
    iterations: int = 0


@dataclass(frozen=True, eq=False)
class LocusEvent:
    """A special point of a locus.

    Attributes
    ----------
    kind : 'cusp' (two folds meet), 'criticality' (a pitchfork changes between super- and subcritical; a locus of folds
        ends there), 'coalescence' (a fold meets a branch point), 'crossing' (another branch point at the same
        solution), 'pitchfork' (a branch point that nothing protects is one), 'extremum' (the locus turns back in
        `parameter`, or an observable is extreme on it), or 'zero of NAME'.
    parameter : name of the parameter or observable that is extreme, or ''.
    status : CONVERGED when the test function was brought to zero, else BRACKETED; UNRESOLVED when it was, but on the
        finest mesh allowed the error exceeds ten times the tolerance.
    bracket : arclengths between which it lies; test : value of the test function at the solution.
    what : what happens there, in words.
    effect : the same where a locus of folds turns back, for programs; None elsewhere.
    coefficients : of the normal form at a cusp, see :func:`rodatlas.continuation.singular.normal_form.cusp_form`.
    """

    kind: str
    parameter: str
    solution: Solution
    arclength: float
    status: Status
    bracket: tuple[float, float]
    test: float
    what: str = ""
    coefficients: Mapping[str, float] = field(default_factory=dict)
    effect: Effect | None = None

    def __repr__(self) -> str:
        of = f" in {self.parameter}" if self.parameter else ""
        return f"LocusEvent({self.kind}{of}: {self.what}; {self.status.value}, {self.solution!r})"


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of folds, branch points, or values or extrema of an observable in the plane of two parameters.

    Attributes
    ----------
    kind : 'fold', 'branch point', 'zero of NAME', 'extremum of NAME', or 'unprotected branch point' (in three
        parameters).
    free : names of the free parameters, the two of the plane first.
    points : tuple of LocusPoint; events : tuple of LocusEvent; both in order of arclength.
    ends : reasons at the two ends.
    scale : units of the arclength norm; settings : the options of the run, as plain values.
    pitchfork : whether the branch points are pitchforks.
    unresolved : points and events whose estimated error exceeds ten times the tolerance, or is not known although the
        mesh adapts.
    """

    kind: str
    free: tuple[str, ...]
    points: tuple[LocusPoint, ...]
    events: tuple[LocusEvent, ...]
    ends: tuple[EndReason, EndReason]
    scale: Scale = field(repr=False)
    settings: Mapping[str, Any] = field(default_factory=dict, repr=False)
    pitchfork: bool = False
    unresolved: int = 0

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        spans = ", ".join(f"{n} in [{self.column(n).min():.6g}, {self.column(n).max():.6g}]" for n in self.free[:2])
        counts = {k: sum(e.kind == k for e in self.events) for k in dict.fromkeys(e.kind for e in self.events)}
        found = ", ".join(f"{v} x {k}" for k, v in counts.items()) or "no special points"
        missed = f"; {self.unresolved} points miss the tolerance" if self.unresolved else ""
        return (
            f"Locus({self.kind}: {len(self)} points, {spans}, {found}; "
            f"ends: {self.ends[0].value} | {self.ends[1].value}{missed})"
        )

    @property
    def closed(self) -> bool:
        """Whether the curve returned to its start."""
        return EndReason.CLOSED in self.ends

    def of_kind(self, kind: str) -> tuple[LocusEvent, ...]:
        """The special points of one kind; ValueError for a kind that no point of a locus could be of."""
        check_kind(kind, KINDS, ("zero",), self.points[0].solution)
        return tuple(e for e in self.events if e.kind == kind)

    def column(self, name: str) -> np.ndarray:
        """A parameter or observable at all points."""
        return np.array([p.solution[name] for p in self.points])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.continuation.store.locus import save_locus

        save_locus(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Locus:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.continuation.store.locus import load_locus

        return load_locus(path)

    def plot(self, x: str | None = None, y: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw in the plane of its parameters, or of what is named, see :func:`rodatlas.plot.draw_locus`."""
        from rodatlas.plot.branches import draw_locus

        return draw_locus(self, x, y, ax=ax)

    def to_frame(self) -> Table:
        """One row per point and special point: event, arclength, parameters, observables, error."""
        from rodatlas.continuation.table import Table

        marked = [("", p.arclength, p.solution) for p in self.points]
        marked += [(f"{e.kind} {e.parameter}".strip(), e.arclength, e.solution) for e in self.events]
        rows = []
        for event, arclength, solution in sorted(marked, key=lambda row: row[1]):
            parameters = dict(zip(solution.parameter_names, solution.parameters.tolist(), strict=True))
            row = {"event": event, "arclength": arclength} | parameters | dict(solution.observables)
            rows.append(row | {"error": solution.error})
        return Table(rows)
