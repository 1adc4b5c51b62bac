"""Files: exact round trips, atomic replacement, damage noticed."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from bvp_problems import algebraic, bratu, constant, elastica

from rodatlas.continuation import Branch, Discrepancy, NewtonCode, Solution, TraceOptions, switch, trace
from rodatlas.continuation.store.branch import read_branch, write_branch
from rodatlas.continuation.store.hdf5 import atomic_hdf5, checked_hdf5

LOAD = ("P", "V")
OPTIONS = TraceOptions(bounds={"P": (1.0, 100.0), "compression": (-0.1, 0.3)}, zeros={"P": 50.0})


@pytest.fixture(scope="module", name="column")
def column_fixture() -> Branch:
    return trace(elastica(), constant(elastica(), P=10.0), LOAD, replace(OPTIONS, index=lambda s: int(s["P"] > 60)))


def assert_same_solution(one: Solution, two: Solution) -> None:
    for name in ("mesh", "values", "stages", "parameters"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert (one.unknowns, one.parameter_names) == (two.unknowns, two.parameter_names)
    assert dict(one.observables) == dict(two.observables)
    assert one.error == two.error or np.isnan([one.error, two.error]).all()


def test_a_solution_comes_back_bit_for_bit(tmp_path: Path, column: Branch) -> None:
    for solution in (column.points[3].solution, constant(bratu())):
        solution.save(tmp_path / "solution.h5")
        assert_same_solution(solution, Solution.load(tmp_path / "solution.h5"))


def test_a_branch_comes_back_bit_for_bit(tmp_path: Path, column: Branch) -> None:
    side = switch(elastica(), column.special[0], LOAD, OPTIONS)
    assert side is not None
    doubts = (
        Discrepancy((0.1, 0.2), (1, 3), ("fold", "branch point"), (1.5, 1.6)),
        Discrepancy((2.0, 3.0), (0, 1), (), (0.0, 1.0)),
    )
    failed = replace(side, failures=(None, NewtonCode.SLOW), discrepancies=doubts)
    for i, branch in enumerate((column, side, failed)):
        path = tmp_path / f"{i}.h5"
        branch.save(path)
        loaded = Branch.load(path)
        for name in ("free", "ends", "discrepancies", "newton_iterations", "failures"):
            assert getattr(loaded, name) == getattr(branch, name)
        assert loaded.settings == branch.settings
        assert repr(loaded) == repr(branch)
        for one, two in zip(branch.points, loaded.points, strict=True):
            assert_same_solution(one.solution, two.solution)
            np.testing.assert_array_equal(one.tangent, two.tangent)
            for name in ("arclength", "fold_test", "branch_test", "index", "iterations", "step"):
                assert getattr(one, name) == getattr(two, name)
        for a, b in zip(branch.special, loaded.special, strict=True):
            assert_same_solution(a.solution, b.solution)
            for name in ("kind", "arclength", "status", "bracket", "tests", "index", "residual", "free", "turns"):
                assert getattr(a, name) == getattr(b, name)
            for c, d in zip(a.directions, b.directions, strict=True):
                for name in ("stage", "mesh", "scalars"):
                    np.testing.assert_array_equal(getattr(c, name), getattr(d, name))
    assert len({s.solution.intervals for s in side}) > 1  # ragged meshes were tried


def test_the_settings_of_the_run_are_in_the_file(tmp_path: Path, column: Branch) -> None:
    column.save(tmp_path / "b.h5")
    settings = Branch.load(tmp_path / "b.h5").settings
    assert settings["problem"] == "elastica"
    assert settings["bounds"] == {"P": [1.0, 100.0], "compression": [-0.1, 0.3]}
    assert settings["mesh"]["tolerance"] == 1e-8
    assert settings["index"].endswith("<lambda>")


def test_a_run_goes_on_from_a_file(tmp_path: Path, column: Branch) -> None:
    column.points[0].solution.save(tmp_path / "start.h5")
    again = trace(elastica(), Solution.load(tmp_path / "start.h5"), LOAD, OPTIONS)
    np.testing.assert_allclose(
        [x.solution["P"] for x in again.special], [x.solution["P"] for x in column.special], rtol=1e-7
    )
    column.save(tmp_path / "branch.h5")
    loaded = Branch.load(tmp_path / "branch.h5")
    here, there = (switch(elastica(), b.of_kind("branch point")[0], LOAD, OPTIONS) for b in (column, loaded))
    assert here is not None
    assert there is not None
    np.testing.assert_array_equal(here.column("P"), there.column("P"))
    bare = replace(loaded.of_kind("branch point")[0], directions=(), scale=None)
    anew = switch(elastica(), bare, LOAD, OPTIONS)
    assert anew is not None
    assert anew.points[-1].solution["compression"] == pytest.approx(0.3, abs=1e-9)


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path, column: Branch) -> None:
    path = tmp_path / "b.h5"
    column.save(path)
    before = path.read_bytes()

    def write_half() -> None:
        with atomic_hdf5(path, "rodatlas/branch") as file:
            file["half"] = np.zeros(10)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["b.h5"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_is_one_plain_error(tmp_path: Path, column: Branch) -> None:
    """/dev/full stands for the disk: every write to it fails as on a full one."""
    path = tmp_path / "x.h5"
    column.save(path)
    before = path.read_bytes()
    write = Path.write_bytes

    def full(self: Path, data: bytes) -> int:
        return write(Path("/dev/full"), data)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with pytest.raises(OSError, match=r"No space left on device: '.*/x\.h5'"):
            column.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_or_file_is_named(tmp_path: Path, column: Branch) -> None:
    with pytest.raises(ValueError, match="expected a file in an existing folder, got the missing folder"):
        column.save(tmp_path / "nowhere" / "b.h5")
    with pytest.raises(FileNotFoundError, match=r"No such file or directory: '.*b\.h5'"):
        Branch.load(tmp_path / "b.h5")


def test_foreign_new_and_damaged_files_are_refused(tmp_path: Path, column: Branch) -> None:
    path = tmp_path / "x.h5"
    expected = r"x\.h5: expected a 'rodatlas/branch' file of version 2, got "
    path.write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match=expected + "a damaged file"):
        Branch.load(path)
    with h5py.File(path, "w") as file:
        file["data"] = 1.0
    with pytest.raises(ValueError, match=expected + "an HDF5 file without a schema"):
        Branch.load(path)
    column.points[0].solution.save(path)
    with pytest.raises(ValueError, match=expected + "schema 'rodatlas/solution'"):
        Branch.load(path)
    column.save(path)
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 1
    with pytest.raises(ValueError, match=expected + "version 1: read it with the rodatlas that wrote it"):
        Branch.load(path)
    column.save(path)
    with h5py.File(path, "r+") as file:
        del file["points/arclength"]
    with pytest.raises(ValueError, match=expected + "a damaged file"):
        Branch.load(path)
    column.save(path)
    with h5py.File(path, "r+") as file:
        del file["points/solutions/mesh"]
        file["points/solutions/mesh"] = np.zeros(3)
    with pytest.raises(ValueError, match=r"a damaged file \(/points/solutions/mesh has shape"):
        Branch.load(path)


@pytest.mark.parametrize("place", [0.25, 0.5, 0.75, 0.95])
def test_truncation_and_flipped_bytes_never_pass(tmp_path: Path, column: Branch, place: float) -> None:
    path = tmp_path / "x.h5"
    column.save(path)
    whole = path.read_bytes()
    at = int(place * len(whole))
    path.write_bytes(whole[:at])
    with pytest.raises(ValueError, match="damaged file"):
        Branch.load(path)
    with h5py.File(path, "w"):
        pass
    column.save(path)
    with h5py.File(path, "r") as file:
        offset = file["points/solutions/stages"].id.get_chunk_info(0).byte_offset
    damaged = bytearray(path.read_bytes())
    damaged[offset + int(place * 1000)] ^= 0xFF
    path.write_bytes(bytes(damaged))
    with pytest.raises(ValueError, match="damaged file"):
        Branch.load(path)


def test_several_branches_fit_in_one_file(tmp_path: Path, column: Branch) -> None:
    other = trace(bratu(), constant(bratu()), ("lam",), TraceOptions(bounds={"mean": (-1.0, 1.0), "lam": (0.0, 4.0)}))
    with atomic_hdf5(tmp_path / "two.h5", "mine", 3) as file:
        write_branch(file.create_group("column"), column)
        write_branch(file.create_group("bratu"), other)
    with checked_hdf5(tmp_path / "two.h5", "mine", 3) as file:
        assert repr(read_branch(file["column"])) == repr(column)
        assert repr(read_branch(file["bratu"])) == repr(other)
        assert os.path.exists(tmp_path / "two.h5")


def test_a_branch_without_special_points_or_observables(tmp_path: Path) -> None:
    bvp = algebraic(lambda u, p: [u.x - p.lam])
    branch = trace(bvp, constant(bvp), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}))
    branch.save(tmp_path / "b.h5")
    loaded = Branch.load(tmp_path / "b.h5")
    assert loaded.special == ()
    assert loaded.points[2].solution.observables == {}
