"""Curves of a diagram: they meet every computed point, and change style exactly where stability changes."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rodatlas.plot.look.placement import uncovered
from rodatlas.plot.slices.curves import branch_stretches, slice_stretches, unique_events


def distances(points, stretches):
    """Distance of each point to the nearest sample of the curves."""
    samples = np.concatenate([s.xy for s in stretches])
    return np.array([np.hypot(*(samples - p).T).min() for p in points])


def test_curves_pass_through_all_points_and_special_points(slice_15):
    for b in slice_15.branches:
        stretches = branch_stretches(b, slice_15.states, slice_15.settings)
        computed = [p.solution for p in b.followed.branch.points] + [e.special.solution for e in b.events]
        places = np.array([(s["dD"], s["height"]) for s in computed])
        assert distances(places, stretches).max() < 1e-12


def test_stretches_of_a_branch_are_connected(slice_15):
    for b in slice_15.branches:
        stretches = branch_stretches(b, slice_15.states, slice_15.settings)
        for one, two in pairwise(stretches):
            assert np.array_equal(one.xy[-1], two.xy[0])
            assert (one.stable, one.name) != (two.stable, two.name)


def test_style_changes_exactly_at_index_changes(slice_15):
    for b in slice_15.branches:
        stretches = branch_stretches(b, slice_15.states, slice_15.settings)
        cuts = [s.xy[0] for s in stretches[1:]]
        expected = [
            (e.special.solution["dD"], e.special.solution["height"])
            for e in b.events if (e.special.index[0] == 0) != (e.special.index[1] == 0)
        ]  # fmt: skip
        assert np.array_equal(np.array(cuts).reshape(-1, 2), np.array(expected).reshape(-1, 2))


def test_stable_stretches_are_named_and_unstable_ones_are_not(slice_15):
    stretches = slice_stretches(slice_15)
    assert {s.name for s in stretches if s.stable} == {x.name for x in slice_15.states}
    assert all((s.name is not None) == s.stable for s in stretches)


def test_interpolation_is_near_the_dense_curve(slice_15):
    """Dropping every second point of U and interpolating meets the dropped points to 1e-4 of the diagram's extent."""
    b = next(b for b in slice_15.branches if b.id == "U")
    branch = b.followed.branch
    thin = replace(b, followed=replace(b.followed, branch=replace(branch, points=branch.points[::2])))
    dropped = np.array([(p.solution["dD"], p.solution["height"]) for p in branch.points[1::2]])[:12]
    samples = np.concatenate([s.xy for s in branch_stretches(thin, (), slice_15.settings)])
    samples = samples[np.append(True, np.diff(samples, axis=0).any(axis=1))]  # ends of neighbors coincide
    one, two = samples[:-1], samples[1:]
    for place in dropped:
        t = np.clip(np.einsum("ij,ij->i", place - one, two - one) / np.sum((two - one) ** 2, axis=1), 0, 1)
        assert np.hypot(*(one + t[:, None] * (two - one) - place).T).min() < 1e-4


def test_side_branch_leaves_the_pitchfork_smoothly(slice_15):
    """Shear and height are even functions of the distance from the pitchfork, so the curve starts straight."""
    b = next(b for b in slice_15.branches if b.id == "U.1")
    xy = branch_stretches(b, slice_15.states, slice_15.settings)[0].xy[:13]
    direction = np.diff(xy, axis=0)
    angles = np.arctan2(direction[:, 1], direction[:, 0])
    assert np.ptp(angles) < 1e-2


def test_each_event_is_marked_once(slice_15):
    events = unique_events(slice_15)
    places = [(e.kind == "fold", *(round(x, 6) for x in e.place))
              for e in events]  # fmt: skip
    assert len(set(places)) == len(events)
    assert {e.number for e in events if e.number} == {e.number for b in slice_15.branches for e in b.events if e.number}


def test_index_change_without_event_cuts_half_way(slice_15):
    b = next(b for b in slice_15.branches if b.id == "U")
    bare = replace(b, events=())
    stretches = branch_stretches(bare, (), slice_15.settings)
    assert [s.stable for s in stretches] == [True, False, True]
    first, second = (e.special.solution["dD"] for e in b.events)
    assert stretches[0].xy[-1, 0] == pytest.approx(first, abs=0.04)
    assert stretches[1].xy[-1, 0] == pytest.approx(second, abs=0.04)


def test_uncovered_drops_a_common_run_but_not_a_crossing():
    x = np.linspace(0.0, 100.0, 401)
    line, crossing = np.column_stack([x, 0 * x]), np.column_stack([x, x - 50.0])
    assert len(uncovered(crossing, crossing, line)) == 1
    bent = np.column_stack([x, np.maximum(x - 50.0, 0.0)])
    (piece,) = uncovered(bent, bent, line)
    assert piece[0, 0] == pytest.approx(50.0, abs=1.0)
    assert piece[-1, 0] == 100.0
    assert uncovered(line, line, line) == []
