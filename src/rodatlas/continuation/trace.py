"""The public verbs: solve at fixed parameters, trace a branch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from numbers import Integral
from typing import Any

import numpy as np

from rodatlas.continuation.collocation import Collocation, Scale, free_indices, scaled
from rodatlas.continuation.frame import Frame, first_frame
from rodatlas.continuation.linear import Columns
from rodatlas.continuation.newton import NewtonCode, fixed, is_singular_around
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import Branch, Discrepancy, EndReason, Point, SpecialPoint
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.walker import Step, Walker, settled


class NotConverged(RuntimeError):
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
    guard = _Guard()
    watched = guard.options(options)
    forward, backward = _Half(Walker(frame, watched, arclength)), None
    try:
        forward.walk(guard, options)
        if both and forward.end is not EndReason.CLOSED:
            backward = _Half(Walker(frame.reversed(), watched, -arclength))
            backward.walk(guard, options)
    except BaseException as error:
        error.branch = _joined(frame, options, forward, backward, EndReason.INTERRUPTED if both else start)  # type: ignore[attr-defined]
        raise
    if both and backward is None:
        start = EndReason.CLOSED
    return _joined(frame, options, forward, backward, start)


class _Guard:
    """Keeps the first exception of a user's functions, so that the step in which it comes is finished and kept."""

    def __init__(self) -> None:
        self.error: BaseException | None = None

    def options(self, options: TraceOptions) -> TraceOptions:
        """The same with guarded functions; `on_point` is left to whoever collects the points."""
        index = self._guarded(_integer(options.index), None)
        stop_at = self._guarded(options.stop_at, True)
        return replace(options, index=index, stop_at=stop_at, on_point=None)

    def _guarded(self, function: Callable[..., Any] | None, otherwise: Any) -> Callable[..., Any] | None:
        if function is None:
            return None

        def guarded(*arguments: Any) -> Any:
            if self.error is None:
                try:
                    return function(*arguments)
                except BaseException as error:
                    self.error = error
            return otherwise

        return guarded

    def check(self) -> None:
        """Raise what was kept."""
        if self.error is not None:
            raise self.error


def _integer(index: Callable[[Solution], Any] | None) -> Callable[[Solution], int | None] | None:
    """The caller's index function, its result checked."""
    if index is None:
        return None

    def checked(solution: Solution) -> int | None:
        value = index(solution)
        if value is not None and not isinstance(value, Integral):
            raise ValueError(f"index: expected an integer or None, got {value!r}")
        return None if value is None else int(value)

    return checked


class _Half:
    """The steps of one walker, and why they end."""

    def __init__(self, walker: Walker):
        self.walker, self.steps = walker, list[Step]()
        self.end = EndReason.INTERRUPTED

    def walk(self, guard: _Guard, options: TraceOptions) -> None:
        """Take all steps; whatever happens, those that were finished stay."""
        guard.check()
        for step in self.walker:
            self.steps.append(step)
            guard.check()
            if options.on_point is not None:
                options.on_point(step.point)
        guard.check()
        self.end = self.walker.end or EndReason.STOPPED
        while self.failure is NewtonCode.NOT_FINITE and self.steps and not self._last_is_finite():
            self.steps.pop()  # its last correction left the domain of the right-hand side

    def _last_is_finite(self) -> bool:
        solution, colloc = self.steps[-1].point.solution, self.walker.frame.colloc
        there = Collocation(
            colloc.bvp, solution.mesh, solution.points, solution.parameters, list(colloc.free), colloc.scale
        )  # fmt: skip
        return _is_finite(there, there.state(solution))

    @property
    def failure(self) -> NewtonCode | None:
        """Why Newton failed last, where that is the end."""
        return self.walker.failure if self.end is EndReason.MIN_STEP else None


def _joined(
    frame: Frame, options: TraceOptions, forward: _Half, backward: _Half | None, start: EndReason
) -> Branch:
    """The branch from its two halves; `start` is the first end's reason when there is one half only."""
    bvp = frame.colloc.bvp
    names = tuple(bvp.parameter_names[i] for i in frame.colloc.free)
    points, special, discrepancies = _collect(forward.steps)
    points = [forward.walker.first_point(), *points]
    first, failure, spent = start, None, forward.walker.newton_iterations
    if backward is not None:
        more, also, doubts = _collect(backward.steps)
        points = [_flipped(p) for p in reversed(more)] + points
        also = [_flipped_special(x) for x in reversed(also)]
        special = also + special[_is_at_start(also, special) :]
        discrepancies = [_flipped_discrepancy(d) for d in reversed(doubts)] + discrepancies
        first, failure = backward.end, backward.failure
        spent += backward.walker.newton_iterations
    return Branch(
        names, tuple(points), tuple(special), (first, forward.end), tuple(discrepancies), spent,
        (failure, forward.failure), {"problem": bvp.name, **options.settings()},
    )  # fmt: skip


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
    if not _is_finite(frame.colloc, frame.x):
        raise NotConverged(NewtonCode.NOT_FINITE, where)
    return frame


def _is_undetermined(bvp: BVP, guess: Solution, free: list[int], options: TraceOptions) -> bool:
    """Whether Newton failed because the conditions repeat one another (and perhaps contradict one another)."""
    colloc = Collocation(
        bvp, guess.mesh, guess.points, guess.parameters, free, Scale.of(bvp, guess), options.backend
    )  # fmt: skip
    x, name = colloc.state(guess), bvp.parameter_names[free[0]]
    return is_singular_around(colloc, x, fixed(name, guess.parameter(name))(colloc)(x)[1])


def _is_finite(colloc: Collocation, x: Columns) -> bool:
    """Whether the equations can be evaluated at x."""
    with np.errstate(all="ignore"):
        return colloc.linearize(x).is_finite


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


def _collect(steps: list[Step]) -> tuple[list[Point], list[SpecialPoint], list[Discrepancy]]:
    return (
        [s.point for s in steps], [x for s in steps for x in s.special], [s.discrepancy for s in steps if s.discrepancy]
    )  # fmt: skip


def _is_at_start(before: list[SpecialPoint], after: list[SpecialPoint]) -> bool:
    """Whether both halves of a branch report one multiple branch point, right at the start."""
    if not (before and after and before[-1].multiplicity == after[0].multiplicity > 1):
        return False
    return after[0].arclength - before[-1].arclength < 1e-6


def _flipped(p: Point) -> Point:
    """A point of the backward half, seen along the forward direction."""
    return replace(p, arclength=-p.arclength, tangent=-p.tangent, fold_test=-p.fold_test, branch_test=-p.branch_test)


def _flipped_special(x: SpecialPoint) -> SpecialPoint:
    sign = -1.0 if x.kind in ("fold", "branch point") else 1.0
    if x.multiplicity > 1:  # rays: forward and backward change places
        directions, nearby = ((*v[:2][::-1], *v[2:]) for v in (x.directions, x.nearby))
    else:
        directions, nearby = (*(scaled(d, -1.0) for d in x.directions[:1]), *x.directions[1:]), x.nearby
    return replace(
        x, arclength=-x.arclength, bracket=(-x.bracket[1], -x.bracket[0]), tests=(sign * x.tests[1], sign * x.tests[0]),
        index=(x.index[1], x.index[0]), directions=directions, nearby=nearby,
    )  # fmt: skip


def _flipped_discrepancy(d: Discrepancy) -> Discrepancy:
    return Discrepancy((-d.bracket[1], -d.bracket[0]), d.index[::-1], d.events[::-1], d.parameter[::-1])
