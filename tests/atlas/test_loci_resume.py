"""Interrupted loci resume with those that are finished, and become what they would have been."""

import pytest

from rodatlas.atlas.cache import LOCUS, FolderCache
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.continuation import Locus
from rodatlas.paper.model import band_loci


class Interrupt(KeyboardInterrupt):
    pass


@pytest.mark.slow
def test_interrupted_loci_resume(tmp_path, slice_15, loci):
    slice_15.save(tmp_path / "slice-15.h5")
    said, stem = [], band_loci().stem(loci.wanted)

    def stop(message, done, pending):
        if message == "locus 5":
            raise Interrupt

    with pytest.raises(Interrupt):
        obtain_loci(band_loci(), tmp_path, loci.wanted, stop, say=said.append)
    kept = {p: p.stat().st_mtime_ns for p in (tmp_path / stem).glob("*.h5")}
    assert len(kept) >= 2
    assert all(Locus.load(p).points for p in kept)
    assert f"{len(kept)} finished loci are kept" in said[-1]
    seen = {}

    def look(message, done, pending):
        seen.update({p: p.stat().st_mtime_ns for p in kept if p.exists()})

    found = obtain_loci(band_loci(), tmp_path, loci.wanted, look, say=said.append)
    assert seen == kept  # never written again
    assert [(p.number, p.kind) for p in found.pieces] == [(p.number, p.kind) for p in loci.pieces]
    assert [len(c.points) for c in found.curves] == [len(c.points) for c in loci.curves]
    one, two = found.to_json()["events"], loci.to_json()["events"]
    assert [e["description"] for e in one] == [e["description"] for e in two]
    for name in ("angle_deg", "shear", "height"):
        assert [e[name] for e in one] == pytest.approx([e[name] for e in two], abs=1e-9)
    assert {p.name for p in tmp_path.iterdir()} == {"slice-15.h5", f"{stem}.h5"}


def test_loci_of_other_settings_start_afresh(tmp_path, loci):
    FolderCache(tmp_path, band_loci()).put("locus-3", loci.curves[0], LOCUS)
    assert len(FolderCache(tmp_path, band_loci())) == 1
    assert len(FolderCache(tmp_path, band_loci(poisson=0.3))) == 0
