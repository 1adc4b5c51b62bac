"""`rodatlas study` and `rodatlas show`: exit codes, progress, tables, JSON."""

import json
import os
import signal
import subprocess
import sys

import pytest

from rodatlas.atlas import Slice
from rodatlas.cli import main

pytestmark = pytest.mark.slow

TWO = """
name = "two slices"
[[slices]]
angle = 15
poisson = [0.25, 0.3]
shear_max = 0.02
shear_min = 0
tolerance = 1e-6
search = 0
"""


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main([str(a) for a in arguments])
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


@pytest.fixture
def two(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO)
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A study that is done: its folder, and what was printed."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "two.toml").write_text(TWO)
    command = [sys.executable, "-m", "rodatlas", "study", "two.toml", "--out", "out", "--workers", "2", "--json", "-"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode == 0, done.stderr
    return folder, done


def test_a_study_prints_json_alone_and_lines_of_progress(finished):
    folder, done = finished
    data = json.loads(done.stdout)
    assert (data["schema"], data["name"]) == ("rodatlas/study/1", "two slices")
    assert [t["status"] for t in data["tasks"]] == ["done", "done"]
    for task in data["tasks"]:
        slice_ = Slice.load(folder / "out" / task["file"])
        assert slice_.settings.identity() == task["settings"]
        assert f"  {task['file'][:-3]}: begun\n" in done.stderr
        assert f"  {task['file'][:-3]}: done [" in done.stderr
    assert "2 done in" in done.stderr


def test_a_finished_study_is_not_computed_again(finished, capsys, monkeypatch):
    folder, _ = finished
    monkeypatch.chdir(folder)
    times = {p.name: p.stat().st_mtime_ns for p in (folder / "out").glob("*.h5")}
    code, out, _ = run(capsys, "study", "two.toml", "--out", "out")
    assert code == 0
    assert "2 reused in" in out
    assert {p.name: p.stat().st_mtime_ns for p in (folder / "out").glob("*.h5")} == times


def test_show_lists_what_is_there(finished, capsys, monkeypatch):
    folder, done = finished
    monkeypatch.setenv("COLUMNS", "140")
    code, out, _ = run(capsys, "show", folder / "out")
    assert code == 0
    for task in json.loads(done.stdout)["tasks"]:
        assert task["file"] in out
    assert "study: two slices" in out
    assert "nu 0.3" in out
    assert "4 states, 9 branches" in out
    code, out, err = run(capsys, "show", folder / "out", "--check", "--json", "-")
    data = json.loads(out)
    assert [r["status"] for r in data["results"]] == ["complete", "complete"]
    assert [r["warnings"] for r in data["results"]] == [0, 0]
    assert "2 complete" in err


def test_show_lists_the_results_of_other_commands(finished, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    slice_ = Slice.load(sorted((finished[0] / "out").glob("*.h5"))[0])
    slice_.save(tmp_path / "slice-15.h5")
    slice_.branches[0].followed.branch.save(tmp_path / "branch.h5")
    slice_.states[0].solutions[0].save(tmp_path / "u.h5")
    (tmp_path / "cut.h5").write_bytes((tmp_path / "u.h5").read_bytes()[:4000])
    (tmp_path / "states.json").write_text('{"schema": "rodatlas/states/1", "angle_deg": 30, "states": [{}, {}]}')
    clamps = {"angle_left": 20.0, "angle_right": 35.0, "compression": 0.5, "shear": 0.0, "offset": 0.0, "twist": 30.0}
    unequal = {"schema": "rodatlas/states/1", "angle_deg": None, "shear": 0.0, "setting": clamps, "states": []}
    (tmp_path / "unequal.json").write_text(json.dumps(unequal))
    (tmp_path / "short.json").write_text(
        '{"schema": "rodatlas/slice/1", "angle_deg": 15, "shear_range": [0.0, 0.4], "states": [{}]}'
    )
    (tmp_path / "slice-15-diagram.png").write_bytes(b"")
    code, out, _ = run(capsys, "show", tmp_path, "--json", "-")
    assert code == 0
    data = json.loads(out)
    found = {r["file"]: (r["kind"], r["status"], r["contents"]) for r in data["results"]}
    points = len(slice_.branches[0].followed.branch)
    assert found == {
        "slice-15.h5": ("slice", "complete", "4 states, 9 branches"),
        "branch.h5": ("branch", "complete", f"{points} points"), "u.h5": ("solution", "complete", ""),
        "cut.h5": ("?", "damaged", ""), "states.json": ("states", "complete", "2 states"),
        "short.json": ("slice", "complete", "1 states"), "unequal.json": ("states", "complete", "0 states"),
    }  # fmt: skip
    settings = {r["file"]: r["settings"] for r in data["results"]}
    assert settings["short.json"] == {"angle_deg": 15, "shear_min": 0.0, "shear_max": 0.4}
    assert settings["unequal.json"] == {"shear": 0.0, "angle_left": 20.0, "angle_right": 35.0, "twist": 30.0}
    assert data["others"] == 1
    assert {p.name for p in tmp_path.iterdir() if p.name.startswith((".", "catalogue"))} == set()  # left alone


def test_a_study_that_lacks_a_result_exits_with_1_and_says_which(capsys, two, tmp_path):
    code, out, _ = run(capsys, "study", two, "--out", tmp_path / "out", "--dry-run", "--json", "-")
    assert code == 0
    assert not (tmp_path / "out").exists()
    files = [task["file"] for task in json.loads(out)["tasks"]]
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / files[1][:-3]).write_text("in the way of its branches")
    code, out, err = run(capsys, "study", two, "--out", tmp_path / "out", "--workers", "2")
    assert code == 1
    assert f"{files[1][:-3]} failed: ValueError: out: expected a folder that can be written" in out
    assert "1 done, 1 failed" in out
    assert err.count("trying again") == 2
    code, out, _ = run(capsys, "show", tmp_path / "out", "--json", "-")
    assert [r["status"] for r in json.loads(out)["results"]] == ["complete", "failed"]


def test_ctrl_c_keeps_everything_finished(two, tmp_path):
    command = [sys.executable, "-m", "rodatlas", "study", str(two), "--out", str(tmp_path / "out"), "--workers", "1"]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    for line in running.stderr:
        if ": done [1 of 2" in line:
            os.killpg(running.pid, signal.SIGINT)  # as a terminal does: to the workers too
            break
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "interrupted: 1 of 2 results and all finished branches are kept" in err
    assert "Traceback" not in err
    assert len(list((tmp_path / "out").glob("*.h5"))) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["study", "none.toml", "--out", "o"], "study: expected a file that can be read, got 'none.toml'"),
        (["study", "two.toml"], "Missing option '--out'"),
        (["study", "two.toml", "--out", "o", "--workers", "0"], "workers: expected a whole number from 1 to 1024"),
        (["study", "two.toml", "--out", "o", "--scheduler", "host"], "scheduler: expected an address such as tcp://"),
        (["study", "two.toml", "--out", "/proc/x"], "out: expected a folder that can be written"),
        (["study", "bad.toml", "--out", "o"], "bad.toml: slices[0].angle: expected degrees with 0 <= angle < 90, got"),
        (["show", "nowhere"], "folder: expected a folder with results, got 'nowhere'"),
        (["show"], "Missing argument 'FOLDER'"),
    ],
)
def test_wrong_input_is_one_line(capsys, two, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("[[slices]]\nangle = 95\n")
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"rodatlas: {message}")
    assert err.count("\n") == 1
