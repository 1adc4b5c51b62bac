"""Names that tell all settings apart; files that are replaced at once; nothing is lost when a file is set aside."""

import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodatlas.files import digest, exact, remove_partials, replace_file, set_aside, write_text
from rodatlas.files.atomic import STALE, remove_folder


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_read_back_from_its_text(number):
    assert float(exact(number)) == number


@pytest.mark.parametrize(("number", "text"), [(15, "15"), (27.5, "27.5"), (-0.0, "0"), (1e-8, "1e-08"), (0.1, "0.1")])
def test_texts_of_numbers(number, text):
    assert exact(number) == text


def test_a_digest_tells_identities_apart():
    one = {"angle": 15, "stable": True}
    assert digest(one) == digest({"stable": True, "angle": 15.0})
    assert len({digest(x) for x in (one, one | {"angle": 16}, one | {"stable": False}, {"angle": 15})}) == 4


def test_a_file_is_set_aside_beside_what_was_set_aside_before(tmp_path):
    for text in ("one", "two", "three"):
        (tmp_path / "a.h5").write_text(text)
        set_aside(tmp_path / "a.h5")
    found = {p.name: p.read_text() for p in tmp_path.iterdir()}
    assert found == {"a.h5.damaged": "one", "a.h5.damaged-2": "two", "a.h5.damaged-3": "three"}


def test_a_reader_never_sees_a_part(tmp_path):
    """While another process replaces a file again and again."""
    path = tmp_path / "a.txt"
    write_text(path, "0" * 100_000)
    code = (
        "import sys\nfrom rodatlas.files import write_text\n"
        "for i in range(300):\n    write_text(sys.argv[1], str(i % 10) * 100_000)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", code, str(path)])
    while other.poll() is None:
        text = path.read_text()
        assert len(text) == 100_000
        assert len(set(text)) == 1
    assert other.returncode == 0
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(OSError, match="No such file or directory") as error:
        replace_file(tmp_path / "no" / "a", b"x")
    assert error.value.filename == str(tmp_path / "no" / "a")


def test_only_old_leftovers_are_removed_unless_nobody_else_writes(tmp_path):
    fresh, old, gone = (tmp_path / f".{name}.0123456789ab.partial" for name in ("fresh", "old", "gone"))
    fresh.write_text("in work")
    old.write_text("left")
    gone.mkdir()
    (gone / "U.h5").write_text("left")
    for path in (old, gone):
        os.utime(path, (0.0, 0.0))
    kept = {"kept.partial", ".kept.partial", ".of.another.program.partial"}
    for name in kept:
        (tmp_path / name).write_text("somebody's")
        os.utime(tmp_path / name, (0.0, 0.0))
    remove_partials(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == kept | {fresh.name}
    remove_partials(tmp_path, 0.0, lambda name: name == "other")
    assert fresh.exists()
    remove_partials(tmp_path, 0.0, lambda name: name == "fresh")
    assert {p.name for p in tmp_path.iterdir()} == kept
    assert STALE > 600.0


def test_a_folder_is_removed_whole(tmp_path):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "U.h5").write_text("x")
    remove_folder(tmp_path / "s")
    assert list(tmp_path.iterdir()) == []
