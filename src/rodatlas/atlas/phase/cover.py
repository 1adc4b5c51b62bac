"""Angles at which slices pass through every face of the plane and across every line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rodatlas.atlas.phase.arrangement import Frame, Rings, chords, extent
from rodatlas.atlas.phase.lines import Line

THIN = 1e-4  # shear: a face that is nowhere wider is not sampled, since loci are known to 1e-5 between slices
WIDE = 12.0  # degrees: a longer face is passed at least twice, these far apart where it can be
SHARE = 0.3  # of the largest width of a face that a slice through it must meet
EDGE = 0.03  # share of a line's range of angle that is too near its ends
PARTS = (0.5, 0.25, 0.75, 0.1, 0.9, 0.03, 0.97)


def choose_angles(
    faces: Sequence[Rings], lines: Sequence[Line], frame: Frame, given: Sequence[float] = ()
) -> tuple[list[float], list[int]]:
    """A small set of angles (degrees) that cross every line and every face where it is wide; a greedy cover.

    Parameters
    ----------
    lines : of which every one is to be crossed; further ones may have cut the faces.
    given : angles at which slices are there in any case.

    Returns
    -------
    angles beyond the given ones, in order, and the positions of faces that are too thin.
    """
    ranges = [(max(x.points[0, 0], frame[0]), min(x.points[-1, 0], frame[1])) for x in lines]
    ranges = [(low, high) for low, high in ranges if low < high]
    if not faces and not ranges:
        return [], []
    candidates = _candidates([*map(extent, faces), *ranges], frame)
    angles = np.unique(np.concatenate([np.asarray(given, dtype=float), candidates]))
    width = np.array([[max((b - a for a, b in chords(f, x)), default=0.0) for x in angles] for f in faces])
    widest = width.max(axis=1, initial=0.0)
    thin = [i for i, w in enumerate(widest) if w < THIN]
    meets = width >= np.maximum(SHARE * widest, THIN)[:, None]
    needs = np.array([0 if i in thin else 1 + (np.ptp(extent(f)) > WIDE) for i, f in enumerate(faces)])
    crossed = [(low + EDGE * (high - low) <= angles) & (angles <= high - EDGE * (high - low)) for low, high in ranges]
    meets = np.vstack([meets, *crossed]) if crossed else meets
    needs = np.append(needs, np.ones(len(crossed), dtype=int))
    taken: list[int] = []
    for x in given:
        _take(int(np.argmin(np.abs(angles - x))), meets, needs, taken, angles)
    chosen: list[int] = []
    while needs.any():
        gain = np.array([_gain(k, meets, needs, taken, angles) for k in range(len(angles))])
        if gain.max() == 0:
            break
        best = np.flatnonzero(gain == gain.max())
        k = int(best[np.argmin([_roughness(angles[i]) for i in best])])
        _take(k, meets, needs, taken, angles)
        chosen.append(k)
    return [float(angles[k]) for k in sorted(chosen)], thin


def nearly(value: float, slack: float) -> float:
    """The number with the fewest digits near a value."""
    for digits in range(7):
        if abs(round(value, digits) - value) <= slack:
            return round(value, digits)
    return value


def _candidates(ranges: Iterable[tuple[float, float]], frame: Frame) -> np.ndarray:
    """Angles inside some ranges, the roundest near each place."""
    found = []
    for low, high in ranges:
        found += [nearly(low + part * (high - low), 0.05 * (high - low)) for part in PARTS]
    inside = [x for x in found if frame[0] < x < frame[1]]
    return np.unique(np.round(inside, 9))


def _roughness(value: float) -> int:
    """How many digits a number has after the point."""
    return next((digits for digits in range(7) if abs(round(value, digits) - value) < 1e-9), 7)


def _useful(k: int, meets: np.ndarray, needs: np.ndarray, taken: Sequence[int], angles: np.ndarray) -> np.ndarray:
    """Which faces an angle would serve: those never met, or met once but far away."""
    near = np.zeros(len(needs), dtype=bool)
    for other in taken:
        if abs(angles[other] - angles[k]) < 0.5 * WIDE:
            near |= meets[:, other]
    return meets[:, k] & (needs > 0) & ~near


def _gain(k: int, meets: np.ndarray, needs: np.ndarray, taken: Sequence[int], angles: np.ndarray) -> int:
    return int(_useful(k, meets, needs, taken, angles).sum())


def _take(k: int, meets: np.ndarray, needs: np.ndarray, taken: list[int], angles: np.ndarray) -> None:
    needs[_useful(k, meets, needs, taken, angles)] -= 1
    taken.append(k)
