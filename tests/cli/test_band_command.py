"""`rodatlas band`: what it prints and how it refuses."""

import json

import pytest

from rodatlas.cli import main


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(["band", *arguments])
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


def test_json_alone_on_stdout(capsys):
    code, out, err = run(capsys, "--width", "30", "--modulus", "4.5", "--density", "1390", "--json", "-")
    assert code == 0
    data = json.loads(out)
    assert data["schema"] == "rodatlas/band/1"
    assert data["limiting_shear"] == pytest.approx(0.75)
    assert data["narrow_band_model"] == "does not hold"
    assert data["weight"] == pytest.approx(data["weight_N"] / data["force_N"])
    force = data["weight_over_force"] * data["width_checks"][0]["force"]
    assert force == pytest.approx(data["weight"])
    assert "180.000 mm" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--length", "x"], "length: expected a number, got 'x'"),
        (["--width", "0"], "band width: expected a positive length from 2.4e-07 to the length, 240, got 0.0"),
        (["--thickness", "inf"], "band thickness: expected a positive length from 2.4e-07 to the width, 3, got inf"),
        (["--modulus", "-1"], "modulus: expected a positive Young's modulus in GPa, from 1e-09 to 1e+06, got -1.0"),
        (["--density", "0"], "density: expected a positive density in kg/m^3, from 0.001 to 100000, got 0.0"),
        (["--compression", "1"], "compression: expected a number between 0 and 1 (from 1e-06 to 0.999999), got 1.0"),
        (["--poisson", "0.6"], "poisson: expected a number with -1 < nu <= 0.5, got 0.6"),
        (["--angle", "95"], "angle: expected degrees with 0 <= angle < 90, got 95.0"),
        (["--angle-error", "-1"], "angle error: expected degrees of at least 0"),
        (["--json", "/proc/none/x"], "json: expected a folder that can be written, got '/proc/none'"),
    ],
)
def test_wrong_input_is_one_line(capsys, arguments, message):
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"rodatlas: {message}")
    assert err.count("\n") == 1
