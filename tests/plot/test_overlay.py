"""Measured ranges drawn on a slice: where they lie, and that the axis tells the unit."""

import numpy as np
import pytest

from rodatlas.atlas.experiments.comparison import compare
from rodatlas.atlas.experiments.measured import Measurement
from rodatlas.paper.names.yu_hanna import COLORS
from rodatlas.plot.look.style import color_of
from rodatlas.plot.slices.overlay import draw_overlay
from rodatlas.rods import limiting_shear

ROWS = (
    Measurement("U", "U", 0.0, 0.32, error=0.01, label="A"),
    Measurement("w", "w", 0.45, 0.60, label="A"),
    Measurement("WS", "WS+-", 0.40, 0.45, error=0.02, label="B"),
    Measurement("wi", None, 0.5, 0.56, label="B"),
)


def lines(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


@pytest.fixture(scope="module")
def figure(slice_15):
    return draw_overlay(slice_15, compare(slice_15, ROWS))


def test_ranges_have_their_shears_and_the_color_of_their_state(figure, slice_15):
    top, low = figure.axes[:2]
    drawn = {line.get_color(): line.get_xydata() for line in lines(top, "measured")}
    assert set(drawn) == {color_of(name, COLORS) for name in ("U", "w", "WS+-")}
    for row, name in zip(ROWS, ("U", "w", "WS+-"), strict=False):
        x = drawn[color_of(name, COLORS)][:, 0]
        assert (x.min(), x.max()) == pytest.approx((row.low, row.high), abs=1e-9)
        assert (np.diff(x) >= 0).all()
    assert len(lines(low, "measured bar")) == len(ROWS)
    assert len(lines(low, "computed")) == len(slice_15.states)
    assert [t.get_text() for t in low.get_yticklabels()][-1] == "wi"


def test_ranges_lie_just_below_their_curves(figure, slice_15):
    top = figure.axes[0]
    u = next(line for line in lines(top, "measured") if line.get_color() == color_of("U", COLORS)).get_xydata()
    heights = {s["dD"]: s["height"] for s in slice_15.state("U", 0.1).solutions}
    curve = np.interp(u[:, 0], sorted(heights), [heights[x] for x in sorted(heights)])
    assert (u[:, 1] < curve).all()
    assert (u[:, 1] > curve - 0.02).all()


def test_whiskers_are_the_errors(figure):
    top = figure.axes[0]
    spans = sorted(float(np.ptp(line.get_xdata())) for line in lines(top, "error"))
    assert spans == pytest.approx([0.02, 0.02, 0.04, 0.04])  # of U and WS; w has none
    symbols = {line.get_marker() for line in lines(top, "measured end")}
    assert len(symbols) == 2
    assert "o" not in symbols  # disks are folds and branch points
    (legend,) = [ax.get_legend() for ax in figure.axes[1:2]]
    assert [t.get_text() for t in legend.get_texts()] == ["computed", "A", "B"]


def test_the_axis_of_normalized_ranges(slice_15):
    limit = limiting_shear(0.5)
    fig = draw_overlay(slice_15, compare(slice_15, [Measurement("U", "U", 0.0, 0.5, "limit", aspect=1 / 8)]))
    low = fig.axes[1]
    assert "limiting shear" in low.get_xlabel()
    ticks = {t.get_text(): t.get_position()[0] for t in low.get_xticklabels()}
    assert ticks["0.4"] == pytest.approx(0.4 * limit)
    (bar,) = lines(low, "measured bar")
    assert bar.get_xdata()[1] == pytest.approx(0.5 * limit)
