"""Loci of folds, branch points and values of observables in two parameters, with the special points on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rodatlas.continuation.checks import check_each, check_flag, check_type
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.orbit import bare_scale, member_near
from rodatlas.continuation.curve.trace import NotConverged
from rodatlas.continuation.curve.ways import walked
from rodatlas.continuation.discrete.collocation import free_indices
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.discrete.phase import phased
from rodatlas.continuation.locus.events import PITCHFORK
from rodatlas.continuation.locus.extremum import follow_extremum
from rodatlas.continuation.locus.point import LocusFrame, Sought, correct
from rodatlas.continuation.locus.settle import first_frame, resolved
from rodatlas.continuation.locus.system import UNPROTECTED
from rodatlas.continuation.locus.unprotected import branch_point_of, is_near
from rodatlas.continuation.locus.walker import AT_START, LocusWalker
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import EndReason, SpecialPoint
from rodatlas.continuation.results.locus import Locus, LocusEvent, LocusPoint
from rodatlas.continuation.singular.extremum import KIND as EXTREMUM

AT_CUSP = 1e-4  # arclength from a cusp within which a parameter is not told to be extreme: there all of them turn


def follow_locus(
    bvp: BVP, start: SpecialPoint | LocusEvent, free: Sequence[str], options: TraceOptions | None = None, *,
    both: bool = True,
) -> Locus:  # fmt: skip
    """Follow a fold, a branch point, or a zero or extremum of an observable in two parameters.

    A branch point that nothing protects exists at single points of the plane only, as where two branches merge and
    split: it is followed in three parameters.

    Parameters
    ----------
    start : a located fold, branch point or extremum, or a zero of a free parameter or observable, whose value is kept;
        with three parameters also an event of a locus of folds that is a branch point, such as an 'extremum' in the
        second parameter.
    free : bvp.n_free + 1 names: the parameter in which it was found, the second one, then any inner ones; one name more
        for a branch point in three parameters, which come first.
    options : bounds, zeros, extrema, steps, mesh and `within` as for branches; `locate` and `index` are not used. Of a
        pitchfork the solutions are kept `within`, not the side branch.
    both : follow both directions.

    Raises
    ------
    ValueError
        when the point is of another kind, or the names do not fit the problem.
    NotConverged
        when Newton does not converge from the start, or no mesh allowed meets the tolerance there.
    BaseException
        what interrupted the run (Ctrl-C, an error in `on_point`), with the part computed so far in its attribute
        `locus`, whose end there is `EndReason.INTERRUPTED`.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("start", start, (SpecialPoint, LocusEvent), "a special point of a branch or locus")
    check_each("free", free, str, "names of parameters such as ('lam', 'mu')")
    check_flag("both", both)
    names = list(dict.fromkeys(free))
    followed = max(bvp.n_free, len(start.free)) if bvp.generators and isinstance(start, SpecialPoint) else bvp.n_free
    unprotected = len(names) == followed + 2
    if isinstance(start, LocusEvent):
        start = branch_point_of(start, unprotected)
    if len(names) != followed + 1 and not (unprotected and start.kind == "branch point"):
        raise ValueError(f"free: expected {followed + 1} parameter names for a locus, got {list(free)}")
    options = TraceOptions.given(options)
    if start.kind.startswith(EXTREMUM):
        return follow_extremum(follow_locus, bvp, start, names, options, both)
    sought = Sought(UNPROTECTED) if unprotected else Sought.of(start)
    index = [bvp.parameter_index(name) for name in names]
    free_indices(bvp, [names[0], *names[3 if unprotected else 2 :]])
    options.check_names(bvp, names)
    _check_inside(start, options)
    near, controls = member_near(bvp, start) or start.solution, 3 if unprotected else 2
    inside, index = phased(bvp, near, index, start.scale, controls)
    frame = first_frame(inside, sought, start, index, options)
    if frame is None and (idle := [name for name in names if name in bvp.idle]):
        raise ValueError(f"free: expected parameters on which an equation or condition depends, got '{idle[0]}'")
    if frame is None or (unprotected and not is_near(frame, start)):
        raise NotConverged(NewtonCode.SLOW, f"start of the locus at {start!r}")
    if sought.kind == "branch point":
        sought = replace(sought, pitchfork=_is_pitchfork(sought, frame, options))

    def way(sense: float) -> LocusWalker:
        return LocusWalker(sought, frame if sense > 0 else frame.reversed(), options, tuple(names))

    return resolved(walked(way, _joined, "locus", both), frame, sought, options)


def _joined(forward: LocusWalker, backward: LocusWalker | None, start: EndReason) -> Locus:
    """The locus from its two halves; `start` is the first end's reason when there is one half only."""
    points, events, first = forward.marked_points(), forward.events, start
    if backward is not None:
        points = [_flipped(p) for p in reversed(backward.marked_points()[1:])] + points
        before = [_flipped_event(e) for e in reversed(backward.events)]
        events = before + [e for e in events if not any(_is_same(e, other) for other in before)]
        first = backward.end or EndReason.INTERRUPTED
    cusps = [e.arclength for e in events if e.kind == "cusp"]
    events = [e for e in events if e.kind != "extremum" or all(abs(e.arclength - c) > AT_CUSP for c in cusps)]
    sought, bvp = forward.sought, forward.start.colloc.bvp
    return Locus(
        sought.kind, forward.names, tuple(points), tuple(events), (first, forward.end or EndReason.INTERRUPTED),
        bare_scale(forward.start.colloc.scale, bvp), {"problem": bvp.name, **forward.options.settings()},
        sought.pitchfork,
    )  # fmt: skip


def _is_same(one: LocusEvent, two: LocusEvent) -> bool:
    """Whether both halves of a locus report one event, right at the start."""
    alike = (one.kind, one.parameter, one.what) == (two.kind, two.parameter, two.what)
    return alike and abs(one.arclength - two.arclength) < AT_START


def _is_pitchfork(sought: Sought, frame: LocusFrame, options: TraceOptions) -> bool:
    """Whether the quadratic term of the branch points vanishes at the start and a little further on."""
    step = options.step.initial
    for _ in range(10):
        found = correct(sought, frame, frame.predict(step), frame.tangent, options, exact=True)
        if found is not None:
            values = [f.tests.values["quadratic"] for f in (frame, found[0])]
            return max(map(abs, values)) < PITCHFORK
        step *= 0.5
    return abs(frame.tests.values["quadratic"]) < PITCHFORK


def _check_inside(start: SpecialPoint, options: TraceOptions) -> None:
    for name, (low, high) in options.bounds.items():
        value = start.solution[name]
        slack = 1e-9 * max(1.0, abs(value))
        if not low - slack <= value <= high + slack:
            raise ValueError(f"bounds: expected the start inside those of '{name}', {low} to {high}, got {value:.8g}")


def _flipped(p: LocusPoint) -> LocusPoint:
    return replace(p, arclength=-p.arclength, tangent=-p.tangent)


def _flipped_event(e: LocusEvent) -> LocusEvent:
    return replace(e, arclength=-e.arclength, bracket=(-e.bracket[1], -e.bracket[0]))
