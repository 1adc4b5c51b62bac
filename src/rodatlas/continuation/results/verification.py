"""What was checked on a branch, and what does not add up."""

from __future__ import annotations

from dataclasses import dataclass

NEARLY_SINGULAR = (
    "the problem is nearly singular without a change of sign: a branch point with a kernel of even dimension, or two "
    "very close"
)
ROUND_OFF = (
    "the determinant changes sign, but no singular value vanishes: round-off, or a test function that means nothing "
    "here"
)
UNRESOLVED_MODE = (
    "the mesh did not resolve the mode in which the problem is nearest to singular: a branch point may lie there"
)


@dataclass(frozen=True)
class Discrepancy:
    """An interval of a branch on which the bookkeeping does not add up.

    Attributes
    ----------
    bracket : arclengths; parameter : values of the continuation parameter at both ends.
    index : index of the solution at both ends, None when it is not known.
    events : kinds of the folds and branch points located there.
    reason : what is wrong, '' when it is the index.
    """

    bracket: tuple[float, float]
    index: tuple[int | None, int | None]
    events: tuple[str, ...]
    parameter: tuple[float, float]
    reason: str = ""

    def __str__(self) -> str:
        where = f"between parameter values {self.parameter[0]:.8g} and {self.parameter[1]:.8g}"
        if self.reason:
            return f"{where} {self.reason}"
        found = ", ".join(self.events) or "no event"
        return f"index changes from {self.index[0]} to {self.index[1]} {where}, where {found} was located"


@dataclass(frozen=True)
class Verification:
    """The record of what was checked on a branch.

    Attributes
    ----------
    steps : accepted steps; on each, signs of the tangent's parameter component and of the determinant, its slope and
        the smallest singular value were watched.
    indexed : those on which the caller's index was known at both ends and compared with the events located.
    repeated : steps that were taken again shorter, because something might have hidden on them.
    retraced : suspicious intervals that were traced again with much smaller steps.
    cleared : those of them on which everything then added up.
    converged, bracketed : folds, branch points and extrema by status.
    least_singular : smallest singular value of the bordered matrix at a computed point, scaled.
    untrusted : arclength intervals on which the determinant was found to be round-off.
    unresolved : points and special points whose estimated error exceeds ten times the tolerance, or is not known
        although the mesh adapts.
    unfolding : largest unfolding parameter of phase conditions; it vanishes at solutions, but for their error.
    """

    steps: int
    indexed: int
    repeated: int = 0
    retraced: int = 0
    cleared: int = 0
    converged: int = 0
    bracketed: int = 0
    least_singular: float = float("nan")
    untrusted: tuple[tuple[float, float], ...] = ()
    unresolved: int = 0
    unfolding: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether every special point converged, every point meets the tolerance, and nothing is left untrusted."""
        doubts = self.bracketed or self.untrusted or self.unresolved
        return not doubts and self.retraced == self.cleared

    def __str__(self) -> str:
        index = f"index compared on {self.indexed}" if self.indexed else "no index was given"
        parts = [f"{self.steps} steps, {self.repeated} of them repeated shorter; {index}"]
        parts += [f"{self.converged} folds, branch points and extrema converged, {self.bracketed} only bracketed"]
        parts += [f"smallest singular value {self.least_singular:.1e}"]
        if self.retraced:
            parts += [f"{self.retraced} intervals traced again, {self.cleared} cleared"]
        parts += [f"{len(self.untrusted)} intervals not trusted" if self.untrusted else "all test functions trusted"]
        if self.unresolved:
            parts += [f"{self.unresolved} points miss the tolerance: raise intervals or loosen the tolerance"]
        if self.unfolding:
            parts += [f"phase conditions unfolded by {self.unfolding:.1e} at most"]
        return "; ".join(parts)
