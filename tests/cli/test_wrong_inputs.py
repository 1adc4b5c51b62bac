"""Wrong values of every option of every command: one line on stderr, exit code 2, nothing written, no work begun.

The cases follow from the commands themselves: each option says by its metavar what kind of value it takes, and each
kind has values that are wrong for it. An option that is added later is covered by itself.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.core import TyperArgument, TyperOption

from command_options import COMMANDS, options_of
from rodatlas.cli import main
from rodatlas.cli.command import KINDS
from rodatlas.continuation import Solution

BASE = {
    "slice": ["--angle", "15"], "loci": [], "phase": [], "band": [], "paper": ["--figure", "setup"],
    "solve": ["--angle", "15", "--shear", "0.2", "--state", "U"], "states": ["--angle", "15", "--shear", "0.2"],
    "export": ["u.h5", "--out", "x.csv"], "study": ["study.toml", "--out", "new"], "show": ["folder"],
}  # fmt: skip
TEXTS = ["x", "", " ", "0x10", "1_000", "１５", "½", "1,5", "1 5", "15deg", "a\0b", "\n", "\x1b[31m", "--5"]
NUMBERS = [*TEXTS, "nan", "inf", "-inf", "1e400", "1e300", "-1e300", "9" * 5000]
NAMES = ["x" * 300, "a\0b", "", " ", "text.txt/x", "/proc/none/x"]
WRONG = {
    "NUMBER": NUMBERS, "DEGREES": [*NUMBERS, "1000", "-1000"], "MM": [*NUMBERS, "-1", "-1e-9"],
    "RATIO": [*NUMBERS, "0", "-1/80", "1/0", "80", "1/80/2", "/", "1/", "nan/2"],
    "INTEGER": [*TEXTS, "nan", "1.5", "1e5", "-1", "+-3", "1000000000000", "9" * 5000],
    "NAME": ["", " ", "Q", "U:", "U:0", "U:1:2", ":1", "U:１", f"W:{'9' * 5000}", "u u", "a\0b", "US++",
             "x" * 10_000, "\x1b[31m"],
    "FILE": [*NAMES, "."], "FOLDER": [*NAMES, "text.txt"], "FILE.toml": [*NAMES, ".", "none.toml", "text.txt"],
    "LxWxT": ["", "3", "240x3", "240x3x0.1x1", "ax3x0.1", "240x3xnan", "infx3x0.1", "-240x3x0.1", "240x500x0.1",
              "240x3x5", "240x3x1e-300", "1_0x3x0.1", "1e300x3x0.1", "240x0x0.1"],
    "ADDRESS": ["", "host", "host:80", "tcp://", "://x", "tcp://host", "tcp://ho st:80", "tcp://h:999999999", "a\0b"],
    "SECTION": ["", "rect:3", "rectangle", "rectangle:0.5", "rectangle:x", "rectangle:inf", "square:1", "circle,", "a:",
                "a:0", "a:1,b:0", "b:3", "a:1,b:2,c:3", "a:1,a:2", "ellipse:nan", "x" * 10_000],
    "VECTOR": ["", "1", "1,2", "1,2,3,4", "1,2,x", "1;2;3", "nan,0,0", "inf,0,0", "0,1e9,0", "a\0b,0,0"],
    "FORMAT": ["", "obj", "csv,stl", "c s v"], "CLASS": ["", "++", "x", "Both", "+-"],
}  # fmt: skip
FURTHER = {  # wrong for one option only
    ("slice", "--angle"): ["-1", "90", "-1e-12"], ("slice", "--shear-max"): ["0", "-0.1", "0.9", "1e-9"],
    ("slice", "--shear-min"): ["0.1", "-0.9"], ("slice", "--overlay"): ["none.csv", "text.txt", "u.h5"],
    ("loci", "--number"): ["19", "99"], ("loci", "--angle-max"): ["0", "10", "90", "-1"],
    ("phase", "--angle-min"): ["-1", "89.5"], ("phase", "--angle-max"): ["0", "-1", "90"],
    ("phase", "--workers"): ["0", "1000000", "2000"], ("paper", "--workers"): ["0", "1000000"],
    ("study", "--workers"): ["0", "1000000"], ("states", "--starts"): ["0", "100000000"],
    ("states", "--threads"): ["0", "1000000"], ("states", "--deflate"): ["0", "1000000"],
    ("states", "--offset"): ["0.9", "-0.9", "1"], ("states", "--twist"): ["721", "-721"],
    ("states", "--shear"): ["0.9", "-0.9", "1"], ("solve", "--shear"): ["0.9", "-0.9", "1"],
    ("solve", "--angle"): ["-1", "90", "95"], ("solve", "--from"): ["none", "folder"],
    ("export", "--samples"): ["0", "2", "1000000"], ("export", "--at"): ["1e7", "-1e7"],
    ("export", "--format"): ["stl", "vtp", "glb"], ("export", "FILE"): ["none.h5", "none.json", "text.txt"],
    ("band", "--length"): ["0", "1e-300", "1"], ("band", "--width"): ["0", "500", "1e-300", "0.1"],
    ("band", "--thickness"): ["0", "5", "1e-300"], ("band", "--modulus"): ["0", "-1", "1e308", "1e-300"],
    ("band", "--density"): ["0", "-1", "1e308", "1e-300"], ("band", "--angle"): ["-1", "90"],
    ("slice", "--from"): ["-1", "0.9"], ("slice", "--to"): ["-1", "0.9"], ("slice", "--shear"): ["0", "0.2"],
    ("loci", "--in"): ["angle", "angle,angle", "a,b,c"], ("phase", "--in"): ["shear"],
    ("band", "--angle-error"): ["-1", "90"], ("band", "--displacement-error"): ["500"],
}  # fmt: skip
for _name in BASE:
    FURTHER |= {(_name, "--poisson"): ["-1", "0.6", "-2"], (_name, "--tol"): ["0", "1", "-1e-8", "1e-11", "1e-5"]}
    FURTHER[_name, "--compression"] = ["0", "1", "-0.5", "1e-300", "1e-7", "0.9999999999"]
TOGETHER = [  # wrong only together
    (["slice", "--along", "compression", "--angle", "15", "--compression", "0.4"], "compression: expected none beside"),
    (["slice", "--along", "angle", "--angle", "15"], "angle: expected none beside --along angle, got '15'"),
    (["slice", "--along", "angle-left", "--angle-left", "15"], "angle-left: expected none beside --along angle-left"),
    (["slice", "--angle", "15", "--shear", "0.1"], "shear: expected none beside --along shear, got '0.1'"),
    (["slice", "--angle", "15", "--along", "compression", "--shear-max", "0.5"], "shear-max: expected the range by"),
    (["slice", "--angle", "15", "--from", "0.1", "--shear-max", "0.5"], "shear-max: expected the range by"),
    (["slice", "--angle", "15", "--from", "0.4", "--to", "0.2"], "from: expected a number below that of --to, 0.2"),
    (["slice", "--angle", "15", "--along", "lambda"], "along: expected one of poisson, compression, angle, "),
    (["slice", "--angle", "15", "--against", "mass"], "against: expected one of height, energy, force-x, "),
    (["slice", "--angle", "15", "--turn-left", "3", "--angle-left", "9"], "angle-left: expected no --angle beside"),
    (["slice", "--angle", "15", "--model", "arc"], "model: expected one of band, rod, elliptic-rod, "),
    (["slice", "--angle", "15", "--model", "rod", "--section", "square"], "section: expected none beside --model"),
    (["slice", "--angle", "15", "--section", "square", "--thickness", "0.3"], "thickness: expected none beside --sec"),
    (["slice", "--angle", "15", "--gravity", "0,0,1", "--gravity-z", "3"], "gravity-z: expected none beside --gravity"),
    (["slice", "--angle", "15", "--angle-left", "20"], "angle-left: expected no --angle beside --angle-left, got both"),
    (["slice", "--angle-left", "20"], "angle-right: expected --angle-right beside --angle-left, got none"),
    (["loci", "--in", "compression,shear"], "angle: expected --angle, or --angle-left and --angle-right, got none"),
    (["loci", "--in", "angle,shear", "--shear", "0.1"], "shear: expected none beside --in angle,shear, got '0.1'"),
    (["loci", "--in", "compression,shear", "--angle", "15", "--angle-max", "60"], "angle-max: expected none for the"),
    (["slice", "--angle", "15", "--out", "-"], "out: expected a folder that can be written, got '-'"),
    (["export", "u.h5", "--out", "-", "--format", "csv"], "out: expected a file name, got '-'"),
    (["solve", "--angle", "15", "--shear", "0", "--state", "U", "--out", "-"], "out: expected a file name, got '-'"),
    (["loci", "--all", "--number", "4"], "all: expected no --number"),
    (["paper", "--list", "--figure", "setup"], "list: expected no other option beside --list, got --figure"),
    (["paper", "--list", "--out", "x"], "list: expected no other option beside --list, got --out"),
    (["slice", "--angle", "15", "--band", "240x3x0.127"], "band: expected --band only with --overlay"),
    (["export", "u.h5", "--out", "x.csv", "--width", "1/8"], "width: expected no --width for tables"),
    (["export", "u.h5", "--out", "x.vtp", "--width", "1/8", "--band", "240x3x0.1"], "width: expected no --width"),
    (["export", "u.h5", "--out", "x.csv", "--format", "stl"], "format: expected csv, as the file 'x.csv' is called"),
    (["export", "states.json", "--out", "x.csv", "--samples", "9"], "samples: expected --samples only for the table"),
    (["export", "u.h5", "--out", "x.csv", "--at", "0"], "at: expected --state beside --at for a table"),
    (["study", "study.toml", "--out", "o", "--workers", "2", "--scheduler", "tcp://h:80"], "workers: expected no"),
    (["phase", "--angle-min", "50", "--angle-max", "40"], "angle-max: expected degrees with 50.01 <= angle-max"),
    (["band", "--length", "10", "--width", "20"], "band width: expected a positive length from 1e-08 to the len"),
    (["band", "--width", "3", "--thickness", "5"], "band thickness: expected a positive length from"),
    (["band", "--modulus", "1e308", "--width", "1e200"], "band width: expected a positive length"),
    (["slice", "--angle", "15", "--out", "new", "--json", "."], "json: expected a file name or -, got the folder '.'"),
    (["states", "--shear", "0"], "angle: expected --angle, or --angle-left and --angle-right, got none"),
    (["states", "--shear", "0", "--angle-left", "20"], "angle-right: expected --angle-right beside --angle-left, got"),
    (["states", "--shear", "0", "--angle-right", "20"], "angle-left: expected --angle-left beside --angle-right, got"),
    (["states", "--shear", "0", "--angle", "20", "--angle-right", "20"], "angle-right: expected no --angle beside"),
    (["states", "--shear", "0", "--angle-left", "181", "--angle-right", "0"], "angle-left: expected degrees between"),
    (["states", "--shear", "0.5", "--angle", "20", "--offset", "0.8"], "shear: expected a number of size below 0.33"),
    (["slice"], "angle: expected --angle, or --angle-left and --angle-right, got none"),
    (["solve"], "Missing option '--state'"), (["states", "--angle", "1"], "Missing opt"),
    (["export", "u.h5"], "Missing option '--out'"), (["export"], "Missing argument"), (["show"], "Missing argument"),
    (["study", "study.toml"], "Missing option '--out'"), (["slyce"], "No such command 'slyce'"),
    (["--angle", "15"], "No such option"), (["show", "folder", "more"], "Got unexpected extra argument"),
    (["band", "240"], "Got unexpected extra argument"), ([""], "No such command"),
    (["band", "--fresh"], "No such option"),
    (["slice", "--angle"], "Option '--angle' requires an argument"), (["slice", "--fresh=1", "--angle=1"], "Option"),
]  # fmt: skip


def options(name: str) -> Iterator[TyperOption]:
    """Options of a command that take a value."""
    return (p for p in options_of(name) if not p.is_flag)


def without(arguments: list[str], option: str) -> list[str]:
    """Arguments of a command without those of one option."""
    if option not in arguments:
        return arguments
    at = arguments.index(option)
    return arguments[:at] + arguments[at + 2 :]


def cases() -> Iterator[tuple[list[str], str]]:
    """Command lines, each with one wrong value, and the option that is wrong."""
    for name, base in BASE.items():
        for option in options(name):
            called = option.opts[0]
            for value in [*WRONG[option.metavar], *FURTHER.get((name, called), [])]:
                yield [name, *without(base, called), f"{called}={value}"], called.lstrip("-")
        for argument in (p for p in COMMANDS[name].params if isinstance(p, TyperArgument)):
            for value in [*WRONG[argument.metavar], *FURTHER.get((name, argument.metavar), [])]:
                yield [name, value, *base[1:]], ""


def repeated() -> Iterator[tuple[list[str], str]]:
    """Command lines with an option twice that takes one value."""
    for name, base in BASE.items():
        for option in (o for o in options(name) if not o.multiple):
            called = option.opts[0]
            rest = without(base, called)
            yield [name, *rest, called, "20", called, "35"], f"{called[2:]}: expected once, got 20 and 35"
            yield [name, called, "20", *rest, f"{called}=20"], f"{called[2:]}: expected once, got 20 and 20"


CASES, REPEATED = list(cases()), list(repeated())


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with right files of every kind that commands read."""
    folder = tmp_path_factory.mktemp("place")
    Solution.from_function(lambda s: s[:, None], ("v",), {"lam": 1.0}).save(folder / "u.h5")
    (folder / "text.txt").write_text("hello\n")
    (folder / "study.toml").write_text("[[slices]]\nangle = 15\n")
    state = '{"name": "U", "class": "+", "energy": 1, "N0": [0, 0, 0], "M0": [0, 0, 0]}'
    setting = '"setting": {"angle": 15, "compression": 0.5, "shear": 0.1, "offset": 0, "twist": 0, "poisson": 0.25}'
    (folder / "states.json").write_text(f'{{"schema": "rodatlas/states/1", {setting}, "states": [{state}]}}')
    (folder / "folder").mkdir()
    return folder


WORK = {  # where each command begins to compute
    "rodatlas.atlas.slices.obtain": "compute_slice", "rodatlas.paper.model": "find_states",
    "rodatlas.states.discover": "hunt", "rodatlas.atlas.experiments.real_band": "state_at",
    "rodatlas.atlas.loci.obtain": "compute_loci", "rodatlas.atlas.phase.obtain": "obtain_slices",
    "rodatlas.atlas.study.run": "LocalExecutor", "rodatlas.paper.output": "draw_to",
}  # fmt: skip


@pytest.fixture
def refused(capsys, place, monkeypatch):
    """Runs a wrong command line and gives its line."""
    monkeypatch.chdir(place)

    def work(*_: object, **__: object) -> None:
        raise AssertionError("work has begun")

    for module, name in WORK.items():
        monkeypatch.setattr(importlib.import_module(module), name, work)

    def refuse(arguments: list[str]) -> str:
        before = state_of(place)
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        out, err = capsys.readouterr()
        assert (stop.value.code, out) == (2, ""), err
        assert err.startswith("rodatlas: ")
        assert len(err.splitlines()) == 1
        assert err.isprintable() or err[:-1].isprintable()
        assert len(err) < 2100
        assert state_of(place) == before
        return err

    return refuse


def state_of(folder: Path) -> dict[str, tuple[int, int]]:
    """All files and folders with their sizes; the times of files, not of folders, which trials touch."""
    return {
        str(p): (p.stat().st_size, p.stat().st_mtime_ns if p.is_file() else 0) for p in sorted(folder.rglob("*"))
    }  # fmt: skip


@pytest.mark.parametrize(("arguments", "field"), CASES, ids=lambda x: " ".join(x)[:60] if isinstance(x, list) else "")
def test_a_wrong_value_is_one_line_that_names_it(refused, arguments, field):
    line = refused(arguments)
    named = field.replace("-", " ") in line.replace("-", " ")
    assert named or line.startswith("rodatlas: text.txt, line 1")  # of a file that is read, the line
    assert ", got " in line or "Option" in line


@pytest.mark.parametrize(("arguments", "message"), TOGETHER + REPEATED, ids=lambda x: " ".join(x)[:60])
def test_wrong_together(refused, arguments, message):
    assert refused(arguments).startswith(f"rodatlas: {message}")


def test_there_are_cases_for_every_command_and_kind():
    assert set(BASE) == set(COMMANDS)
    assert set(WRONG) == set(KINDS)
    assert len(CASES) + len(REPEATED) + len(TOGETHER) >= 500
    for name, option in FURTHER:
        called = {p.opts[0] for p in options(name)} | {p.metavar for p in COMMANDS[name].params}
        assert option in called or option in ("--poisson", "--tol", "--compression")
