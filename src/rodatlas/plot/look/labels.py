"""Numbers on curves: each where other curves and numbers are far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHORT = 22.0  # points: a curve that is seen shorter does not carry its number, but is pointed at
ROOM = 16.0  # points of free space around a number that are enough
LEAD = 20.0  # length of the line from a number to a short curve
ENDS = 1 / 12  # part of a curve near its ends without numbers


def label_lines(
    curves: Sequence[np.ndarray], texts: Sequence[str], colors: Sequence[str], ax: Axes, *, size: float = 8.5,
    keep_clear: Sequence[tuple[float, float]] = (),
) -> None:  # fmt: skip
    """Write a number on each curve of axes whose limits and place are final; curves with '' are only kept clear.

    Parameters
    ----------
    curves : (n, 2) each, in data coordinates; only what is inside the axes counts.
    keep_clear : further places, in data coordinates, that numbers keep away from.
    """
    scale = 72.0 / ax.figure.dpi
    box = np.array(ax.get_window_extent().extents) * scale
    clouds = [_visible(ax.transData.transform(c) * scale, box) for c in curves]
    taken = [ax.transData.transform(p) * scale for p in keep_clear]
    order = sorted((k for k, c in enumerate(clouds) if texts[k] and len(c)), key=lambda k: _length(clouds[k]))
    for k in order:
        others = [c for i, c in enumerate(clouds) if i != k and len(c)]
        obstacles = np.vstack([*others, *[t[None] for t in taken], np.full((1, 2), 1e6)])
        style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": size, "color": colors[k], "zorder": 5}
        style["bbox"] = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.85}
        if _length(clouds[k]) < SHORT:
            at, place = _beside(clouds[k], np.vstack([obstacles, clouds[k]]), box)
            style |= {"arrowprops": {"arrowstyle": "-", "lw": 0.5, "shrinkA": 0.0, "shrinkB": 0.0}}
        else:
            at = place = _along(clouds[k], obstacles, box)
        taken.append(place)
        back = ax.transData.inverted()
        (x0, y0), (x1, y1) = back.transform(at / scale), back.transform(place / scale)
        ax.annotate(texts[k], xy=(x0, y0), xytext=(x1, y1), textcoords="data", **style)


def _visible(points: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Points every 2 points of length along the part of a curve that is inside a box."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] == 0.0:
        return np.empty((0, 2))
    at = np.linspace(0.0, length[-1], max(int(min(length[-1], 4e4) / 2.0), 8))
    dense = np.column_stack([np.interp(at, length, points[:, i]) for i in range(2)])
    return dense[((dense >= box[:2]) & (dense <= box[2:])).all(axis=1)]


def _length(cloud: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(cloud, axis=0))) if len(cloud) else 0.0


def _along(cloud: np.ndarray, obstacles: np.ndarray, box: np.ndarray) -> np.ndarray:
    """The point of a curve that is farthest from all else; near its middle where there is room enough."""
    cut = max(int(len(cloud) * ENDS), 1)
    inner = cloud[cut:-cut] if len(cloud) > 2 * cut else cloud
    gap = np.array([np.min(np.linalg.norm(obstacles - p, axis=1)) for p in inner])
    border = np.minimum(inner - box[:2], box[2:] - inner).min(axis=1)
    middle = np.abs(np.linspace(-1.0, 1.0, len(inner)))
    return inner[int(np.argmax(np.minimum(np.minimum(gap, 1.5 * border), ROOM) - 2.0 * middle))]


def _beside(cloud: np.ndarray, obstacles: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The middle of a short curve, and a free place for its number near by."""
    at = cloud[len(cloud) // 2]
    angles = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    trials = [at + r * LEAD * np.array([np.cos(a), np.sin(a)]) for a in angles for r in (1.0, 1.5)]
    inside = [p for p in trials if ((p > box[:2] + 5.0) & (p < box[2:] - 5.0)).all()] or trials
    gap = [float(np.min(np.linalg.norm(obstacles - p, axis=1))) for p in inside]
    return at, inside[int(np.argmax(np.minimum(gap, ROOM)))]
