"""From a branch point onto the other branches through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from rodatlas.continuation.checks import check_each, check_type, shown
from rodatlas.continuation.curve.events import events_off
from rodatlas.continuation.curve.join import is_same
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.orbit import bare_special
from rodatlas.continuation.curve.point import Frame, with_tests
from rodatlas.continuation.curve.segment import AT_START, Segment
from rodatlas.continuation.curve.settle import across, settled
from rodatlas.continuation.curve.start import check_belongs
from rodatlas.continuation.curve.trace import follow
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.newton import newton, plane
from rodatlas.continuation.discrete.phase import fitted, orbit_directions, phased, with_phases
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import Branch, EndReason, Point, SpecialPoint, Status
from rodatlas.continuation.singular.augmented import kernel_directions
from rodatlas.continuation.symmetric.isotropy import with_symmetry

UNDECLARED = (
    "at: expected isolated branches, got a branch point from which a circle of branches leaves. The problem has a "
    "continuous symmetry: declare it, as a ContinuousSymmetry among its `symmetries`, and one member is followed"
)


def switch(
    bvp: BVP, at: SpecialPoint, free: Sequence[str], options: TraceOptions | None = None, *, side: int = 1,
    ray: int | None = None, scale: Scale | None = None, first_step: float | None = None,
) -> Branch | None:  # fmt: skip
    """Follow another branch through a branch point, to one side of it.

    Returns None when the branch point has no second direction or the step onto it fails; the branch starts at the
    branch point itself, with arclength zero there.

    Parameters
    ----------
    free : the free parameters; when they are not those of the branch on which the point was found, or the point
        carries no directions, the other branch is the one along which the parameter changes least. At a multiple
        branch point they have to be those of the branch.
    side : 1 or -1, of the first other branch.
    ray : number of one of the half-branches `at.rays`; it takes the place of `side`.
    first_step : arclength of the first step; at a multiple branch point by default the distance at which its rays
        were told apart.

    Raises
    ------
    ValueError
        when `at` is no branch point, or one from which a circle of branches leaves that no declared symmetry explains.

    Notes
    -----
    Where a declared continuous symmetry moves the other branches around, `rays` has one member of each circle, which is
    followed with a phase condition.

    See Also
    --------
    switch_all : every other branch, to both sides.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    _check(bvp, at, side, ray, free)
    options = TraceOptions.given(options)
    options.check_names(bvp, free)
    start = _departure(bvp, at, tuple(free), options, (2 if side == 1 else 3) if ray is None else ray, scale)
    return None if start is None else _followed(at, start, options, first_step)


def switch_all(
    bvp: BVP, at: SpecialPoint, free: Sequence[str], options: TraceOptions | None = None, *,
    scale: Scale | None = None, first_step: float | None = None,
) -> tuple[Branch, ...]:  # fmt: skip
    """Follow every other branch through a simple or multiple branch point, to both sides.

    The branches come in the order of `at.rays[2:]`, two for each curve: its two sides. One on which no step succeeds
    has the branch point as its only point, and its end says so; the tuple is empty where no other branch passes.

    See Also
    --------
    switch : one of them, with the same parameters and exceptions.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    _check(bvp, at, 1, None, free)
    options = TraceOptions.given(options)
    options.check_names(bvp, free)
    found = []
    for ray in range(2, max(4, len(at.rays)) if at.multiplicity == 1 else len(at.rays)):
        start = _departure(bvp, at, tuple(free), options, ray, scale)
        if start is not None:
            branch = _followed(at, start, options, first_step)
            found.append(branch or _stuck(bvp, at, tuple(free), options, start.origin))
    return tuple(found)


@dataclass(frozen=True)
class _Departure:
    """Frame at a branch point, with the tangent to leave along; second derivative and length of the first step."""

    origin: Frame
    bend: Columns | None
    step: float

    @property
    def guess(self) -> Columns:
        """Where the branch is expected after the first step."""
        terms = [(self.step, self.origin.tangent)] + ([(self.step**2 / 2, self.bend)] if self.bend else [])
        return add(self.origin.x, *terms)


def _check(bvp: BVP, at: SpecialPoint, side: int, ray: int | None, free: Sequence[str]) -> None:
    """Raise ValueError when no branch can be followed from here, or the choice does not exist."""
    check_each("free", free, str, "names of parameters such as ('lam',)")
    if not isinstance(at, SpecialPoint):
        raise ValueError(f"at: expected a special point of a branch, got {at!r}")
    if at.kind != "branch point":
        raise ValueError(f"at: expected a branch point, got a {at.kind}")
    if isinstance(side, bool) or side not in (1, -1):
        raise ValueError(f"side: expected 1 or -1, got {shown(side)}")
    if at.continuum and not bvp.generators:
        raise ValueError(UNDECLARED)
    count = max(4, len(at.rays)) if at.multiplicity == 1 else len(at.rays)
    if ray is not None and not (type(ray) is int and 0 <= ray < count):
        raise ValueError(f"ray: expected 0 to {count - 1}, got {shown(ray)}")
    check_belongs(bvp, "at", at.solution)


def _departure(
    bvp: BVP, at: SpecialPoint, free: tuple[str, ...], options: TraceOptions, ray: int, scale: Scale | None
) -> _Departure | None:
    """Where and how to leave a branch point along one of its rays; None when the ray does not exist."""
    if scale is not None:
        check_type("scale", scale, Scale, "a Scale")
    scale, indices = scale or at.scale or Scale.of(bvp, at.solution), free_indices(bvp, free)
    inside, all_free = phased(bvp, at.solution, indices, scale)
    colloc = Collocation.at(inside, at.solution, all_free, scale, options.backend)
    x0, step = colloc.state(at.solution), options.step.initial
    bend: Columns | None
    if at.multiplicity > 1:
        if ray >= len(at.rays):
            return None
        direction, bend, step = _along_ray(colloc, at, x0, free, ray)
    elif ray < 2:
        if at.free != free or not at.directions:
            return None
        d = _in_units(at.directions[0], at.scale or colloc.scale, colloc)
        direction, bend = scaled(d, (1.0 if ray == 0 else -1.0) / colloc.norm(d)), None
    else:
        other, bend = _other_direction(colloc, at, x0, free)
        if other is None:
            return None
        direction = scaled(other, 1.0 if ray % 2 == 0 else -1.0)
    start = _Departure(Frame(colloc, x0, direction, (0.0, 0.0), error=at.solution.error), bend, step)
    return _onto_orbit(bvp, start, indices)


def _onto_orbit(bvp: BVP, start: _Departure, free: list[int], near: Columns | None = None) -> _Departure:
    """The departure with as many phase conditions as the branch needs, which a state on it tells, or the first one
    expected there."""
    if not bvp.generators:
        return start
    old, origin, near = start.origin.colloc, start.origin, near or start.guess
    inside, indices = with_phases(bvp, len(orbit_directions(old, near)), free)
    new = Collocation(inside, old.mesh, old.scheme.points, old.base, indices, old.scale, old.backend)
    k = len(indices)
    new.hold(fitted(near, k))
    origin = replace(origin, colloc=new, x=fitted(origin.x, k), tangent=fitted(origin.tangent, k))
    return replace(start, origin=origin, bend=start.bend and fitted(start.bend, k))


def _along_ray(
    colloc: Collocation, at: SpecialPoint, x0: Columns, free: tuple[str, ...], ray: int
) -> tuple[Columns, Columns | None, float]:
    """Unit tangent of a ray of a multiple point, the second derivative that leads to the state nearby, its distance."""
    if at.free != free:
        raise ValueError(f"free: expected {', '.join(at.free)}, to which the rays belong, got {', '.join(free)}")
    scale = at.scale or colloc.scale
    d = _in_units(at.directions[ray], scale, colloc)
    d = scaled(d, 1.0 / colloc.norm(d))
    if ray >= len(at.nearby):
        return d, None, 0.01
    away = add(_in_units(at.nearby[ray], scale, colloc), (-1.0, x0))
    step = colloc.inner(away, d)
    return d, scaled(add(away, (-step, d)), 2.0 / step**2), step


def _followed(at: SpecialPoint, start: _Departure, options: TraceOptions, first_step: float | None) -> Branch | None:
    """The branch that leaves a branch point, which is its first point; None when the first step fails."""
    if first_step is not None:
        check_type("first_step", first_step, Real, "a length")
        if not 0 < first_step < np.inf:
            raise ValueError(f"first_step: expected a positive length, got {first_step!r}")
    origin = start.origin
    found = _step_off(origin, start.bend, options, first_step or start.step)
    if found is None:
        return None
    stepped, step = found
    frame = settled(stepped, options, (across,)).frame
    old = origin.colloc
    if old.bvp.phases - old.bvp.unfoldings <= len(orbit_directions(frame.colloc, frame.x)) < old.bvp.phases:
        # what seemed to be one more direction was the error of the guess
        own = old.free[: len(old.free) - old.bvp.unfoldings].tolist()
        near = frame.colloc.interpolate(frame.x, old)
        return _followed(at, _onto_orbit(old.bvp.plain, start, own, near), options, first_step)
    frame = replace(frame, weakness_before=0.0, previous_step=step)  # before it lies the branch point itself
    first, passed = _first_point(at, origin), _passed(origin, stepped, step, options)
    if (ended := _ended(first, passed, options, origin)) is not None:
        return ended
    try:
        branch = follow(frame, options, both=False, start=EndReason.BRANCH_POINT, arclength=step)
    except BaseException as error:
        if (part := getattr(error, "branch", None)) is not None:
            error.branch = _from(first, passed, part)  # type: ignore[attr-defined]
        raise
    if any(not low <= branch.points[0].solution[name] <= high for name, (low, high) in options.bounds.items()):
        return replace(branch, points=(first,), special=(), ends=(EndReason.BRANCH_POINT, EndReason.RANGE))
    return _from(first, passed, branch)


def _passed(origin: Frame, stepped: Frame, step: float, options: TraceOptions) -> list[SpecialPoint]:
    """The special points between a branch point and the first state beyond it."""
    segment, bvp = Segment(origin, stepped, step, 0.0), origin.colloc.bvp
    found = [with_symmetry(bvp, e.special) for e in events_off(segment, options)]
    if bvp.phases:
        found = [bare_special(x, len(origin.colloc.free) - bvp.unfoldings, bvp) for x in found]
    return found


def _from(first: Point, passed: list[SpecialPoint], branch: Branch) -> Branch:
    """A branch with the branch point before it, and what lies between."""
    passed = [x for x in passed if not any(is_same(x, y) for y in branch.special)]
    converged = sum(x.status is Status.CONVERGED and not x.is_zero for x in passed)
    record = replace(branch.verification, converged=branch.verification.converged + converged)
    return replace(branch, points=(first, *branch.points), special=(*passed, *branch.special), verification=record)


def _ended(first: Point, passed: list[SpecialPoint], options: TraceOptions, origin: Frame) -> Branch | None:
    """The branch that ends at a special point of its first step, as the options want it; None when it goes on."""
    for i, item in enumerate(passed):
        stops = options.stop_at is not None and item.arclength > AT_START and options.stop_at(item, first)
        many = options.max_folds is not None and sum(x.kind == "fold" for x in passed[: i + 1]) > options.max_folds
        if stops or many:
            last = replace(first, solution=item.solution, arclength=item.arclength, fold_test=0.0, step=item.arclength)
            ends = (EndReason.BRANCH_POINT, EndReason.STOPPED if stops else EndReason.FOLD_LIMIT)
            names = tuple(origin.colloc.bvp.parameter_names[k] for k in origin.colloc.free[: len(first.tangent)])
            settings = {"problem": origin.colloc.bvp.name, **options.settings()}
            return Branch(names, (first, last), tuple(passed[: i + 1]), ends, settings=settings)
    return None


def _first_point(at: SpecialPoint, origin: Frame) -> Point:
    tangent = origin.tangent.scalars[: len(origin.colloc.free) - origin.colloc.bvp.unfoldings]
    return Point(at.solution, 0.0, tangent.copy(), origin.fold_test, 0.0)


def _stuck(bvp: BVP, at: SpecialPoint, free: tuple[str, ...], options: TraceOptions, origin: Frame) -> Branch:
    """A branch that does not get away from its branch point."""
    ends = (EndReason.BRANCH_POINT, EndReason.MIN_STEP)
    settings = {"problem": bvp.name, **options.settings()}
    return Branch(free, (_first_point(at, origin),), (), ends, settings=settings)


def _other_direction(
    colloc: Collocation, at: SpecialPoint, x0: Columns, free: tuple[str, ...]
) -> tuple[Columns | None, Columns | None]:
    """Unit tangent of the other branch in the units of `colloc`, and its second derivative where that is known."""
    if len(at.directions) == 1:
        return None, None
    if len(at.directions) == 2 and at.free in (free, ()):
        scale = at.scale or colloc.scale
        d = _in_units(at.directions[1], scale, colloc)
        size = colloc.norm(d)
        bend = scaled(_in_units(at.bend, scale, colloc), size**-2) if at.bend else None
        return scaled(d, 1.0 / size), bend
    parameter = Columns(np.zeros_like(x0.stage), np.zeros_like(x0.mesh), np.eye(len(colloc.free))[0])
    found = kernel_directions(colloc, x0, parameter)
    return (found[1][1] if found else None), None


def _in_units(v: Columns, scale: Scale, colloc: Collocation) -> Columns:
    """A vector measured in the units of `scale`, in those of `colloc`."""
    v, scale = fitted(v, len(colloc.free)), scale.with_unfolding(colloc.bvp)
    unknowns = scale.unknowns / colloc.scale.unknowns
    parameters = (scale.parameters / colloc.scale.parameters)[colloc.free]
    return Columns(v.stage * unknowns, v.mesh * unknowns, v.scalars * parameters)


def _step_off(
    origin: Frame, bend: Columns | None, options: TraceOptions, step: float, attempts: int = 6
) -> tuple[Frame, float] | None:
    """First frame on a branch whose tangent at `origin` is known, inside the bounds if possible, and its distance."""
    colloc, last = origin.colloc, None
    for _ in range(attempts):
        guess = origin.predict(step)
        if bend is not None:  # up to a share of the step: far out the parabola is no better than the tangent
            weight = min(step * step / 2, 0.2 * step / max(colloc.norm(bend), 1e-12))
            guess = add(guess, (weight, bend))
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
