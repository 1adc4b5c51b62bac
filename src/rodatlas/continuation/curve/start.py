"""The first state of a run: a guess corrected, on a mesh that meets the tolerance, and checked to be determined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rodatlas.continuation.checks import check_each
from rodatlas.continuation.curve.damped import approached
from rodatlas.continuation.curve.join import is_finite
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, first_frame
from rodatlas.continuation.curve.settle import across, at_own_parameter, settled
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.newton import NewtonCode, Row, fixed, is_singular_around
from rodatlas.continuation.discrete.phase import moved_in, with_phases
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import EndReason
from rodatlas.failures import Failure

FARTHEST, CLOSEST = 50.0, 0.05  # distance of two bounds, in units of the parameter
MORE = 4  # times the intervals, when finer meshes lose what was found from a guess by hand
IDLE = 1e-11  # effect of a parameter, in scaled variables, that is round-off
DOUBTFUL = 1e-7  # smallest singular value of a settled start below which it is asked whether it is determined


class NotConverged(Failure, RuntimeError):
    """No solution was found.

    Attributes
    ----------
    code : NewtonCode, or an EndReason when Newton converged but the tolerance is missed: MESH_LIMIT, ROUND_OFF, or
        UNREFINED when finer meshes lose the solution.
    solution : what was found in the second case, else None.
    undetermined : names of free parameters that nothing determines, where that makes the problem singular.
    """

    def __init__(
        self, code: NewtonCode | EndReason, where: str, solution: Solution | None = None,
        undetermined: tuple[str, ...] = (),
    ):  # fmt: skip
        idle = f" (nothing determines {', '.join(undetermined)} here)" if undetermined else ""
        super().__init__(f"{where}: {code.value}{idle}")
        self.code, self.where, self.solution, self.undetermined = code, where, solution, undetermined

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.code, self.where, self.solution, self.undetermined)


def first_state(
    bvp: BVP, guess: Solution, free: Sequence[str], options: TraceOptions, scale: Scale | None = None
) -> Frame:
    """First frame of a run, at the guess's own parameter; exceptions as in :func:`rodatlas.continuation.curve.trace`.

    A guess by hand, which is a function rather than a state of one mesh, is tried on finer meshes too.
    """
    indices = free_indices(bvp, free)
    guess = on_allowed_mesh(_checked(bvp, guess), options)
    scale = scale or unit_of_bounds(bvp, guess, indices, options)
    by_hand = not np.isfinite(guess.error)  # from a computed solution a step that is too long should fail
    while True:
        try:
            return _on_orbit(bvp, guess, indices, options, scale, by_hand)
        except NotConverged as error:
            finer = MORE * guess.intervals
            if not by_hand or error.code is not EndReason.UNREFINED or finer > options.mesh.intervals[1]:
                raise
        guess = guess.remesh(np.interp(np.arange(finer + 1) / MORE, np.arange(guess.intervals + 1), guess.mesh))


def _on_orbit(bvp: BVP, guess: Solution, free: list[int], options: TraceOptions, scale: Scale, by_hand: bool) -> Frame:
    """The first frame, with as many phase conditions as the solution needs.

    It may need fewer than the guess does: where two generators move the solution in one direction, or not at all.
    """
    most, fewest = moved_in(bvp, guess, free, scale), len(free) - bvp.n_free
    failed: NotConverged | None = None
    for count in range(max(most, fewest), max(fewest, min(1, most)) - 1, -1):
        inside, indices = with_phases(bvp, count, free)
        try:
            frame = _settled_start(inside, guess, indices, options, scale, by_hand)
        except NotConverged as error:
            failed = failed or error
            continue
        solution = frame.colloc.solution(frame.x, frame.error)
        if (needed := moved_in(bvp, solution, free, scale)) >= count:
            return frame
        if needed < fewest:
            names = tuple(bvp.parameter_names[i] for i in free[bvp.n_free :])
            raise NotConverged(NewtonCode.SINGULAR, f"{solution!r}", undetermined=names)
        return _on_orbit(bvp, solution, free, options, scale, by_hand)
    assert failed is not None
    raise failed


def _settled_start(
    bvp: BVP, guess: Solution, free: list[int], options: TraceOptions, scale: Scale, by_hand: bool
) -> Frame:
    """Frame at the solution that Newton finds from a guess, settled; NotConverged where there is none."""
    where = f"start of the run at {guess!r}"
    frame, result = first_frame(bvp, guess, free, options, scale)
    if frame is None and by_hand and result.code in (NewtonCode.DIVERGED, NewtonCode.SLOW, NewtonCode.NOT_FINITE):
        near = approached(bvp, guess, free, options, scale)
        if near is not None:
            frame, result = first_frame(bvp, near, free, options, scale)
    if frame is None:
        colloc, x, row = _at_guess(bvp, guess, free, options)
        singular = result.code is NewtonCode.SINGULAR or is_singular_around(colloc, x, row)
        code = NewtonCode.SINGULAR if singular else result.code
        raise NotConverged(code, where, undetermined=idle_parameters(colloc, x) if singular else ())
    _refuse_singular(frame.colloc, frame.x, frame.colloc.row(frame.tangent), where, frame.tangent)
    if frame.branch_test[0] == 0.0:  # the mesh of a branch point stays, for there is no regular system to move it
        known = frame.colloc.step.shape == (guess.intervals,) and np.array_equal(frame.colloc.mesh, guess.mesh)
        return replace(frame, error=guess.error if known else float("nan"))
    found = settled(frame, options, (at_own_parameter(frame), across), anywhere=by_hand)
    frame = found.frame
    if not is_finite(frame.colloc, frame.x):
        raise NotConverged(NewtonCode.NOT_FINITE, where)
    if not frame.weakness > DOUBTFUL:
        _refuse_singular(frame.colloc, frame.x, frame.colloc.row(frame.tangent), where, frame.tangent)
    if found.missed is not None:
        solution = frame.colloc.solution(frame.x, frame.error)
        if not frame.weakness > DOUBTFUL:  # on any mesh
            raise NotConverged(NewtonCode.SINGULAR, f"{solution!r}", solution)
        raise NotConverged(found.missed, f"{solution!r}", solution)
    return frame


def unit_of_bounds(bvp: BVP, guess: Solution, free: list[int], options: TraceOptions) -> Scale:
    """The units of a run: a free parameter without a declared scale gets one that suits its bounds.

    One, unless the bounds are so far apart that a branch would take more than a hundred of the longest steps by
    default, or so close that the first steps would leap over them.
    """
    scale = Scale.of(bvp, guess)
    for i in free:
        name = bvp.parameter_names[i]
        low, high = (bvp.coordinate(name, v) for v in options.bounds.get(name, (-np.inf, np.inf)))
        if bvp.parameter_names[i] not in bvp.scales and np.isfinite(high - low):
            scale.parameters[i] = np.clip(1.0, (high - low) / FARTHEST, (high - low) / CLOSEST)
    return scale


def on_allowed_mesh(guess: Solution, options: TraceOptions) -> Solution:
    """The guess with the Gauss points, and a number of intervals, of the options."""
    mesh = options.mesh
    fewest, most = mesh.intervals
    if guess.points == mesh.points and fewest <= guess.intervals <= most:
        return guess
    places = np.linspace(0, 1, int(np.clip(guess.intervals, fewest, most)) + 1)
    there = np.interp(places, np.linspace(0, 1, len(guess.mesh)), guess.mesh)
    return replace(guess.remesh(there, mesh.points), error=guess.error)


def _at_guess(bvp: BVP, guess: Solution, free: list[int], options: TraceOptions) -> tuple[Collocation, Columns, Row]:
    """The discrete problem at a guess, with the parameter held: conditions that repeat one another make it singular."""
    colloc = Collocation.at(bvp, guess, free, backend=options.backend)
    x, name = colloc.state(guess), bvp.parameter_names[free[0]]
    return colloc, x, fixed(name, guess.parameter(name))(colloc)(x)[1]


def _refuse_singular(colloc: Collocation, x: Columns, row: Row, where: str, tangent: Columns | None = None) -> None:
    """Raise NotConverged where the problem leaves something undetermined."""
    if is_singular_around(colloc, x, row, tangent):
        raise NotConverged(NewtonCode.SINGULAR, where, undetermined=idle_parameters(colloc, x))


def idle_parameters(colloc: Collocation, x: Columns) -> tuple[str, ...]:
    """Free parameters on which no condition depends at a state, besides the continuation parameter."""
    lin = colloc.linearize(x)
    names = [colloc.bvp.parameter_names[i] for i in colloc.free]
    blocks = (lin.stage_scal.reshape(-1, len(names)), lin.b_scal, lin.dense_scal)
    largest = [max(np.abs(b[:, i]).max(initial=0.0) for b in blocks) for i in range(len(names))]
    return tuple(name for name, size in zip(names[1:], largest[1:], strict=True) if size < IDLE)


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
    bvp.check_places("start", bvp.parameter_vector(dict(zip(start.parameter_names, start.parameters, strict=True))))
    if (start.unknowns, start.parameter_names) == (bvp.unknowns, bvp.parameter_names):
        return start
    order = [start.unknowns.index(name) for name in bvp.unknowns]
    parameters = np.array([start.parameter(name) for name in bvp.parameter_names])
    return replace(
        start, unknowns=bvp.unknowns, parameter_names=bvp.parameter_names, values=start.values[:, order],
        stages=start.stages[..., order], parameters=parameters,
    )  # fmt: skip


def free_or_only(bvp: BVP, free: Sequence[str] | None) -> Sequence[str]:
    """The names of free parameters that were given; where there is one to choose only, that is held."""
    if free is None:
        return bvp.parameter_names[:1] if bvp.n_free == 1 else ()
    check_each("free", free, str, "names of parameters such as ('lam',)")
    return free


def check_belongs(bvp: BVP, field: str, solution: Solution, in_order: bool = False) -> None:
    """Raise ValueError when a solution belongs to another problem."""
    for kind, wanted, found in (("unknowns", bvp.unknowns, solution.unknowns),
                                ("parameters", bvp.parameter_names, solution.parameter_names)):  # fmt: skip
        if sorted(wanted) != sorted(found) or (in_order and wanted != found):
            raise ValueError(f"{field}: expected the {kind} {', '.join(wanted)}, got {', '.join(found)}")
