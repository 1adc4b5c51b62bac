"""A slice survives its file; an interrupted one resumes; other settings never mix in; a damaged file is named."""

import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest

from rodatlas.atlas import FolderCache, Slice, SliceSettings, compute_slice
from rodatlas.atlas.slices.store import stored_slice


class Interrupt(KeyboardInterrupt):
    pass


def test_interrupted_slice_resumes(tmp_path, slice_15):
    settings = SliceSettings(15.0)
    cache = FolderCache(tmp_path / "s", settings)

    def stop(message, done, pending):
        if done == 4:
            raise Interrupt

    with pytest.raises(Interrupt):
        compute_slice(settings, cache, stop)
    kept = {p.name: p.stat().st_mtime_ns for p in cache.folder.glob("*.h5")}
    assert len(kept) == 4
    resumed = compute_slice(settings, FolderCache(tmp_path / "s", settings))
    for name, time in kept.items():
        assert (cache.folder / name).stat().st_mtime_ns == time  # not computed again
    compare(resumed, slice_15)
    # and once more, everything from files
    compare(compute_slice(settings, FolderCache(tmp_path / "s", settings)), slice_15)


def compare(one, two):
    a, b = one.to_json(), two.to_json()
    assert len(a["branches"]) == len(b["branches"])
    for x, y in zip(a["states"], b["states"], strict=True):
        assert (x["name"], x["pair"], x["path"]) == (y["name"], y["pair"], y["path"])
        assert x["shear"] == pytest.approx(y["shear"], abs=1e-9)
        assert [(e["kind"], e["number"], e["snap"]) for e in x["ends"]] == [
            (e["kind"], e["number"], e["snap"]) for e in y["ends"]
        ]


def test_other_settings_start_afresh(tmp_path, slice_15):
    settings = SliceSettings(15.0)
    cache = FolderCache(tmp_path, settings)
    cache.put("U", slice_15.branches[0].followed.branch)
    assert len(FolderCache(tmp_path, settings)) == 1
    assert len(FolderCache(tmp_path, settings, fresh=True)) == 0
    cache.put("U", slice_15.branches[0].followed.branch)
    assert len(FolderCache(tmp_path, SliceSettings(15.0, poisson=0.3))) == 0


def test_damaged_branch_file_is_named(tmp_path, slice_15):
    cache = FolderCache(tmp_path, SliceSettings(15.0))
    cache.put("U", slice_15.branches[0].followed.branch)
    path = tmp_path / "U.h5"
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(ValueError, match=r"U\.h5: expected"):
        cache.get("U")


@pytest.fixture(scope="module")
def file_30(slice_30, tmp_path_factory):
    """A slice with smooth ends, pairs and side branches, in a file."""
    path = tmp_path_factory.mktemp("slices") / "slice.h5"
    slice_30.save(path)
    return path


def test_slice_survives_its_file(file_30, slice_30):
    found = Slice.load(file_30)
    assert found.settings == slice_30.settings
    assert found.to_json() == slice_30.to_json()
    assert repr(found) == repr(slice_30)
    for one, two in zip(found.branches, slice_30.branches, strict=True):
        assert one.followed.origin == two.followed.origin
        assert [e.special.kind for e in one.events] == [e.special.kind for e in two.events]
        assert one.followed.branch.to_frame().equals(two.followed.branch.to_frame())
    for one, two in zip(found.states, slice_30.states, strict=True):
        assert len(one.solutions) == len(two.solutions)
        for a, b in zip(one.solutions, two.solutions, strict=True):
            assert np.array_equal(a.values, b.values)
            assert a.observables == b.observables


def test_loading_computes_nothing(file_30):
    """Neither equations nor solvers are even imported."""
    code = (
        "import sys\nfrom rodatlas.atlas import Slice\n"
        f"print(Slice.load({str(file_30)!r}).state('w', 0.625).path)\n"
        "print([m for m in ('casadi', 'numba', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["U-w", "[]"]


def test_slice_without_anything_survives_its_file(tmp_path):
    empty = Slice(SliceSettings(80.0), (), (), ("planar states not reached",), 0.5)
    empty.save(tmp_path / "s.h5")
    assert Slice.load(tmp_path / "s.h5") == empty


def test_only_a_slice_of_the_wanted_settings_and_version_is_taken(file_30, tmp_path):
    assert stored_slice(file_30, SliceSettings(30.0)).state("w", 0.625)
    assert stored_slice(file_30, SliceSettings(30.0, poisson=0.3)) is None
    assert stored_slice(tmp_path / "none.h5", SliceSettings(30.0)) is None
    old = tmp_path / "old.h5"
    old.write_bytes(file_30.read_bytes())
    with h5py.File(old, "r+") as file:
        file.attrs["identity"] = file.attrs["identity"].replace('"rodatlas": "', '"rodatlas": "0.0.')
    assert stored_slice(old, SliceSettings(30.0)) is None
    assert Slice.load(old).settings == SliceSettings(30.0)


def test_damaged_slice_file_is_named(file_30, tmp_path):
    path = tmp_path / "cut.h5"
    path.write_bytes(file_30.read_bytes()[:20000])
    with pytest.raises(ValueError, match=r"cut\.h5: expected a 'rodatlas/slice' file"):
        Slice.load(path)


def test_finished_cache_is_cleared_but_not_what_else_is_there(tmp_path, slice_15):
    cache = FolderCache(tmp_path / "s", SliceSettings(15.0))
    cache.put("U", slice_15.branches[0].followed.branch)
    (tmp_path / "s" / "notes.txt").write_text("mine")
    cache.clear()
    assert [p.name for p in (tmp_path / "s").iterdir()] == ["notes.txt"]
    (tmp_path / "s" / "notes.txt").unlink()
    FolderCache(tmp_path / "s", SliceSettings(15.0)).clear()
    assert not (tmp_path / "s").exists()


def test_tables_of_states_and_events(slice_15):
    states, events = slice_15.to_frame(), slice_15.to_frame("events")
    assert list(states["name"]) == [s.name for s in slice_15.states]
    w = states.set_index("name").loc["w"]
    assert (w["kind_low"], w["number_low"], w["snap_low"]) == ("fold", 7, True)
    assert w["shear_high"] == slice_15.state("w", 0.55).high.shear
    assert len(events) == sum(len(b.events) for b in slice_15.branches)
    u = events[events["branch"] == "U"]
    assert np.allclose(u["shear"], (0.327675302, 0.616372198), atol=1e-8)
    assert list(u["criticality"]) == ["super", "sub"]
    with pytest.raises(ValueError, match="of: expected 'states' or 'events', got 'points'"):
        slice_15.to_frame("points")


def test_reprs_say_what_a_user_looks_for(slice_15):
    u = next(b for b in slice_15.branches if b.id == "U")
    assert repr(u.events[0]).startswith("Event(pitchfork 4: shear 0.327675, height 0.1828, index 0 to 1)")
    assert "fold 6, snaps" in repr(slice_15.state("w", 0.55))
    bare = replace(u.events[0], number=None)
    assert repr(bare).startswith("Event(pitchfork: shear")
    assert all(len(repr(x)) < 200 for x in (*slice_15.branches, *slice_15.states, *u.events, slice_15))
