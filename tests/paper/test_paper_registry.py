"""The list of figures, the numbers known from elsewhere, the files, and the command."""

import json
import re
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest

from rodatlas.cli import main
from rodatlas.paper import ENTRIES, NOT_DRAWN, chosen, figure_names
from rodatlas.paper.drawn import Number, known_numbers
from rodatlas.paper.output import draw_to, page_of, stored_records, texts_of, to_json, write_tables
from rodatlas.paper.page import SHOWN, write_page
from rodatlas.paper.sources import slice_settings

DOCS = Path(__file__).parents[2] / "docs" / "atlas"
PAPER_FIGURES = set(range(1, 28))


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out = capsys.readouterr()
    return stop.value.code, out.out, out.err


def test_every_figure_of_the_paper_is_drawn_or_said_to_be_missing():
    listed = [e.of_paper for e in ENTRIES] + list(NOT_DRAWN)
    numbers = [int(n.split(" ")[0]) for text in listed for n in text.split(", ") if n]
    assert set(numbers) == PAPER_FIGURES
    assert all(NOT_DRAWN.values())


@pytest.mark.parametrize("entry", ENTRIES, ids=figure_names())
def test_every_entry_has_a_module_that_takes_its_options(entry):
    draw = import_module(f"rodatlas.paper.{entry.module}").draw
    signature(draw).bind(None, **entry.options)
    assert entry.description
    assert len(entry.description) < 80


def test_names_are_unique_and_a_wrong_one_is_named():
    assert len(set(figure_names())) == len(figure_names())
    assert [e.name for e in chosen(["profiles", "slice-15", "profiles"])] == ["profiles", "slice-15"]
    assert chosen([]) == list(ENTRIES)
    with pytest.raises(ValueError, match=r"^figure: expected one of .*, got 'fig-1'$"):
        chosen(["fig-1"])


def test_known_numbers_are_sound():
    for key, known in known_numbers().items():
        assert known.source in ("paper", "independent", "closed form"), key
        assert known.resolution >= 0, key


def test_a_number_is_compared_with_the_known_one():
    known = known_numbers()["w-meets-U"]
    near = Number("angle", known.value + 0.9 * known.resolution, "deg", "w-meets-U")
    far = Number("angle", known.value - 1.1 * known.resolution, "deg", "w-meets-U")
    assert (near.agrees, far.agrees) == (True, False)
    assert far.difference == pytest.approx(-0.011)
    alone = Number("length", 1.0)
    assert (alone.known, alone.difference, alone.agrees) == (None, None, None)
    assert "known" not in alone.to_json()
    with pytest.raises(KeyError):
        Number("x", 1.0, "", "no such key").to_json()


def test_numbers_are_printed_with_the_digits_that_are_known():
    assert texts_of(0.35923577, 0.359236, 5e-7) == ("0.3592358", "0.359236")
    assert texts_of(27.7098, 27.71, 0.01) == ("27.7098", "27.71")
    assert texts_of(5.0, 5.0, 0.0) == ("5", "5")


def test_the_page_shows_what_disagrees():
    good = Number("angle one", 27.71, "deg", "w-meets-U").to_json()
    bad = Number("angle two", 28.5, "deg", "w-meets-U").to_json()
    record = {
        "name": "x", "of_paper": "9", "caption": "A figure.", "description": "d", "remarks": ["Mind this."],
        "numbers": [good, bad, Number("alone", 1.5).to_json()],
    }  # fmt: skip
    page = page_of([record], {"x": "fig-x.png"})
    assert "1 of 2 known numbers agree to the last digit shown. Others: x: angle two." in page
    assert "| angle two | 28.5000 deg | 27.71 deg | paper | **7.9e-01** |" in page
    assert "| alone | 1.5 | | | |" in page
    assert "![d](fig-x.png)" in page
    assert "- Mind this." in page
    assert to_json([record])["schema"] == "rodatlas/paper/1"


@pytest.mark.slow
def test_one_figure_and_its_tables(capsys, folder, sources):
    entry = chosen(["slice-15"])[0]
    record = draw_to(entry, sources, folder)
    numbers = {n["quantity"]: n for n in record["numbers"]}
    assert all(n["agrees"] for n in numbers.values() if "known" in n)
    assert sum("known" in n for n in numbers.values()) == 6
    assert abs(numbers["energy of TU+ at dD = 0"]["value"] - 37.41956) < 1e-5
    written = (folder / "slice-30.h5").stat().st_mtime_ns
    code, out, err = run(capsys, "paper", "--figure", "profiles", "--out", str(folder), "--json", "-")
    assert code == 0
    data = json.loads(out)
    assert [f["name"] for f in data["figures"]] == ["slice-15", "profiles"]
    assert json.loads((folder / "paper.json").read_text(encoding="utf-8")) | {"identity": data["identity"]} == data
    assert (folder / "slice-30.h5").stat().st_mtime_ns == written  # read, not computed
    assert "profiles: In tension all along: uUu." in err
    for name in ("slice-15", "profiles"):
        assert (folder / f"fig-{name}.png").stat().st_size > 20_000
        assert (folder / f"fig-{name}.pdf").stat().st_size > 10_000
        assert f"(fig-{name}.png)" in (folder / "paper.md").read_text(encoding="utf-8")


def test_a_figure_that_fails_is_reported_and_the_others_are_drawn(capsys, folder, monkeypatch):
    def fail(sources):
        raise ValueError("slice: expected a fold,\ngot none")

    monkeypatch.setattr("rodatlas.paper.profiles.draw", fail)
    code, out, err = run(capsys, "paper", "--figure", "profiles", "--figure", "setup", "--out", str(folder))
    assert code == 1
    assert "fig-" in out
    assert err.splitlines()[-1] == "rodatlas: figure profiles: slice: expected a fold, got none"
    assert (folder / "fig-setup.png").exists()


def test_every_figure_says_which_slices_it_needs():
    assert all(slice_settings(*need) for entry in ENTRIES for need in entry.needs)


def test_records_of_another_version_are_left_out_and_damaged_ones_set_aside(tmp_path):
    (tmp_path / "fig-profiles.json").write_text(json.dumps({"rodatlas": "0", "name": "profiles"}))
    assert stored_records(tmp_path) == []
    assert write_tables(tmp_path)[0].exists()
    (tmp_path / "fig-slice-5.json").write_text("{")
    said = []
    assert stored_records(tmp_path, said.append) == []
    assert said == ["fig-slice-5.json is damaged and is kept as fig-slice-5.json.damaged: draw that figure again"]
    assert (tmp_path / "fig-slice-5.json.damaged").read_text() == "{"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--figure", "nothing"], "figure: expected one of "),
        (["--out", "/proc/rodatlas"], "out: expected a folder that can be written"),
        (["--json", "/"], "json: expected a file name or -, got the folder '/'"),
        (["--workers", "0"], "workers: expected a whole number from 1 to 1024, got 0"),
        (["nothing"], "Got unexpected extra argument"),
    ],
)
def test_wrong_input_is_one_line(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "paper", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"rodatlas: {message}")
    assert err.count("\n") == 1


def test_the_list_names_every_figure(capsys):
    code, out, _ = run(capsys, "paper", "--list")
    assert code == 0
    for name in figure_names():
        assert name in out
    assert out.count("(not drawn)") == len(NOT_DRAWN)


def test_the_page_of_the_documentation_needs_every_figure(tmp_path):
    with pytest.raises(ValueError, match=r"^folder: expected all figures to be drawn in .*, got none of setup, states"):
        write_page(tmp_path, tmp_path)


def test_the_page_of_the_documentation_has_the_numbers_of_today(sources):
    """Those that are quick to draw; every figure it shows is there, small, and every figure has a part."""
    page = (DOCS / "paper.md").read_text(encoding="utf-8")
    for name in figure_names():
        assert f"## {name}\n" in page
    for entry in chosen(["profiles", "sheared"]):
        part = page.split(f"## {entry.name}\n")[1].split("\n## ")[0]
        written = {m[1]: float(m[2]) for m in re.finditer(r"^\| ([^|]+) \| (-?[\d.e+-]+)[^|]* \|", part, re.MULTILINE)}
        for n in entry.draw(sources).numbers:
            digits = n.known.resolution if n.known else 1e-5 * abs(n.value)  # of what is written
            assert abs(written[n.quantity] - n.value) <= digits, n.quantity
    shown = re.findall(r"\]\((paper-\S+\.png)\)", page)
    assert len(shown) == len(SHOWN)
    assert sum((DOCS / name).stat().st_size for name in shown) < 1_000_000
