"""Loci of folds, branch points and values of observables in two parameters, with the special points on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rodatlas.continuation.checks import check_each, check_type
from rodatlas.continuation.curve.bounds import Crossing, are_finite, crossed
from rodatlas.continuation.curve.doubt import ErrorWatch, marked
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.orbit import bare_scale, member_near
from rodatlas.continuation.curve.trace import NotConverged
from rodatlas.continuation.curve.ways import walked
from rodatlas.continuation.discrete.collocation import add, arc_length, free_indices, scaled
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.continuation.discrete.phase import phased
from rodatlas.continuation.locus.double_zeros import cut_between
from rodatlas.continuation.locus.events import PITCHFORK, crowded, locate, watched, with_sure_signs
from rodatlas.continuation.locus.extremum import follow_extremum
from rodatlas.continuation.locus.point import LocusFrame, Sought, adapted, correct, density_of, error_of, on_mesh
from rodatlas.continuation.locus.segment import Stretch
from rodatlas.continuation.locus.settle import first_frame, resolved, resolved_event, settled
from rodatlas.continuation.locus.system import UNPROTECTED
from rodatlas.continuation.locus.unprotected import branch_point_of, is_near
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import EndReason, SpecialPoint, Status
from rodatlas.continuation.results.locus import Locus, LocusEvent, LocusPoint
from rodatlas.continuation.singular.bordered import norm_of, overlap
from rodatlas.continuation.singular.extremum import KIND as EXTREMUM

ALIGNED = 0.5  # cosine of the largest turn of a kernel vector on one step
AT_CUSP = 1e-4  # arclength from a cusp within which a parameter is not told to be extreme: there all of them turn
AT_START = 1e-5  # arclength within which an event is one at the start of a closed locus
ON_BOUND = 1e-10  # distance from a bound, relative to it or to one, within which a point lies on it
SMOOTH = 0.05  # the chord of a step may differ by this share from the mean of the tangents at its ends


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
    names = list(dict.fromkeys(free))
    followed = max(bvp.n_free, len(start.free)) if bvp.generators and isinstance(start, SpecialPoint) else bvp.n_free
    unprotected = len(names) == followed + 2
    if isinstance(start, LocusEvent):
        start = branch_point_of(start, unprotected)
    if len(names) != followed + 1 and not (unprotected and start.kind == "branch point"):
        raise ValueError(f"free: expected {followed + 1} parameter names for a locus, got {list(free)}")
    options = options or TraceOptions()
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
    if frame is None or (unprotected and not is_near(frame, start)):
        raise NotConverged(NewtonCode.SLOW, f"start of the locus at {start!r}")
    if sought.kind == "branch point":
        sought = replace(sought, pitchfork=_is_pitchfork(sought, frame, options))

    def way(sense: float) -> _Walk:
        return _Walk(sought, frame if sense > 0 else frame.reversed(), options, tuple(names))

    return resolved(walked(way, _joined, "locus", both), frame, sought, options)


def _joined(forward: _Walk, backward: _Walk | None, start: EndReason) -> Locus:
    """The locus from its two halves; `start` is the first end's reason when there is one half only."""
    points, events, first = forward.marked_points(), forward.events, start
    if backward is not None:
        points = [_flipped(p) for p in reversed(backward.marked_points()[1:])] + points
        events = [_flipped_event(e) for e in reversed(backward.events)] + events
        first = backward.end or EndReason.INTERRUPTED
    cusps = [e.arclength for e in events if e.kind == "cusp"]
    events = [e for e in events if e.kind != "extremum" or all(abs(e.arclength - c) > AT_CUSP for c in cusps)]
    sought, bvp = forward.sought, forward.start.colloc.bvp
    return Locus(
        sought.kind, forward.names, tuple(points), tuple(events), (first, forward.end or EndReason.INTERRUPTED),
        bare_scale(forward.start.colloc.scale, bvp), {"problem": bvp.name, **forward.options.settings()},
        sought.pitchfork,
    )  # fmt: skip


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


def _continues(here: LocusFrame, frame: LocusFrame) -> bool:
    """Whether kernel vectors have turned little on a step, so that signs of the test functions can be compared."""
    old, new = here.border, frame.border
    if not old.vectors:
        return True
    turn = overlap(old.column, new.column) / (norm_of(old.column) * norm_of(new.column))
    return min(turn, *(here.colloc.inner(v, w) for v, w in zip(old.vectors, new.vectors, strict=True))) > ALIGNED


class _Walk:
    """Pseudo-arclength continuation of a locus in one direction."""

    def __init__(self, sought: Sought, frame: LocusFrame, options: TraceOptions, names: tuple[str, ...]):
        self.sought, self.start, self.frame, self.options, self.names = sought, frame, frame, options, names
        self.arclength = 0.0
        self.end: EndReason | None = None
        self.points = [self._point(frame)]
        self.events: list[LocusEvent] = []
        self._watch = ErrorWatch(options.mesh, frame.colloc, frame.error, density_of(frame), 0.0)

    def walk(self) -> None:
        """Walk until there is a reason to end."""
        control, step = self.options.step, self.options.step.initial
        largest = step
        while self.end is None:
            tried = self._attempt(step)
            whole = self._landed(*tried[:2]) if tried else None
            if self.end is not None:
                break
            stretch = cut_between(with_sure_signs(whole, self.names)) if whole is not None else None
            events = self._events(stretch, step, largest) if stretch is not None else None
            if tried is None or stretch is None or events is None:
                step *= 0.5
                if step < control.minimum:
                    self.end = EndReason.MIN_STEP
                continue
            if self._breaks_up(stretch.right):
                self.end = EndReason.UNFOLDED
                break
            at_bound = whole is not None and whole.right is not tried[0] and stretch.step == whole.step
            self.end = EndReason.RANGE if at_bound else None
            self._accept(stretch, events)
            step = largest = control.next_step(step, tried[2], stretch.right.iterations)
        if self.end not in (EndReason.CRITICALITY, EndReason.CLOSED):  # whose last point has its own error
            self._measure_end()

    def _events(self, stretch: Stretch, step: float, largest: float) -> list[LocusEvent] | None:
        """The special points on a stretch; None when a shorter step should tell more."""
        found = watched(stretch, self.names)
        if step > 64 * self.options.step.minimum and crowded(stretch, found):
            return None
        events = [locate(stretch, w, self.names) for w in found]
        if step > largest / 16 and any(e.status is Status.BRACKETED for e in events):
            return None
        events = [resolved_event(stretch, w, e, self.names) for w, e in zip(found, events, strict=True)]
        return sorted(events, key=lambda e: e.arclength)

    def _attempt(self, step: float) -> tuple[LocusFrame, float, float] | None:
        """Correct a step: the frame, its distance and the first correction; None when a smaller step is needed."""
        control, here = self.options.step, self.frame
        found = correct(self.sought, here, here.predict(step), here.tangent, self.options)
        if found is None:
            return None
        frame, corrections = found
        if sum(corrections) > control.max_correction * step:
            return None
        cosine = here.colloc.inner(frame.tangent, here.tangent)
        if cosine < control.min_cosine:
            return None
        chord = add(frame.x, (-1.0, here.x))
        length = here.colloc.norm(chord)
        mean = add(scaled(here.tangent, 0.5 * length), (0.5 * length, frame.tangent))
        if here.colloc.norm(add(chord, (-1.0, mean))) > SMOOTH * length:  # on another curve
            return None
        if not _continues(here, frame):
            return None
        distance = arc_length(length, cosine)
        return frame.after(here, distance), distance, corrections[0]

    def _accept(self, stretch: Stretch, events: list[LocusEvent]) -> None:
        ending = next((e for e in events if self.sought.kind == "fold" and e.kind == "criticality"), None)
        if ending is not None:  # beyond it the locus is its own mirror image
            self._measure_end()
            self.events += [e for e in events if e.arclength <= ending.arclength]
            self.arclength = ending.arclength
            self.points.append(replace(self._point(stretch.left), solution=ending.solution))
            self.end = EndReason.CRITICALITY
            return
        closing = stretch.passes(self.start) if self.end is None and len(self.points) >= 4 else None
        if closing is not None:
            self._measure_end()
            self.arclength += closing * stretch.step
            self.events += [e for e in events if self._is_new(e)]
            self.points.append(replace(self.points[0], arclength=self.arclength))
            self.end = EndReason.CLOSED
            return
        self.events += events
        self.frame = stretch.right
        self.arclength += stretch.step
        self.points.append(self._point(stretch.right))
        if self.end is None and len(self.points) > self.options.max_points:
            self.end = EndReason.POINT_LIMIT
        if self.options.on_point is not None:
            self.options.on_point(self.points[-1])
        self._watch.stepped()
        if self.end is None and self._watch.is_due(self.frame.colloc, density_of(self.frame)):
            self._adapt()

    def _is_new(self, event: LocusEvent) -> bool:
        """Whether an event of the step that passes the start lies before it, or at it and was not found there."""
        start = self.start
        way = add(start.colloc.state(event.solution), (-1.0, start.x))
        ahead = start.colloc.inner(start.tangent, way)
        known = [(e.kind, e.parameter) for e in self.events if e.arclength < AT_START]
        return ahead < -AT_START or (ahead < AT_START and (event.kind, event.parameter) not in known)

    def _adapt(self) -> None:
        """Let the mesh follow; where the error is more than is accepted, settle it here."""
        control, here = self.options.mesh, self.frame
        self.frame, estimate = adapted(self.sought, here, self.options)
        self._watch.measured(estimate.error, self.arclength)
        if not control.accepts(estimate.error):
            if estimate.is_round_off and estimate.error > 100 * control.tolerance:
                self.end = EndReason.ROUND_OFF
                return
            better = settled(self.sought, here, self.options)
            # signs stay what they were when the step that ends here was searched: each event is seen on one step
            same = on_mesh(here, better.frame.colloc.mesh)
            self.frame = replace(better.frame, tangent=same.tangent, tests=same.tests)
            if better.missed in (EndReason.MESH_LIMIT, EndReason.UNREFINED):
                self.end = better.missed
        self._watch.moved(self.frame.colloc, self.frame.error, density_of(self.frame))

    def _measure_end(self) -> None:
        """Look at the last point too, for the mesh has followed since the last adaptation only so far."""
        if self._watch.is_behind(self.arclength):
            error = error_of(self.sought, self.frame, self.options.mesh.tolerance).error
            self._watch.measured(error, self.arclength)

    def marked_points(self) -> list[LocusPoint]:
        """The points with the errors that were found after them."""
        return [replace(p, solution=marked(p.solution, p.arclength, self._watch.doubts)) for p in self.points]

    def _point(self, frame: LocusFrame) -> LocusPoint:
        solution = frame.colloc.solution(frame.x, frame.error)
        return LocusPoint(
            solution, self.arclength, frame.tangent.scalars[: len(self.names)].copy(), frame.tests.values,
            frame.unfolding, frame.iterations,
        )  # fmt: skip

    def _breaks_up(self, frame: LocusFrame) -> bool:
        """Whether the branch point exists only for a perturbed problem: what protected it is gone."""
        error = frame.error if frame.error == frame.error else 0.0
        return abs(frame.unfolding) > 1e-6 + 100 * max(self.options.mesh.tolerance, error)

    def _landed(self, frame: LocusFrame, step: float) -> Stretch | None:
        """The step as a stretch, cut exactly at the first bound that it crosses; None when that fails."""
        stretch = Stretch(self.sought, self.frame, frame, step, self.arclength, self.options)
        if not are_finite(frame.colloc, (*self.options.bounds, *self.options.zeros, *self.options.extrema), frame.x):
            return None
        passed = self._crossed(frame)
        if passed and passed[0][0] <= 0.0:  # the present point lies on a bound
            self.end = EndReason.RANGE
            return None
        for _, name, bound in passed:
            found = stretch.root(lambda f, name=name, bound=bound: f.beyond(name, bound), 1e-13)  # type: ignore[misc]
            if found is not None and not self._crossed(found[0]):
                return replace(stretch, right=found[0], step=found[1] * step)
        return None if passed else stretch

    def _crossed(self, frame: LocusFrame) -> list[Crossing]:
        """Bounds between the present frame and another."""
        return crossed(frame.colloc, self.options.bounds, self.frame.x, frame.x, ON_BOUND)


def _flipped(p: LocusPoint) -> LocusPoint:
    return replace(p, arclength=-p.arclength, tangent=-p.tangent)


def _flipped_event(e: LocusEvent) -> LocusEvent:
    return replace(e, arclength=-e.arclength, bracket=(-e.bracket[1], -e.bracket[0]))
