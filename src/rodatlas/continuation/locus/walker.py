"""The steps along a locus: special points, its end where the symmetry is lost, and the mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rodatlas.continuation.curve.bounds import Crossing
from rodatlas.continuation.curve.doubt import marked
from rodatlas.continuation.curve.march import Corrected, March, Step, Trial
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.vectors import add, arc_length, scaled
from rodatlas.continuation.locus.double_zeros import cut_between
from rodatlas.continuation.locus.events import crowded, locate, watched, with_sure_signs
from rodatlas.continuation.locus.point import LocusFrame, Sought, adapted, correct, density_of, error_of, on_mesh
from rodatlas.continuation.locus.segment import Stretch
from rodatlas.continuation.locus.settle import resolved_event, settled
from rodatlas.continuation.results.branch import EndReason, Status
from rodatlas.continuation.results.locus import LocusEvent, LocusPoint
from rodatlas.continuation.singular.bordered import norm_of, overlap

ALIGNED = 0.5  # cosine of the largest turn of a kernel vector on one step
AT_START = 1e-5  # arclength within which an event is one at the start of a closed locus
SMOOTH = 0.05  # the chord of a step may differ by this share from the mean of the tangents at its ends


class LocusWalker(March[LocusFrame, Stretch, LocusPoint, LocusEvent]):
    """Follows a locus from a frame in one direction; `points` and `events` are those so far."""

    on_bound = 1e-10

    def __init__(self, sought: Sought, frame: LocusFrame, options: TraceOptions, names: tuple[str, ...]):
        super().__init__(frame, options, density_of)
        self.sought, self.names = sought, names
        self.arclength = 0.0  # of the frame
        self.points = [self._point(frame)]
        self.events: list[LocusEvent] = []

    def walk(self) -> None:
        """Walk until there is a reason to end."""
        for _ in self:
            pass

    def __iter__(self) -> Iterator[Step[LocusPoint, LocusEvent]]:
        yield from super().__iter__()
        if self._watch.is_behind(self.arclength):  # the mesh has followed since the last adaptation only so far
            error = error_of(self.sought, self.frame, self.options.mesh.tolerance).error
            self._watch.measured(error, self.arclength)

    def _corrected(self, step: float) -> Corrected[LocusFrame] | None:
        here = self.frame
        found = correct(self.sought, here, here.predict(step), here.tangent, self.options)
        return None if found is None else Corrected(found[1], lambda: found[0])

    def _arc(self, frame: LocusFrame, cosine: float) -> Stretch | None:
        here = self.frame
        chord = add(frame.x, (-1.0, here.x))
        length = here.colloc.norm(chord)
        mean = add(scaled(here.tangent, 0.5 * length), (0.5 * length, frame.tangent))
        if here.colloc.norm(add(chord, (-1.0, mean))) > SMOOTH * length or not _continues(here, frame):
            return None
        step = arc_length(length, cosine)
        return Stretch(self.sought, here, frame.after(here, step), step, self.arclength, self.options)

    def _landed(self, arc: Stretch, crossing: Crossing) -> Stretch | None:
        _, name, bound = crossing
        found = arc.root(lambda frame: frame.beyond(name, bound), 1e-13)
        return None if found is None else replace(arc, right=found[0], step=found[1] * arc.step)

    def _taken(self, trial: Trial[Stretch], tried: float, longest: float) -> Step[LocusPoint, LocusEvent] | None:
        stretch = cut_between(with_sure_signs(trial.arc, self.names))
        events = self._events(stretch, trial.step, tried)
        if events is None:
            return None
        if self._breaks_up(stretch.right):
            self.end = EndReason.UNFOLDED
            return None
        if trial.at_bound and stretch.step == trial.arc.step:
            self.end = EndReason.RANGE
        taken = self._accept(stretch, events)
        self.points.append(taken.point)
        self.events += taken.special
        return taken

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

    def _accept(self, stretch: Stretch, events: list[LocusEvent]) -> Step[LocusPoint, LocusEvent]:
        ending = next((e for e in events if self.sought.kind == "fold" and e.kind == "criticality"), None)
        if ending is not None:  # beyond it the locus is its own mirror image
            self.end = EndReason.CRITICALITY
            last = replace(self._point(stretch.left), solution=ending.solution, arclength=ending.arclength)
            return Step(last, tuple(e for e in events if e.arclength <= ending.arclength))
        closing = stretch.passes(self.start) if self.end is None and self._count >= 3 else None
        if closing is not None:
            self.end = EndReason.CLOSED
            last = replace(self.points[0], arclength=self.arclength + closing * stretch.step)
            return Step(last, tuple(e for e in events if self._is_new(e)))
        self.frame = stretch.right
        self.arclength += stretch.step
        return Step(self._point(stretch.right), tuple(events))

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


def _continues(here: LocusFrame, frame: LocusFrame) -> bool:
    """Whether kernel vectors have turned little on a step, so that signs of the test functions can be compared."""
    old, new = here.border, frame.border
    if not old.vectors:
        return True
    turn = overlap(old.column, new.column) / (norm_of(old.column) * norm_of(new.column))
    return min(turn, *(here.colloc.inner(v, w) for v, w in zip(old.vectors, new.vectors, strict=True))) > ALIGNED
