"""The search for stable states beside the branches: it finds isolated ones alone, and agrees with what is followed."""

from dataclasses import replace

import numpy as np
import pytest

from rodatlas.atlas import FolderCache, Followed, MemoryCache, compute_slice
from rodatlas.atlas.cache import SOLUTIONS
from rodatlas.atlas.slices.branches import follow
from rodatlas.atlas.slices.branches.follow import trace_options
from rodatlas.atlas.slices.branches.search import Found, search_at, searched_values
from rodatlas.atlas.slices.states import crosscheck
from rodatlas.atlas.slices.states.segments import stable_segments
from rodatlas.continuation import trace
from rodatlas.paper.model import band_slice
from rodatlas.paper.names.segments import OTHER, name_parts
from rodatlas.rods import RodState, is_symmetric, second_variation_index
from rodatlas.states.labels import parse_label

SHEARS = (0.624,)


@pytest.fixture(scope="module")
def alone():
    """The slice at 30 degrees with nothing carried over: only a search at one shear knows of isolated branches."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(follow, "carried_seeds", lambda *arguments: ([], []))
        patch.setattr(follow, "searched_values", lambda settings: SHEARS)
        return compute_slice(band_slice(30.0))


@pytest.mark.slow
def test_isolated_states_are_found_without_being_carried_over(alone, slice_30):
    """US+- and uUu lie on branches of their own; two independent ways lead to the same ones."""
    assert alone.warnings == ()
    assert {s.name for s in alone.states if s.branch.startswith("found@0.624")} == {"US+-", "uUu"}
    assert [s.name for s in alone.states] == [s.name for s in slice_30.states]
    for one, two in zip(alone.states, slice_30.states, strict=True):
        assert one.span == pytest.approx(two.span, abs=1e-6)
        assert [e.number for e in (one.low, one.high)] == [e.number for e in (two.low, two.high)]


def test_the_search_meets_every_named_state(slice_15, slice_30):
    """Warnings would say which it did not; it finds nothing that is not followed."""
    for found in (slice_15, slice_30):
        assert found.settings.search > 0
        assert found.warnings == ()
        assert not any(b.id.startswith("found") for b in found.branches)


def test_a_state_that_the_search_misses_is_said(slice_30, monkeypatch):
    monkeypatch.setattr(type(slice_30.settings.model.search), "stable_states", lambda *arguments: ())
    u = slice_30.state("U", 0.26)
    warnings = crosscheck.missed_states([Found(0.26, (), ())], [u], slice_30.settings)
    assert warnings == ["the search at shear 0.26 did not meet U: raise its number of starts"]
    near_its_end = Found(u.high.value - 1e-3, (), ())
    assert crosscheck.missed_states([near_its_end], [u], slice_30.settings) == []
    met = Found(u.solutions[2]["dD"], (u.solutions[2],), ())
    assert crosscheck.missed_states([met], [u], slice_30.settings) == []


def test_searches_that_found_no_state_are_said(slice_30):
    """There is a stable state at every shear, that of least energy: a search without any has not done its work."""
    u = slice_30.state("U", 0.26).solutions[0]
    assert crosscheck.empty_searches([Found(0.26, (u,), ()), Found(0.7, (), ())], slice_30.settings) == [
        "search: no stable state found at shear 0.7: raise the number of starts"
    ]


def test_what_was_found_is_kept_for_a_run_that_goes_on(tmp_path, slice_30, monkeypatch):
    settings = band_slice(30.0)
    states = tuple(slice_30.state(name, 0.7).solutions[0] for name in ("uUu", "US+-"))
    FolderCache(tmp_path, settings).put("search-0.624", states, SOLUTIONS)
    FolderCache(tmp_path, settings).put("search-0.26", (), SOLUTIONS)
    monkeypatch.setattr(type(settings.model.search), "stable_states", None)  # nothing is searched again
    again = search_at(0.624, settings, FolderCache(tmp_path, settings)).states
    assert [s["energy"] for s in again] == [s["energy"] for s in states]
    assert np.array_equal(again[0].values, states[0].values)
    assert search_at(0.26, settings, FolderCache(tmp_path, settings)).states == ()
    assert len(FolderCache(tmp_path, band_slice(30.0, search=64))) == 0
    FolderCache(tmp_path, settings).put("search-0.624", states, SOLUTIONS)
    path = tmp_path / "search-0.624.h5"
    path.write_bytes(path.read_bytes()[:1000])
    said = []
    assert FolderCache(tmp_path, settings, say=said.append).get("search-0.624", SOLUTIONS) is None
    assert "search-0.624.h5 is damaged and is computed again" in said[0]


def test_a_stable_state_without_a_name_of_the_paper():
    """At 45 degrees and dL = 0.7 a search alone knows of an isolated symmetric branch, stable between two folds."""
    settings = band_slice(45.0, 0.7, shear_min=-0.05, shear_max=0.45, search=512)
    states = search_at(0.286, settings, MemoryCache()).states
    symmetric = [s for s in states if is_symmetric(s)]
    assert sorted(s["height"] > 0 for s in symmetric) == [False, True, True]  # W, U and this one
    state = max(symmetric, key=lambda s: s["energy"])
    branch = trace(settings.model.problem, state, settings.free, replace(trace_options(settings), max_folds=2))
    segments = stable_segments(Followed.by(settings.model, "found", branch, state), None, settings.value)
    (found,) = [s for s in segments if s.low.kind == s.high.kind == "fold"]
    assert (found.low.solution["dD"], found.high.solution["dD"]) == pytest.approx((0.2392, 0.3712), abs=1e-4)
    rod = RodState(state).at(np.linspace(0.0, 1.0, 401))
    assert second_variation_index(rod.s, rod.quaternion, rod.position, rod.strain, rod.law).index == 0
    assert [part.name for part in name_parts(found.solutions, symmetric=True)] == [OTHER]
    with pytest.raises(ValueError, match="state: expected one of U, US"):
        parse_label(OTHER)


def test_shears_that_are_searched_lie_in_the_range():
    assert searched_values(band_slice(15.0))[0] == 0.0
    assert all(s <= 0.3 for s in searched_values(band_slice(15.0, shear_max=0.3)))
    small = searched_values(band_slice(15.0, 0.3, shear_max=0.65))
    assert max(small) < 0.65
    for wrong in (-1, 2.5, True):
        with pytest.raises(ValueError, match="search: expected a whole number from 0 to 1000000, got"):
            band_slice(15.0, search=wrong)
