"""Figures of the phase diagram: what is drawn, where numbers stand, and that no two cover each other."""

import numpy as np
import pytest
from matplotlib.legend import Legend
from matplotlib.text import Text

from rodatlas.atlas import PhaseDiagram
from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.phase.arrangement import chords, cut_plane
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.regions import Face
from rodatlas.atlas.phase.result import Interval
from rodatlas.paper.model import band_phase
from rodatlas.paper.phase import CLOSE_UPS, PANELS, close_ups_of
from rodatlas.plot import draw_phase, draw_phase_figure, draw_phase_states, draw_region, save_figure
from rodatlas.plot.planes.phase import count_colors

ANGLE_LABEL, SHEAR_LABEL = r"clamp angle $\psi_0$  (degrees)", r"shear $\Delta D$  (units of $L$)"
SETTING = r"$\Delta L=0.5\,L$,  $\nu=0.25$"


def straight(label, kind, left, right, end=80.0):
    angle = np.linspace(0.0, end, 30)
    return Line(label, kind, np.column_stack([angle, left + (right - left) * angle / end]))


@pytest.fixture(scope="module")
def diagram():
    """U below a pitchfork, a pair above it, w between two folds that fan out; a short line; S+- on the left edge."""
    settings = band_phase()
    lines = (
        straight("4", "pitchfork", 0.3, 0.35), straight("7", "fold", 0.5, 0.52), straight("6", "fold", 0.5, 0.6),
        straight("18", "fold", 0.2, 0.201, 0.7), straight("4'", "fold", 0.1, 0.12),
    )  # fmt: skip
    faces = []
    for rings in cut_plane(lines, settings):
        ((low, high),) = chords(rings, 40.0)
        shear = 0.5 * (low + high)
        states = ("U",) if shear < 0.325 else ("US+-", "w") if 0.51 < shear < 0.55 else ("US+-",)
        faces.append(Face(rings, states, ((40.0, shear),)))
    event = PlaneEvent("cusp", "", 0.0, 0.5, 0.1, ("7", "6"), (), True, "converged", True, "two folds meet", "born")
    return PhaseDiagram(settings, lines, tuple(faces), (Interval(0.0, "S+-", 0.53, 0.8),), (event,), (0.0, 15.0))


def boxes(ax, texts):
    renderer = ax.figure.canvas.get_renderer()
    ax.figure.canvas.draw()
    return [(t, t.get_window_extent(renderer)) for t in ax.texts if t.get_text() in texts]


def test_every_numbered_line_has_its_number_once(diagram):
    ax = draw_phase_figure(diagram).axes[0]
    texts = [t.get_text() for t in ax.texts]
    assert sorted(t for t in texts if not t.startswith("(")) == ["18", "4", "6", "7"]
    for label, box in boxes(ax, {"4", "6", "7"}):
        line = next(x for x in diagram.lines if x.label == label.get_text())
        center = ax.transData.inverted().transform(((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2))
        assert np.interp(center[0], *line.points.T) == pytest.approx(center[1], abs=0.01)


def test_numbers_do_not_cover_each_other(diagram):
    ax = draw_phase_figure(diagram).axes[0]
    found = [box for _, box in boxes(ax, {"4", "6", "7", "18"})]
    assert len(found) == 4
    for i, one in enumerate(found):
        assert ax.bbox.x0 <= one.x0
        assert one.x1 <= ax.bbox.x1
        assert not any(one.overlaps(two) for two in found[:i])


def test_shades_tell_the_number_of_stable_states(diagram):
    ax = draw_phase_figure(diagram).axes[0]
    colors = count_colors(diagram)
    assert sorted(colors) == [1, 2, 3]
    assert len({tuple(c) for c in colors.values()}) == 3
    drawn = [tuple(p.get_facecolor()) for p in ax.patches if p.get_facecolor()[3] == 1.0]
    assert drawn == [tuple(colors[f.count]) for f in diagram.faces]


def test_close_ups_are_drawn_where_the_diagram_has_them(diagram):
    assert len(draw_phase_figure(diagram, CLOSE_UPS).axes) == 1 + len(CLOSE_UPS)
    assert close_ups_of(diagram.settings) == CLOSE_UPS
    assert close_ups_of(band_phase(0.4)) == ()
    part = PhaseDiagram(band_phase(angle_min=5.0, angle_max=20.0), diagram.lines, diagram.faces, (), (), ())
    assert len(draw_phase_figure(part, CLOSE_UPS).axes) == 1
    first = draw_phase_figure(diagram, CLOSE_UPS).axes[1]
    assert (*first.get_xlim(), *first.get_ylim()) == CLOSE_UPS[0].window


def test_one_panel_for_each_state(diagram):
    fig = draw_phase_states(diagram, PANELS)
    names = [next(t.get_text() for t in ax.texts if t.get_text() in ("U", "w", "US±", "S±")) for ax in fig.axes]
    assert names == ["U", "w", "US±", "S±"]


def test_a_region_shows_its_sides_only(diagram):
    ax = draw_region(diagram, "w", draw_phase_states(diagram).axes[0].figure.add_axes((0, 0, 1, 1)))
    assert {t.get_text() for t in ax.texts} == {"6", "7", "w"}
    thick = [x for x in ax.lines if x.get_linewidth() > 1.0]
    assert len(thick) == 2


def test_a_region_has_a_figure_of_its_own_and_needs_a_state_of_the_diagram(diagram):
    ax = draw_region(diagram, "w")
    assert ax.get_title("left") == SETTING
    assert (ax.get_xlabel(), ax.get_ylabel()) == (ANGLE_LABEL, SHEAR_LABEL)
    with pytest.raises(ValueError, match=r"^name: expected one of U, US\+-, w, S\+-, got 'V'"):
        draw_region(diagram, "V")


def test_settings_units_and_meanings_are_told(diagram):
    for ax in (draw_phase(diagram), draw_phase_figure(diagram).axes[0]):
        assert ax.get_title("left") == SETTING
        assert (ax.get_xlabel(), ax.get_ylabel()) == (ANGLE_LABEL, SHEAR_LABEL)
        told = {t.get_text() for legend in ax.findobj(Legend) for t in legend.get_texts()}
        assert told == {"fold", "pitchfork", "without a number", "cusp", "stable states:", "1", "2", "3"}
    figure = draw_phase_states(diagram)
    assert [t.get_text() for t in figure.texts] == [SETTING]
    (legend,) = figure.legends
    told = {t.get_text() for t in legend.get_texts()}
    assert told == {"stable", "ends at a fold", "ends at a pitchfork", "other loci"}
    for ax in [*draw_phase_figure(diagram, CLOSE_UPS).axes[1:], figure.axes[0]]:
        assert "degrees" in ax.get_xlabel()
    assert "units of $L$" in figure.axes[0].get_ylabel()


def test_keys_lie_above_the_plane_and_apart(diagram):
    ax = draw_phase(diagram)
    ax.figure.draw_without_rendering()
    keys = [legend.get_window_extent() for legend in ax.findobj(Legend)]
    keys.append(next(t for t in ax.findobj(Text) if t.get_text() == SETTING).get_window_extent())
    for i, one in enumerate(keys):
        assert one.y0 > ax.bbox.y1
        assert one.y1 < ax.figure.bbox.y1
        assert not any(one.overlaps(two) for two in keys[:i])


def test_figures_are_saved(diagram, tmp_path):
    for name, fig in (("phase", draw_phase_figure(diagram)), ("phase-states", draw_phase_states(diagram))):
        for path in save_figure(fig, tmp_path / name):
            assert path.stat().st_size > 5000
