"""The other figures: what the paper says of them, and what is on them."""

from types import SimpleNamespace

import numpy as np
import pytest

from rodatlas.paper import critical_mode, phase, poisson, setup, sheared, states
from rodatlas.paper.slices import numbers_of
from rodatlas.plot.look.style import new_figure
from rodatlas.plot.planes.against import draw_curves_against
from rodatlas.plot.shapes.gallery import draw_gallery
from rodatlas.plot.shapes.modes import draw_mode
from rodatlas.plot.shapes.sequence import draw_sequence
from rodatlas.rods import RodState, index_of, pair_member


def bands(figure):
    return [ax for ax in figure.axes if ax.collections]


@pytest.fixture(scope="module")
def curves(slice_15):
    return {c.number: c for c in poisson.curves_of(slice_15)}


def test_thirteen_states_at_15_degrees(sources, slice_15, monkeypatch):
    monkeypatch.setitem(sources.given, 0.0, slice_15)  # has no S
    drawn = states.draw(sources)
    assert [n.agrees for n in drawn.numbers] == [True]
    assert len(bands(drawn.figure)) == 13


def test_the_members_of_a_pair_are_reversals_and_all_are_stable(slice_15):
    for state in states.one_of_each(slice_15):
        for name, solution in states.members(state, slice_15).items():
            assert index_of(solution).index == 0
            assert state.span[0] < solution["dD"] < state.span[1]
            assert name == state.name or pair_member(solution) == name[-1]


def test_0_1_and_2_move_most_with_poissons_ratio(curves):
    assert set(curves) == set(range(12))
    order = sorted(curves, key=lambda n: -abs(curves[n].travel))
    assert set(order[:3]) == {0, 1, 2}
    assert abs(curves[order[3]].travel) < 0.5 * abs(curves[order[2]].travel)


def test_a_larger_poissons_ratio_widens_the_range_of_the_twisted_states(curves):
    """TU and TW end at folds 2 and 1."""
    for number in (1, 2):
        assert (np.diff(curves[number].shears) > 0).all()
        assert curves[number].travel > 0.03


def test_curves_pass_through_the_slice_and_span_the_range(curves, slice_15):
    events = {e.number: e for b in slice_15.branches for e in b.events if e.number is not None}
    for number, curve in curves.items():
        assert curve.ratios[[0, -1]] == pytest.approx([0.0, 0.5], abs=1e-9)
        at = np.argmin(np.abs(curve.ratios - 0.25))
        assert curve.ratios[at] == pytest.approx(0.25, abs=1e-8)
        assert curve.shears[at] == pytest.approx(events[number].value, abs=1e-8)


def test_the_figure_of_poissons_ratio_names_every_curve(sources):
    drawn = poisson.draw(sources)
    (ax,) = drawn.figure.axes
    assert [t.get_text() for t in ax.texts] == [str(n) for n in range(12)]
    places = sorted(t.xyann[1] for t in ax.texts)
    assert np.diff(places).min() > 0.02
    assert "widens" in drawn.remarks[1]
    with pytest.raises(ValueError, match=r"^curves: expected"):
        draw_curves_against({}, "x")


def test_two_inflections_appear_near_the_middle():
    """The paper: at dD about 0.489."""
    where = sheared.inflection_shear()
    assert where == pytest.approx(0.489, abs=5e-4)
    counts = [RodState(sheared.state_at_shear(s)).inflections["k1"] for s in (where - 5e-3, where + 5e-3)]
    assert counts == [2, 4]


def test_the_sheared_band_agrees_with_the_reference(sources):
    drawn = sheared.draw(sources)
    assert sum(n.known is not None for n in drawn.numbers) == 9
    assert all(n.agrees for n in drawn.numbers if n.known)
    assert len(bands(drawn.figure)) == 4
    panels = [ax for ax in drawn.figure.axes if ax.get_xlabel()]
    assert [len([x for x in ax.lines if x.get_gid()]) for ax in panels] == [4, 4]
    with pytest.raises(ValueError, match=r"^states: expected one to 6, got 0"):
        draw_sequence([], "dD")


def test_w_is_lost_out_of_its_plane(sources, loci):
    drawn = critical_mode.draw(sources)
    values = {n.quantity: n for n in drawn.numbers}
    assert values["W loses stability at"].value == pytest.approx(76.95, abs=0.01)
    assert values["share of the displacement of the mode normal to the plane of the band"].value > 1 - 1e-9
    assert abs(values["eigenvalue of the mode there"].value) < 1e-3
    assert [values[f"index of W 1 degree {side}"].value for side in ("below", "above")] == [0.0, 1.0]
    assert values["planar W exists up to"].value == pytest.approx(86.40, abs=0.01)
    assert "out of the plane" in drawn.remarks[0]
    assert len(bands(drawn.figure)) == 3
    with pytest.raises(ValueError, match=r"^amplitude: expected a positive number"):
        draw_mode(None, 0.0, "W", "black")


def test_the_setup_names_what_it_shows(sources):
    drawn = setup.draw(sources)
    assert len(bands(drawn.figure)) == 2
    for ax in bands(drawn.figure):
        written = [t.get_text() for t in ax.texts]
        for text in (r"$L-\Delta L$", r"$\Delta D$", r"$\mathbf{d}_1$", r"$\mathbf{d}_2$", r"$\mathbf{d}_3$"):
            assert written.count(text) == 1
        assert written.count(r"$\psi_0$") == 2


def test_numbers_of_a_slice_name_the_bifurcations(slice_30):
    numbers = {n.quantity: n.value for n in numbers_of(slice_30)}
    assert numbers["shear at which US+- begins (fold 12, snaps)"] == pytest.approx(0.324, abs=1e-3)
    assert numbers["shear at which U ends (smooth)"] == numbers["shear at which w begins (smooth)"]
    assert not any("range" in text for text in numbers)


def test_a_gallery_needs_something_to_show():
    with pytest.raises(ValueError, match=r"^items: expected"):
        draw_gallery([], 3)


def test_what_does_not_add_up_in_the_phase_diagram_is_said(sources, monkeypatch):
    figure = new_figure(1.0, 1.0)
    monkeypatch.setattr("rodatlas.plot.draw_phase_figure", lambda *arguments: figure)
    monkeypatch.setattr(sources, "phase", lambda: SimpleNamespace(warnings=("a face was not sampled",)), raising=False)
    drawn = phase.draw(sources)
    assert drawn.figure is figure
    assert drawn.remarks[-1] == "a face was not sampled"
    assert [n.agrees for n in drawn.numbers if n.known] == [True] * 5
