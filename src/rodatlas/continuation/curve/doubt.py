"""Stretches of a walk whose points may miss the tolerance: what was estimated too late for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rodatlas.continuation.discrete.solution import Solution


@dataclass(frozen=True)
class Doubt:
    """Arclengths between two estimates of the error, of which the second is more than accepted."""

    low: float
    high: float
    error: float


def marked(solution: Solution, arclength: float, doubts: Sequence[Doubt]) -> Solution:
    """The solution with the largest error (NaN: unknown) that was found after it, where one was."""
    errors = [d.error for d in doubts if d.low <= arclength <= d.high]
    return replace(solution, error=max(errors, key=_rank)) if errors else solution


def _rank(error: float) -> float:
    return error if error == error else float("inf")
