"""Settings of a continuation run; every one has a default that suits scaled problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rodatlas.continuation.mesh import MeshControl
from rodatlas.continuation.newton import NewtonOptions

if TYPE_CHECKING:
    from rodatlas.continuation.results import Point, SpecialPoint
    from rodatlas.continuation.solution import Solution


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
        if not 0 < self.minimum <= self.initial <= self.maximum:
            raise ValueError(
                f"step: expected 0 < minimum <= initial <= maximum, got {self.minimum}, {self.initial}, {self.maximum}"
            )

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
    bounds : parameter or observable name -> (low, high); the branch ends exactly there.
    zeros : observable or parameter name -> value to be located along the way.
    locate : kinds of special points to detect.
    index : function of a solution that returns an integer which changes by one at each simple fold and branch
        point (the Morse index of a variational problem); it is compared with the located events.
    stop_at : function of (special point, last point); True ends the branch at the special point.
    on_point : called with every accepted point (progress).
    """

    step: StepControl = field(default_factory=StepControl)
    mesh: MeshControl = field(default_factory=MeshControl)
    newton: NewtonOptions = field(default_factory=NewtonOptions)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    zeros: Mapping[str, float] = field(default_factory=dict)
    locate: tuple[str, ...] = ("fold", "branch point")
    index: Callable[[Solution], int | None] | None = None
    stop_at: Callable[[SpecialPoint, Point], bool] | None = None
    on_point: Callable[[Point], None] | None = None
    max_points: int = 1000
    max_folds: int | None = None
    backend: str | None = None
