"""The public verbs: solve at fixed parameters, trace a branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from rodatlas.continuation.checks import check_each, check_flag, check_number, check_type
from rodatlas.continuation.curve.join import Guard, Half, joined
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.orbit import bare
from rodatlas.continuation.curve.point import Frame
from rodatlas.continuation.curve.resolve import resolved
from rodatlas.continuation.curve.retrace import rechecked
from rodatlas.continuation.curve.start import NotConverged, check_belongs, first_state, free_or_only
from rodatlas.continuation.curve.walker import Walker
from rodatlas.continuation.curve.ways import walked
from rodatlas.continuation.discrete.collocation import Scale
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import Branch, EndReason

DIRECTION = "a number whose sign tells the way"


def solve(
    bvp: BVP, guess: Solution, free: Sequence[str] | None = None, options: TraceOptions | None = None
) -> Solution:
    """Correct a guess at its own parameter values, on a mesh that meets the tolerance.

    Parameters
    ----------
    guess : Solution
        its parameters are kept, except those that the conditions determine.
    free : names of bvp.n_free parameters; the first is held, the others are solved for. With one free parameter
        the choice does not matter and may be left out. A problem without parameters is solved too.

    Raises
    ------
    NotConverged
        with a sentence that says what to change.
    ValueError
        when the guess belongs to another problem or holds NaN.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("guess", guess, Solution, "a Solution")
    options = TraceOptions.given(options)
    if not bvp.parameters:
        return _solved_without_parameters(bvp, guess, options)
    frame = first_state(bvp, guess, free_or_only(bvp, free), options)
    return frame.colloc.solution(frame.x, frame.error)


def _solved_without_parameters(bvp: BVP, guess: Solution, options: TraceOptions) -> Solution:
    """Solve with a parameter that has no effect, which is held as the continuation parameter."""
    name = "held_parameter"
    check_belongs(bvp, "start", guess)

    def bare(solution: Solution) -> Solution:
        return replace(solution, parameter_names=(), parameters=np.zeros(0))

    given = replace(guess, parameter_names=(name,), parameters=np.zeros(1))
    try:
        return bare(solve(bvp.with_parameter(name), given, (name,), options))
    except NotConverged as error:
        found = error.solution and bare(error.solution)
        raise NotConverged(error.code, f"start of the run at {guess!r}", found) from None


def trace(
    bvp: BVP,
    start: Solution,
    free: Sequence[str],
    options: TraceOptions | None = None,
    *,
    both: bool = True,
    direction: float = 1.0,
    scale: Scale | None = None,
) -> Branch:
    """Follow the branch through `start`.

    Parameters
    ----------
    start : Solution
        of the problem, or a guess. At a branch point the branch along which the parameter changes most is followed; it
        is one of the branch's special points, as a fold is.
    free : names of the free parameters (bvp.n_free of them), the continuation parameter first; on an orbit of a
        continuous symmetry one more, such as a period, for each phase condition that is to determine it.
    both : follow both directions (default), else only the one in which the parameter changes as `direction`.
    scale : units of the arclength norm; by default those of the problem and the start.

    Raises
    ------
    NotConverged
        when the start is not a solution and Newton cannot make it one.
    ValueError
        when the start belongs to another problem, holds NaN, or lies outside the bounds and the run leads away from
        them.

    Notes
    -----
    Nothing computed is lost when the run is interrupted (Ctrl-C), or when a function of the options or anything else
    raises: the exception has an attribute `branch`, which holds the part computed so far and ends with
    EndReason.INTERRUPTED.

    >>> try:
    ...     branch = trace(bvp, start, ("lam",), options)
    ... except KeyboardInterrupt as stopped:
    ...     branch = stopped.branch
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("start", start, Solution, "a Solution")
    check_each("free", free, str, "names of parameters such as ('lam',)")
    check_flag("both", both)
    if check_number("direction", direction, -np.inf, np.inf, DIRECTION) == 0:
        raise ValueError(f"direction: expected {DIRECTION}, got {direction}")
    check_type("scale", scale, (Scale, type(None)), "a Scale")
    options = TraceOptions.given(options)
    options.check_names(bvp, free)
    frame = first_state(bvp, start, free, options, scale)
    values = _watched_values(frame, options)
    if frame.fold_test * direction < 0:
        frame = frame.reversed()
    branch = follow(frame, options, both)
    left_at_once = len(branch) == 1 and EndReason.RANGE in branch.ends
    for name, (low, high) in options.bounds.items() if left_at_once else ():
        a, b = bvp.coordinate(name, low), bvp.coordinate(name, high)
        if not a - 1e-9 * max(1.0, abs(a)) <= values[name] <= b + 1e-9 * max(1.0, abs(b)):
            raise ValueError(
                f"bounds: expected {low:g} <= {name} <= {high:g} at the start or on the way, got {name} = "
                f"{branch.points[0].solution[name]:g} and a run that leads away from there"
            )
    return branch


def _watched_values(frame: Frame, options: TraceOptions) -> dict[str, float]:
    """What bounds, zeros and extrema refer to; a NaN would be neither inside nor outside."""
    names = (*options.bounds, *options.zeros, *options.extrema)
    values = {name: frame.colloc.observable_row(name, frame.x)[0] for name in names}
    for name, value in values.items():
        if not np.isfinite(value):
            raise ValueError(f"bounds, zeros, extrema: expected a finite value of '{name}' at the start, got {value}")
    return values


def follow(
    frame: Frame, options: TraceOptions, both: bool = True, start: EndReason = EndReason.START, arclength: float = 0.0
) -> Branch:
    """Walk from a frame, in its direction and (if `both`) in the other one.

    Parameters
    ----------
    start : reason of the first end when only one direction is followed.
    arclength : of the frame.

    Raises
    ------
    BaseException
        what interrupted the run, with the part computed so far in its attribute `branch`, see :func:`trace`.
    """
    check_type("frame", frame, Frame, "a frame: see `trace` for runs from a Solution")
    check_type("options", options, TraceOptions, "TraceOptions")
    check_flag("both", both)
    check_type("start", start, EndReason, "an EndReason")
    check_number("arclength", arclength, -np.inf, np.inf, "a finite number")
    guard, bvp = Guard(), frame.colloc.bvp
    watched = guard.options(options)

    def way(sense: float) -> Half:
        walker = Walker(frame if sense > 0 else frame.reversed(), watched, sense * arclength)
        return Half(walker, guard, options.on_point)

    try:
        branch = walked(way, partial(joined, frame, options), "branch", both, start)
    except BaseException as error:
        if hasattr(error, "branch"):
            error.branch = bare(error.branch, bvp)
        raise
    return bare(resolved(rechecked(branch, frame, options), frame, options), bvp)
