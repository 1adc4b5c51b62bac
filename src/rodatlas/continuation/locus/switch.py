"""From a special point of a locus to the other locus that meets it there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.switch import switch
from rodatlas.continuation.curve.trace import NotConverged
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.locus.follow import follow_locus
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import EndReason, SpecialPoint, Status
from rodatlas.continuation.results.locus import Locus, LocusEvent
from rodatlas.continuation.singular.augmented import kernel_directions


def fold_locus_at(bvp: BVP, locus: Locus, event: LocusEvent, options: TraceOptions | None = None) -> Locus | None:
    """The locus of folds that ends where a pitchfork changes between super- and subcritical.

    Beside the event, on one side of it, the side branch of the pitchfork has a fold at a small distance; it is found
    by following that branch, and followed both ways. None when no such fold leads back to the event.

    Parameters
    ----------
    locus : of branch points, on which the event was found.
    event : of kind 'criticality'.
    options : as for :func:`follow_locus`, but for `within`: the side branch has lost that symmetry.

    Raises
    ------
    ValueError
        when the event is of another kind.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("locus", locus, Locus, "a Locus")
    check_type("event", event, LocusEvent, "one of the events of the locus")
    if event.kind != "criticality" or locus.kind != "branch point":
        raise ValueError(f"event: expected a criticality on a locus of branch points, got a {event.kind}")
    options = replace(TraceOptions.given(options), within=())
    branch_options = replace(options, zeros={}, extrema=(), max_points=80, max_folds=0, locate=("fold",), bounds={})
    names = (locus.free[0], *locus.free[2:])
    i = int(np.searchsorted([p.arclength for p in locus.points], event.arclength))
    neighbors = [locus.points[j].solution for j in (i - 1, i) if 0 <= j < len(locus.points)]
    for weight in (0.3, 1.0, 0.05):
        for neighbor in neighbors:
            point = _beside(bvp, event.solution, neighbor, weight, names, locus)
            side = switch(bvp, point, names, branch_options) if point is not None else None
            for fold in side.of_kind("fold")[:1] if side is not None else ():
                found = _from_fold(bvp, fold, locus, event, options)
                if found is not None:
                    return found
    return None


def _beside(
    bvp: BVP, event: Solution, neighbor: Solution, weight: float, names: tuple[str, ...], locus: Locus
) -> SpecialPoint | None:
    """The pitchfork at a place between the event and a point of the locus."""
    free = [bvp.parameter_index(name) for name in names]
    parameters = (1 - weight) * event.parameters + weight * neighbor.parameters
    colloc = Collocation(bvp, event.mesh, event.points, parameters, free, locus.scale)
    x, y = colloc.state(event), colloc.state(neighbor)
    guess = Columns(*((1 - weight) * a + weight * b for a, b in zip(vars(x).values(), vars(y).values(), strict=True)))
    parameter = Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), np.eye(len(free))[0])
    found = kernel_directions(colloc, guess, parameter)
    if found is None:
        return None
    return SpecialPoint(
        "branch point", colloc.solution(found[0], event.error), 0.0, Status.CONVERGED, (0.0, 0.0), (0.0, 0.0),
        directions=found[1], free=names, scale=locus.scale,
    )  # fmt: skip


def _from_fold(bvp: BVP, fold: SpecialPoint, locus: Locus, event: LocusEvent, options: TraceOptions) -> Locus | None:
    """The locus through a fold, when one of its ends is the event."""
    try:
        found = follow_locus(bvp, fold, locus.free, options)
    except (NotConverged, ValueError):
        return None
    for end, point in zip(found.ends, (found.points[0], found.points[-1]), strict=True):
        gap = [abs(point.solution[name] - event.solution[name]) for name in locus.free[:2]]
        if end is EndReason.CRITICALITY and max(gap) < 1e-4:
            return found
    return None
