"""How commands end: exit codes, one line for whatever goes wrong, and nothing refused that is right."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

import rodatlas.cli.show
from rodatlas.atlas.study import TasksFailed
from rodatlas.cli import main
from rodatlas.cli.common import number, whole_number
from rodatlas.cli.output import json_target
from rodatlas.continuation import NotConverged
from rodatlas.continuation.discrete.newton import NewtonCode
from rodatlas.rods import Band, BandUnits, Ends

NOT_FOUND = NotConverged(NewtonCode.SINGULAR, "state")


@pytest.fixture
def raising(monkeypatch, capsys):
    """Lets `show` raise an error; the exit code and what is printed."""

    def run(error: BaseException) -> tuple[int, str]:
        def fail(*_: object) -> None:
            raise error

        monkeypatch.setattr(rodatlas.cli.show, "run", fail)
        with pytest.raises(SystemExit) as stop:
            main(["show", "folder"])
        out, err = capsys.readouterr()
        assert out == ""
        return stop.value.code, err

    return run


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (NOT_FOUND, 1, f"{NOT_FOUND}"),
        (TasksFailed("1 of 2 slices could not be computed"), 1, "1 of 2 slices could not be computed"),
        (MemoryError("8 TB"), 1, "memory: expected enough for this, got too little (8 TB)"),
        (ValueError("angle: expected a number,\n got 'x'"), 2, "angle: expected a number, got 'x'"),
        (ValueError("a\x1b[31m\x07\udc80"), 2, "a\\x1b[31m\\x07\\udc80"),
        (ValueError("x" * 5000), 2, f"{'x' * 2000}..."),
        (PermissionError(13, "Permission denied", "a.h5"), 2,
         "file: expected one that can be read and written, got 'a.h5' (Permission denied)"),
        (OSError(28, "No space left on device"), 2,
         "output: expected room and a place to write to, got an error (No space left on device)"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"), 2, "text: expected UTF-8, got something else"),
        (TypeError("no"), 70, "fault of the program: TypeError: no; RODATLAS_TRACEBACK=1 shows where it came from"),
        (KeyError("k"), 70, "fault of the program: KeyError: 'k'; RODATLAS_TRACEBACK=1 shows where it came from"),
        (OverflowError("too large"), 70, "fault of the program: OverflowError: too large"),
        (RecursionError("deep"), 70, "fault of the program: RecursionError: deep"),
        (json.JSONDecodeError("bad", "x", 0), 70, "fault of the program: JSONDecodeError: bad"),
    ],
    ids=lambda x: type(x).__name__,
)  # fmt: skip
def test_whatever_goes_wrong_is_one_line(raising, error, code, line):
    ended, err = raising(error)
    assert ended == code
    assert err.startswith(f"rodatlas: {line}")
    assert len(err.splitlines()) == 1


def test_an_interrupt_says_nothing_more(raising):
    assert raising(KeyboardInterrupt()) == (130, "")


def test_the_traceback_comes_on_demand(raising, monkeypatch):
    monkeypatch.setenv("RODATLAS_TRACEBACK", "1")
    code, err = raising(TypeError("no"))
    assert code == 70
    assert err.startswith("Traceback")
    assert err.splitlines()[-1].startswith("rodatlas: fault of the program: TypeError: no")


def run(*arguments: str, **more: object) -> subprocess.CompletedProcess[str]:
    whole = [sys.executable, "-m", "rodatlas", *arguments]
    return subprocess.run(whole, text=True, stderr=subprocess.PIPE, timeout=120, check=False, **more)


def test_a_reader_that_has_enough_is_no_error():
    read, write = os.pipe()
    os.close(read)
    done = run("paper", "--list", stdout=write)
    os.close(write)
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_output_that_has_no_room_is_one_line(tmp_path):
    with open("/dev/full", "w") as full:
        done = run("paper", "--list", stdout=full)
    assert done.returncode == 2
    assert done.stderr == (
        "rodatlas: output: expected room and a place to write to, got an error (No space left on device)\n"
    )
    with pytest.raises(ValueError, match=r"^json: expected a file that can be written, got '/dev/full' \(No space"):
        json_target("/dev/full").write("{}", {})


def test_devices_are_written_to_and_not_replaced():
    json_target(os.devnull).write("{}", {})
    assert not os.path.isfile(os.devnull)


def test_a_new_folder_for_json_is_made_when_the_result_is_there(tmp_path):
    wanted = str(tmp_path / "a/b/x.json")
    target = json_target(wanted)
    assert list(tmp_path.iterdir()) == []
    target.write("{}", {})
    assert (tmp_path / "a/b/x.json").read_text() == "{}"


@pytest.mark.parametrize(
    ("text", "value"),
    [("15", 15.0), (" 15 ", 15.0), ("+15", 15.0), ("1.5e1", 15.0), ("015", 15.0), (".5", 0.5), ("5.", 5.0), ("-0", 0.0),
     ("1E-3", 1e-3), ("1e-320", 1e-320)],
)  # fmt: skip
def test_odd_numbers_that_are_right(text, value):
    assert number("x", text) == value


@pytest.mark.parametrize(("text", "value"), [("3", 3), (" 3 ", 3), ("+3", 3), ("003", 3), ("-3", -3), ("0", 0)])
def test_odd_whole_numbers_that_are_right(text, value):
    assert whole_number("x", text) == value


def test_odd_settings_that_are_right():
    for compression in (1e-6, 1e-3, 0.999, 0.999999):
        assert Ends(15.0, compression).compression == compression
    assert Ends(-180.0).angle_deg == -180.0
    BandUnits(Band(1e-6, 1e-6, 1e-6), young=1e-9, density=1e-3)
    BandUnits(Band(1e9, 1e9, 1.0), young=1e6, density=1e5)
    assert Band.from_text(" 240 × 3 x .127mm ") == Band(240.0, 3.0, 0.127)


def test_odd_command_lines_that_are_right(capsys, tmp_path, monkeypatch):
    """Flags may be repeated, values may follow = or a space, options may come in any order."""
    monkeypatch.chdir(tmp_path)
    for arguments in (["--check", "--check", "."], ["./", "--json=ö ä.json"], [".", "--json", "-"]):
        with pytest.raises(SystemExit) as stop:
            main(["show", *arguments])
        assert stop.value.code == 0
    assert "1 complete" in capsys.readouterr().err
    assert (tmp_path / "ö ä.json").exists()
