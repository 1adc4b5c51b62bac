"""The public verbs: solve at fixed parameters, trace a branch, switch to another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rodatlas.continuation.collocation import Collocation, Scale, free_indices, scaled
from rodatlas.continuation.frame import Frame, first_frame, with_tests
from rodatlas.continuation.newton import NewtonCode, newton, plane
from rodatlas.continuation.options import TraceOptions
from rodatlas.continuation.problem import BVP
from rodatlas.continuation.results import Branch, EndReason, Point, SpecialPoint
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.walker import Step, Walker, settled


class NotConverged(RuntimeError):
    """No solution was found; `code` is the :class:`NewtonCode`."""

    def __init__(self, code: NewtonCode, where: str):
        super().__init__(f"{where}: {code.value}")
        self.code = code


def solve(bvp: BVP, guess: Solution, free: Sequence[str] | None = None, options: TraceOptions | None = None) -> Solution:
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
    free : names of the free parameters (bvp.n_free of them), the continuation parameter first.
    both : follow both directions (default), else only the one in which the parameter changes as `direction`.
    scale : units of the arclength norm; by default those of the problem and the start.

    Raises
    ------
    NotConverged
        when the start is not a solution and Newton cannot make it one.
    """
    options = options or TraceOptions()
    frame = _start(bvp, start, free, options, scale)
    if frame.fold_test * direction < 0:
        frame = frame.reversed()
    return follow(frame, options, both)


def follow(frame: Frame, options: TraceOptions, both: bool = True, start: EndReason = EndReason.START) -> Branch:
    """Walk from a frame, in its direction and (if `both`) in the other one."""
    forward = Walker(frame, options)
    steps = list(forward)
    points, special = _collect(steps)
    discrepancies = [s.discrepancy for s in steps if s.discrepancy]
    first = start
    spent = forward.newton_iterations
    origin = forward.first_point()
    if both and forward.end is EndReason.CLOSED:
        first = EndReason.CLOSED
    elif both:
        backward = Walker(frame.reversed(), options)
        back = list(backward)
        more, also = _collect(back)
        points = [_flipped(p) for p in reversed(more)] + [origin] + points
        special = [_flipped_special(x) for x in reversed(also)] + special
        discrepancies += [s.discrepancy for s in back if s.discrepancy]
        first = backward.end or EndReason.STOPPED
        spent += backward.newton_iterations
    if not points or points[0].arclength >= 0 and points[0] is not origin:
        points = [origin, *points]
    ends = (first, forward.end or EndReason.STOPPED)
    names = tuple(frame.colloc.bvp.parameter_names[i] for i in frame.colloc.free)
    return Branch(names, tuple(points), tuple(special), ends, tuple(discrepancies), spent)


def switch(
    bvp: BVP, at: SpecialPoint, free: Sequence[str], options: TraceOptions | None = None, *, side: int = 1,
    scale: Scale | None = None, first_step: float | None = None,
) -> Branch | None:  # fmt: skip
    """Follow the other branch through a simple branch point, to one side of it.

    Returns None when the branch point has no second direction or the step onto it fails; the branch starts at the
    branch point itself.
    """
    if at.kind != "branch point":
        raise ValueError(f"at: expected a branch point, got a {at.kind}")
    if len(at.directions) < 2:
        return None
    options = options or TraceOptions()
    scale = scale or Scale.of(bvp, at.solution)
    colloc = Collocation(
        bvp, at.solution.mesh, at.solution.points, at.solution.parameters, free_indices(bvp, free), scale,
        options.backend,
    )  # fmt: skip
    normal = scaled(at.directions[1], float(side))
    x0 = colloc.state(at.solution)
    origin = Frame(colloc, x0, normal, (0.0, 0.0), error=at.solution.error)
    step = first_step or options.step.initial
    for _ in range(6):
        guess = origin.predict(step)
        result = newton(colloc, guess, [plane(colloc, normal, guess)], options.newton)
        spent = colloc.norm(colloc_difference(result.state, guess)) if result.converged else float("inf")
        if result.converged and result.factorization is not None and spent < 0.5 * step:
            frame = replace(origin.reached(result.state, result.factorization, step), previous=None)
            branch = follow(with_tests(frame), options, both=False, start=EndReason.BRANCH_POINT)
            first = Point(at.solution, -step, normal.scalars.copy(), float(normal.scalars[0]), 0.0)
            return replace(branch, points=(first, *branch.points))
        step *= 0.5
    return None


def colloc_difference(x, y):  # type: ignore[no-untyped-def]
    from rodatlas.continuation.collocation import add

    return add(x, (-1.0, y))


def _start(bvp: BVP, guess: Solution, free: Sequence[str], options: TraceOptions, scale: Scale | None) -> Frame:
    """First frame on a mesh that meets the tolerance."""
    mesh = options.mesh
    fewest, most = mesh.intervals
    if guess.points != mesh.points or not fewest <= guess.intervals <= most:
        import numpy as np

        size = int(np.clip(guess.intervals, fewest, most))
        guess = guess.remesh(np.interp(np.linspace(0, 1, size + 1), np.linspace(0, 1, len(guess.mesh)), guess.mesh),
                             mesh.points)  # fmt: skip
    frame, result = first_frame(bvp, guess, free_indices(bvp, free), options, scale)
    if frame is None:
        raise NotConverged(result.code, f"start of the run at {guess!r}")
    return settled(frame, options)


def _collect(steps: list[Step]) -> tuple[list[Point], list[SpecialPoint]]:
    return [s.point for s in steps], [x for s in steps for x in s.special]


def _flipped(p: Point) -> Point:
    """A point of the backward half, seen along the forward direction."""
    return replace(p, arclength=-p.arclength, tangent=-p.tangent, fold_test=-p.fold_test, branch_test=-p.branch_test)


def _flipped_special(x: SpecialPoint) -> SpecialPoint:
    return replace(
        x, arclength=-x.arclength, bracket=(-x.bracket[1], -x.bracket[0]), tests=(x.tests[1], x.tests[0]),
        index=(x.index[1], x.index[0]),
    )  # fmt: skip
