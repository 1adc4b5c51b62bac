"""The plane cut by lines into faces: a planar arrangement."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rodatlas.atlas.phase.lines import Line, past_frame

Frame = tuple[float, float, float, float]
"""Smallest and largest angle in degrees, smallest and largest shear."""

SLIVER = 1e-9  # degrees times shear: smaller faces are round-off where lines touch or cross
Rings = tuple[np.ndarray, ...]
"""The outer boundary of a polygon, then its holes; each (n, 2) closed: angle in degrees and shear."""


def cut_plane(lines: Iterable[Line], frame: Frame) -> list[Rings]:
    """The faces into which lines cut the frame, from small to large angle.

    Parts of lines that end inside a face bound nothing.
    """
    import shapely

    box = shapely.box(frame[0], frame[2], frame[1], frame[3])
    strings = [shapely.LineString(past_frame(line.points, frame)) for line in lines]
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


def chords(rings: Rings, angle: float) -> list[tuple[float, float]]:
    """Intervals of shear in which a face is met at an angle, from low to high."""
    crossings: list[float] = []
    for ring in rings:
        a, b = ring[:-1], ring[1:]
        left, right = np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 0], b[:, 0])
        cut = (left <= angle) & (angle < right)  # half-open: a vertex counts once, a vertical side never
        share = (angle - a[cut, 0]) / (b[cut, 0] - a[cut, 0])
        crossings += (a[cut, 1] + share * (b[cut, 1] - a[cut, 1])).tolist()
    crossings.sort()
    return list(zip(crossings[::2], crossings[1::2], strict=True))


def extent(rings: Rings) -> tuple[float, float]:
    """Smallest and largest angle of a face."""
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


def covers(rings: Rings, angle: float, shear: float) -> bool:
    """Whether a point lies in a face or on its boundary."""
    import shapely

    return bool(polygon_of(rings).covers(shapely.Point(angle, shear)))
