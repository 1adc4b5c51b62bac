"""Bands that touch themselves: where along a state, and how slices, searches, phase diagrams and figures say so."""

import io
import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from rich.console import Console

from rodatlas.atlas import Slice, compute_slice
from rodatlas.atlas.phase.compute import slice_warnings
from rodatlas.atlas.slices.states.coexisting import solve_state
from rodatlas.atlas.slices.states.contact import contact_of_slices, contact_ranges, contact_warnings
from rodatlas.cli.slice import _table as slice_table
from rodatlas.cli.solve import _table as solve_table
from rodatlas.cli.states import _table as states_table
from rodatlas.cli.tables import say_table
from rodatlas.paper.model import band, band_phase, band_slice
from rodatlas.paper.names.yu_hanna import COLORS
from rodatlas.plot import color_of, draw_profiles, draw_slice, draw_slice_figure
from rodatlas.plot.exports.tables import slice_tables
from rodatlas.plot.slices.curves import branch_stretches
from rodatlas.plot.slices.panel import label_of
from rodatlas.rods import NARROW, Ends, self_contact
from rodatlas.states.discover import Discovery, FoundState

EDGE = 0.01234  # shear at which the strands of a narrow U at 15 degrees, dL = 0.95 have passed each other


@pytest.fixture(scope="module")
def touching():
    """The slice at 15 degrees and compression 0.95 about zero shear, where U is a loop whose strands cross."""
    return compute_slice(band_slice(15.0, 0.95, shear_min=-0.02, shear_max=0.02, search=0), carry=False)


@pytest.fixture(scope="module")
def u(touching):
    return touching.state("U", 0.0)


def test_range_ends_where_the_strands_have_passed_each_other(touching, u):
    ((low, high),) = u.contact
    assert low == pytest.approx(-EDGE, abs=5e-5)
    assert high == pytest.approx(EDGE, abs=5e-5)
    for shear, touches in ((high - 1e-4, True), (high + 1e-4, False), (low + 1e-4, True), (low - 1e-4, False)):
        assert (self_contact(solve_state(u, shear, touching.settings)) is not None) == touches


def test_a_range_between_two_computed_solutions_is_not_missed(touching, u):
    """Only states outside the range are known: both are free, and yet what lies between them is not."""
    free = tuple(s for s in u.solutions if abs(s["dD"]) > 0.0135)
    assert len(free) >= 2
    assert not any(self_contact(s) for s in free)
    known = replace(u, solutions=(free[0], free[-1]))
    ((low, high),) = contact_ranges(known, touching.settings)
    assert (low, high) == pytest.approx(u.contact[0], abs=1e-4)


def test_the_range_grows_with_the_width_of_the_band(touching, u):
    ((_, high),) = contact_ranges(u, touching.settings, NARROW / 2)
    assert high == pytest.approx(EDGE / 2, rel=0.02)
    assert contact_ranges(u, touching.settings, 0.1) == (u.span,)
    with pytest.raises(ValueError, match=r"^width: expected the width over the length, between 0 and 10, got 0"):
        contact_ranges(u, touching.settings, 0.0)


def test_slice_says_so_in_its_warnings_json_frame_and_file(touching, u, tmp_path):
    said = [w for w in touching.warnings if w.startswith("U: a band L/80 wide passes through itself at shear -0.0123")]
    assert len(said) == 1
    low, high = u.contact[0]
    state = next(s for s in touching.to_json()["states"] if s["name"] == "U")
    assert state["contact"] == [[low, high]]
    json.dumps(state)
    assert list(touching.to_frame().set_index("name").loc["U", "contact"]) == [(low, high)]
    assert list(slice_tables(touching)["states"]["contact"]) == [f"{low:.6g} {high:.6g}"]
    touching.save(tmp_path / "s.h5")
    assert Slice.load(tmp_path / "s.h5").to_json() == touching.to_json()


def printed(table):
    text = io.StringIO()
    say_table(Console(file=text, width=200), table)
    return text.getvalue()


def test_table_has_a_column_only_when_something_touches(touching):
    text = printed(slice_table(touching))
    assert "touches itself" in text
    assert "-0.0123" in text
    free = replace(touching, states=tuple(replace(s, contact=()) for s in touching.states))
    assert "touches" not in printed(slice_table(free))


def test_one_state_and_a_list_of_states_say_so(touching, u):
    inside, outside = (solve_state(u, shear, touching.settings) for shear in (0.0, 0.018))
    assert "touches itself" in printed(solve_table(band(), "U", inside))
    assert "touches" not in printed(solve_table(band(), "U", outside))
    one, two = (FoundState(s, "+", "U", 0, None, 3) for s in (inside, outside))
    assert one.to_json()["contact"] is True
    first, second = one.to_json()["contact_at"]
    assert first == pytest.approx(1 - second, abs=1e-4)
    assert (two.to_json()["contact"], two.to_json()["contact_at"]) == (False, [])
    found = Discovery(Ends(15.0, 0.95, 0.0), (one, two), 1, 1, 2, 0.0, 0.0, None)
    text = printed(states_table(found))
    assert f"{first:.4f} and {second:.4f}" in text
    assert "passes through itself" in text
    assert "touches" not in printed(states_table(replace(found, states=(two,))))


def test_many_slices_say_it_once_for_each_name(touching):
    other = replace(touching, settings=touching.settings.at(angle=16.0))
    (line,) = contact_of_slices([touching, other], "angle")
    assert line.startswith("U: a band L/80 wide passes through itself at shear within -0.0123")
    assert "in the slices at angle 15, 16" in line
    assert contact_of_slices([], "angle") == []
    assert set(contact_warnings(touching.states, touching.settings)) <= set(touching.warnings)
    told = slice_warnings([replace(touching, warnings=(*touching.warnings, "something else")), other], band_phase())
    assert told == [f"slice at {touching.settings.place_text}: something else", line]


def test_curve_is_cut_at_the_ends_of_the_range(touching, u):
    b = next(b for b in touching.branches if b.id == u.branch)
    parts = branch_stretches(b, touching.states, touching.settings)
    assert [(p.stable, p.name, p.touching) for p in parts] == [
        (True, "U", False), (True, "U", True), (True, "U", False)
    ]  # fmt: skip
    for one, two in pairwise(parts):
        assert np.array_equal(one.xy[-1], two.xy[0])
    assert sorted((parts[1].xy[0, 0], parts[1].xy[-1, 0])) == pytest.approx(u.contact[0], abs=1e-12)


def lines(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def legends(of):
    return [t.get_text() for box in of.findobj(lambda a: type(a).__name__ == "Legend") for t in box.get_texts()]


def test_figure_dots_what_touches_and_explains_it(touching):
    ax = draw_slice(touching)
    (dotted,) = lines(ax, "touching")
    assert dotted.get_color() == color_of("U", COLORS)
    assert dotted.is_dashed()
    assert dotted.get_dash_capstyle() == "round"  # dots, where unstable curves have dashes
    assert "stable, touches itself" in legends(ax)
    assert [t.get_text() for t in ax.texts].count(label_of("U")) == 1
    free = replace(touching, states=tuple(replace(s, contact=()) for s in touching.states))
    ax = draw_slice(free)
    assert lines(ax, "touching") == []
    assert "stable, touches itself" not in legends(ax)


def test_drawings_of_touching_bands_say_so(touching, u):
    inner = replace(u, solutions=tuple(s for s in u.solutions if abs(s["dD"]) < EDGE))
    shown = [t.get_text() for t in draw_slice_figure(replace(touching, states=(inner,))).texts]
    assert any("touches itself" in text and text.strip().startswith(r"$\Delta D") for text in shown)
    assert any("$L/80$ wide touches itself where its line is dotted" in text for text in shown)


def test_profiles_of_touching_bands_say_so(touching, u):
    for shear, touches in ((0.0, True), (0.018, False)):
        texts = draw_profiles({"U": solve_state(u, shear, touching.settings)}).texts
        assert any(t.get_text() == "U: a band $L/80$ wide touches itself." for t in texts) == touches
