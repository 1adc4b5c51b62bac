"""Figures: what is on them, their colors, and the files they become."""

import itertools
import subprocess
import sys
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from rodatlas.atlas.slices.states.coexisting import coexisting_states, richest_value
from rodatlas.paper.names.segments import NAMES
from rodatlas.paper.names.yu_hanna import COLORS
from rodatlas.plot import color_of, draw_profiles, draw_slice, draw_slice_figure, label_of, save_figure
from rodatlas.plot.look.style import INK, new_figure
from rodatlas.plot.slices.arrangement import crosses, isotonic
from rodatlas.plot.slices.curves import unique_events
from rodatlas.rods.symmetry import pair_member

# Machado, Oliveira & Fernandes 2009, severity 1
VISION = {
    "all colors": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
}


@pytest.fixture(scope="module")
def axes(slice_15):
    return draw_slice(slice_15)


@pytest.fixture(scope="module")
def figure(slice_15):
    return draw_slice_figure(slice_15)


def lines(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def lab(hexadecimal, matrix):
    rgb = np.array(mpl.colors.to_rgb(hexadecimal))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    f = np.cbrt(np.maximum(to_xyz @ np.clip(np.asarray(matrix) @ linear, 0, 1) / [0.9505, 1.0, 1.089], 0.008856))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_every_name_has_a_color():
    assert set(NAMES) <= set(COLORS)
    assert color_of("US+", COLORS) == color_of("US-", COLORS) == color_of("US+-", COLORS)
    assert color_of(None, COLORS) == color_of("nothing", COLORS)


@pytest.mark.parametrize("vision", VISION)
def test_colors_are_distinct_for_all_eyes(vision):
    seen = [lab(c, VISION[vision]) for c in COLORS.values()]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 24


def test_labels():
    assert [label_of(n) for n in ("U", "US+-", "US+", "US-")] == ["U", "US±", "US+", "US−"]


def test_markers_one_for_each_special_point(axes, slice_15):
    events = unique_events(slice_15)
    for kind, face in (("fold", "white"), ("branch point", INK)):
        marks = lines(axes, kind)
        assert len(marks) == sum((e.kind == "fold") == (kind == "fold") for e in events)
        assert all(m.get_markerfacecolor() == face for m in marks)


def test_stable_lines_are_solid_and_have_the_color_of_their_state(axes, slice_15):
    stable, unstable = lines(axes, "stable"), lines(axes, "unstable")
    assert all(line.get_linestyle() == "-" for line in stable)
    assert all(line.get_linestyle() == "--" for line in unstable)
    assert min(line.get_linewidth() for line in stable) > max(line.get_linewidth() for line in unstable)
    assert len(stable) == len(slice_15.states)
    assert {line.get_color() for line in stable} == {color_of(s.name, COLORS) for s in slice_15.states}


def test_numbers_and_names_are_written(axes, slice_15):
    written = [t.get_text() for t in axes.texts]
    for event in unique_events(slice_15):
        if event.number:
            assert written.count(str(event.number)) == 1
    for state in slice_15.states:
        assert label_of(state.name) in written
    assert "limiting shear" in written
    assert axes.get_xlabel()
    assert axes.get_ylabel()


def cores(ax):
    """Boxes of the texts without the room for ascenders and descenders, which labels hardly use."""
    renderer = ax.figure.canvas.get_renderer()
    boxes = [mpl.text.Text.get_window_extent(t, renderer) for t in ax.texts if t.get_text()]
    return [mpl.transforms.Bbox.from_extents(b.x0 + 1, b.y0 + 0.25 * b.height, b.x1 - 1, b.y1 - 0.2 * b.height)
            for b in boxes]  # fmt: skip


def test_labels_cover_neither_each_other_nor_stable_curves(axes):
    found = cores(axes)
    assert not any(one.overlaps(two) for one, two in itertools.combinations(found, 2))
    for line in lines(axes, "stable"):
        path = axes.transData.transform(line.get_xydata())
        assert not any(box.contains(*p) for box in found for p in path)


def test_small_type_is_at_least_seven_points(axes, figure):
    for ax in (axes, *figure.axes):
        sizes = [t.get_fontsize() for t in ax.findobj(mpl.text.Text) if t.get_text() and t.get_visible()]
        assert all(size >= 7 for size in sizes)


def test_slice_figure_shows_each_named_state_once(figure, slice_15):
    main = figure.axes[0]
    names = {s.name for s in slice_15.states}
    assert len(lines(main, "leader")) == len(lines(main, "shown")) == len(names)
    assert {line.get_markerfacecolor() for line in lines(main, "shown")} == {color_of(n, COLORS) for n in names}
    drawings = [ax for ax in figure.axes[1:] if ax.collections]
    assert len(drawings) == len(names)
    ends = [line.get_xydata() for line in lines(main, "leader")]
    for one, two in itertools.combinations(ends, 2):
        assert not crosses(one[0], one[1], two[:1], two[1:])[0]


def test_drawings_are_apart_and_clear_of_the_curves(figure):
    main = figure.axes[0]
    places = [ax.get_position() for ax in figure.axes[1:] if ax.collections]
    for one, two in itertools.combinations(places, 2):
        assert not one.overlaps(two)
    paths = [main.transData.transform(line.get_xydata()) for gid in ("stable", "unstable") for line in lines(main, gid)]
    seen = figure.transFigure.inverted().transform(np.concatenate(paths))
    for place in places:
        assert not any(place.contains(*p) for p in seen)
        assert place.x0 > main.get_position().x0
        assert place.x1 < main.get_position().x1


def test_draws_on_given_axes(slice_15):
    ax = new_figure(4, 3).add_subplot()
    assert draw_slice(slice_15, ax) is ax


def test_profiles_have_four_panels_with_all_states(slice_15):
    states = coexisting_states(slice_15, 0.72)
    fig = draw_profiles(states)
    assert len(fig.axes) == 4
    for ax in fig.axes:
        assert {line.get_gid() for line in ax.lines if line.get_gid()} == set(states)
    curve = next(line for line in fig.axes[3].lines if line.get_gid() == "uUu")
    assert np.trapezoid(curve.get_ydata(), curve.get_xdata()) == pytest.approx(2 * states["uUu"]["energy"], rel=1e-4)
    with pytest.raises(ValueError, match=r"^states: expected"):
        draw_profiles({})


def test_coexisting_states_are_solved_at_the_shear(slice_15):
    shear = 0.625
    states = coexisting_states(slice_15, shear)
    assert list(states) == ["US+", "uUu", "uUui"]
    assert all(s["dD"] == shear for s in states.values())
    assert pair_member(states["US+"]) == "+"
    assert richest_value(slice_15.states) == 0.01  # U, W, TU and TW
    with pytest.raises(ValueError, match=r"^shear: expected a number from -0.05 to 0.82"):
        coexisting_states(slice_15, 0.9)


def test_files_are_written_the_same_each_time(tmp_path, slice_15):
    before = dict(mpl.rcParams)
    one = [p.read_bytes() for p in save_figure(draw_slice(slice_15), tmp_path / "one.v1")]
    two = [p.read_bytes() for p in save_figure(draw_slice(slice_15), tmp_path / "two.png")]
    assert {p.name for p in tmp_path.iterdir()} == {"one.v1.png", "one.v1.pdf", "two.png", "two.pdf"}
    assert one == two
    assert one[0].startswith(b"\x89PNG")
    assert one[1].startswith(b"%PDF")
    assert dict(mpl.rcParams) == before


def test_importing_is_cheap():
    heavy = ("matplotlib", "scipy", "numba", "casadi")
    code = f"import sys, rodatlas.plot; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_isotonic_is_the_nearest_increasing_sequence():
    assert isotonic(np.array([1.0, 3.0, 2.0, 4.0])) == pytest.approx([1.0, 2.5, 2.5, 4.0])
    assert isotonic(np.array([3.0, 2.0, 1.0])) == pytest.approx([2.0, 2.0, 2.0])
    assert len(isotonic(np.empty(0))) == 0


def test_every_stable_stretch_belongs_to_a_named_state(slice_30):
    """Where U becomes w between two computed points, the curve is cut exactly there."""
    from rodatlas.plot.slices.curves import slice_stretches

    stable = [x for x in slice_stretches(slice_30) if x.stable]
    assert {x.name for x in stable} == {s.name for s in slice_30.states}
    u = next(x for x in stable if x.name == "U")
    assert u.xy[:, 0].max() == slice_30.state("U", 0.2).high.value


@pytest.mark.slow
def test_warnings_stand_at_the_foot_of_the_figure(slice_15):
    """Below the axis label and the note, whole, and not too many; a slice without any has none."""
    empty = "search: no stable state found at shear 0.745: raise the number of starts"
    figures = [draw_slice_figure(replace(slice_15, warnings=w)) for w in ((), (empty, "names: $W$"), (empty,) * 6)]
    texts = [[t for t in f.texts if t.get_text().startswith(("Warning", "and "))] for f in figures]
    assert [[t.get_text() for t in found] for found in texts] == [
        [], [f"Warning: {empty}", "Warning: names: $W$"], [f"Warning: {empty}"] * 4 + ["and 2 more warnings"]
    ]  # fmt: skip
    renderer = figures[1].canvas.get_renderer()
    boxes = [t.get_window_extent(renderer) for t in figures[1].texts if t.get_position()[1] < 0.2]
    boxes += [figures[1].axes[0].xaxis.label.get_window_extent(renderer)]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    assert min(b.y0 for b in boxes) > 0
    assert max(b.x1 for b in boxes) <= figures[1].bbox.x1
