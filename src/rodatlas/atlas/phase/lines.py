"""Loci as polylines in the plane of angle and shear that share their vertices where they meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rodatlas.atlas.loci.events import PlaneEvent, labels
from rodatlas.atlas.loci.result import Piece
from rodatlas.atlas.slices.result import Slice

FINE = 16  # vertices of a polyline between two computed points
ON_LOCUS = 1e-3  # largest distance (angle, shear, height) of a bifurcation of a slice from its locus
BEYOND = 1e-5  # by how much a line that ends on the frame is drawn past it, in degrees/100 and shear
ANGLE_SCALE = 100.0  # degrees that count as much as a unit of shear

Knots = Mapping[str, Sequence[tuple[float, float]]]
"""Label of a locus -> further points on it, (angle in degrees, shear)."""


@dataclass(frozen=True, eq=False)
class Line:
    """A locus, or a curve along which a state changes its name smoothly.

    Attributes
    ----------
    label : number of the locus, one with a prime for a piece without a number, or 'U|w' for a change of name.
    kind : 'fold', 'pitchfork', 'branch point' or 'smooth'.
    points : (n, 2) angle in degrees and shear, in order of increasing angle.
    """

    label: str
    kind: str
    points: np.ndarray

    @property
    def number(self) -> int | None:
        """The paper's number or None."""
        return int(self.label) if self.label.isdigit() else None

    def __repr__(self) -> str:
        low, high = self.points[0, 0], self.points[-1, 0]
        return f"Line({self.kind} {self.label}: {low:.5g} to {high:.5g} deg, {len(self.points)} vertices)"


def locus_lines(pieces: Sequence[Piece], events: Sequence[PlaneEvent], knots: Knots | None = None) -> list[Line]:
    """The pieces of loci as polylines.

    They pass exactly through the computed points, through special points, at the same coordinates for all loci that
    have one in common, and through the given knots; between, a cubic spline along the curve.
    """
    lines = []
    for label, piece in zip(labels(pieces), pieces, strict=True):
        if not label:
            continue
        special = [(e.angle_deg, e.shear) for e in events if label in e.labels and e.parameter != "shear"]
        computed = [(float(np.degrees(p["psi0"])), float(p["dD"])) for p in piece.points]
        exact = [*special, *(knots or {}).get(label, ())]
        lines.append(Line(label, piece.kind, spline(_joined(computed, exact))))
    return lines


def slice_knots(places: Sequence[Place], slices: Sequence[Slice]) -> dict[str, list[tuple[float, float]]]:
    """Bifurcations of slices as further points on the loci on which they lie."""
    knots: dict[str, list[tuple[float, float]]] = {}
    for one in slices:
        angle = one.settings.angle_deg
        for event in (e for b in one.branches for e in b.events):
            label = label_at(places, angle, event.kind, event.shear, event.height)
            if label:
                knots.setdefault(label, []).append((angle, event.shear))
    return knots


@dataclass(frozen=True, eq=False)
class Place:
    """A locus with its height: points (m, 3) of angle (in units of `ANGLE_SCALE` degrees), shear and height."""

    label: str
    fold: bool
    points: np.ndarray


def places_of(pieces: Sequence[Piece]) -> list[Place]:
    """Where the loci are, with the height, by which those that cross in the plane differ."""
    from scipy.interpolate import CubicSpline

    found = []
    for label, piece in zip(labels(pieces), pieces, strict=True):
        points = np.array([[np.degrees(p["psi0"]) / ANGLE_SCALE, p["dD"], p["height"]] for p in piece.points])
        if not label or len(points) < 2:
            continue
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        share = np.linspace(0.0, 1.0, 4 * FINE, endpoint=False)
        at = np.append((length[:-1, None] + np.diff(length)[:, None] * share).ravel(), length[-1])
        dense = CubicSpline(length, points)(at) if len(points) > 2 else points
        found.append(Place(label, piece.kind == "fold", dense))
    return found


def label_at(places: Sequence[Place], angle: float, kind: str, shear: float, height: float) -> str:
    """Label of the locus on which a bifurcation of a slice lies, '' when it lies on none."""
    target = np.array([angle / ANGLE_SCALE, shear, height])
    best, found = ON_LOCUS, ""
    for place in (p for p in places if p.fold == (kind == "fold")):
        distance = _distance(target, place.points)
        if distance < best:
            best, found = distance, place.label
    return found


def _distance(target: np.ndarray, points: np.ndarray) -> float:
    """Distance of a point from a polyline."""
    start, step = points[:-1], np.diff(points, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", step, step), 1e-300)
    share = np.clip(np.einsum("ij,ij->i", target - start, step) / square, 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * step - target, axis=1).min())


def spline(points: np.ndarray) -> np.ndarray:
    """A cubic spline (m, 2) along points (n, 2) of increasing angle; it passes through them exactly."""
    from scipy.interpolate import CubicSpline

    if len(points) < 3:
        return points
    scaled = points / [ANGLE_SCALE, 1.0]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(scaled, axis=0), axis=1))])
    share = np.linspace(0.0, 1.0, FINE, endpoint=False)
    at = np.append((length[:-1, None] + np.diff(length)[:, None] * share).ravel(), length[-1])
    fine = CubicSpline(length, points)(at)
    fine[::FINE] = points
    low = np.repeat(points[:-1, 0], FINE)
    high = np.repeat(points[1:, 0], FINE)
    fine[:-1, 0] = np.clip(fine[:-1, 0], low, high)
    return fine


def past_frame(points: np.ndarray, frame: tuple[float, float, float, float]) -> np.ndarray:
    """The line, drawn a little further where it ends on the frame, so that it crosses it."""
    low, high = np.array([frame[0], frame[2]]), np.array([frame[1], frame[3]])
    scale = np.array([ANGLE_SCALE, 1.0])
    out = [points]
    for end, inner, first in ((points[0], points[1], True), (points[-1], points[-2], False)):
        if np.min(np.abs(np.concatenate([end - low, high - end]) / np.tile(scale, 2))) > 0.1 * BEYOND:
            continue
        along = (end - inner) / scale
        size = float(np.linalg.norm(along))
        further = end + BEYOND * along / size * scale if size > 0 else end
        out = [further[None], *out] if first else [*out, further[None]]
    return np.concatenate(out)


def _joined(computed: Sequence[tuple[float, float]], exact: Sequence[tuple[float, float]]) -> np.ndarray:
    """Points in order of angle; of computed and exact ones at nearly one place the exact one is kept."""
    kept = [np.array(p) for p in exact]
    distinct: list[np.ndarray] = []
    for p in [*kept, *(np.array(c) for c in computed)]:
        if all(abs(p[0] - q[0]) > 2e-4 or abs(p[1] - q[1]) > 2e-4 for q in distinct):
            distinct.append(p)
    return np.array(sorted(distinct, key=lambda p: (p[0], p[1])))
