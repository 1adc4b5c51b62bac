"""The public verbs: solve at fixed parameters, trace a branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rodatlas.continuation.checks import check_each, check_type
from rodatlas.continuation.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.frame import Frame, first_frame
from rodatlas.continuation.halves import Guard, Half, is_finite, joined
from rodatlas.continuation.newton import NewtonCode, fixed, is_singular_around
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.recheck import rechecked
from rodatlas.continuation.results import Branch, EndReason
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.walker import Walker, settled
from rodatlas.failures import Failure


class NotConverged(Failure, RuntimeError):
    """No solution was found.

    Attributes
    ----------
    code : NewtonCode, or EndReason.MESH_LIMIT when Newton converged but the mesh cannot meet the tolerance.
    solution : what was found in the second case, else None.
    """

    def __init__(self, code: NewtonCode | EndReason, where: str, solution: Solution | None = None):
        super().__init__(f"{where}: {code.value}")
        self.code, self.where, self.solution = code, where, solution

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.code, self.where, self.solution)


def solve(
    bvp: BVP, guess: Solution, free: Sequence[str] | None = None, options: TraceOptions | None = None
) -> Solution:
    """Correct a guess at its own parameter values, on a mesh that meets the tolerance.

    Parameters
    ----------
    guess : Solution
        its parameters are kept, except those that the conditions determine.
    free : names of bvp.n_free parameters; the first is held, the others are solved for. With one free parameter
        the choice does not matter and may be left out.

    Raises
    ------
    NotConverged
        with a sentence that says what to change.
    ValueError
        when the guess belongs to another problem or holds NaN.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("guess", guess, Solution, "a Solution")
    options = options or TraceOptions()
    free = free or (bvp.parameter_names[:1] if bvp.n_free == 1 else ())
    frame = _start(bvp, guess, free, options, None)
    found = frame.colloc.solution(frame.x, frame.error)
    mesh = options.mesh
    if found.intervals >= mesh.intervals[1] and found.error > 10 * mesh.tolerance:  # nan where the size is fixed
        raise NotConverged(EndReason.MESH_LIMIT, f"{found!r}", found)
    return found


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
        of the problem, or a guess. At a branch point the branch along which the parameter changes most is followed.
    free : names of the free parameters (bvp.n_free of them), the continuation parameter first.
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
    check_type("options", options, (TraceOptions, type(None)), "TraceOptions")
    options = options or TraceOptions()
    options.check_names(bvp, free)
    frame = _start(bvp, start, free, options, scale)
    values = _watched_values(frame, options)
    if frame.fold_test * direction < 0:
        frame = frame.reversed()
    branch = follow(frame, options, both)
    left_at_once = len(branch) == 1 and EndReason.RANGE in branch.ends
    for name, (low, high) in options.bounds.items() if left_at_once else ():
        if not low - 1e-9 * max(1.0, abs(low)) <= values[name] <= high + 1e-9 * max(1.0, abs(high)):
            raise ValueError(
                f"bounds: expected {low:g} <= {name} <= {high:g} at the start or on the way, got {name} = "
                f"{values[name]:g} and a run that leads away from there"
            )
    return branch


def _watched_values(frame: Frame, options: TraceOptions) -> dict[str, float]:
    """What bounds and zeros refer to; a NaN would be neither inside nor outside."""
    values = {name: frame.colloc.observable_row(name, frame.x)[0] for name in (*options.bounds, *options.zeros)}
    for name, value in values.items():
        if not np.isfinite(value):
            raise ValueError(f"bounds, zeros: expected a finite value of '{name}' at the start, got {value}")
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
    guard = Guard()
    watched = guard.options(options)
    forward, backward = Half(Walker(frame, watched, arclength)), None
    try:
        forward.walk(guard, options)
        if both and forward.end is not EndReason.CLOSED:
            backward = Half(Walker(frame.reversed(), watched, -arclength))
            backward.walk(guard, options)
    except BaseException as error:
        error.branch = joined(frame, options, forward, backward, EndReason.INTERRUPTED if both else start)  # type: ignore[attr-defined]
        raise
    if both and backward is None:
        start = EndReason.CLOSED
    return rechecked(joined(frame, options, forward, backward, start), frame, options)


def _start(bvp: BVP, guess: Solution, free: Sequence[str], options: TraceOptions, scale: Scale | None) -> Frame:
    """First frame on a mesh that meets the tolerance."""
    guess = _checked(bvp, guess)
    mesh = options.mesh
    fewest, most = mesh.intervals
    if guess.points != mesh.points or not fewest <= guess.intervals <= most:
        places = np.linspace(0, 1, int(np.clip(guess.intervals, fewest, most)) + 1)
        guess = guess.remesh(np.interp(places, np.linspace(0, 1, len(guess.mesh)), guess.mesh), mesh.points)
    where, indices = f"start of the run at {guess!r}", free_indices(bvp, free)
    frame, result = first_frame(bvp, guess, indices, options, scale)
    if frame is None:
        undetermined = result.code is not NewtonCode.SINGULAR and _is_undetermined(bvp, guess, indices, options)
        raise NotConverged(NewtonCode.SINGULAR if undetermined else result.code, where)
    if is_singular_around(frame.colloc, frame.x, frame.colloc.row(frame.tangent)):
        raise NotConverged(NewtonCode.SINGULAR, where)
    if frame.branch_test[0] != 0.0:  # the mesh of a branch point stays, for there is no regular system to move it
        frame = settled(frame, options)
    if not is_finite(frame.colloc, frame.x):
        raise NotConverged(NewtonCode.NOT_FINITE, where)
    return frame


def _is_undetermined(bvp: BVP, guess: Solution, free: list[int], options: TraceOptions) -> bool:
    """Whether Newton failed because the conditions repeat one another (and perhaps contradict one another)."""
    colloc = Collocation(
        bvp, guess.mesh, guess.points, guess.parameters, free, Scale.of(bvp, guess), options.backend
    )  # fmt: skip
    x, name = colloc.state(guess), bvp.parameter_names[free[0]]
    return is_singular_around(colloc, x, fixed(name, guess.parameter(name))(colloc)(x)[1])


def _checked(bvp: BVP, start: Solution) -> Solution:
    """The start with unknowns and parameters in the problem's order; all its numbers are finite."""
    if not isinstance(start, Solution):
        raise ValueError(f"start: expected a Solution, got {start!r}")
    check_belongs(bvp, "start", start)
    for names, values in ((start.unknowns, start.values), (start.unknowns, start.stages),
                          (start.parameter_names, start.parameters)):  # fmt: skip
        finite = np.isfinite(values.reshape(-1, len(names))).all(axis=0)
        if not finite.all():
            raise ValueError(f"start: expected finite numbers, got NaN or infinity in '{names[int(finite.argmin())]}'")
    if (start.unknowns, start.parameter_names) == (bvp.unknowns, bvp.parameter_names):
        return start
    order = [start.unknowns.index(name) for name in bvp.unknowns]
    parameters = np.array([start.parameter(name) for name in bvp.parameter_names])
    return replace(
        start, unknowns=bvp.unknowns, parameter_names=bvp.parameter_names, values=start.values[:, order],
        stages=start.stages[..., order], parameters=parameters,
    )  # fmt: skip


def check_belongs(bvp: BVP, field: str, solution: Solution, in_order: bool = False) -> None:
    """Raise ValueError when a solution belongs to another problem."""
    for kind, wanted, found in (("unknowns", bvp.unknowns, solution.unknowns),
                                ("parameters", bvp.parameter_names, solution.parameter_names)):  # fmt: skip
        if sorted(wanted) != sorted(found) or (in_order and wanted != found):
            raise ValueError(f"{field}: expected the {kind} {', '.join(wanted)}, got {', '.join(found)}")
