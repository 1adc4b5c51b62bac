"""The bounds of a run, on free parameters and observables: which of them a step passes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.linear.matrix import Columns

Crossing = tuple[float, str, float]
"""Fraction of the step, name, and value of the bound."""


def crossed(
    colloc: Collocation, bounds: Mapping[str, tuple[float, float]], here: Columns, ahead: Columns, slack: float
) -> list[Crossing]:
    """Bounds between two states, the nearest first.

    The fraction is zero when the first state already lies on the bound, up to `slack`, or outside.
    """
    found = []
    for name, pair in bounds.items():
        before, value = (colloc.observable_row(name, x)[0] for x in (here, ahead))
        for bound, outward in zip(pair, (-1.0, 1.0), strict=True):
            at = colloc.bvp.coordinate(name, bound)
            tiny = slack * max(1.0, abs(at))
            if outward * (value - at) > tiny and outward * (value - before) > 0:
                inside = outward * (at - before) > tiny
                found.append(((at - before) / (value - before) if inside else 0.0, name, bound))
    return sorted(found)


def are_finite(colloc: Collocation, names: Iterable[str], x: Columns) -> bool:
    """Whether observables have values at a state: NaN would be neither inside nor outside."""
    return all(np.isfinite(colloc.observable_row(name, x)[0]) for name in dict.fromkeys(names))
