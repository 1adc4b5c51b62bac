"""The plane cut by lines into faces: a planar arrangement."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rodatlas.atlas.phase.lines import Line, past_frame
from rodatlas.atlas.phase.settings import PhaseSettings

Frame = tuple[float, float, float, float]
"""Least and largest value of the second control, least and largest of that along slices."""

SLIVER = 1e-9  # of units of both controls: smaller faces are round-off where lines touch or cross
Rings = tuple[np.ndarray, ...]
"""The outer boundary of a polygon, then its holes; each (n, 2) closed: second control, and control along slices."""


def cut_plane(lines: Iterable[Line], settings: PhaseSettings) -> list[Rings]:
    """The faces into which lines cut the plane, from small to large values of the second control.

    Parts of lines that end inside a face bound nothing.
    """
    import shapely

    box = shapely.Polygon(settings.region)
    strings = [shapely.LineString(past_frame(line.points, settings)) for line in lines]
    noded = shapely.unary_union([*strings, box.exterior])
    polygons = shapely.get_parts(shapely.polygonize([noded]))
    inside = [p for p in polygons if p.area > SLIVER and box.contains(p.representative_point())]
    inside.sort(key=lambda p: (p.bounds[0], p.bounds[1]))
    return [rings_of(p) for p in inside]


def rings_of(polygon: Any) -> Rings:
    """The boundary of a shapely polygon."""
    return (np.array(polygon.exterior.coords), *(np.array(ring.coords) for ring in polygon.interiors))


def polygon_of(rings: Rings) -> Any:
    """A shapely polygon."""
    import shapely

    return shapely.Polygon(rings[0], rings[1:])


def chords(rings: Rings, second: float) -> list[tuple[float, float]]:
    """Intervals in which a face is met at a value of the second control, from low to high."""
    crossings: list[float] = []
    for ring in rings:
        a, b = ring[:-1], ring[1:]
        left, right = np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 0], b[:, 0])
        cut = (left <= second) & (second < right)  # half-open: a vertex counts once, a vertical side never
        share = (second - a[cut, 0]) / (b[cut, 0] - a[cut, 0])
        crossings += (a[cut, 1] + share * (b[cut, 1] - a[cut, 1])).tolist()
    crossings.sort()
    return list(zip(crossings[::2], crossings[1::2], strict=True))


def extent(rings: Rings) -> tuple[float, float]:
    """Least and largest value of the second control on a face."""
    return float(rings[0][:, 0].min()), float(rings[0][:, 0].max())


def united(faces: Sequence[Rings]) -> list[Rings]:
    """Faces joined where they have sides in common: the polygons that remain."""
    import shapely

    if not faces:
        return []
    whole = shapely.unary_union([polygon_of(f) for f in faces])
    parts = [p for p in shapely.get_parts(whole) if p.geom_type == "Polygon" and p.area > SLIVER]
    found = [rings_of(p) for p in sorted(parts, key=lambda p: p.bounds)]
    return [(r[0], *(hole for hole in r[1:] if shapely.Polygon(hole).area > 10 * SLIVER)) for r in found]


def covers(rings: Rings, second: float, value: float) -> bool:
    """Whether a point lies in a face or on its boundary."""
    import shapely

    return bool(polygon_of(rings).covers(shapely.Point(second, value)))
