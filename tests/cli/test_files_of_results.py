"""No command replaces a result by another one: over all commands, two settings in one folder at a time.

What is computed does not matter here: one slice, next to zero shear, stands for all.
"""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from rodatlas.atlas import Slice
from rodatlas.cli import main
from rodatlas.cli.app import app
from rodatlas.paper.model import band_loci, band_phase, band_slice
from small_results import plain_figure

pytestmark = pytest.mark.slow

SLICE = ("slice", "--angle", "15", "--shear-min", "0", "--search", "0")
RANGE = ("--shear-max", "0.02")
TOL = ("--tol", "1e-6")
SOLVE = ("solve", "--angle", "15", "--state", "U")
STATES = ("states", "--angle", "15", "--stable-only", "--class", "+", "--starts", "16", "--json", "s.json")
EXPORT = ("export", "out/U-15-dD0.1.h5", "--samples")
PAIRS = {
    "range of a slice": ((*SLICE, *TOL, *RANGE), (*SLICE, *TOL, "--shear-max", "0.03")),
    "tolerance": ((*SLICE, *TOL, *RANGE), (*SLICE, "--tol", "2e-7", *RANGE)),
    "angle to eight digits": ((*SLICE, *TOL, *RANGE), ("slice", "--angle", "15.0000001", *SLICE[3:], *TOL, *RANGE)),
    "JSON of slices": ((*SLICE, *TOL, *RANGE, "--json", "s.json"),
                       (*SLICE, *TOL, *RANGE, "--poisson", "0.3", "--json", "s.json")),
    "measured data": ((*SLICE, *TOL, *RANGE, "--overlay", "a.csv"), (*SLICE, *TOL, *RANGE, "--overlay", "b/a.csv")),
    "JSON with measured data": ((*SLICE, *TOL, *RANGE, "--json", "s.json"),
                                (*SLICE, *TOL, *RANGE, "--overlay", "a.csv", "--json", "s.json")),
    "shear of a state": ((*SOLVE, "--shear", "0.1"), (*SOLVE, "--shear", "0.1001")),
    "Poisson's ratio of a state": ((*SOLVE, "--shear", "0.1"), (*SOLVE, "--shear", "0.1", "--poisson", "0.3")),
    "tolerance of a state": ((*SOLVE, "--shear", "0.1"), (*SOLVE, "--shear", "0.1", "--tol", "1e-7")),
    "named file of a state": ((*SOLVE, "--shear", "0.1", "--out", "u.h5"), (*SOLVE, "--shear", "0.2", "--out", "u")),
    "searches": ((*STATES, "--shear", "0.1"), (*STATES, "--shear", "0.2")),
    "bands": (("band", "--json", "b.json"), ("band", "--width", "4", "--json", "b.json")),
    "tables": ((*EXPORT, "11", "--out", "t.csv"), (*EXPORT, "12", "--out", "t.csv")),
    "shapes": ((*EXPORT, "11", "--out", "t.vtp"), (*EXPORT, "12", "--out", "t.vtp")),
    "several formats": ((*EXPORT, "11", "--out", "t.glb"), (*EXPORT, "11", "--out", "t.glb", "--width", "1/8")),
    "studies": (("study", "one.toml", "--out", "out", "--workers", "1"),
                ("study", "two.toml", "--out", "out", "--workers", "1")),
    "plans of studies": (("study", "one.toml", "--out", "x", "--dry-run", "--json", "p.json"),
                         ("study", "two.toml", "--out", "x", "--dry-run", "--json", "p.json")),
    "listings": (("show", "b", "--json", "l.json"), ("show", ".", "--json", "l.json")),
}  # fmt: skip
RECORDS = ("study.json", "catalogue.sqlite")  # of the study that ran last; it holds no results


def run(*arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    return stop.value.code or 0


def contents(folder):
    return {p: p.read_bytes() for p in Path(folder).rglob("*") if p.is_file() and p.name not in RECORDS}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with what the commands read."""
    monkeypatch.chdir(tmp_path)
    Path("b").mkdir()
    Path("a.csv").write_text("state,shear_min,shear_max\nU,0.0,0.01\n")
    Path("b/a.csv").write_text("state,shear_min,shear_max\nU,0.0,0.015\n")
    for name, shear in (("one", 0.1), ("two", 0.2)):
        Path(f"{name}.toml").write_text(
            f'name = "{name}"\n[[states]]\nangle = 15\nshear = {shear}\nstarts = 16\nclasses = "+"\n'
            "stable_only = true\n"
        )
    return tmp_path


@pytest.fixture
def one_slice(monkeypatch, near_zero):
    """Slices take no time: the same branches whatever the settings, and the diagram without drawings of bands."""
    monkeypatch.setattr(
        "rodatlas.atlas.slices.obtain.compute_slice", lambda s, *_, **__: replace(near_zero, settings=s)
    )
    monkeypatch.setattr("rodatlas.plot.draw_slice_figure", plain_figure)


@pytest.mark.parametrize("name", PAIRS)
def test_another_result_leaves_the_first_alone(name, place, one_slice, capsys):
    first, second = PAIRS[name]
    if "export" in first:
        assert run(*SOLVE, "--shear", "0.1") == 0
    assert run(*first) == 0
    known = contents(place)
    code = run(*second)
    err = capsys.readouterr().err
    for path, data in known.items():
        assert path.read_bytes() == data, f"{path} was replaced"
    if code:
        assert code == 2
        assert err.splitlines()[-1].endswith("with something else; --overwrite replaces it")
        assert set(contents(place)) >= set(known)
        assert run(*second, "--overwrite") == 0
        assert contents(place) != known
    else:
        assert len(contents(place)) > len(known)
    # the first again: it is right whether it is read or computed, and replaces its own files only
    if not code:
        now = contents(place)
        assert run(*first) == 0
        assert {p for p, data in contents(place).items() if data != now.get(p)} <= set(known)


def test_every_command_that_writes_is_tested():
    """`loci`, `phase` and `paper`, which take long, are below."""
    commands = {command.name for command in app.registered_commands}
    assert commands == {pair[0][0] for pair in PAIRS.values()} | {"loci", "phase", "paper"}


def test_some_loci_leave_others_alone(place, slice_15, capsys):
    Path("out").mkdir()
    slice_15.save("out/slice-15.h5")
    command = ("loci", "--angle-max", "15.2", "--json", "l.json", "--number")
    assert run(*command, "4") == 0
    known = contents(place)
    assert {p.name for p in known} >= {f"loci-4-0to15.2{end}" for end in (".h5", ".json", ".png", ".pdf")}
    assert run(*command, "11") == 2
    assert run(*command[:3], "--number", "11") == 0
    assert all(path.read_bytes() == data for path, data in known.items())
    assert json.loads(Path("out/loci-11-0to15.2.json").read_text())["identity"]["numbers"] == [11]
    capsys.readouterr()


def test_names_of_loci_and_phase_diagrams_tell_all_settings_apart():
    loci = [band_loci(), band_loci(0.4), band_loci(poisson=0.3), band_loci(angle_max=80.0000001),
            band_loci(tolerance=1e-7)]  # fmt: skip
    phases = [band_phase(), band_phase(0.4), band_phase(poisson=0.3), band_phase(angle_min=1.0),
              band_phase(angle_max=79.99999), band_phase(tolerance=1e-7)]  # fmt: skip
    numbers = [(), (4,), (4, 12), (12,)]
    names = [s.stem(n) for s in loci for n in numbers] + [s.stem for s in phases]
    assert len({n.lower() for n in names}) == len(names)


def test_two_commands_at_once_are_both_right(tmp_path):
    """The same slice, and the same file for its JSON."""
    command = [sys.executable, "-m", "rodatlas", *SLICE, *TOL, *RANGE, "--out", str(tmp_path)]
    command += ["--json", str(tmp_path / "s.json")]
    runs = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    told = [run.communicate(timeout=240) for run in runs]
    assert [run.returncode for run in runs] == [0, 0], told
    assert told[0][0] == told[1][0]  # the table, with the seconds of the one that computed it
    assert sum("read from" in err for _, err in told) == 1
    (data,) = tmp_path.glob("*.h5")
    assert json.loads((tmp_path / "s.json").read_text())["states"] == Slice.load(data).to_json()["states"]
    assert not list(tmp_path.glob(".*"))


def test_the_result_of_an_older_version_is_kept(place, one_slice, capsys, monkeypatch):
    """Under another name, with a line that says so."""
    assert run(*SLICE, *TOL, *RANGE) == 0
    (data,) = Path("out").glob("*.h5")
    old = data.read_bytes()
    monkeypatch.setattr("rodatlas.atlas.slices.settings.code_hash", lambda *folders: "other")
    assert run(*SLICE, *TOL, *RANGE) == 0
    assert f"it is kept as {data.name}.other" in capsys.readouterr().err
    assert Path(f"{data}.other").read_bytes() == old
    assert Slice.load(data).settings == band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)
