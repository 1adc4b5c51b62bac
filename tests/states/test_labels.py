"""What states are called that share a name: numbers in order of energy, and choices that are never silent."""

import pytest

from rodatlas.states.labels import Wanted, chosen, in_file_name, labels, parse_label


def test_labels_are_read():
    assert parse_label("U") == Wanted("U", "")
    assert parse_label("US") == parse_label("US+-") == parse_label("US+") == Wanted("US+-", "+")
    assert parse_label("US-:3") == Wanted("US+-", "-", 3)
    assert parse_label("W:2") == Wanted("W", "", 2)
    assert (parse_label("US-:3").member, parse_label("US-:3").label) == ("US-", "US-:3")
    for wrong in ("", "V", "w+", "W:", "W:0", "W:x", "W:-1", "US+-+", "other", "W 2", "US+\n"):
        with pytest.raises(ValueError, match=r"^state: expected one of U, US\+, US-, uUu") as error:
            parse_label(wrong)
        assert str(error.value).endswith(f", got '{wrong}'")


def test_only_shared_names_are_numbered():
    """By energy; where two energies are equal, as of mirror images at rest, by the slope of the energy with shear."""
    names = ["U", "W", "W", None, None, "US+", "US-"]
    assert labels(names, [5.0, 4.0, 3.0, 1.0, 2.0, 7.0, 7.0], [0.0] * 7) == [
        "U", "W:2", "W:1", None, None, "US+", "US-",
    ]  # fmt: skip
    assert labels(["W", "W"], [37.0 + 1e-9, 37.0], [-28.0, 28.0]) == ["W:1", "W:2"]
    assert labels(["W", "W"], [37.0, 37.0 + 1e-9], [28.0, -28.0]) == ["W:2", "W:1"]
    assert labels([], [], []) == []


def test_a_choice_is_never_silent():
    one, two = [("a", "low")], [("a", "low"), ("b", "high")]
    assert chosen(Wanted("W", ""), []) is None
    assert chosen(Wanted("W", ""), one) == chosen(Wanted("W", "", 1), one) == "a"
    assert chosen(Wanted("W", "", 2), two) == "b"
    with pytest.raises(ValueError, match=r"^state: expected one of W:1 \(low\), W:2 \(high\), got 'W'$"):
        chosen(Wanted("W", ""), two)
    with pytest.raises(ValueError, match=r"^state: expected one of W:1 \(low\), W:2 \(high\), got 'W:3'$"):
        chosen(Wanted("W", "", 3), two)
    with pytest.raises(ValueError, match=r"^state: expected US\+ without a number, there is one, got 'US\+:2'$"):
        chosen(Wanted("US+-", "+", 2), one)


def test_parts_of_labels():
    assert in_file_name("W:2") == "W-2"
