"""Extrema of observables along a branch: where the slope changes sign between two points, located by Newton."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.point import Frame, unit_tangent
from rodatlas.continuation.curve.segment import AT_START, Located, Segment, attempts, begins, changes, dips
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import NormalForm, SpecialPoint, Status
from rodatlas.continuation.singular.augmented import Augmented, solve_fold
from rodatlas.continuation.singular.extremum import KIND, Lift, ValueView, size_of, slope_along
from rodatlas.continuation.singular.refine import refined

# in units of the gradient of the observable:
INEXACT = (
    1e-3  # slopes above have a sure sign, though the tangent belongs to the last but one iterate of Newton's method
)
NOISE = 1e-7  # slopes that states known to the usual tolerance may have where the observable is constant
AT_BRANCH_POINT = 1e-5  # slopes that mean: extreme at the branch point itself, as on a pitchfork's side branch
ROUND_OFF = 1e-12
SHARE = 0.2  # of the mean second derivative on a first segment, below which that at its start is none


def locate_extrema(segment: Segment, options: TraceOptions, branch_point: Located | None) -> list[Located]:
    """The extrema of the observables asked for, at places where their slopes change sign on a segment.

    Parameters
    ----------
    branch_point : located on the segment, if one was: an observable may be extreme there.
    """
    found = []
    for name in options.extrema:
        one, two = slopes(segment, name)
        if changes(one, two, NOISE):
            met = branch_point and _met(segment, name, branch_point, (one, two))
            found.append(met or _locate(segment, name, options, (one, two)))
        elif segment.left.branch_test[0] != 0.0 and begins(segment, one, two, NOISE):
            located = _locate(segment, name, options, (one, two))
            if _bends(segment, name, located, two):
                found.append(located)
    return found


def _bends(segment: Segment, name: str, located: Located, slope: float) -> bool:
    """Whether the slope that an observable has at the end of a first segment comes from an extremum at its start.

    At an inflection the second derivative vanishes too.
    """
    form = located.special.normal_form
    if form is None or located.fraction * segment.step > AT_START:
        return False
    return abs(form.bend) * segment.step > SHARE * abs(slope) * _size(segment.colloc, name, segment.right.x)


def may_be_extreme_twice(segment: Segment, name: str) -> bool:
    """Whether two extrema of an observable may hide on a segment at whose ends it has slopes of one sign."""
    values = [segment.colloc.observable_row(name, f.x)[0] for f in (segment.left, segment.right)]
    size = _size(segment.colloc, name, segment.right.x)
    return dips(*slopes(segment, name), (values[1] - values[0]) / segment.step / size, NOISE)


def slopes(segment: Segment, name: str) -> tuple[float, float]:
    """Derivative of an observable along the branch at both ends, in units of its gradient."""
    size = _size(segment.colloc, name, segment.right.x)
    left, right = (_slope(frame, name) / size for frame in (segment.left, segment.right))
    if segment.left.branch_test[0] == 0.0 and abs(left) < AT_BRANCH_POINT:
        left = float(np.copysign(ROUND_OFF, right))  # the branch starts there, and is the other half of itself before
    return left, right


def _size(colloc: Collocation, name: str, x: Columns) -> float:
    return size_of(colloc.observable_row(name, x)[1], colloc) or 1.0


def _slope(frame: Frame, name: str) -> float:
    """The slope at a point; one that is round-off gets the sign of the parameter's, which changes with the sense.

    So a start that is extreme to all digits is so on one of the two halves of its branch.
    """
    colloc, x, t = frame.colloc, frame.x, frame.tangent
    size, slope = _size(colloc, name, x), slope_along(colloc, name, x, t)
    if abs(slope) < INEXACT * size and frame.branch_test[0] != 0.0:
        fac = colloc.factor(colloc.linearize(x), [colloc.row(t)])
        if fac.sign != 0.0:
            slope = slope_along(colloc, name, x, unit_tangent(colloc, fac, t))
    return slope if abs(slope) > ROUND_OFF * size else float(np.copysign(ROUND_OFF * size, frame.fold_test))


def _met(segment: Segment, name: str, at: Located, tests: tuple[float, float]) -> Located | None:
    """The extremum at a branch point, if there is one: beside it a pitchfork's side branch is its own mirror image."""
    special = at.special
    if special.status is not Status.CONVERGED or special.scale is None:
        return None
    colloc = Collocation.at(segment.colloc.bvp, special.solution, list(segment.colloc.free), special.scale)
    x, along = colloc.state(special.solution), special.directions[0]
    if abs(slope_along(colloc, name, x, along)) > AT_BRANCH_POINT * _size(colloc, name, x):
        return None
    extremum = SpecialPoint(
        KIND + name, special.solution, special.arclength, special.status, special.bracket, tests,
        residual=special.residual, directions=special.directions, free=special.free, scale=special.scale,
        multiplicity=special.multiplicity, normal_form=NormalForm("maximum" if tests[0] > 0 else "minimum", 0.0),
    )  # fmt: skip
    return Located(extremum, at.fraction, 0)


def _locate(segment: Segment, name: str, options: TraceOptions, tests: tuple[float, float]) -> Located:
    """The extremum from an augmented system, on a mesh that resolves the tangent of the branch, too."""
    colloc = segment.colloc
    view = ValueView.of(colloc.bvp, name)
    lift = Lift(view, colloc, segment.right.x)

    def attempt(x: Columns, t: Columns) -> Augmented:
        found = solve_fold(lift.colloc, lift.state(x), lift.tangent(x, t))
        return replace(found, state=lift.back(found.state))

    a, b = tests
    met, tangent, bracket, spent = attempts(segment, options, attempt, lambda f: _slope(f, name), a / (a - b))
    inside, found, error = lift.colloc, replace(met, state=lift.state(met.state)), segment.right.error
    if met.converged:
        ahead = lift.tangent(met.state, tangent)
        found = solve_fold(inside, found.state, ahead)
        if found.converged and not options.mesh.is_fixed_size:
            inside, found, error = refined(inside, found, ahead, options.mesh)
        spent += found.iterations
    bend = lift.unit * float(found.form[0, 0])
    fraction = float(np.clip(segment.position(met.state)[0], 0.0, 1.0))
    special = SpecialPoint(
        KIND + name, view.original(inside.solution(found.state, error)), segment.start + fraction * segment.step,
        Status.CONVERGED if found.converged else Status.BRACKETED,
        (segment.start + bracket[0] * segment.step, segment.start + bracket[1] * segment.step), tests,
        residual=found.residual, free=tuple(colloc.bvp.parameter_names[i] for i in colloc.free), scale=colloc.scale,
        normal_form=NormalForm("maximum" if bend < 0 else "minimum", 0.0, bend) if found.converged else None,
    )  # fmt: skip
    return Located(special, fraction, spent)
