"""Shear of the bifurcations at 15 degrees against Poisson's ratio: figure 25 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rodatlas.paper.drawn import Drawn, Number

if TYPE_CHECKING:
    from rodatlas.atlas import Event, Slice
    from rodatlas.paper.sources import Sources

ANGLE_DEG = 15.0
SECOND, RATIOS = "poisson", (0.0, 0.5)
MOST = 3  # bifurcations that are named as those that move most


class Curve(NamedTuple):
    """A bifurcation by number: its kind, Poisson's ratios (n,), increasing, and shears (n,)."""

    number: int
    kind: str
    ratios: np.ndarray
    shears: np.ndarray

    @property
    def travel(self) -> float:
        """Change of the shear from the smallest to the largest ratio."""
        return float(self.shears[-1] - self.shears[0])


def draw(sources: Sources) -> Drawn:
    """Curves of all numbered bifurcations of the slice."""
    from rodatlas.plot.look.heading import setting_text
    from rodatlas.plot.planes.against import draw_curves_against

    found = sources.slice_at(ANGLE_DEG)
    curves, settings = curves_of(found), found.settings
    labels = settings.model.control(SECOND).label, settings.control.label
    figure = draw_curves_against(
        {str(c.number): (c.kind, c.ratios, c.shears) for c in curves}, labels,
        setting_text(settings.model.controls, settings.setting.without(SECOND)),
    )  # fmt: skip
    caption = (
        f"Shear of the numbered bifurcations at {ANGLE_DEG:g} degrees against Poisson's ratio, each followed from the "
        "slice at 0.25."
    )
    return Drawn(figure, caption, numbers_of(curves), remarks_on(curves))


def curves_of(found: Slice) -> list[Curve]:
    """The numbered bifurcations of a slice, followed in shear and Poisson's ratio."""
    events: dict[int, Event] = {}
    for b in found.branches:
        for e in b.events:
            if e.number is not None:
                events.setdefault(e.number, e)
    return [_followed(events[n], found) for n in sorted(events)]


def _followed(event: Event, found: Slice) -> Curve:
    """One bifurcation over the whole range of Poisson's ratio, or as far as it exists."""
    from rodatlas.continuation import MeshControl, TraceOptions, follow_locus

    settings, model = found.settings, found.settings.model
    second = model.control(SECOND)
    low, high = (second.raw(ratio, settings.parameters) for ratio in RATIOS)
    bounds = {second.parameter: (low, high), settings.parameter: (-settings.high, settings.high)}
    options = TraceOptions(mesh=MeshControl(tolerance=settings.tolerance), bounds=bounds)
    locus = follow_locus(model.problem, event.special, model.free_with(settings.along, SECOND), options)
    ratios = np.array([model.value(SECOND, p.solution) for p in locus.points])
    shears = np.array([settings.value(p.solution) for p in locus.points])
    if ratios[-1] < ratios[0]:
        ratios, shears = ratios[::-1], shears[::-1]
    return Curve(event.number or 0, event.kind, ratios, shears)


def numbers_of(curves: list[Curve]) -> tuple[Number, ...]:
    """Shear of each bifurcation at both ends of the range."""
    return tuple(
        Number(f"shear of {c.kind} {c.number} at nu = {abs(round(c.ratios[end], 6)):g}", float(c.shears[end]), "L")
        for c in curves
        for end in (0, -1)
    )


def remarks_on(curves: list[Curve]) -> tuple[str, ...]:
    """Which move most, and what becomes of the range of the twisted states."""
    order = sorted(curves, key=lambda c: -abs(c.travel))
    most = ", ".join(str(n) for n in sorted(c.number for c in order[:MOST]))
    wider = all(c.travel > 0 for c in curves if c.number in (1, 2))
    twisted = "widens" if wider else "does not widen"
    return (
        f"The bifurcations {most} move most: by {', '.join(f'{abs(c.travel):.3f}' for c in order[:MOST])}; the next, "
        f"{order[MOST].number}, by {abs(order[MOST].travel):.3f}.",
        f"A larger Poisson's ratio {twisted} the range of the twisted states TU and TW, which end at folds 2 and 1.",
    )
