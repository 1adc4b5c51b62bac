"""Values of the second control at which slices pass through every face of the plane and across every line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rodatlas.atlas.phase.arrangement import Frame, Rings, chords, extent
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.settings import PhaseSettings

THIN = 1e-4  # units: a face that is nowhere wider is not sampled, since loci are known to 1e-5 between slices
WIDE = 0.15  # of the range of loci: a longer face is passed at least twice, these far apart where it can be
SHARE = 0.3  # of the largest width of a face that a slice through it must meet
EDGE = 0.03  # share of the range of a line that is too near its ends
PARTS = (0.5, 0.25, 0.75, 0.1, 0.9, 0.03, 0.97)


def choose_values(
    faces: Sequence[Rings], lines: Sequence[Line], settings: PhaseSettings, given: Sequence[float] = ()
) -> tuple[list[float], list[int]]:
    """A small set of values that cross every line and every face where it is wide; a greedy cover.

    Parameters
    ----------
    lines : of which every one is to be crossed; further ones may have cut the faces.
    given : values at which slices are there in any case.

    Returns
    -------
    values beyond the given ones, in order, and the positions of faces that are too thin.
    """
    frame, thin_width = settings.frame, THIN * settings.units[1]
    wide = WIDE * (settings.loci.second_high - settings.loci.second_low)
    ranges = [(max(x.points[0, 0], frame[0]), min(x.points[-1, 0], frame[1])) for x in lines]
    ranges = [(low, high) for low, high in ranges if low < high]
    if not faces and not ranges:
        return [], []
    candidates = _candidates([*map(extent, faces), *ranges], frame)
    values = np.unique(np.concatenate([np.asarray(given, dtype=float), candidates]))
    width = np.array([[max((b - a for a, b in chords(f, x)), default=0.0) for x in values] for f in faces])
    widest = width.max(axis=1, initial=0.0)
    thin = [i for i, w in enumerate(widest) if w < thin_width]
    meets = width >= np.maximum(SHARE * widest, thin_width)[:, None]
    needs = np.array([0 if i in thin else 1 + (np.ptp(extent(f)) > wide) for i, f in enumerate(faces)])
    crossed = [(low + EDGE * (high - low) <= values) & (values <= high - EDGE * (high - low)) for low, high in ranges]
    meets = np.vstack([meets, *crossed]) if crossed else meets
    needs = np.append(needs, np.ones(len(crossed), dtype=int))
    taken: list[int] = []
    for x in given:
        _take(int(np.argmin(np.abs(values - x))), meets, needs, taken, values, wide)
    chosen: list[int] = []
    while needs.any():
        gain = np.array([_gain(k, meets, needs, taken, values, wide) for k in range(len(values))])
        if gain.max() == 0:
            break
        best = np.flatnonzero(gain == gain.max())
        k = int(best[np.argmin([_roughness(values[i]) for i in best])])
        _take(k, meets, needs, taken, values, wide)
        chosen.append(k)
    return [float(values[k]) for k in sorted(chosen)], thin


def nearly(value: float, slack: float) -> float:
    """The number with the fewest digits near a value."""
    for digits in range(7):
        if abs(round(value, digits) - value) <= slack:
            return round(value, digits)
    return value


def _candidates(ranges: Iterable[tuple[float, float]], frame: Frame) -> np.ndarray:
    """Values inside some ranges, the roundest near each place."""
    found = []
    for low, high in ranges:
        found += [nearly(low + part * (high - low), 0.05 * (high - low)) for part in PARTS]
    inside = [x for x in found if frame[0] < x < frame[1]]
    return np.unique(np.round(inside, 9))


def _roughness(value: float) -> int:
    """How many digits a number has after the point."""
    return next((digits for digits in range(7) if abs(round(value, digits) - value) < 1e-9), 7)


def _useful(
    k: int, meets: np.ndarray, needs: np.ndarray, taken: Sequence[int], values: np.ndarray, wide: float
) -> np.ndarray:
    """Which faces a value would serve: those never met, or met once but far away."""
    near = np.zeros(len(needs), dtype=bool)
    for other in taken:
        if abs(values[other] - values[k]) < 0.5 * wide:
            near |= meets[:, other]
    return meets[:, k] & (needs > 0) & ~near


def _gain(k: int, meets: np.ndarray, needs: np.ndarray, taken: Sequence[int], values: np.ndarray, wide: float) -> int:
    return int(_useful(k, meets, needs, taken, values, wide).sum())


def _take(k: int, meets: np.ndarray, needs: np.ndarray, taken: list[int], values: np.ndarray, wide: float) -> None:
    needs[_useful(k, meets, needs, taken, values, wide)] -= 1
    taken.append(k)
