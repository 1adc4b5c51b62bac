"""A slice survives its file; an interrupted one resumes; other settings never mix in; a damaged file is named."""

import os
import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodatlas.atlas import FolderCache, Slice, compute_slice
from rodatlas.atlas.cache import BRANCH
from rodatlas.atlas.slices.obtain import obtain_slice, stored_slice
from rodatlas.atlas.study import list_folder
from rodatlas.paper.model import band_slice


class Interrupt(KeyboardInterrupt):
    pass


@pytest.mark.slow
def test_interrupted_slice_resumes(tmp_path, slice_15):
    """Without its search, which at 15 degrees finds nothing more."""
    settings = band_slice(15.0, search=0)
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
    settings = band_slice(15.0)
    cache = FolderCache(tmp_path, settings)
    cache.put("U", slice_15.branches[0].followed.branch, BRANCH)
    assert len(FolderCache(tmp_path, settings)) == 1
    assert len(FolderCache(tmp_path, settings, fresh=True)) == 0
    cache.put("U", slice_15.branches[0].followed.branch, BRANCH)
    assert len(FolderCache(tmp_path, band_slice(15.0, poisson=0.3))) == 0


def test_a_damaged_branch_is_computed_again(tmp_path, slice_15):
    said = []
    cache = FolderCache(tmp_path, band_slice(15.0), say=said.append)
    cache.put("U", slice_15.branches[0].followed.branch, BRANCH)
    path = tmp_path / "U.h5"
    path.write_bytes(path.read_bytes()[:1000])
    assert cache.get("U", BRANCH) is None
    assert f"{tmp_path.name}/U.h5 is damaged and is computed again" in said[0]
    assert not path.exists()


def test_a_folder_of_somebody_else_is_left_alone(tmp_path):
    (tmp_path / "data.h5").write_bytes(b"mine")
    with pytest.raises(ValueError, match=r"out: expected no folder named"):
        FolderCache(tmp_path, band_slice(15.0))
    assert (tmp_path / "data.h5").read_bytes() == b"mine"


def test_a_damaged_record_of_settings_loses_no_curve(tmp_path, slice_15):
    said = []
    FolderCache(tmp_path / "s", band_slice(15.0)).put("U", slice_15.branches[0].followed.branch, BRANCH)
    (tmp_path / "s" / "settings.json").write_text("{")
    assert len(FolderCache(tmp_path / "s", band_slice(15.0), say=said.append)) == 0
    assert (tmp_path / "s.damaged" / "U.h5").exists()
    assert "kept as s.damaged" in said[0]


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
    empty = Slice(band_slice(80.0), (), (), ("planar states not reached",), 0.5)
    empty.save(tmp_path / "s.h5")
    assert Slice.load(tmp_path / "s.h5") == empty


def test_only_a_slice_of_the_wanted_settings_and_version_is_taken(file_30, tmp_path):
    here, other = tmp_path / "slice-30.h5", tmp_path / "slice-30-nu0.3.h5"
    for path in (here, other):
        path.write_bytes(file_30.read_bytes())
    assert stored_slice(tmp_path, band_slice(30.0)).state("w", 0.625)
    assert stored_slice(tmp_path, band_slice(30.0, poisson=0.3)) is None
    assert stored_slice(tmp_path, band_slice(45.0)) is None
    with h5py.File(here, "r+") as file:
        file.attrs["identity"] = file.attrs["identity"].replace('"rodatlas": "', '"rodatlas": "0.0.')
    assert stored_slice(tmp_path, band_slice(30.0)) is None
    assert Slice.load(here).settings == band_slice(30.0)


SMALL = band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)  # of the fixture near_zero
SMALL_TEXT = "band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)"  # for other processes


def cut(path):
    path.write_bytes(path.read_bytes()[:-1000])


def other_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["identity"] = file.attrs["identity"].replace('"rodatlas": "', '"rodatlas": "0.0.')


@pytest.mark.slow
@pytest.mark.parametrize(("damage", "reason"), [(cut, "damaged"), (other_version, "other")])
def test_what_cannot_be_used_is_kept_and_computed_again(tmp_path, near_zero, damage, reason):
    """Twice: the second does not replace the first that was kept."""
    path = tmp_path / f"{SMALL.stem}.h5"
    near_zero.save(path)
    kept = []
    for _ in range(2):
        damage(path)
        kept.append(path.read_bytes())
        said = []
        assert obtain_slice(SMALL, tmp_path, say=said.append).to_json()["states"] == near_zero.to_json()["states"]
        assert f"it is kept as {path.name}.{reason}" in said[0]
    assert (tmp_path / f"{path.name}.{reason}").read_bytes() == kept[0]
    assert (tmp_path / f"{path.name}.{reason}-2").read_bytes() == kept[1]
    assert Slice.load(path).settings == SMALL


def test_curves_that_a_kill_left_beside_a_finished_slice_go(tmp_path, near_zero):
    """As after a kill between the two: the file is complete, its curves and half-written files are still there."""
    path = tmp_path / f"{SMALL.stem}.h5"
    near_zero.save(path)
    for leave in (lambda: obtain_slice(SMALL, tmp_path), lambda: list_folder(tmp_path)):
        cache = FolderCache(tmp_path / path.stem, SMALL)
        cache.put("U", near_zero.branches[0].followed.branch, BRANCH)
        (tmp_path / f".{path.name}.0123456789ab.partial").write_bytes(b"half")
        gone = tmp_path / f".{path.stem}.0123456789ab.partial"
        gone.mkdir()
        (gone / "U.h5").write_bytes(b"curve")
        for old in (gone, tmp_path / f".{path.name}.0123456789ab.partial"):
            os.utime(old, (0, 0))
        leave()
        assert [p.name for p in tmp_path.iterdir()] == [path.name]
    # those of an unfinished slice stay
    FolderCache(tmp_path / path.stem, SMALL.at(poisson=0.3)).put("U", near_zero.branches[0].followed.branch, BRANCH)
    assert [e.status for e in list_folder(tmp_path).entries] == ["partial", "complete"]


def test_curves_are_left_while_another_process_is_at_them(tmp_path, near_zero):
    path = tmp_path / f"{SMALL.stem}.h5"
    near_zero.save(path)
    FolderCache(tmp_path / path.stem, SMALL).put("U", near_zero.branches[0].followed.branch, BRANCH)
    code = (
        "import sys\nfrom pathlib import Path\nfrom rodatlas.files import claimed\n"
        "with claimed(Path(sys.argv[1])):\n    print('held', flush=True)\n    sys.stdin.read()\n"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout.readline() == "held\n"
    assert [e.status for e in list_folder(tmp_path).entries] == ["partial", "complete"]
    other.communicate("")
    assert [e.status for e in list_folder(tmp_path).entries] == ["complete"]


@pytest.mark.slow
def test_two_runs_of_one_slice_at_once_are_both_right(tmp_path):
    """The second waits for the first and reads what that has computed."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom rodatlas.paper import band_slice\n"
        "from rodatlas.atlas.slices.obtain import obtain_slice\n"
        f"settings = {SMALL_TEXT}\n"
        "found = obtain_slice(settings, Path(sys.argv[1]), say=print)\n"
        "print(found.seconds, len(found.branches))\n"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    out = [run.communicate(timeout=240)[0].splitlines() for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    assert out[0][-1] == out[1][-1]  # the same seconds: computed once
    assert sum(any(line.startswith("read from") for line in lines) for lines in out) == 1
    assert [p.name for p in tmp_path.iterdir()] == [f"{SMALL.stem}.h5"]


@pytest.mark.slow
def test_a_kill_while_the_file_is_written_loses_nothing(tmp_path, near_zero):
    """Killed with the file half written: no result, all curves; the next run uses them."""
    code = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom rodatlas.paper import band_slice\n"
        "from rodatlas.atlas.slices import obtain\nfrom rodatlas.continuation import store\n"
        f"settings, stem = {SMALL_TEXT}, {SMALL.stem!r}\n"
        "write = Path.write_bytes\n"
        "def half(path, data):\n"
        "    if path.name.startswith(f'.{stem}.h5.'):\n"
        "        write(path, data[: len(data) // 2])\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return write(path, data)\n"
        "Path.write_bytes = half\n"
        "obtain.obtain_slice(settings, Path(sys.argv[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert done.returncode == -9
    assert not (tmp_path / f"{SMALL.stem}.h5").exists()
    assert len(list(tmp_path.glob(".*.partial"))) == 1
    kept = len(list((tmp_path / SMALL.stem).glob("*.h5")))
    said = []
    found = obtain_slice(SMALL, tmp_path, say=said.append)
    assert said[0].startswith(f"resuming: {kept} finished branches")
    assert {**found.to_json(), "seconds": 0} == {**near_zero.to_json(), "seconds": 0}
    assert [p.name for p in tmp_path.iterdir()] == [f"{SMALL.stem}.h5"]


@given(st.lists(st.builds(
    band_slice, st.sampled_from([0.0, 15.0, 15.000000001, 27.5, 1e-5]), st.sampled_from([0.5, 0.4, 0.50000001]),
    st.sampled_from([0.25, 0.3]), st.sampled_from([None, 0.1, 0.7]), st.sampled_from([None, 0.0, -0.1, -0.05]),
    st.sampled_from([1e-8, 1e-7]), st.sampled_from([256, 0, 64]),
), min_size=2, max_size=2))  # fmt: skip
def test_other_settings_have_another_name(pair):
    one, two = pair
    assert (one.stem.lower() == two.stem.lower()) == (one == two)


def test_the_default_range_fits_every_compression():
    assert band_slice(15.0, 0.4).high == pytest.approx(0.82 * 0.8 / 0.75**0.5)
    for compression in (1e-4, 0.01, 0.2, 0.95, 0.999):
        s = band_slice(15.0, compression)
        limit = (1.0 - (1.0 - compression) ** 2) ** 0.5
        assert s.high / limit == pytest.approx(0.82 / 0.75**0.5, rel=1e-6)
        assert s.low / limit == pytest.approx(-0.05 / 0.75**0.5, rel=1e-5)


def test_damaged_slice_file_is_named(file_30, tmp_path):
    path = tmp_path / "cut.h5"
    path.write_bytes(file_30.read_bytes()[:20000])
    with pytest.raises(ValueError, match=r"cut\.h5: expected a 'rodatlas/slice' file"):
        Slice.load(path)


def test_finished_cache_is_cleared_but_not_what_else_is_there(tmp_path, slice_15):
    cache = FolderCache(tmp_path / "s", band_slice(15.0))
    cache.put("U", slice_15.branches[0].followed.branch, BRANCH)
    (tmp_path / "s" / "notes.txt").write_text("mine")
    cache.clear()
    assert [p.name for p in (tmp_path / "s").iterdir()] == ["notes.txt"]
    (tmp_path / "s" / "notes.txt").unlink()
    FolderCache(tmp_path / "s", band_slice(15.0)).clear()
    assert not (tmp_path / "s").exists()


def test_tables_of_states_and_events(slice_15):
    states, events = slice_15.to_frame(), slice_15.to_frame("events")
    assert list(states["name"]) == [s.name for s in slice_15.states]
    w = states.set_index("name").loc["w"]
    assert (w["kind_low"], w["number_low"], w["snap_low"]) == ("fold", 7, True)
    assert w["shear_high"] == slice_15.state("w", 0.55).high.value
    assert len(events) == sum(len(b.events) for b in slice_15.branches)
    u = events[events["branch"] == "U"]
    assert np.allclose(u["shear"], (0.327675302, 0.616372198), atol=1e-8)
    assert list(u["criticality"]) == ["super", "sub"]
    with pytest.raises(ValueError, match="of: expected 'states' or 'events', got 'points'"):
        slice_15.to_frame("points")


def test_reprs_say_what_a_user_looks_for(slice_15):
    u = next(b for b in slice_15.branches if b.id == "U")
    assert repr(u.events[0]).startswith("Event(pitchfork 4: at 0.327675, 0.1828")
    assert "fold 6, snaps" in repr(slice_15.state("w", 0.55))
    bare = replace(u.events[0], number=None)
    assert repr(bare).startswith("Event(pitchfork: at")
    assert all(len(repr(x)) < 200 for x in (*slice_15.branches, *slice_15.states, *u.events, slice_15))
