"""The public verbs: solve at fixed parameters, trace a branch, switch to another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodatlas.continuation.augmented import kernel_directions
from rodatlas.continuation.collocation import Collocation, Scale, add, free_indices, scaled
from rodatlas.continuation.frame import Frame, adapted, first_frame, with_tests
from rodatlas.continuation.linear import Columns
from rodatlas.continuation.newton import NewtonCode, newton, plane
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import Branch, Discrepancy, EndReason, Point, SpecialPoint
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.walker import Step, Walker, settled


class NotConverged(RuntimeError):
    """No solution was found; `code` is the :class:`NewtonCode`."""

    def __init__(self, code: NewtonCode, where: str):
        super().__init__(f"{where}: {code.value}")
        self.code = code


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
    """
    options = options or TraceOptions()
    free = free or (bvp.parameter_names[:1] if bvp.n_free == 1 else ())
    frame = _start(bvp, guess, free, options, None)
    return frame.colloc.solution(frame.x, frame.error)


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
    """
    options = options or TraceOptions()
    options.check_names(bvp, free)
    frame = _start(bvp, start, free, options, scale)
    if frame.fold_test * direction < 0:
        frame = frame.reversed()
    return follow(frame, options, both)


def follow(
    frame: Frame, options: TraceOptions, both: bool = True, start: EndReason = EndReason.START, arclength: float = 0.0
) -> Branch:
    """Walk from a frame, in its direction and (if `both`) in the other one.

    Parameters
    ----------
    start : reason of the first end when only one direction is followed.
    arclength : of the frame.
    """
    bvp = frame.colloc.bvp
    names = tuple(bvp.parameter_names[i] for i in frame.colloc.free)
    forward = Walker(frame, options, arclength)
    points, special, discrepancies = _collect(list(forward))
    points = [forward.first_point(), *points]
    first, failure, spent = start, None, forward.newton_iterations
    if both and forward.end is EndReason.CLOSED:
        first = EndReason.CLOSED
    elif both:
        backward = Walker(frame.reversed(), options, -arclength)
        more, also, doubts = _collect(list(backward))
        points = [_flipped(p) for p in reversed(more)] + points
        special = [_flipped_special(x) for x in reversed(also)] + special
        discrepancies = [_flipped_discrepancy(d) for d in reversed(doubts)] + discrepancies
        first = backward.end or EndReason.STOPPED
        failure = backward.failure if first is EndReason.MIN_STEP else None
        spent += backward.newton_iterations
    last = forward.end or EndReason.STOPPED
    return Branch(
        names, tuple(points), tuple(special), (first, last), tuple(discrepancies), spent,
        (failure, forward.failure if last is EndReason.MIN_STEP else None), {"problem": bvp.name, **options.settings()},
    )  # fmt: skip


def switch(
    bvp: BVP, at: SpecialPoint, free: Sequence[str], options: TraceOptions | None = None, *, side: int = 1,
    scale: Scale | None = None, first_step: float | None = None,
) -> Branch | None:  # fmt: skip
    """Follow the other branch through a simple branch point, to one side of it.

    Returns None when the branch point has no second direction or the step onto it fails; the branch starts at the
    branch point itself, with arclength zero there.

    Parameters
    ----------
    free : the free parameters; when they are not those of the branch on which the point was found, or the point
        carries no directions, the other branch is the one along which the parameter changes least.
    side : 1 or -1.
    """
    if at.kind != "branch point":
        raise ValueError(f"at: expected a branch point, got a {at.kind}")
    options = options or TraceOptions()
    options.check_names(bvp, free)
    scale = scale or at.scale or Scale.of(bvp, at.solution)
    colloc = Collocation(
        bvp, at.solution.mesh, at.solution.points, at.solution.parameters, free_indices(bvp, free), scale,
        options.backend,
    )  # fmt: skip
    x0 = colloc.state(at.solution)
    direction = _other_direction(colloc, at, x0, tuple(free))
    if direction is None:
        return None
    origin = Frame(colloc, x0, scaled(direction, float(side)), (0.0, 0.0), error=at.solution.error)
    found = _step_off(origin, options, first_step or options.step.initial)
    if found is None:
        return None
    frame, step = adapted(found[0], options, correct=True)[0], found[1]
    first = Point(at.solution, 0.0, origin.tangent.scalars.copy(), origin.fold_test, 0.0)
    branch = follow(frame, options, both=False, start=EndReason.BRANCH_POINT, arclength=step)
    if any(not low <= branch.points[0].solution[name] <= high for name, (low, high) in options.bounds.items()):
        return replace(branch, points=(first,), special=(), ends=(EndReason.BRANCH_POINT, EndReason.RANGE))
    return replace(branch, points=(first, *branch.points))


def _other_direction(colloc: Collocation, at: SpecialPoint, x0: Columns, free: tuple[str, ...]) -> Columns | None:
    """Unit tangent of the other branch in the units of `colloc`."""
    if len(at.directions) == 1:
        return None
    if len(at.directions) == 2 and at.free in (free, ()):
        d, scale = at.directions[1], at.scale or colloc.scale
        unknowns = scale.unknowns / colloc.scale.unknowns
        parameters = (scale.parameters / colloc.scale.parameters)[colloc.free]
        d = Columns(d.stage * unknowns, d.mesh * unknowns, d.scalars * parameters)
        return scaled(d, 1.0 / colloc.norm(d))
    parameter = Columns(np.zeros_like(x0.stage), np.zeros_like(x0.mesh), np.eye(len(free))[0])
    found = kernel_directions(colloc, x0, parameter)
    return found[1][1] if found else None


def _step_off(origin: Frame, options: TraceOptions, step: float, attempts: int = 6) -> tuple[Frame, float] | None:
    """First frame on a branch whose tangent at `origin` is known, inside the bounds if possible, and its distance."""
    colloc, last = origin.colloc, None
    for _ in range(attempts):
        guess = origin.predict(step)
        result = newton(colloc, guess, [plane(colloc, origin.tangent, guess)], options.newton)
        near = result.converged and colloc.norm(add(result.state, (-1.0, guess))) < 0.5 * step
        if near and result.factorization is not None:
            frame = with_tests(replace(origin.reached(result.state, result.factorization, step), previous=None))
            last = frame, step
            solution = colloc.solution(frame.x)
            if all(low <= solution[name] <= high for name, (low, high) in options.bounds.items()):
                return last
        step *= 0.5
    return last


def _start(bvp: BVP, guess: Solution, free: Sequence[str], options: TraceOptions, scale: Scale | None) -> Frame:
    """First frame on a mesh that meets the tolerance."""
    mesh = options.mesh
    fewest, most = mesh.intervals
    if guess.points != mesh.points or not fewest <= guess.intervals <= most:
        places = np.linspace(0, 1, int(np.clip(guess.intervals, fewest, most)) + 1)
        guess = guess.remesh(np.interp(places, np.linspace(0, 1, len(guess.mesh)), guess.mesh), mesh.points)
    frame, result = first_frame(bvp, guess, free_indices(bvp, free), options, scale)
    if frame is None:
        raise NotConverged(result.code, f"start of the run at {guess!r}")
    if frame.branch_test[0] == 0.0:  # a branch point: its mesh stays, for there is no regular system to move it
        return frame
    return settled(frame, options)


def _collect(steps: list[Step]) -> tuple[list[Point], list[SpecialPoint], list[Discrepancy]]:
    return (
        [s.point for s in steps], [x for s in steps for x in s.special], [s.discrepancy for s in steps if s.discrepancy]
    )  # fmt: skip


def _flipped(p: Point) -> Point:
    """A point of the backward half, seen along the forward direction."""
    return replace(p, arclength=-p.arclength, tangent=-p.tangent, fold_test=-p.fold_test, branch_test=-p.branch_test)


def _flipped_special(x: SpecialPoint) -> SpecialPoint:
    sign = -1.0 if x.kind in ("fold", "branch point") else 1.0
    along = tuple(scaled(d, -1.0) for d in x.directions[:1])
    return replace(
        x, arclength=-x.arclength, bracket=(-x.bracket[1], -x.bracket[0]), tests=(sign * x.tests[1], sign * x.tests[0]),
        index=(x.index[1], x.index[0]), directions=(*along, *x.directions[1:]),
    )  # fmt: skip


def _flipped_discrepancy(d: Discrepancy) -> Discrepancy:
    return Discrepancy((-d.bracket[1], -d.bracket[0]), d.index[::-1], d.events[::-1], d.parameter[::-1])
