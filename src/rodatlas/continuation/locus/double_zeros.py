"""Two zeros of a test function on one step of a locus: no change of sign tells of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodatlas.continuation.locus.events import ROUND_OFF, smooth_tests
from rodatlas.continuation.locus.point import LocusFrame
from rodatlas.continuation.locus.segment import Stretch, Test

SUSPICIOUS = 0.5  # share of the lowest known value; where the parabola falls below it, a point is computed
APART = 0.01  # fraction of a step that a new point keeps from the known ones
ROUNDS = 6
Place = tuple[float, float]  # fraction of the step, value


def cut_between(stretch: Stretch) -> Stretch:
    """The stretch, cut where a test function has another sign than at both of its ends, if one has.

    What is left, and the step that follows, have one zero each. (Turns of the parameters are found otherwise, from
    their slopes at both ends; see :func:`rodatlas.continuation.locus.events.crowded`.)
    """
    for test in smooth_tests(stretch):
        found = _between(stretch, test)
        if found is not None:
            stretch = replace(stretch, right=found[1], step=found[0] * stretch.step)
    return stretch


def _between(stretch: Stretch, test: Test) -> tuple[float, LocusFrame] | None:
    """Fraction and frame of a point at which a test function differs in sign from both ends; None without one."""
    left, before = stretch.left, stretch.left.behind
    if before is None:
        return None
    sign, at = np.sign(test(left)), -left.distance / stretch.step
    known = {at: sign * test(before), 0.0: sign * test(left), 1.0: sign * test(stretch.right)}
    if not min(known.values()) > 0 or max(known[0.0], known[1.0]) < ROUND_OFF:
        return None
    place, near = _first_place(*known.items()), None
    for count in range(ROUNDS):
        if place is None:
            return None
        frame = stretch.corrected(place, near)
        if frame is None:
            return None
        known[place] = sign * test(frame)
        if known[place] < 0:
            return place, frame
        near = place, frame
        place = _next_place(sorted(known.items()), sharp=count % 2 == 0)
    return None


def _first_place(before: Place, left: Place, right: Place) -> float | None:
    """Where to look on 0 < t < 1, from values at t < 0, 0 and 1; None when there is no reason to.

    The parabola through them may have a low minimum there, or the line through the first two a zero: of two modes of a
    matrix that become singular in turn the smaller singular value is known, whose graph has a corner.
    """
    place = _minimum([before, left, right])
    slope = (before[1] - left[1]) / -before[0]
    if place is None and slope > left[1]:
        place = (1 + (left[1] - right[1]) / slope) / 2
    return place if place is not None and APART < place < 1 - APART else None


def _next_place(known: list[Place], sharp: bool) -> float | None:
    """Where the curve through the lowest value and its neighbors has a low minimum, `sharp` or smooth; else None."""
    lowest = min(range(len(known)), key=lambda i: known[i][1])
    corners = [_corner(known[i : i + 4]) for i in (lowest - 2, lowest - 1) if 0 <= i <= len(known) - 4]
    corner = next((t for t in corners if t is not None), None)
    i = min(max(lowest - 1, 0), len(known) - 3)
    smooth = _minimum(known[i : i + 3])
    for place in (corner, smooth) if sharp else (smooth, corner):
        if place is not None and min(abs(place - t) for t, _ in known) > 1e-4:
            return place
    return None


def _minimum(known: list[Place]) -> float | None:
    """Minimum on 0 < t < 1 of the parabola through three points, when it is low."""
    (t0, v0), (t1, v1), (t2, v2) = known
    falling, rising = (v1 - v0) / (t1 - t0), (v2 - v1) / (t2 - t1)
    bend = (rising - falling) / (t2 - t0)  # v = v1 + slope (t - t1) + bend (t - t1)^2
    if bend <= 0:
        return None
    slope = falling + bend * (t1 - t0)
    place, depth = t1 - slope / (2 * bend), v1 - slope**2 / (4 * bend)
    return place if 0.0 < place < 1.0 and depth < SUSPICIOUS * min(v0, v1, v2) else None


def _corner(known: list[Place]) -> float | None:
    """Where the lines through the first two and the last two of four points meet between them, when that is low."""
    (t0, v0), (t1, v1), (t2, v2), (t3, v3) = known
    falling, rising = (v0 - v1) / (t1 - t0), (v3 - v2) / (t3 - t2)
    if not (falling > 0 and rising > 0):
        return None
    place = (v1 - v2 + falling * t1 + rising * t2) / (falling + rising)
    low = v1 - falling * (place - t1) < SUSPICIOUS * min(v1, v2)
    return float(place) if low and max(t1, 0.0) < place < t2 else None
