"""Measured ranges: how they are read, converted and compared with a slice; wrong tables say where they are wrong."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from rodatlas.atlas.experiments.comparison import compare
from rodatlas.atlas.experiments.measured import Measurement, family_of, read_measurements
from rodatlas.atlas.experiments.sensitivity import sensitivity
from rodatlas.paper.model import band_slice
from rodatlas.rods import Band, BandUnits, ClampErrors, limiting_shear

EXAMPLE = Path(__file__).parents[2] / "examples/data/synthetic-ranges-15deg.csv"
NARROW = Band(240.0, 3.0, 0.127)
PITCHFORK_4, FOLD_6 = 0.327675302, 0.579102  # of the slice at 15 degrees


def read(tmp_path, text, band=None):
    path = tmp_path / "data.csv"
    path.write_text(text, encoding="utf-8")
    return read_measurements(path, band)


def ends(comparison):
    """(state, label, side) -> end."""
    return {
        (c.measurement.state, c.measurement.label, side): getattr(c, side)
        for c in comparison.checks
        for side in ("low", "high")
    }


def test_all_columns(tmp_path):
    text = (
        "\ufeff# a comment, with commas\n\nShear_Max, state, shear_min, unit, width, band, label, error\n"
        '78.64, U, 0, MM, , 240x3x0.127, "mine, the first", 0.5\n'
        "# between\n"
        "0.4, US+, 0.35, limit, 1/8, , ,\n"
        "0.34, U2, 0.3, , 30 mm, 240x3x0.127, ,\n"
    )
    first, second, third = read(tmp_path, text)
    assert first == Measurement(
        "U", "U", 0.0, 78.64, "mm", 0.5, NARROW, 1 / 80, "mine, the first", f"{tmp_path}/data.csv, line 4"
    )
    assert first.convert(first.high, 0.5, normalized=False) == pytest.approx(78.64 / 240)
    assert first.convert(first.high, 0.5, normalized=True) == pytest.approx(78.64 / 204.868, rel=5e-6)
    assert (second.family, second.label, second.error) == ("US+-", "D/L = 1/8", None)
    assert second.convert(0.4, 0.5, normalized=True) == 0.4
    assert second.convert(0.4, 0.5, normalized=False) == pytest.approx(0.4 * 0.75)
    assert (third.unit, third.band, third.label) == ("L", Band(240.0, 30.0, 0.127), "D/L = 1/8")


@pytest.mark.parametrize(
    ("name", "family"), [("U", "U"), ("U1", "U"), ("US2-", "US+-"), ("WS", "WS+-"), ("TU+-", "TU+-"), ("wi", None)]
)
def test_names(name, family):
    assert family_of(name) == family


HEAD = "state,shear_min,shear_max,unit,width,band,error\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ": expected a line with the columns state, shear_min, shear_max, got no line but comments"),
        ("# only\n", ": expected a line with the columns state, shear_min, shear_max, got no line but comments"),
        (HEAD, ": expected at least one row below the names of the columns, got none"),
        ("state;shear_min;shear_max\n", ", line 1: expected columns among state, shear_min, .* separated by commas"),
        ("state,shear_min,sheer_max\n", ", line 1: expected columns among .*, got 'sheer_max'"),
        ("state,shear_min,unit\n", ", line 1: expected the columns state, .*, got none named shear_max"),
        ("state,shear_min,state\n", ", line 1: expected each column once, got 'state' twice"),
        (HEAD + "U,0,1\n", r", line 2: expected 7 fields \(state, .*\), got 3"),
        (HEAD + "\n#\nU,0,x,,,,\n", ", line 4, column shear_max: expected a number, got 'x'"),
        (HEAD + "U,nan,0,,,,\n", ", line 2, column shear_min: expected a number, got 'nan'"),
        (HEAD + "U,,0,,,,\n", ", line 2, column shear_min: expected a value, got none"),
        (HEAD + "U,0.3,0.2,,,,\n", ", line 2, column shear_max: expected at least shear_min = 0.3, got 0.2"),
        (HEAD + "Q,0,0.2,,,,\n", ", line 2, column state: expected one of U, US.*or U1, U2, wi .*, got 'Q'"),
        (HEAD + "U,0,0.2,cm,,,\n", ", line 2, column unit: expected one of L, mm, limit, got 'cm'"),
        (HEAD + "U,0,0.2,,-1/8,,\n", ", line 2, column width: expected the width over the length, .* got -0.125"),
        (HEAD + "U,0,0.2,,3 mm,,\n", ", line 2, column width: expected the width over the length where no band"),
        (HEAD + "U,0,0.2,,,240x3,\n", ", line 2, column band: expected LENGTHxWIDTHxTHICKNESS in mm .*, got '240x3'"),
        (HEAD + "U,0,0.2,,,240x0x1,\n", ", line 2, column band: expected a positive length from .*, got 0.0"),
        (HEAD + "U,0,0.2,,,,-1\n", ", line 2, column error: expected a number of at least 0, got -1"),
    ],
)
def test_a_wrong_table_says_where(tmp_path, text, message):
    with pytest.raises(ValueError, match=rf"data\.csv{message}"):
        read(tmp_path, text)


def test_no_table(tmp_path):
    with pytest.raises(ValueError, match=r"^overlay: expected a CSV file, got '.*none.csv' \(No such file"):
        read_measurements(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"state,\xff\xfe")
    with pytest.raises(ValueError, match=r"^overlay: expected a CSV file in UTF-8, got '.*b.csv'"):
        read_measurements(tmp_path / "b.csv")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("U,0,70,mm,,,", "line 2, column band: expected LENGTHxWIDTHxTHICKNESS in mm"),
        ("U,0,0.4,limit,,,\nU,0,0.4,L,,,", "line 3, column width: expected the width over the length"),
        ("U,0,70,L,,,", "line 2, column shear_max: expected at most the limiting shear .* read in the unit L"),
        ("U,-1.1,0,limit,1/8,,", "line 2, column shear_min: expected at most the limiting shear .* got -1.1 times"),
    ],
)
def test_what_cannot_be_converted(tmp_path, slice_15, row, message):
    with pytest.raises(ValueError, match=message):
        compare(slice_15, read(tmp_path, HEAD + row))


def test_data_made_from_computed_ends_agree(slice_15):
    """A range in mm that is exactly what was computed has no difference; a bit more is outside a smaller error."""
    exact = Measurement("U", "U", 0.0, 240 * PITCHFORK_4, "mm", 0.24, NARROW, 1 / 80)
    off = Measurement("w", "w", 240 * 0.49, 240 * FOLD_6, "mm", 0.24, NARROW, 1 / 80, "off")
    found = ends(compare(slice_15, [exact, off]))
    end = found["U", "measured", "high"]
    assert end.difference == pytest.approx(0.0, abs=1e-8)
    assert (end.inside, end.number, end.error) == (True, 4, pytest.approx(0.001))
    assert found["U", "measured", "low"].verdict == "from rest"
    assert found["w", "off", "low"].verdict == "outside"
    assert found["w", "off", "low"].difference == pytest.approx(0.49 - 0.503295, abs=1e-5)


def test_normalized_ranges_are_divided_by_their_own_limiting_shears(slice_15):
    rows = [
        Measurement("U", "U", 0.0, PITCHFORK_4 / limiting_shear(0.5), "limit", 0.01),
        Measurement("w", "w", 120.0, FOLD_6 * 204.868, "mm", None, NARROW, 1 / 80),
    ]
    comparison = compare(slice_15, rows)
    assert comparison.normalized
    assert comparison.scale == pytest.approx(math.sqrt(3) / 2)
    found = ends(comparison)
    assert found["U", "measured", "high"].difference == pytest.approx(0.0, abs=1e-8)
    end = found["w", "measured", "high"]
    assert end.measured == pytest.approx(FOLD_6 * 204.868 / 240 / 0.853616, rel=1e-5)
    assert end.computed == pytest.approx(FOLD_6 / limiting_shear(0.5), rel=1e-6)
    assert not end.stated


def test_an_error_that_is_not_stated_comes_from_the_clamps(slice_15):
    """Of pitchforks as ends of either branch, and of folds; none without a length in mm."""
    rows = [Measurement(n, f, 0.3, 0.4, band=NARROW, aspect=1 / 80) for n, f in (("US", "US+-"), ("WS", "WS+-"))]
    found = ends(compare(slice_15, [*rows, Measurement("w", "w", 0.5, 0.58)], ClampErrors(2.0, 0.5)))
    four = next(e for b in slice_15.branches for e in b.events if e.number == 4)
    expected = sensitivity(four.special).error(ClampErrors(2.0, 0.5), BandUnits(NARROW))
    assert found["US", "measured", "low"].error == pytest.approx(expected, rel=1e-9)
    assert 0.002 < found["WS", "measured", "high"].error < 0.01
    assert found["WS", "measured", "low"].error is not None
    assert found["US", "measured", "high"].verdict == "slice ends"
    assert found["w", "measured", "low"].verdict == "no error known"


def test_what_lies_beyond_a_short_slice_is_not_called_missing(slice_15):
    """A slice up to 0.4 does not know whether uUu exists at 0.6; wi, which no rod has, is missing anywhere."""
    states = tuple(s for s in slice_15.states if s.name not in ("uUu", "w"))
    short = replace(slice_15, settings=band_slice(15.0, shear_max=0.4), states=states)
    rows = [Measurement("uUu", "uUu", 0.6, 0.8), Measurement("w", "w", 0.3, 0.5), Measurement("wi", None, 0.5, 0.56)]
    found = ends(compare(short, rows))
    verdicts = {(state, end): check.verdict for (state, _, end), check in found.items()}
    assert verdicts == {
        ("uUu", "low"): "slice ends", ("uUu", "high"): "slice ends", ("w", "low"): "no such state",
        ("w", "high"): "slice ends", ("wi", "low"): "no such state", ("wi", "high"): "no such state",
    }  # fmt: skip


def test_the_example_file(slice_15):
    comparison = compare(slice_15, read_measurements(EXAMPLE, NARROW))
    found = ends(comparison)
    narrow = [e for key, e in found.items() if key[1] == "synthetic 1/80" and e.inside is not None]
    assert len(narrow) == 10
    assert all(e.inside for e in narrow)
    assert found["wi", "synthetic 1/8", "low"].verdict == "no such state"
    frame = comparison.to_frame()
    assert len(frame) == 2 * len(comparison.checks)
    assert comparison.to_json()["unit"] == "L"
    assert "SYNTHETIC" in EXAMPLE.read_text().splitlines()[0]
