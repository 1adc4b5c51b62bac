"""Loci of extrema: followed as folds in the value of the observable, told as what they are for the branches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.start import NotConverged
from rodatlas.continuation.discrete.collocation import Scale
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.results.branch import SpecialPoint
from rodatlas.continuation.results.locus import Effect, Locus, LocusEvent, LocusPoint
from rodatlas.continuation.singular.extremum import ValueView

Follow = Callable[..., Locus]


def follow_extremum(
    follow: Follow, bvp: BVP, start: SpecialPoint, free: Sequence[str], options: TraceOptions, both: bool
) -> Locus:
    """Follow an extremum in two parameters.

    Parameters
    ----------
    follow : what follows a fold, :func:`rodatlas.continuation.follow_locus`.
    free : the parameter of the branches, the second one, then any inner ones; all that is extreme may be one of these.
    """
    if start.is_branch_point:
        raise ValueError(f"start: expected the branch point itself, of which this {start.kind} is a part")
    if start.name in free[:2]:
        raise ValueError(f"free: expected '{start.name}', which is extreme, after the two parameters, got {list(free)}")
    scale = start.scale or Scale.of(bvp, start.solution)
    said = _Said(ValueView.of(bvp, start.name), start.kind, tuple(free), scale, options)
    view, given = said.view, options.on_point
    inside = replace(
        options, extrema=tuple(dict.fromkeys((free[0], *(n for n in options.extrema if n != start.name)))),
        on_point=None if given is None else lambda point: given(said.point(point)),
    )  # fmt: skip
    lifted = SpecialPoint(
        "fold", view.solution(start.solution), start.arclength, start.status, start.bracket, start.tests,
        free=view.free(start.free), scale=view.scale(scale, start.solution[start.name]),
    )  # fmt: skip
    try:
        return said.locus(follow(view.inside, lifted, view.free(free, at=1), inside, both=both))
    except BaseException as error:
        if hasattr(error, "locus"):
            error.locus = said.locus(error.locus)
        if isinstance(error, NotConverged) and error.solution is not None:
            error.solution = view.original(error.solution)
        raise


@dataclass(frozen=True)
class _Said:
    """What is found in the view, in terms of the problem."""

    view: ValueView
    kind: str
    free: tuple[str, ...]
    scale: Scale
    options: TraceOptions

    def locus(self, found: Locus) -> Locus:
        return replace(
            found, kind=self.kind, free=self.free, scale=self.scale,
            points=tuple(map(self.point, found.points)), events=tuple(map(self.event, found.events)),
            settings={**found.settings, "extrema": list(self.options.extrema)},
        )  # fmt: skip

    def point(self, p: LocusPoint) -> LocusPoint:
        order = [self.view.free(self.free, at=1).index(name) for name in self.free]
        return replace(p, solution=self.view.original(p.solution), tangent=np.asarray(p.tangent)[order])

    def event(self, e: LocusEvent) -> LocusEvent:
        e = replace(e, solution=self.view.original(e.solution))
        name, (one, two) = self.view.name, self.free[:2]
        if e.kind == "cusp":
            what = f"a maximum and a minimum of {name} meet and vanish"
            return replace(e, kind="extremum", parameter=two, what=what, coefficients={})
        if e.kind == "extremum" and e.parameter == self.view.value:
            saddle = e.effect is Effect.TOUCH
            what = f"{name} is stationary in {one} and {two}: {'a saddle' if saddle else 'a maximum or minimum'}"
            return replace(e, parameter=name, what=what, effect=None)
        if e.kind == "extremum" and e.parameter == one:
            return replace(e, what=f"the locus turns back in {one}", effect=None)
        return replace(e, what=e.what.replace("the fold", f"the extremum of {name}"))
