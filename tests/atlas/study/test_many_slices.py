"""Slices computed by two processes equal those computed here, and are read back by the same call."""


import pytest

from rodatlas.atlas import Slice
from rodatlas.atlas.study import TasksFailed, obtain_slices
from rodatlas.paper.model import band_slice

NEAR = band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)  # of the fixture near_zero
OTHER = NEAR.at(poisson=0.3)


def values(slice_):
    return {k: v for k, v in slice_.to_json().items() if k != "seconds"}


@pytest.mark.slow
def test_two_processes_give_what_one_gives(tmp_path, near_zero):
    heard, said = [], []
    found = obtain_slices([NEAR, OTHER, NEAR], tmp_path, 2, lambda *args: heard.append(args), say=said.append)
    assert values(found[0]) == values(near_zero)
    assert found[0] is found[2]
    assert found[1].settings == OTHER
    assert {p.name for p in tmp_path.iterdir()} == {f"{s.stem}.h5" for s in (NEAR, OTHER)}
    assert values(Slice.load(tmp_path / f"{OTHER.stem}.h5")) == values(found[1])
    assert said == []
    assert {done + left for _, done, left in heard} == {2}
    assert {message.split(":")[0] for message, _, _ in heard} == {NEAR.stem, OTHER.stem}
    # again: read, nothing computed, nothing written
    written = {p.name: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    again = obtain_slices([NEAR, OTHER], tmp_path)
    assert [s.seconds for s in again] == [found[0].seconds, found[1].seconds]
    assert {p.name: p.stat().st_mtime_ns for p in tmp_path.iterdir()} == written


def test_a_damaged_file_is_kept_and_computed_again(tmp_path):
    path = tmp_path / f"{NEAR.stem}.h5"
    path.write_bytes(b"no HDF5")
    said = []
    assert obtain_slices([NEAR], tmp_path, say=said.append)[0].settings == NEAR
    assert "is damaged" in said[0]
    assert path.with_name(f"{path.name}.damaged").read_bytes() == b"no HDF5"


def test_what_cannot_be_computed_is_told_with_the_reason(tmp_path):
    """A folder in the way of the files of one slice: the other is there afterwards."""
    (tmp_path / NEAR.stem).write_text("in the way of its branches")
    said = []
    with pytest.raises(TasksFailed, match=r"1 of 2 slices could not be computed: slice-15\S+ \(ValueError: out: exp"):
        obtain_slices([NEAR, OTHER], tmp_path, say=said.append)
    assert len(said) == 2  # tried three times
    assert Slice.load(tmp_path / f"{OTHER.stem}.h5").settings == OTHER
