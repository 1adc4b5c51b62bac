"""Settings of a continuation run; every one has a default that suits scaled problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import check_distinct, check_fields, check_function, check_type, shown
from rodatlas.continuation.discrete.mesh import MeshControl
from rodatlas.continuation.discrete.newton import NewtonOptions
from rodatlas.continuation.problem.bvp import BVP

if TYPE_CHECKING:
    from rodatlas.continuation.discrete.solution import Solution
    from rodatlas.continuation.results.branch import Point, SpecialPoint

KINDS = ("fold", "branch point")


@dataclass(frozen=True)
class StepControl:
    """Arclength steps, in scaled variables.

    A step is repeated at half its size when Newton fails, when its corrections exceed `max_correction` of the step,
    or when the tangent turns by more than `min_cosine` allows. Otherwise the next step aims at a first correction
    (the error of the quadratic predictor, of order step^3) of `target`.
    """

    initial: float = 0.02
    minimum: float = 1e-6
    maximum: float = 0.5
    target: float = 2e-3
    max_correction: float = 0.3
    min_cosine: float = 0.9
    growth: float = 1.6

    def __post_init__(self) -> None:
        check_fields(self, *(f.name for f in fields(self)))
        if not 0 < self.minimum <= self.initial <= self.maximum:
            raise ValueError(
                f"step: expected 0 < minimum <= initial <= maximum, got {self.minimum}, {self.initial}, {self.maximum}"
            )
        for name, low, high in (
            ("target", 0.0, float("inf")), ("max_correction", 0.0, float("inf")), ("min_cosine", 0.0, 1.0),
            ("growth", 1.0, float("inf")),
        ):  # fmt: skip
            if not low < getattr(self, name) < high:
                raise ValueError(f"step: expected {low} < {name} < {high}, got {getattr(self, name)}")

    def next_step(self, step: float, first_correction: float, iterations: int) -> float:
        """The step that follows a successful one."""
        factor = (self.target / max(first_correction, 1e-12)) ** (1.0 / 3.0)
        factor = min(max(factor, 0.5), self.growth)
        if iterations > 4:
            factor = min(factor, 0.7)
        return min(max(step * factor, self.minimum), self.maximum)


@dataclass(frozen=True)
class TraceOptions:
    """What a run follows, watches and stops at.

    Attributes
    ----------
    bounds : free parameter or observable name -> (low, high); the branch ends exactly there.
    zeros : free parameter or observable name -> value to be located along the way, its start included, or a sequence of
        them.
    extrema : free parameters or observables whose maxima and minima along the branch, or a locus, are located. (Those
        of the continuation parameter are the folds.)
    locate : kinds of special points to detect.
    index : function of a solution that returns an integer (None: unknown) which changes by one at each simple fold
        and branch point (the Morse index of a variational problem); it is compared with the located events.
    stop_at : function of (special point, last point); True ends the branch at the special point. Zeros and extrema at
        the very start of a run do not end it.
    newton : its tolerance is lowered to a tenth of the mesh's when it is above.
    on_point : called with every accepted point of a branch or locus (progress).
    max_points, max_folds : limits in each direction; the branch ends at the fold that is one too many.
    backend : 'numba' or 'scipy'; None follows the environment variable RODATLAS_BACKEND and what is installed.
    within : names of symmetries (or products 'a * b') that every state of the branch keeps: it passes the pitchforks
        where they are lost, which are located all the same. Side branches are followed outside.
    """

    step: StepControl = field(default_factory=StepControl)
    mesh: MeshControl = field(default_factory=MeshControl)
    newton: NewtonOptions = field(default_factory=NewtonOptions)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    zeros: Mapping[str, float | Sequence[float]] = field(default_factory=dict)
    extrema: tuple[str, ...] = ()
    locate: tuple[str, ...] = KINDS
    index: Callable[[Solution], int | None] | None = None
    stop_at: Callable[[SpecialPoint, Point], bool] | None = None
    on_point: Callable[[Any], None] | None = None
    max_points: int = 1000
    max_folds: int | None = None
    backend: str | None = None
    within: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, part in (("step", StepControl), ("mesh", MeshControl), ("newton", NewtonOptions)):
            check_type(name, getattr(self, name), part, f"{part.__name__}(..)")
        check_type("bounds", self.bounds, Mapping, "a mapping of names to (low, high)")
        check_type("zeros", self.zeros, Mapping, "a mapping of names to values")
        check_distinct("locate", self.locate, f"some of {KINDS}")
        check_distinct("extrema", self.extrema, "a tuple of names of free parameters or observables")
        check_distinct("within", self.within, "a tuple of names of symmetries")
        check_type("max_points", self.max_points, Integral, "a whole number")
        for name in ("index", "stop_at", "on_point"):
            if getattr(self, name) is not None:
                check_function(name, getattr(self, name))
        if self.max_folds is not None:
            check_type("max_folds", self.max_folds, Integral, "a whole number")
            if self.max_folds < 0:
                raise ValueError(f"max_folds: expected at least 0, got {self.max_folds}")
        for kind in self.locate:
            if kind not in KINDS:
                raise ValueError(f"locate: expected some of {KINDS}, got '{kind}'")
        for name, pair in self.bounds.items():
            if not _is_pair(pair) or not pair[0] < pair[1]:
                raise ValueError(f"bounds: expected numbers low < high for '{name}', got {shown(pair)}")
        for name, value in self.zeros.items():
            if not _is_number(value) and not _are_numbers(value):
                raise ValueError(f"zeros: expected a number, or a sequence of them, for '{name}', got {shown(value)}")
            if not np.isfinite(np.asarray(value, dtype=float)).all():
                raise ValueError(f"zeros: expected finite numbers for '{name}', got {shown(value)}")
        if self.backend not in (None, "numba", "scipy"):
            raise ValueError(f"backend: expected 'numba', 'scipy' or None, got {shown(self.backend)}")
        if self.max_points < 1:
            raise ValueError(f"max_points: expected at least 1, got {self.max_points}")
        if self.newton.tolerance > 0.1 * self.mesh.tolerance:  # else no mesh could meet its own tolerance
            object.__setattr__(self, "newton", replace(self.newton, tolerance=0.1 * self.mesh.tolerance))

    @classmethod
    def given(cls, options: TraceOptions | None) -> TraceOptions:
        """What a caller gave, the defaults for None; ValueError for anything else."""
        check_type("options", options, (TraceOptions, type(None)), "TraceOptions")
        return cls() if options is None else options

    @property
    def sought(self) -> tuple[tuple[str, float], ...]:
        """All pairs of a name and one of the values to be located, each once."""
        every = ((name, values if isinstance(values, Sequence | np.ndarray) else (values,))
                 for name, values in self.zeros.items())  # fmt: skip
        return tuple((name, float(value)) for name, values in every for value in dict.fromkeys(values))

    def check_names(self, bvp: BVP, free: Sequence[str]) -> None:
        """Raise ValueError when a bound, zero or extremum is not one of a free parameter or an observable."""
        known = [*free, *bvp.observables]
        for field_name in ("bounds", "zeros", "extrema"):
            among = known[1:] if field_name == "extrema" else known
            for name in getattr(self, field_name):
                if name not in among:
                    folds = f": extrema of '{name}' are the folds" if name == known[0] else ""
                    raise ValueError(f"{field_name}: expected one of {', '.join(among)}, got '{name}'{folds}")

    def settings(self) -> dict[str, Any]:
        """The options as plain values, for a record of the run (functions by name)."""
        plain: dict[str, Any] = {key: asdict(getattr(self, key)) for key in ("step", "mesh", "newton")}
        plain["mesh"]["intervals"] = list(self.mesh.intervals)
        plain["bounds"] = {name: [float(v) for v in pair] for name, pair in self.bounds.items()}
        plain["zeros"] = {name: [v for other, v in self.sought if other == name] for name in self.zeros}
        for key in ("locate", "extrema", "within"):
            plain[key] = list(getattr(self, key))
        for key in ("index", "stop_at"):
            function = getattr(self, key)
            plain[key] = None if function is None else getattr(function, "__qualname__", type(function).__name__)
        return plain | {key: getattr(self, key) for key in ("max_points", "max_folds", "backend")}


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_pair(value: object) -> bool:
    return isinstance(value, Sequence) and len(value) == 2 and all(map(_is_number, value))


def _are_numbers(value: object) -> bool:
    return isinstance(value, Sequence | np.ndarray) and len(value) > 0 and all(map(_is_number, value))
