"""Any registered model on the command line: its controls are options, its names and quantities are in what is said."""

import json

import pytest

import arch_model  # noqa: F401  (registers the shallow arch)
from rodatlas.cli import main
from rodatlas.cli.setting import slice_settings_from
from rodatlas.paper import band


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    told = capsys.readouterr()
    return stop.value.code or 0, told.out, told.err


@pytest.mark.parametrize("command", ["slice", "solve", "loci", "phase"])
def test_every_control_is_an_option(capsys, command):
    text = run(capsys, command, "-h")[1]
    assert all(f"--{control.name} " in text for control in band().controls)
    text = run(capsys, command, "--model", "arch", "-h")[1]
    assert "--rise NUMBER" in text
    assert "--load NUMBER" in text
    assert "--angle" not in text.replace("--angle-m", "")


@pytest.mark.parametrize(
    ("options", "model", "values"),
    [
        ((), "band", {}),
        (("--section", "rectangle:23.6"), "rod", {"thickness": 1 / 23.6, "poisson": 0.25}),
        (("--section=square", "--poisson", "0.3"), "rod", {"thickness": 1.0, "poisson": 0.3}),
        (("--section", "ellipse:3"), "elliptic-rod", {"thickness": 1 / 3}),
        (("--section", "circle"), "round-rod", {}),
        (("--section", "a:0.625"), "given-rod", {"a": 0.625, "c2": 0.0}),
        (("--section", "a:0.7,b:18"), "given-rod", {"a": 0.7, "c2": 1 / 18}),
        (("--gravity", "0,0,-20"), "rod", {"thickness": 0.0, "gravity-x": 0.0, "gravity-z": -20.0}),
        (("--gravity-y=2",), "rod", {"gravity-y": 2.0}),
        (("--rest", "1,0,0.5", "--section", "circle"), "round-rod", {"rest-k1": 1.0, "rest-twist": 0.5}),
        (("--thickness", "0.1"), "rod", {"thickness": 0.1}),
        (("--along=shear", "--thickness", "0.1"), "rod", {"thickness": 0.1}),
    ],
)
def test_sections_weights_and_rest_strains_choose_a_model(monkeypatch, capsys, options, model, values):
    given = []
    monkeypatch.setattr("rodatlas.cli.slice.run", lambda fixed, *_: given.append(fixed))
    assert run(capsys, "slice", "--angle", "15", *options)[0] == 0
    settings = slice_settings_from(given[0], "1e-8")
    assert (settings.model.name, settings.along, settings.setting["angle"]) == (model, "shear", 15.0)
    assert {name: settings.setting[name] for name in values} == pytest.approx(values)


def test_what_varies_chooses_a_model_too(monkeypatch, capsys):
    given = []
    monkeypatch.setattr("rodatlas.cli.slice.run", lambda fixed, *_: given.append(fixed))
    monkeypatch.setattr("rodatlas.cli.loci.run", lambda numbers, fixed, *_: given.append(fixed))
    assert run(capsys, "slice", "--angle", "15", "--along", "gravity-z")[0] == 0
    assert run(capsys, "loci", "--angle", "15", "--in", "thickness,shear")[0] == 0
    assert run(capsys, "loci", "--angle", "15", "--in=compression,shear")[0] == 0
    assert [fixed.model.name for fixed in given] == ["rod", "rod", "band"]


def test_the_arch_from_end_to_end(capsys, tmp_path):
    """Pitchforks at a^2 = h^2 - 4 = 5, where q/pi^4 = h - a + a (h^2 - a^2) = 3 + 3 a."""
    out = str(tmp_path)
    code, printed, told = run(capsys, "slice", "--model", "arch", "--rise", "3", "--out", out, "--json", "-")
    assert code == 0
    data = json.loads(printed)
    assert (data["model"], data["setting"], data["along"]) == ("arch", {"rise": 3.0}, "load")
    assert {s["name"] for s in data["states"]} == {"A1", "A2"}
    assert sorted(max(s["load"]) for s in data["states"]) == [pytest.approx(3 + 3 * 5**0.5, abs=1e-6), 15.0]
    assert "Stable states at rise 3" in told
    code, printed, _ = run(capsys, "solve", "--model=arch", "--load", "1", "--state", "A1", "--from", out, "--out",
                           str(tmp_path / "a"))  # fmt: skip
    assert code == 0
    assert "A1 (from a stored slice)" in printed
    a = float(next(line for line in printed.splitlines() if line.startswith("│ a ")).split("│")[2])
    assert 3 - a + a * (9 - a * a) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("slice", "--model", "arc"), "model: expected one of band, "),
        (("slice", "--model", "arch", "--angle", "3"), "No such option: --angle"),
        (("slice", "--model", "arch", "--rise", "three"), "rise: expected a number, got 'three'"),
        (("slice", "--model=arch", "--model", "arch"), "model: expected once, got arch and arch"),
        (("loci", "--model"), "Option '--model' requires an argument"),
        (("slice", "--model", "arch", "--shear-max", "3"), "shear-max: expected the range by --from and --to alone"),
        (("loci", "--model", "arch", "--angle-max", "3"), "angle-max: expected none for the plane of rise and load"),
        (("loci", "--model", "arch", "--in", "rise,angle"), "in: expected one of rise, load, got 'angle'"),
        (("slice", "--angle", "15", "--turn-left", "3", "--angle-left", "20"), "angle-left: expected no --angle"),
        (("slice", "--angle-right", "15", "--turn-left", "3", "--angle-left", "20"),
         "angle-left: expected none beside turn-left"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(capsys, tmp_path, monkeypatch, arguments, line):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"rodatlas: {line}")
    assert err.count("\n") == 1


@pytest.mark.slow
def test_a_section_from_end_to_end(capsys, tmp_path):
    """The band of the paper, D/t = 23.6: its pitchforks are those of an independent program, and it is drawn."""
    code, printed, told = run(capsys, "slice", "--angle", "15", "--section", "rectangle:23.6", "--out", str(tmp_path),
                              "--json", "-")  # fmt: skip
    assert code == 0
    data = json.loads(printed)
    assert (data["model"], data["warnings"]) == ("rod", [])
    assert data["setting"]["thickness"] == pytest.approx(1 / 23.6)
    upper = next(b for b in data["branches"] if b["id"] == "U")
    found = [event["shear"] for event in upper["special"] if event["kind"] == "pitchfork"]
    assert found == pytest.approx([0.331245594, 0.617774807], abs=1e-7)
    assert len(data["states"]) == 9  # as many as the thin band has names for at 15 degrees
    assert "Stable states at angle 15 deg" in told
    ends = {p.name.rpartition("-")[2] for p in tmp_path.glob("slice-rod-15*.png")}
    assert ends == {"diagram.png", "profiles.png"}
    solved, shape = str(tmp_path / "u"), str(tmp_path / "u.vtp")
    code, printed, _ = run(capsys, "solve", "--angle", "15", "--section", "rectangle:23.6", "--shear", "0.2", "--state",
                           "C1", "--from", str(tmp_path), "--out", solved)  # fmt: skip
    assert code == 0
    assert "0.19543525" in printed
    assert run(capsys, "export", f"{solved}.h5", "--out", shape)[0] == 0
    assert (tmp_path / "u.vtp").stat().st_size > 10_000
