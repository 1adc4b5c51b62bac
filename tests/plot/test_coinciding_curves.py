"""Stable states whose curves coincide in a diagram: both colors are seen, and a panel tells the heights apart."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rodatlas.atlas import coexisting_states
from rodatlas.paper.names.yu_hanna import COLORS
from rodatlas.plot import color_of, draw_profiles, draw_slice, draw_slice_figure
from rodatlas.plot.look.style import STABLE_WIDTH, new_figure
from rodatlas.plot.slices.curves import Stretch
from rodatlas.plot.slices.overlaps import NEAR, RUN, draw_overlaps, overlaps_of
from rodatlas.plot.slices.panel import whole_states


def lines(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def axes():
    """Axes on which 0.01 is one point in both directions."""
    ax = new_figure(2.0, 2.0).add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_xlim(0.0, 1.44)
    ax.set_ylim(-0.72, 0.72)
    return ax


def curve(name, height, left=0.0, right=1.44, *, stable=True):
    x = np.linspace(left, right, 50)
    xy = np.column_stack([x, np.broadcast_to(height(x), x.shape)])
    return Stretch(xy, stable, name, name or "", color=color_of(name, COLORS))


def test_runs_of_two_states_are_found_and_crossings_are_not():
    ax = axes()
    flat = curve("U", lambda x: 0 * x)
    near = curve("TU+-", lambda x: 0 * x + 0.005, 0.2, 0.8)
    (found,) = overlaps_of([flat, near], ax)
    assert (found.hidden.name, found.top.name) == ("U", "TU+-")
    assert (found.xy[0, 0], found.xy[-1, 0]) == pytest.approx((0.2, 0.8), abs=0.01 * (NEAR + 0.5))
    assert overlaps_of([flat, curve("TU+-", lambda x: 2.0 * (x - 0.7))], ax) == []  # a crossing
    assert overlaps_of([flat, curve("TU+-", lambda x: 0 * x + 0.012 * NEAR)], ax) == []  # apart
    assert overlaps_of([flat, curve("TU+-", lambda x: 0 * x, 0.2, 0.2 + 0.01 * (RUN - 2 * NEAR - 1))], ax) == []
    assert len(overlaps_of([flat, curve("U", lambda x: 0 * x + 0.005)], ax)) == 1  # two states of one name
    assert overlaps_of([flat, curve(None, lambda x: 0 * x, stable=False)], ax) == []


def test_what_lies_outside_the_axes_is_not_told():
    ax = axes()
    ax.set_xlim(1.0, 1.44)
    assert overlaps_of([curve("U", lambda x: 0 * x), curve("TU+-", lambda x: 0 * x, 0.0, 0.9)], ax) == []


def test_a_state_that_touches_itself_on_part_of_its_range_is_one_run():
    ax = axes()
    parts = [curve("W", lambda x: 0 * x, *ends) for ends in ((0.0, 0.6), (0.6, 0.8), (0.8, 1.44))]
    parts[1] = replace(parts[1], touching=True)
    (found,) = overlaps_of(whole_states([*parts, curve("W", lambda x: 0 * x + 0.005)]), ax)
    assert np.ptp(found.xy[:, 0]) == pytest.approx(1.44, abs=0.02)


@pytest.mark.parametrize("count", [2, 3])
def test_all_colors_are_seen_along_curves_that_coincide(count):
    ax = axes()
    stretches = [curve(name, lambda x: 0 * x) for name in ("U", "TU+-", "w")[:count]]
    overlaps = overlaps_of(stretches, ax)
    for stretch in stretches:
        ax.plot(*stretch.xy.T, color=color_of(stretch.name, COLORS), lw=STABLE_WIDTH, zorder=3)
        draw_overlaps([o for o in overlaps if o.top is stretch], ax)
    ax.figure.canvas.draw()
    row = np.asarray(ax.figure.canvas.buffer_rgba())[round(ax.bbox.height / 2), :, :3]
    for stretch in stretches:
        color = 255 * np.array([int(color_of(stretch.name, COLORS)[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        share = (np.abs(row - color).max(axis=1) < 3).mean()
        assert share == pytest.approx(1 / count, abs=0.12)


def test_planar_states_have_no_twist_and_both_are_seen_in_the_profiles(slice_15):
    states = coexisting_states(slice_15, 0.0)
    figure = draw_profiles({name: states[name] for name in ("U", "W")})
    counts = [len([x for x in ax.lines if x.is_dashed()]) for ax in figure.axes]
    assert counts[1] == 1  # twist
    (dashes,) = [x for x in figure.axes[1].lines if x.is_dashed()]
    assert dashes.get_color() == color_of("U", COLORS)
    assert np.ptp(dashes.get_xdata()) == pytest.approx(1.0, abs=0.01)


@pytest.fixture(scope="module")
def diagrams(slice_15):
    return draw_slice(slice_15), draw_slice_figure(slice_15).axes[0]


def test_u_and_tu_are_told_apart_at_15_degrees(diagrams, slice_15):
    for ax in diagrams:
        assert {line.get_color() for line in lines(ax, "alternating")} == {color_of("U", COLORS)}
        (panel,) = ax.child_axes
        assert {"U", "TU±"} <= {t.get_text() for t in panel.texts}
        (low, high), (bottom, top) = panel.get_xlim(), panel.get_ylim()
        assert low < 0.0 < high
        heights = {name: slice_15.state(name, 0.0).solutions for name in ("U", "TU+-")}
        at_zero = [min(s, key=lambda x: abs(x["dD"]))["height"] for s in heights.values()]
        assert all(bottom < h < top for h in at_zero)
        apart = np.diff(panel.transData.transform([(0.0, h) for h in at_zero])[:, 1])[0] * 72.0 / ax.figure.dpi
        assert abs(apart) > 1.5 * STABLE_WIDTH


def test_a_panel_covers_no_curve_and_no_label(diagrams):
    for ax in diagrams:
        (panel,) = ax.child_axes
        renderer = ax.figure.canvas.get_renderer()
        box = panel.get_tightbbox(renderer)
        for line in itertools.chain(*(lines(ax, gid) for gid in ("stable", "unstable", "leader"))):
            assert not any(box.contains(*p) for p in ax.transData.transform(line.get_xydata()))
        for text in (t for t in ax.texts if t.get_text()):
            assert not box.overlaps(text.get_window_extent(renderer))
        assert box.x0 > ax.bbox.x0
        assert box.x1 < ax.bbox.x1
