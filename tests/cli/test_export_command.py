"""`rodatlas export`: the files it writes, and how it refuses."""

import json

import numpy as np
import pandas as pd
import pytest
import trimesh

from rodatlas.atlas.results import RESULTS, kind_of
from rodatlas.cli import main
from rodatlas.continuation import Solution
from rodatlas.paper.model import band_phase
from rodatlas.rods import Ends, RodState
from small_results import straight_phase


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(["export", *map(str, arguments)])
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


@pytest.fixture(scope="module")
def files(slice_15, tmp_path_factory):
    """A slice, a solution, and other things, as files."""
    folder = tmp_path_factory.mktemp("results")
    slice_15.save(folder / "slice.h5")
    slice_15.state("U", 0.2).solutions[-1].save(folder / "u.h5")
    plain = Solution.from_function(lambda s: s[:, None], ("v",), {"lam": 1.0})
    plain.save(folder / "plain.h5")
    straight_phase(band_phase()).save(folder / "phase.h5")
    (folder / "damaged.h5").write_bytes((folder / "u.h5").read_bytes()[:3000])
    (folder / "text.h5").write_text("hello")
    rod = RodState(slice_15.state("US+-", 0.5).solutions[3])
    state = {"name": "US+", "class": "+", "energy": rod.energy, "N0": rod.force_body[0].tolist(),
             "M0": rod.moment_body[0].tolist(), "inflections": rod.inflections}  # fmt: skip
    setting = Ends(15.0, shear=rod.solution["dD"]).setting | {"poisson": 0.25}
    table = {"schema": "rodatlas/states/1", "setting": setting, "states": [state, state | {"name": None}]}
    (folder / "states.json").write_text(json.dumps(table))
    (folder / "wrong.json").write_text(json.dumps(table | {"setting": setting | {"shear": 0.1}}))
    (folder / "other.json").write_text("[1]")
    return folder


def test_a_member_of_a_pair_as_a_solid_in_millimeters(capsys, files, tmp_path):
    volumes = {}
    for name in ("US+", "US-"):
        out = tmp_path / f"{name}.stl"
        code, _, _ = run(
            capsys, files / "slice.h5", "--state", name, "--at", "0.5", "--out", out, "--band", "240x30x0.127"
        )
        assert code == 0
        mesh = trimesh.load(out)
        assert mesh.is_watertight
        volumes[name] = mesh.volume
    assert volumes["US+"] == pytest.approx(240 * 30 * 0.127, rel=1e-3)
    assert volumes["US-"] == pytest.approx(volumes["US+"], rel=1e-4)


def test_coexisting_states_in_one_scene(capsys, files, tmp_path):
    code, out, err = run(capsys, files / "slice.h5", "--format", "glb", "--out", tmp_path / "all")
    assert code == 0
    assert "where most stable states coexist" in err
    assert out == f"wrote {tmp_path}/all.glb\n"
    assert set(trimesh.load(tmp_path / "all.glb").geometry) == {"U", "W", "TU+", "TW+"}


def test_one_file_for_each_table_and_shape(capsys, files, tmp_path):
    for form in (("csv",), ("vtp", "--at", "0.01")):
        assert run(capsys, files / "slice.h5", "--out", tmp_path / "s", "--format", *form)[0] == 0
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {f"s-{x}.csv" for x in ("states", "events", "branches")} | {
        f"s-{x}.vtp" for x in ("U", "W", "TU+", "TW+")
    }


def test_tables_of_a_phase_diagram(capsys, files, tmp_path):
    """Of a plane with the lines 0.33 and 0.61 across it: areas in degrees times lengths."""
    assert run(capsys, files / "phase.h5", "--out", tmp_path / "p.csv", "--band", "240x3x0.127")[0] == 0
    assert {p.name for p in tmp_path.iterdir()} == {f"p-{x}.csv" for x in ("events", "faces", "regions")}
    regions, faces = (pd.read_csv(tmp_path / f"p-{x}.csv", comment="#") for x in ("regions", "faces"))
    settings = band_phase()
    pair = regions[regions["state"] == "US+-"].iloc[0]
    assert [pair[f"shear_{side}"] for side in ("low", "high")] == pytest.approx([0.33, settings.high])
    assert [pair[f"angle_deg_{side}"] for side in ("low", "high")] == [settings.second_low, settings.second_high]
    assert pair["shear_low_mm"] == pytest.approx(240 * 0.33)
    lower = regions[regions["state"] == "U"].iloc[0]
    assert lower["area"] == pytest.approx((settings.second_high - settings.second_low) * (0.33 - settings.low))
    assert set(lower["bounds"].split()) == {"4", "frame"}
    assert sorted(zip(faces["states"], faces["count"], faces["names"], strict=True)) == [
        ("U", 1, 1), ("US+-", 2, 1), ("US+- uUu", 3, 2)
    ]  # fmt: skip


def test_every_kind_of_result_is_told_apart():
    for kinds in zip(*((k.word, k.schema, k.type) for k in RESULTS), strict=True):
        assert len(set(kinds)) == len(RESULTS)
    with pytest.raises(ValueError, match=r"^result: expected one of Solution, Branch, .*PhaseDiagram, got 15\.0$"):
        kind_of(15.0)


def test_table_of_found_states(capsys, files, tmp_path):
    code, _, _ = run(capsys, files / "states.json", "--out", tmp_path / "states.csv")
    assert code == 0
    row = pd.read_csv(tmp_path / "states.csv", comment="#").iloc[0]
    assert row["angle_deg"] == 15.0
    state = json.loads((files / "states.json").read_text())["states"][0]
    assert row["inflections_tau"] == state["inflections"]["tau"]
    assert row["N0_3"] == pytest.approx(state["N0"][2])


def test_shapes_of_found_states(capsys, files, slice_15, tmp_path):
    """Rebuilt from force and moment at the clamp, they end at the other clamp."""
    code, _, _ = run(capsys, files / "states.json", "--out", tmp_path / "x.glb")
    assert code == 0
    scene = trimesh.load(tmp_path / "x.glb")
    assert set(scene.geometry) == {"US+", "+2"}
    known = slice_15.state("US+-", 0.5).solutions[3]
    mesh = scene.geometry["US+"]
    ends = np.array([mesh.vertices[:7].mean(axis=0), mesh.vertices[-7:].mean(axis=0)])
    assert ends == pytest.approx(np.array([[0, 0, -known["dD"]], [0.5, 0, 0]]), abs=1e-5)
    middle = mesh.vertices.reshape(481, 7, 3)[240, 3]
    assert middle == pytest.approx([known(0.5, name)[0] for name in "xyz"], abs=1e-5)


@pytest.mark.parametrize(
    ("file", "options", "message"),
    [
        ("none.h5", [], "none.h5: expected an HDF5 file written by rodatlas"),
        ("damaged.h5", [], "damaged.h5: expected an HDF5 file written by rodatlas"),
        ("text.h5", [], "text.h5: expected an HDF5 file written by rodatlas"),
        ("", [], "got a folder"),
        ("other.json", [], "file: expected what 'rodatlas states --json' writes"),
        ("states.json", ["--format", "vtp", "--state", "TU+"], "state: expected one of US+, +2, got 'TU+'"),
        ("states.json", ["--format", "vtp", "--at", "0"], "at: expected a value only for the states of a slice"),
        ("wrong.json", ["--format", "vtp"], "state: expected N0, M0 of a state at angle 15, comp"),
        ("plain.h5", ["--format", "vtp"], "file: expected the solution of a rod, got one without N1, N2, N3"),
        ("phase.h5", ["--format", "vtp"], "file: expected a solution, a slice or found states for shapes, got PhaseDi"),
        ("u.h5", ["--format", "obj"], "format: expected one of csv, vtp, glb, stl, got 'obj'"),
        ("u.h5", ["--format", "stl"], "band: expected LENGTHxWIDTHxTHICKNESS in mm for STL"),
        ("u.h5", ["--format", "vtp", "--band", "240x30"], "band: expected LENGTHxWIDTHxTHICKNESS in mm such as"),
        ("u.h5", ["--format", "vtp", "--width", "1/0"], "width: expected the width over the length"),
        ("u.h5", ["--format", "vtp", "--width", "x"], "width: expected the width over the length, at most 1, such as"),
        ("u.h5", ["--format", "vtp", "--samples", "2"], "samples: expected a whole number from 3"),
        ("u.h5", ["--state", "U", "--at", "0"], "at: expected a value only for the states of a slice"),
        ("u.h5", ["--state", "U"], "state: expected a name only for a slice or a search for states, got 'U'"),
        ("u.h5", ["--at", "0"], "at: expected --state beside --at for a table, got none"),
        ("slice.h5", ["--at", "0"], "at: expected --state beside --at for a table, got none"),
        ("slice.h5", ["--state", "U"], "shear: expected the shear at which U is wanted, got none"),
        ("slice.h5", ["--state", "U", "--at", "0.7"], "shear: expected one at which U is stable at angle 15"),
        ("slice.h5", ["--state", "S+", "--at", "0.7"], "state: expected one that is stable in the slice at angle"),
        ("slice.h5", ["--state", "Q", "--at", "0.7"], "state: expected one of U, US+"),
        ("slice.h5", ["--format", "glb", "--at", "0.9"], "shear: expected a number from -0.05 to 0.82"),
    ],
)
def test_wrong_input_is_one_line(capsys, files, tmp_path, file, options, message):
    target = f"x.{options[1]}" if "--format" in options else "x.csv"
    code, out, err = run(capsys, files / file, "--out", tmp_path / target, *options)
    assert (code, out) == (2, "")
    assert err.startswith("rodatlas: ")
    assert message in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_the_target_is_checked_first(capsys, files, tmp_path):
    code, _, err = run(capsys, "none.h5", "--format", "csv", "--out", tmp_path)
    assert code == 2
    assert err == f"rodatlas: out: expected a file name, got the folder '{tmp_path}'\n"
    code, _, err = run(capsys, "none.h5", "--out", "picture")
    assert (code, err) == (
        2, "rodatlas: format: expected one of csv, vtp, glb, stl, got the file name 'picture' and no --format\n"
    )  # fmt: skip
