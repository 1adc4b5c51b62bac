"""Files that the user names beside those that commands name themselves: none takes the place of another."""

import json
import threading
from pathlib import Path

import pytest

from rodatlas.cli import main
from rodatlas.cli.output import JsonTarget, json_target, place_files, write_own_json
from rodatlas.cli.overlay import overlay_mark

STEM = "slice-15"
DATA = "measured-" + "x" * 200 + ".csv"


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Runs a wrong command line and gives its line; nothing is written and no work begins."""
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text("[[slices]]\nangle = 15\n")
    Path("a.csv").write_text("state,shear_min,shear_max\nU,0.0,0.01\n")

    def refuse(*arguments):
        before = sorted(Path().rglob("*"))
        with pytest.raises(SystemExit) as stop:
            main(list(arguments))
        out, err = capsys.readouterr()
        assert (stop.value.code, out, err.count("\n")) == (2, "", 1)
        assert sorted(Path().rglob("*")) == before
        return err

    return refuse


@pytest.mark.parametrize("arguments", [
    ("slice", "--angle", "15", "--json", f"out/{STEM}.h5"), ("slice", "--angle", "15", "--json", "x.PNG"),
    ("loci", "--json", "out/slice-15.h5"), ("phase", "--json", "out/phase.pdf"),
    ("states", "--angle", "15", "--shear", "0", "--json", f"out/{STEM}.h5", "--overwrite"),
    ("show", ".", "--json", "catalogue.sqlite"),
])  # fmt: skip
def test_json_takes_no_name_of_another_kind_of_result(refused, arguments):
    assert "json: expected a name for JSON, got" in refused(*arguments)


@pytest.mark.parametrize("arguments", [
    ("slice", "--angle", "15", "--overlay", "a.csv", "--json", f"out/../out/{STEM}.json"),
    ("study", "study.toml", "--out", "out", "--json", "out/study.json"),
    ("study", "study.toml", "--out", "out", "--json", "out/study.json", "--dry-run"),
    ("paper", "--figure", "setup", "--json", "out/paper.json"),
    ("paper", "--figure", "setup", "--json", "out/fig-setup.json", "--overwrite"),
])  # fmt: skip
def test_json_takes_no_name_that_the_command_itself_writes(refused, arguments):
    """Else it would be refused after the work, or the record of the folder be lost."""
    assert "json: expected a file that the command does not write itself, got 'out/" in refused(*arguments)


def test_what_has_the_name_of_a_commands_json_is_kept(tmp_path, capsys):
    """That of a search, say, which the user has called so; and what is no JSON at all."""
    path = tmp_path / "slice-15.json"
    identity = {"angle": 15.0, "range": (0.0, 0.1)}
    for i, text in enumerate(['{"identity": {"angle": 30}}\n', "[1]", "{", '"text"', "null", "\x00"]):
        path.write_text(text)
        write_own_json(path, json.dumps({"identity": identity, "n": i}), identity)
        assert json.loads(path.read_text())["n"] == i
        aside = tmp_path / ("slice-15.json.other" + (f"-{i + 1}" if i else ""))
        assert aside.read_text() == text
        assert f"which is kept as {aside.name}" in capsys.readouterr().err
        write_own_json(path, json.dumps({"identity": identity, "n": i}), identity)  # its own is replaced
    assert len(list(tmp_path.iterdir())) == 7


def test_names_of_measured_data_are_cut(tmp_path):
    for content in ("a", "b"):
        (tmp_path / DATA).write_text(content)
        stem = "slice-15.123456-dL0.512345-nu0.312345-dD-0.0123456to0.123456"
        (tmp_path / f".{stem}-overlay-{overlay_mark(str(tmp_path / DATA), None)}.json.0123456789ab.partial").touch()
    assert len(list(tmp_path.iterdir())) == 3


def test_two_exports_at_once_never_replace_each_other(tmp_path):
    """Both have looked whether the name is free before either has written: one of them is refused."""
    met, told = threading.Barrier(2), []

    def export(text):
        def write(target):
            target.write_text(text)
            met.wait(10)
            return [target]

        try:
            place_files(tmp_path / "t.csv", write, False)
            told.append(text)
        except ValueError as error:
            told.append(str(error))

    threads = [threading.Thread(target=export, args=(text,)) for text in ("one", "two")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (kept,) = set(told) & {"one", "two"}
    assert (tmp_path / "t.csv").read_text() == kept
    assert [p.name for p in tmp_path.iterdir()] == ["t.csv"]


def test_all_files_of_an_export_or_none(tmp_path):
    (tmp_path / "t-b.csv").mkdir()

    def write(target):
        paths = [target.with_name(f"t-{name}.csv") for name in "ab"]
        for path in paths:
            path.write_text("x")
        return paths

    with pytest.raises(ValueError, match=r"t-b\.csv', which is no file"):
        place_files(tmp_path / "t.csv", write, True)
    assert [p.name for p in tmp_path.iterdir()] == ["t-b.csv"]


def test_two_results_at_once_under_one_json_name(tmp_path):
    target = json_target(str(tmp_path / "s.json"))
    met, expect, refused = threading.Barrier(2), JsonTarget.expect, []

    def write(angle):
        identity = {"angle": angle}
        expect(target, identity)
        met.wait(10)
        try:
            target.write(json.dumps({"identity": identity}), identity)
        except ValueError as error:
            refused.append(str(error))

    threads = [threading.Thread(target=write, args=(angle,)) for angle in (15, 30)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["s.json"]
