"""`rodatlas slice --overlay`: what it adds to the slice, and that wrong data are told before any work."""

import json
from pathlib import Path

import pytest

from rodatlas.cli import main
from small_results import plain_figure

EXAMPLE = Path(__file__).parents[2] / "examples/data/synthetic-ranges-15deg.csv"


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(["slice", "--angle", "15", *map(str, arguments)])
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


@pytest.mark.slow
def test_overlay_adds_a_table_a_figure_and_json(capsys, tmp_path, monkeypatch, slice_15):
    monkeypatch.setattr("rodatlas.plot.draw_slice_figure", plain_figure)
    slice_15.save(tmp_path / "slice-15.h5")
    code, out, err = run(capsys, "--out", tmp_path, "--overlay", EXAMPLE, "--band", "240x3x0.127", "--json", "-")
    assert code == 0
    data = json.loads(out)
    (written,) = tmp_path.glob("slice-15-overlay-synthetic-ranges-15deg-????????.json")
    assert data["overlay"] == json.loads(written.read_text())
    assert "overlay" not in json.loads((tmp_path / "slice-15.json").read_text())
    assert data["overlay"]["ranges"][0]["high"]["number"] == 4
    assert "read from " in err
    assert "Measured and computed ends" in err
    assert {p.name for p in tmp_path.glob("*-overlay-*")} == {f"{written.stem}.{x}" for x in ("png", "pdf", "json")}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--overlay", "none.csv"], "overlay: expected a CSV file, got 'none.csv' (No such file or directory)"),
        (["--overlay", "."], "overlay: expected a CSV file, got '.' (Is a directory)"),
        (["--overlay", EXAMPLE], f"{EXAMPLE}, line 5, column band: expected LENGTHxWIDTHxTHICKNESS in mm (or --band)"),
        (["--overlay", EXAMPLE, "--band", "3"], "band: expected LENGTHxWIDTHxTHICKNESS in mm such as"),
        (["--band", "240x3x0.127"], "band: expected --band only with --overlay"),
    ],
)
def test_wrong_data_are_told_before_any_work(capsys, tmp_path, options, message):
    code, out, err = run(capsys, "--out", tmp_path / "new", *options)
    assert (code, out) == (2, "")
    assert err.startswith(f"rodatlas: {message}")
    assert err.count("\n") == 1
    assert not (tmp_path / "new").exists()
