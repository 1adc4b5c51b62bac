"""Figures 9 and 14: windows of slices followed with small steps, at angles around special points of the loci."""

import numpy as np
import pytest

from rodatlas.atlas.slices.close_up import close_up
from rodatlas.paper.close_ups import angles_around, numbered, window_of
from rodatlas.paper.phase import meeting, numbers_of
from rodatlas.plot.slices.close_ups import Panel, draw_close_ups
from rodatlas.plot.slices.curves import slice_stretches

WINDOW = ((0.49, 0.54), (0.14, 0.17))  # around fold 7 and pitchfork 9 at 15 degrees


@pytest.fixture(scope="module")
def closer(slice_15):
    return close_up(slice_15, WINDOW)


def events(slice_):
    """Numbered events, of each the one on a symmetric branch."""
    return {e.number: e for b in slice_.branches if b.followed.symmetric for e in b.events if e.number is not None}


def test_a_window_has_the_bifurcations_and_states_of_the_slice(closer, slice_15):
    assert closer.warnings == ()
    found, known = events(closer), events(slice_15)
    assert set(found) == {7, 9}
    for number, event in found.items():
        assert event.kind == known[number].kind
        assert event.value == pytest.approx(known[number].value, abs=1e-8)
        assert event.special.index in (known[number].special.index, known[number].special.index[::-1])
    (w,) = closer.states
    assert w.name == "w"
    assert w.low.value == pytest.approx(known[7].value, abs=1e-8)


def test_branches_end_at_the_border_and_none_is_there_twice(closer, slice_15):
    (low, high), (bottom, top) = WINDOW
    for b in closer.branches:
        shear, height = (b.followed.branch.column(name) for name in ("dD", "height"))
        assert low - 1e-9 <= shear.min() < shear.max() <= high + 1e-9
        assert bottom - 1e-9 <= height.min() < height.max() <= top + 1e-9
    # at one shear, as many states of the window as the slice has
    shear = 0.52
    crossing = []
    for slice_ in (closer, slice_15):
        heights = []
        for stretch in slice_stretches(slice_):
            x, y = stretch.xy.T
            at = np.flatnonzero((x[:-1] - shear) * (x[1:] - shear) < 0)
            heights += [y[i] + (y[i + 1] - y[i]) * (shear - x[i]) / (x[i + 1] - x[i]) for i in at]
        crossing.append(sorted(h for h in heights if bottom < h < top))
    assert len(crossing[0]) == len(crossing[1]) == 4
    assert crossing[0] == pytest.approx(crossing[1], abs=5e-5)


def test_a_window_must_be_one(slice_15):
    with pytest.raises(ValueError, match=r"^window: expected least and largest value and response"):
        close_up(slice_15, ((0.5, 0.5), (0.1, 0.2)))


def test_numbers_come_from_the_loci_where_the_slice_has_none(closer, loci):
    from dataclasses import replace

    bare = [replace(b, events=tuple(replace(e, number=None) for e in b.events)) for b in closer.branches]
    again = numbered(replace(closer, branches=tuple(bare)), loci)
    assert {n: e.value for n, e in events(again).items()} == {n: e.value for n, e in events(closer).items()}


def test_angles_are_before_between_and_after():
    assert angles_around([27.7, 27.8, 28.2]) == [27.45, 27.75, 28.0, 28.45]
    assert angles_around([10.0, 11.0], 0.5) == [9.5, 10.5, 11.5]
    with pytest.raises(ValueError, match=r"^events: expected at least two angles, increasing"):
        angles_around([28.0, 27.0])


def test_the_events_of_both_transitions_are_in_the_order_of_the_paper(loci):
    """w meets U, 18 and 7 vanish in a cusp, then 4 and 9; 14 passes 10 before 8 and 10 vanish."""
    touch, cusp, joined = ("extremum", "13", "18"), ("cusp", "7", "18"), ("extremum", "4", "9")
    near_28 = [meeting(loci, *m).second for m in (touch, cusp, joined)]
    passes, turns, gone = ("coalescence", "10", "14"), ("criticality", "10"), ("extremum", "8", "10")
    near_44 = [meeting(loci, *m).second for m in (passes, turns, gone)]
    assert 27.5 < near_28[0] < near_28[1] < near_28[2] < 28.2
    assert near_28[0] == pytest.approx(27.71, abs=0.01)
    assert 44.1 < near_44[0] < near_44[1] < near_44[2] < 44.3
    with pytest.raises(ValueError, match=r"^loci: expected a point of kind 'cusp' where 3 and 4 meet"):
        meeting(loci, "cusp", "3", "4")


def test_the_window_holds_the_bifurcations(loci):
    (low, high), (bottom, top) = window_of(loci, (4, 9), (27.0, 28.0))
    for number in (4, 9):
        for angle in (27.0, 28.0):
            shear, height = loci.numbered(number).at(angle)
            assert low < shear < high
            assert bottom < height < top


def test_known_angles_of_the_loci_agree(loci):
    known = {n.quantity: n for n in numbers_of(loci) if n.known is not None}
    assert len(known) == 5
    assert all(n.agrees for n in known.values()), known


def test_panels_show_names_and_numbers(closer):
    fig = draw_close_ups([Panel(closer, *WINDOW)] * 3, "angle")
    assert len(fig.axes) == 3
    for ax in fig.axes:
        written = [t.get_text() for t in ax.texts]
        assert {"7", "9", "w"} <= set(written)
        assert ax.get_xlim() == WINDOW[0]
        assert ax.get_ylim() == WINDOW[1]
    with pytest.raises(ValueError, match=r"^panels: expected"):
        draw_close_ups([], "angle")
