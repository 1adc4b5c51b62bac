"""Settings from the options of `slice`, `solve`, `loci` and `phase`: every control of the model is an option."""

import json

import numpy as np
import pytest

from rodatlas.cli import main
from rodatlas.cli.controls import Fixed
from rodatlas.cli.setting import Range, plane_from, slice_settings_from
from rodatlas.paper import band, band_slice
from rodatlas.rods import Ends


def given(texts):
    return Fixed(band(), texts)


def test_without_more_they_are_those_of_the_paper():
    assert slice_settings_from(given({"angle": "15"}), "1e-8") == band_slice(15.0)
    shorter = slice_settings_from(given({"angle": "15", "compression": "0.4"}), "1e-8", "0", Range(shear_max="0.3"))
    assert shorter == band_slice(15.0, 0.4, shear_max=0.3, search=0)


def test_unequal_clamps_are_those_of_the_ends():
    texts = {"angle-left": "20", "angle-right": "35", "twist": "30", "offset": "0.1"}
    found = slice_settings_from(given(texts), "1e-8")
    assert {k: found.setting[k] for k in ("angle", "turn-left", "turn-right")} == {
        "angle": 27.5, "turn-left": pytest.approx(-7.5), "turn-right": pytest.approx(7.5)
    }  # fmt: skip
    ends = Ends.unequal(20.0, 35.0, offset=0.1, twist_deg=30.0)
    mine, theirs = found.parameters, ends.parameters
    sums = [("psi0", "turn_left"), ("psi0", "turn_right"), ("dY",), ("twist_right",), ("dL",)]
    for names in sums:
        assert sum(mine[n] for n in names) == pytest.approx(sum(theirs[n] for n in names), abs=1e-12)
    assert not found.named
    downward = slice_settings_from(given({"angle-left": "-20", "angle-right": "10"}), "1e-8")
    raw = downward.parameters
    left, right = (np.degrees(raw["psi0"] + raw[name]) for name in ("turn_left", "turn_right"))
    assert (left, right) == (pytest.approx(-20.0), pytest.approx(10.0))


def test_any_control_may_vary():
    found = slice_settings_from(given({"angle": "20"}), "1e-8", "64", Range("compression", "0.3", "0.6", "force-x"))
    assert (found.along, found.low, found.high, found.against, found.search) == ("compression", 0.3, 0.6, "force-x", 64)
    assert found.setting["shear"] == 0.0
    assert found.stem == "slice-20-along-compression-dL0.3to0.6-against-force-x-search64"
    one = slice_settings_from(given({"angle-right": "30"}), "1e-8", "0", Range("angle-left", "10", "40"))
    assert one.setting["turn-right"] == pytest.approx(0.0)
    assert one.value_at(one.raw(25.0)) == pytest.approx(25.0)


def test_planes_of_any_two_controls():
    assert plane_from(given({}), None)[1:3] == ("angle", "shear")
    plane = plane_from(given({"angle": "20"}), "compression,shear")
    assert plane == (band(), "compression", "shear", {"angle": 20.0})


@pytest.mark.slow
def test_force_against_compression_from_end_to_end(tmp_path, capsys):
    out = str(tmp_path)
    with pytest.raises(SystemExit) as leave:
        main(["slice", "--along", "compression", "--from", "0.45", "--to", "0.55", "--against", "force-x", "--angle",
              "20", "--search", "0", "--out", out, "--json", "-"])  # fmt: skip
    assert not leave.value.code
    printed, told = capsys.readouterr()
    data = json.loads(printed)
    assert (data["along"], data["against"], data["setting"]["angle"]) == ("compression", "force-x", 20.0)
    assert data["compression_range"] == [0.45, 0.55]
    state = next(s for s in data["states"] if s["branch"] == "U")
    energy, force, lengths = (np.array(state[name]) for name in ("energy", "force-x", "compression"))
    assert np.diff(energy) == pytest.approx(-force.mean() * np.diff(lengths), rel=1e-3)  # work, by the trapezoid
    assert state["force"][0][0] == pytest.approx(state["force-x"][0])
    assert "dE/d(compression) = -force-x" in " ".join(told.split())
    stem = "slice-20-along-compression-dL0.45to0.55-against-force-x-search0"
    assert {p.name for p in tmp_path.iterdir()} >= {f"{stem}.h5", f"{stem}.json", f"{stem}-diagram.png"}
