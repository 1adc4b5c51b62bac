"""What continuation returns: points, special points and branches."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import shown
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.results.labels import LABELS
from rodatlas.continuation.results.verification import Discrepancy, Verification

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rodatlas.continuation.discrete.collocation import Scale
    from rodatlas.continuation.discrete.newton import NewtonCode
    from rodatlas.continuation.linear.matrix import Columns
    from rodatlas.continuation.table import Table


class EndReason(Enum):
    """Why a branch ends; the value is a sentence."""

    RANGE = "range reached"
    CLOSED = "closed: back at its start"
    START = "starts here"
    BRANCH_POINT = "ends at a branch point of another branch"
    FOLD_LIMIT = "the allowed number of folds is reached"
    POINT_LIMIT = (
        "the allowed number of points is reached: raise max_points, or give larger `scales` to unknowns and parameters "
        "that change by much more than one"
    )
    CRITICALITY = "ends where a pitchfork changes between super- and subcritical"
    UNFOLDED = (
        "the branch point does not persist: it needs a symmetry or a branch that the second parameter breaks; follow "
        "it in three parameters"
    )
    ROUND_OFF = "round-off: forces or kernels are too large to be known better, on any mesh"
    MIN_STEP = "the step became too small: loosen the tolerance, allow more intervals or a smaller minimum step"
    MESH_LIMIT = "the tolerance needs more intervals than allowed: raise intervals or loosen the tolerance"
    UNREFINED = (
        "the state is lost when its mesh is refined, so it may be one of the discrete equations only: start closer to "
        "a solution, or from more intervals"
    )
    STOPPED = "stopped by the caller"
    INTERRUPTED = "interrupted: the part computed so far is kept"


class Status(Enum):
    """How well a special point is known.

    UNRESOLVED: Newton converged, but the error on the finest mesh allowed exceeds ten times the tolerance.
    """

    CONVERGED = "converged"
    BRACKETED = "bracketed"
    UNRESOLVED = "converged on a mesh that misses the tolerance"


def check_kind(kind: object, plain: Sequence[str], named: Sequence[str], solution: Solution) -> None:
    """Raise ValueError for what is no kind of special points: a `plain` word, or a `named` one 'of' a name."""
    names = (*solution.parameter_names, *solution.observables)
    if kind not in (*plain, *(f"{word} of {name}" for word in named for name in names)):
        words = ", ".join((*plain, *(f"{word} of NAME" for word in named)))
        raise ValueError(f"kind: expected one of {words}, where NAME is {' or '.join(names)}, got {shown(kind)}")


@dataclass(frozen=True, eq=False)
class Point:
    """One computed point of a branch.

    Attributes
    ----------
    solution : Solution
    arclength : float, signed distance along the branch from its start.
    tangent : (k,) derivative of the free parameters with respect to arclength, scaled.
    fold_test, branch_test : tangent component of the continuation parameter; sign of the bordered determinant
        (oriented along increasing arclength).
    index : int or None, what the caller's `index` function returned.
    iterations, step : Newton iterations spent and arclength step taken to reach the point.
    weakness : smallest singular value of the bordered matrix, scaled: the distance to a branch point, in a sense.
    """

    solution: Solution
    arclength: float
    tangent: np.ndarray
    fold_test: float
    branch_test: float
    index: int | None = None
    iterations: int = 0
    step: float = 0.0
    weakness: float = float("nan")


@dataclass(frozen=True)
class NormalForm:
    r"""The continuation parameter along the curve that bends or branches off at a special point,

    .. math:: \lambda = \lambda_0 + \text{slope}\,a + \tfrac12\,\text{bend}\,a^2 + O(a^3),

    with a the arclength of that curve.

    Attributes
    ----------
    kind : 'fold', 'transcritical', 'pitchfork', 'isolated' (no other curve passes: an isola center) or 'degenerate'; of
        an extremum 'maximum' or 'minimum', with the observable in the place of the parameter.
    slope, bend : coefficients, in units of the parameter; of the branch itself at a fold or extremum, of the side
        branch at a pitchfork, of the other branch at a transcritical point.
    """

    kind: str
    slope: float = float("nan")
    bend: float = float("nan")


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A fold, branch point, user zero or extremum, with the record of how it was found.

    Attributes
    ----------
    kind : 'fold', 'branch point', 'zero of NAME', or 'extremum of NAME'.
    status : CONVERGED when Newton on the augmented system converged inside the bracket and the error is accepted,
        UNRESOLVED when no allowed mesh brought it there, else BRACKETED.
    bracket : arclengths of the two points between which the test function changes sign.
    tests : values of the test function at these points.
    index : index of the solution before and after, None when no index function was given.
    residual : size of the last Newton correction of the augmented system, scaled.
    curvature : for a fold, second derivative of the continuation parameter along the branch, scaled.
    directions : tangents through a branch point: along this branch, and along the other one; at a multiple branch
        point the unit tangents of all rays that leave it, see `rays`; also of an extremum that is a branch point.
    free, scale : free parameters and units that `directions` refer to.
    turns : whether the continuation parameter is extreme here: at a fold, and at a pitchfork met along its side.
    normal_form : NormalForm, None when it was not computed.
    bend : at a branch point, second derivative of the other curve: with its direction it predicts the other branch.
    multiplicity : dimension of the kernel less one: 1 at a simple branch point (and everywhere else), 2 and more where
        several modes become singular at once.
    continuum : whether a continuous symmetry moves some of the branches through a multiple branch point around, so that
        they form families, of which `directions` holds one each.
    nearby : scaled states, one on each ray of a multiple branch point, which tell apart rays with one tangent.
    unverified : candidates of rays of a multiple branch point that could not be confirmed; 0 when all are known.
    isotropy, breaks : names of the problem's symmetries, discrete and continuous, that the solution has, and those of
        them that a branch through the point loses.
    """

    kind: str
    solution: Solution
    arclength: float
    status: Status
    bracket: tuple[float, float]
    tests: tuple[float, float]
    index: tuple[int | None, int | None] = (None, None)
    residual: float = float("nan")
    curvature: float = float("nan")
    directions: tuple[Columns, ...] = field(default=(), repr=False)
    free: tuple[str, ...] = ()
    scale: Scale | None = field(default=None, repr=False)
    turns: bool = False
    normal_form: NormalForm | None = None
    bend: Columns | None = field(default=None, repr=False)
    multiplicity: int = 1
    continuum: bool = False
    nearby: tuple[Columns, ...] = field(default=(), repr=False)
    unverified: int = 0
    isotropy: tuple[str, ...] = ()
    breaks: tuple[str, ...] = ()

    @property
    def rays(self) -> tuple[Columns, ...]:
        """Unit tangents of the half-branches that leave a branch point, the choices of `switch(..., ray=)`.

        This branch forward (0) and backward (1) come first; of every other curve both sides follow one another.
        """
        if self.multiplicity > 1 or self.kind != "branch point":
            return self.directions
        from rodatlas.continuation.discrete.vectors import scaled

        return tuple(scaled(d, sign) for d in self.directions for sign in (1.0, -1.0))

    @property
    def criticality(self) -> str:
        """'supercritical' or 'subcritical' at a pitchfork met along its trunk, with an index on both sides; else ''.

        It is supercritical when the side branch lies where the trunk has the larger index.
        """
        before, after = self.index
        form = self.normal_form
        if form is None or form.kind != "pitchfork" or self.turns:
            return ""
        if before is None or after is None or before == after:
            return ""
        ahead = float(self.directions[0].scalars[0]) * form.bend > 0  # the side branch lies beyond the point
        return "supercritical" if ahead == (after > before) else "subcritical"

    @property
    def name(self) -> str:
        """The observable or parameter that has a value, or is extreme, here; '' at a fold or branch point."""
        return self.kind.partition(" of ")[2]

    @property
    def is_singular(self) -> bool:
        """Whether it is a fold or a branch point, rather than what an observable does."""
        return self.kind in ("fold", "branch point")

    @property
    def is_zero(self) -> bool:
        """Whether only a value is reached: all other kinds have test functions and a mesh of their own."""
        return self.kind.startswith("zero of ")

    @property
    def is_branch_point(self) -> bool:
        """Whether it is a branch point, or an extremum at one: a side branch is its own mirror image there."""
        return self.kind == "branch point" or bool(self.directions)

    @property
    def label(self) -> str:
        """Short label for plots."""
        return LABELS[self.kind.partition(" of ")[0]]

    def __repr__(self) -> str:
        kind = self.kind
        if self.multiplicity > 1:
            family = ", a continuum of branches" if self.continuum else ""
            missing = f", {self.unverified} more unconfirmed" if self.unverified else ""
            kind += f" of multiplicity {self.multiplicity} with {len(self.directions)} rays{missing}{family}"
        return f"SpecialPoint({kind}, {self.status.value}, {self.solution!r})"


@dataclass(frozen=True, eq=False)
class Branch:
    """A curve of solutions in order of arclength.

    Attributes
    ----------
    free : names of the free parameters, the continuation parameter first.
    points : tuple of Point; special : tuple of SpecialPoint; both sorted by arclength.
    ends : reasons at the two ends; closed : whether the curve returned to its start.
    discrepancies : intervals that the bookkeeping could not explain.
    verification : what was checked.
    newton_iterations : total spent, location of special points included.
    failures : why Newton last failed at an end whose reason is MIN_STEP, else None.
    settings : the options of the run, as plain values.
    orbit : names of the continuous symmetries that move the states of the branch, which is one member of a family; it
        was followed with phase conditions.
    """

    free: tuple[str, ...]
    points: tuple[Point, ...]
    special: tuple[SpecialPoint, ...]
    ends: tuple[EndReason, EndReason]
    discrepancies: tuple[Discrepancy, ...] = ()
    newton_iterations: int = 0
    failures: tuple[NewtonCode | None, NewtonCode | None] = (None, None)
    settings: Mapping[str, Any] = field(default_factory=dict)
    verification: Verification = field(default_factory=lambda: Verification(steps=0, indexed=0))
    orbit: tuple[str, ...] = ()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an HDF5 file, which replaces an older one only when complete."""
        from rodatlas.continuation.store.branch import save_branch

        save_branch(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Branch:
        """Read what :meth:`save` wrote; ValueError when the file is damaged or holds something else."""
        from rodatlas.continuation.store.branch import load_branch

        return load_branch(path)

    @property
    def closed(self) -> bool:
        return EndReason.CLOSED in self.ends

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self.points)

    def __repr__(self) -> str:
        counts = {k: sum(x.kind == k for x in self.special) for k in dict.fromkeys(x.kind for x in self.special)}
        found = ", ".join(f"{v} x {k}" for k, v in counts.items()) or "no special points"
        lo, hi = self.column(self.free[0]).min(), self.column(self.free[0]).max()
        return (
            f"Branch({len(self)} points, {self.free[0]} in [{lo:.6g}, {hi:.6g}], {found}; "
            f"ends: {self.ends[0].value} | {self.ends[1].value})"
        )

    def column(self, name: str) -> np.ndarray:
        """A parameter, observable or 'arclength', 'index' at all points."""
        if name in ("arclength", "index", "fold_test", "branch_test", "weakness"):
            return np.array([getattr(p, name) for p in self.points], dtype=float)
        return np.array([p.solution[name] for p in self.points])

    def of_kind(self, kind: str) -> tuple[SpecialPoint, ...]:
        """The special points of one kind; ValueError for a kind that no point of this branch could be of."""
        check_kind(kind, ("fold", "branch point"), ("zero", "extremum"), self.points[0].solution)
        return tuple(x for x in self.special if x.kind == kind)

    def plot(self, x: str, y: str, ax: Axes | None = None, *, color: Any = None) -> Axes:
        """Draw in the plane of two parameters or observables, see :func:`rodatlas.plot.draw_branch`.

        >>> ax = branch.plot("lam", "mean")
        """
        from rodatlas.plot.branches import draw_branch

        return draw_branch(self, x, y, ax=ax, color=color)

    def to_frame(self) -> Table:
        """One row per point and special point: label, arclength, parameters, observables, error, index."""
        from rodatlas.continuation.table import Table

        rows: list[dict[str, Any]] = []
        marked = [("", p.arclength, p.solution, p.index) for p in self.points]
        marked += [(x.label, x.arclength, x.solution, None) for x in self.special]
        for label, arclength, sol, index in sorted(marked, key=lambda r: r[1]):
            row: dict[str, Any] = {"label": label, "arclength": arclength}
            row |= dict(zip(sol.parameter_names, sol.parameters.tolist(), strict=True))
            row |= dict(sol.observables)
            rows.append(row | {"error": sol.error, "intervals": sol.intervals, "index": index})
        return Table(rows)
