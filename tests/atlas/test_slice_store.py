"""An interrupted slice resumes; other settings never mix in; a damaged file is named."""

import pytest

from rodatlas.atlas import SliceSettings, compute_slice
from rodatlas.atlas.store import FolderCache


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
