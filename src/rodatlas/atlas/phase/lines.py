"""Loci as polylines in the plane that share their vertices where they meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, labels
from rodatlas.atlas.loci.result import Piece
from rodatlas.atlas.loci.settings import PlaneSettings
from rodatlas.atlas.loci.stretches import on_chord
from rodatlas.atlas.phase.settings import PhaseSettings
from rodatlas.atlas.slices.result import Slice
from rodatlas.continuation import Solution

FINE = 16  # vertices of a polyline between two computed points
ON_LOCUS = 1e-3  # units: largest distance of a bifurcation of a slice from its locus
BEYOND = 1e-5  # units by which a line that ends on the frame is drawn past it
SAME = 2e-4  # units: of computed and exact points that are nearer the exact one is kept

Point = tuple[float, float]
Knots = Mapping[str, Sequence[tuple[float, float]]]
"""Label of a locus -> further points on it, (second control, control along slices)."""


@dataclass(frozen=True, eq=False)
class Line:
    """A locus, or a curve along which a state changes its name smoothly.

    Attributes
    ----------
    label : number of the locus, one with a prime for a piece without a number, or 'U|w' for a change of name.
    kind : 'fold', 'pitchfork', 'branch point' or 'smooth'.
    points : (n, 2) second control, in increasing order, and control along slices.
    """

    label: str
    kind: str
    points: np.ndarray

    @property
    def number(self) -> int | None:
        """That of the bifurcation, or None."""
        return int(self.label) if self.label.isdigit() else None

    def __repr__(self) -> str:
        low, high = self.points[0, 0], self.points[-1, 0]
        return f"Line({self.kind} {self.label}: {low:.5g} to {high:.5g}, {len(self.points)} vertices)"


def locus_lines(
    pieces: Sequence[Piece], events: Sequence[PlaneEvent], settings: PlaneSettings, knots: Knots | None = None
) -> list[Line]:
    """The pieces of loci as polylines.

    They pass exactly through the computed points, through special points, at the same coordinates for all loci that
    have one in common, and through the given knots; between, a cubic spline along the curve.
    """
    lines = []
    for label, piece in zip(labels(pieces, settings), pieces, strict=True):
        if not label:
            continue
        special = [(e.second, e.value) for e in events if label in e.labels and e.parameter != settings.along]
        computed = [(float(x), float(y)) for x, y in piece.places[:, :2]]
        exact = [*special, *(knots or {}).get(label, ())]
        lines.append(Line(label, piece.kind, spline(_joined(computed, exact, settings), settings.second_scale)))
    return lines


def slice_knots(places: Sequence[Place], slices: Sequence[Slice], settings: PlaneSettings) -> dict[str, list[Point]]:
    """Bifurcations of slices as further points on the loci on which they lie."""
    knots: dict[str, list[Point]] = {}
    for one in slices:
        second = one.settings.setting[settings.second]
        for event in (e for b in one.branches for e in b.events):
            label = label_at(places, event.kind, event.special.solution, settings)
            if label:
                knots.setdefault(label, []).append((second, event.value))
    return knots


@dataclass(frozen=True, eq=False)
class Place:
    """A locus with its response: points (m, 3), the second control in units of its scale, and computed solutions."""

    label: str
    fold: bool
    points: np.ndarray
    solutions: tuple[Solution, ...]


def places_of(pieces: Sequence[Piece], settings: PlaneSettings) -> list[Place]:
    """Where the loci are, with the response, by which those that cross in the plane differ."""
    from scipy.interpolate import CubicSpline

    found = []
    for label, piece in zip(labels(pieces, settings), pieces, strict=True):
        points = piece.places / [settings.second_scale, 1.0, 1.0]
        if not label or len(points) < 2:
            continue
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        share = np.linspace(0.0, 1.0, 4 * FINE, endpoint=False)
        at = np.append((length[:-1, None] + np.diff(length)[:, None] * share).ravel(), length[-1])
        dense = CubicSpline(length, points)(at) if len(points) > 2 else points
        found.append(Place(label, piece.kind == "fold", dense, piece.points))
    return found


def label_at(places: Sequence[Place], kind: str, solution: Solution, settings: PlaneSettings) -> str:
    """Label of the locus on which a bifurcation of a slice lies, '' when it lies on none."""
    target = np.array(settings.point(solution)) / [settings.second_scale, 1.0, 1.0]
    best, found = ON_LOCUS * settings.units[1], ""
    like = [p for p in places if p.fold == (kind == "fold")]
    for place in like:
        distance = _distance(target, place.points)
        if distance < best:
            best, found = distance, place.label
    if found:
        return found
    chords = ((p.label, pair) for p in like for pair in pairwise(p.solutions))
    return next((label for label, (one, two) in chords if on_chord(one, two, solution, settings)), "")


def _distance(target: np.ndarray, points: np.ndarray) -> float:
    """Distance of a point from a polyline."""
    start, step = points[:-1], np.diff(points, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", step, step), 1e-300)
    share = np.clip(np.einsum("ij,ij->i", target - start, step) / square, 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * step - target, axis=1).min())


def spline(points: np.ndarray, scale: float) -> np.ndarray:
    """A cubic spline (m, 2) along points (n, 2) whose first coordinate increases; it passes through them exactly.

    Parameters
    ----------
    scale : of the first coordinate, for lengths.
    """
    from scipy.interpolate import CubicSpline

    if len(points) < 3:
        return points
    scaled = points / [scale, 1.0]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(scaled, axis=0), axis=1))])
    share = np.linspace(0.0, 1.0, FINE, endpoint=False)
    at = np.append((length[:-1, None] + np.diff(length)[:, None] * share).ravel(), length[-1])
    fine = CubicSpline(length, points)(at)
    fine[::FINE] = points
    low = np.repeat(points[:-1, 0], FINE)
    high = np.repeat(points[1:, 0], FINE)
    fine[:-1, 0] = np.clip(fine[:-1, 0], low, high)
    return fine


def past_frame(points: np.ndarray, settings: PhaseSettings) -> np.ndarray:
    """The line, drawn a little further where it ends on the border of the plane, so that it crosses it."""
    import shapely

    scale = np.array([settings.second_scale, 1.0])
    border = shapely.LineString(settings.region / scale)
    beyond = BEYOND * settings.units[1]
    out = [points]
    for end, inner, first in ((points[0], points[1], True), (points[-1], points[-2], False)):
        if border.distance(shapely.Point(end / scale)) > 0.1 * beyond:
            continue
        along = (end - inner) / scale
        size = float(np.linalg.norm(along))
        further = end + beyond * along / size * scale if size > 0 else end
        out = [further[None], *out] if first else [*out, further[None]]
    return np.concatenate(out)


def _joined(computed: Sequence[Point], exact: Sequence[Point], settings: PlaneSettings) -> np.ndarray:
    """Points in order of the second control; of computed and exact ones at nearly one place the exact one is kept."""
    distinct: list[Point] = []
    second, value, _ = settings.units
    for p in [*exact, *computed]:
        if all(abs(p[0] - q[0]) > SAME * second or abs(p[1] - q[1]) > SAME * value for q in distinct):
            distinct.append(p)
    return np.array(sorted(distinct))
