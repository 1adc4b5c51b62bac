"""Interrupted loci resume with those that are finished, and become what they would have been."""

import pytest

from rodatlas.atlas import LociSettings
from rodatlas.atlas.loci.cache import LocusFolder
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.continuation import Locus

NUMBERS = tuple(n for n in range(19) if n not in (16, 17))


class Interrupt(KeyboardInterrupt):
    pass


def test_interrupted_loci_resume(tmp_path, slice_15, loci):
    slice_15.save(tmp_path / "slice-15.h5")
    said = []

    def stop(message, done, pending):
        if message == "locus 5":
            raise Interrupt

    with pytest.raises(Interrupt):
        obtain_loci(LociSettings(), tmp_path, NUMBERS, stop, say=said.append)
    kept = {p: p.stat().st_mtime_ns for p in (tmp_path / "loci").glob("*.h5")}
    assert len(kept) >= 2
    assert all(Locus.load(p).points for p in kept)
    assert f"{len(kept)} finished loci are kept" in said[-1]
    seen = {}

    def look(message, done, pending):
        seen.update({p: p.stat().st_mtime_ns for p in kept if p.exists()})

    found = obtain_loci(LociSettings(), tmp_path, NUMBERS, look, say=said.append)
    assert seen == kept  # never written again
    assert {**found.to_json(), "seconds": 0} == {**loci.to_json(), "seconds": 0}
    assert {p.name for p in tmp_path.iterdir()} == {"slice-15.h5", "loci.h5"}


def test_loci_of_other_settings_start_afresh(tmp_path, loci):
    LocusFolder(tmp_path, LociSettings()).put("locus-3", loci.curves[0])
    assert len(LocusFolder(tmp_path, LociSettings())) == 1
    assert len(LocusFolder(tmp_path, LociSettings(poisson=0.3))) == 0
