"""The command line: one line and exit code 2 for wrong input, JSON on stdout alone, files that can be read back."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest

from rodatlas import __version__
from rodatlas.atlas import Slice
from rodatlas.cli import main
from rodatlas.continuation import Solution
from small_results import plain_figure


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["slice", "--angle", "x"], "angle: expected a number, got 'x'"),
        (["slice", "--angle", "95"], "angle: expected degrees with 0 <= angle < 90, got 95.0"),
        (["slice", "--angle", "nan"], "angle: expected degrees with 0 <= angle < 90, got nan"),
        (["slice", "--angle", "15", "--shear-max", "0.9"], "shear-max: expected a number from 0.001 to below 0.866025"),
        (["slice", "--angle", "15", "--compression", "1"], "compression: expected a number between 0 and 1"),
        (["slice", "--angle", "15", "--compression", "1.5"], "compression: expected a number between 0 and 1"),
        (["slice", "--angle", "15", "--poisson", "0.6"], "poisson: expected a number with -1 < nu <= 0.5, got 0.6"),
        (["slice", "--angle", "15", "--tol", "0"], "tol: expected a number between 1e-10 and 1e-06, got 0.0"),
        (["slice", "--angle", "15", "--out", "/proc/rodatlas"], "out: expected a folder that can be written"),
        (["slice", "--angle", "15", "--json", "/"], "json: expected a file name or -, got the folder '/'"),
        (["slice"], "angle: expected --angle, or --angle-left and --angle-right, got none"),
        (["slice", "--angel", "15"], "No such option: --angel"),
        (["slyce"], "No such command 'slyce'"),
        (["solve", "--angle=15", "--shear=1", "--state=U", "--out=u"], "shear: expected a number of size"),
        (["solve", "--angle=15", "--shear=0", "--state=V", "--out=u"], "state: expected one of U, US+, US-"),
    ],
)
def test_wrong_input_is_one_line(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert err.startswith(f"rodatlas: {message}")
    assert err.count("\n") == 1


def test_a_state_that_is_not_there_says_what_is(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # no slice here
    out = str(tmp_path / "x")
    code, _, err = run(capsys, "solve", "--angle", "15", "--shear", "0.2", "--state", "uUu", "--out", out)
    assert code == 2
    last = err.splitlines()[-1]
    assert "at angle 15 deg, compression 0.5, poisson 0.25 and shear 0.2 (U, W; 1024 of 1024 starts" in last
    assert err.splitlines()[-1].endswith("got 'uUu'; 'rodatlas slice --angle 15' tells where it is")


def test_solve_tells_which_member_of_a_pair_it_took(capsys, tmp_path):
    code, out, _ = run(
        capsys, "solve", "--angle", "15", "--shear", "0.4", "--state", "US+-", "--out", str(tmp_path / "u")
    )  # fmt: skip
    assert code == 0
    assert "US+ (from a search)" in out
    assert "US+-" not in out


def test_solve_writes_a_solution_that_reads_back(capsys, tmp_path):
    path = tmp_path / "new" / "u"
    code, out, _ = run(capsys, "solve", "--angle", "45", "--shear", "0.2", "--state", "U", "--out", str(path))
    assert code == 0
    assert "0.215493955" in out
    assert "stable" in out
    solution = Solution.load(path.with_suffix(".h5"))
    assert abs(solution["energy"] - 8.272356559) < 1e-7
    table = np.loadtxt(path.with_suffix(".csv"), delimiter=",")
    assert table.shape == (201, 14)
    assert np.allclose(table[0, 1:4], (-17.10825468, 10.49335466, -10.49335466), atol=1e-6)


@pytest.mark.slow
def test_slice_prints_json_alone_and_writes_figures(capsys, tmp_path, monkeypatch, slice_15):
    monkeypatch.setattr("rodatlas.atlas.slices.obtain.compute_slice", lambda settings, *_, **__: slice_15)
    command = ("slice", "--angle", "15", "--out", str(tmp_path), "--json", "-")
    code, out, err = run(capsys, *command)
    assert code == 0
    data = json.loads(out)
    assert data["schema"] == "rodatlas/slice/1"
    assert [s["name"] for s in data["states"]] == ["U", "US+-", "uUu", "w", "W", "WS+-", "uUui", "TU+-", "TW+-"]
    assert data["warnings"] == []
    assert "Stable states at angle 15 deg" in err
    figures = ("-diagram.png", "-diagram.pdf", "-profiles.png", "-profiles.pdf")
    assert {p.name for p in tmp_path.iterdir()} == {f"slice-15{end}" for end in (".h5", ".json", *figures)}
    for end in figures:
        assert (tmp_path / f"slice-15{end}").stat().st_size > 10_000
    assert json.loads((tmp_path / "slice-15.json").read_text()) == data
    # repeated, it reads the data file, which holds the same
    monkeypatch.setattr("rodatlas.plot.draw_slice_figure", plain_figure)
    path = tmp_path / "slice-15.h5"
    written = path.stat().st_mtime_ns
    code, out, err = run(capsys, *command)
    assert (code, json.loads(out)) == (0, data)
    assert f"read from {path}" in err
    assert path.stat().st_mtime_ns == written


@pytest.mark.slow
def test_an_interrupt_keeps_what_is_finished(tmp_path):
    command = [sys.executable, "-m", "rodatlas", "slice", "--angle", "15", "--out", str(tmp_path)]
    command += ["--shear-min", "0", "--shear-max", "0.02", "--tol", "1e-6", "--search", "0"]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # jobs in the background ignore it
    )  # fmt: skip
    for line in running.stderr:
        if "twisted states" in line:  # behind U, W and the third mode, and a second before the next branch
            running.send_signal(signal.SIGINT)
            break
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "finished branches are kept" in err
    assert "Traceback" not in err
    (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
    kept = len(list(folder.glob("*.h5")))
    assert kept >= 3
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"resuming: {kept} finished branches" in done.stderr
    assert "branch U [" not in done.stderr
    assert not folder.exists()
    assert Slice.load(tmp_path / f"{folder.name}.h5").warnings == ()


def test_version(capsys):
    assert run(capsys, "--version")[:2] == (0, f"{__version__}\n")
