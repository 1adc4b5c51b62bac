"""All stable states at one setting: the known ones are there, with names, and a larger search finds no other."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from rodatlas.cli import main
from rodatlas.cli.states import completeness
from rodatlas.continuation import MeshControl, TraceOptions, solve
from rodatlas.rods import Ends, index_of, reduced_problem, rod_problem, to_reduced
from rodatlas.rods.perfectly_anisotropic import CONSTANTS
from rodatlas.states.census import species, unseen
from rodatlas.states.discover import find_states
from rodatlas.states.store import load_discovery, save_discovery

ENDS = Ends(30.0, 0.5, 0.625)


@pytest.fixture(scope="module")
def at_30():
    return find_states(ENDS, stable_only=True)


def test_the_five_states_of_the_first_class(at_30):
    """Exactly those published; U at this shear has become uUui, w and uUu."""
    five = {s.name: s for s in at_30.states if s.cls == "+"}
    assert set(five) == {"uUui", "w", "uUu", "US+", "US-"}
    assert len(five) == sum(s.cls == "+" for s in at_30.states)
    assert five["uUui"].solution["energy"] == pytest.approx(21.988286, abs=1e-6)
    assert five["uUui"].solution["height"] == pytest.approx(-0.00727986, abs=1e-8)
    assert five["US+"].solution["energy"] == pytest.approx(five["US-"].solution["energy"], abs=1e-7)
    assert all(index_of(s.solution).trusted for s in at_30.states)


def test_the_known_state_of_the_second_class(at_30):
    """E = 21.874512 as published; a finer mesh and the formulation with q and X alone give 21.8745065."""
    near = [s for s in at_30.states if s.cls == "-" and abs(s.solution["height"] + 0.0424004) < 1e-6]
    assert len(near) == 1
    assert near[0].solution["energy"] == pytest.approx(21.874512, rel=1e-6)
    assert near[0].to_json()["inflections"] == {"k1": 0, "tau": 0}
    assert near[0].name is None
    fine = solve(rod_problem(), near[0].solution, ("dD",), TraceOptions(mesh=MeshControl(tolerance=1e-10)))
    reduced = solve(reduced_problem(), to_reduced(fine), ("dD", *CONSTANTS),
                    TraceOptions(mesh=MeshControl(tolerance=1e-10)))  # fmt: skip
    assert fine["energy"] == pytest.approx(21.8745065, abs=2e-7)
    assert reduced["energy"] == pytest.approx(fine["energy"], abs=1e-8)


def test_wound_up_states_are_told_apart(at_30):
    """Class + needs no turn and class - one, either way; nothing stable lies near the bounds of 1 and 2 turns."""
    assert all(abs(s.turns) < 0.3 if s.cls == "+" else 0.7 < abs(s.turns) < 1.0 for s in at_30.states)
    assert {np.sign(s.turns) for s in at_30.states if s.cls == "-"} == {-1.0, 1.0}
    every = find_states(ENDS, starts=128, stable_only=True, wound=True)
    wound = [s for s in every.states if s.wound]
    assert len(wound) >= 4
    assert at_30.wound_left_out >= len({(s.cls, round(s.solution["energy"], 3)) for s in wound})
    assert all(abs(s.turns) > (1.5 if s.cls == "+" else 2.3) for s in wound)
    assert all(s.to_json()["wound"] is s.wound for s in every.states)


def test_threads_do_not_change_the_result():
    """A search in one thread meets each state as often as one in three."""
    one, three = (find_states(ENDS, starts=256, classes="+", stable_only=True, threads=n) for n in (1, 3))
    assert [(s.solution["energy"], s.count) for s in one.states] == [
        (s.solution["energy"], s.count) for s in three.states
    ]
    assert one.converged == three.converged > 200


def test_planar_and_twisted_states_without_shear():
    found = find_states(Ends(15.0), classes="+", starts=256, stable_only=True)
    energies = {round(s.solution["energy"], 5): s for s in found.states}
    assert energies[11.15823].name == "U"
    assert any(s.name == "W" for s in found.states)
    twisted = [s for s in found.states if s.solution["energy"] == pytest.approx(37.41956, abs=1e-5)]
    assert {s.name for s in twisted} == {"TU+", "TU-"}
    assert twisted[0].solution["height"] == pytest.approx(0.202848, abs=1e-6)


def test_unstable_states_come_with_their_index():
    """States of several indices within the force range; every pair is complete."""
    found = find_states(Ends(15.0), classes="+", starts=512)
    assert {s.index for s in found.states} >= {0, 1, 2}
    assert max(np.linalg.norm(s.to_json()["N0"]) for s in found.states) <= 200.0
    sides = [s.pair for s in found.states if s.pair]
    assert sides.count("+") == sides.count("-") > 0


def test_deflation_adds_what_few_starts_miss():
    """32 starts at 15 degrees and 0.4 leave states out; deflation from what they found adds some, and says so."""
    options = {"classes": "+", "starts": 32, "wound": True}
    few, more = (find_states(Ends(15.0, 0.5, 0.4), deflate=n, **options) for n in (0, 12))
    added = [s for s in more.states if s.count == 0]
    assert few.deflated is None
    assert more.deflated == (len([s for s in added if s.pair != "-"]), 12)
    assert more.to_json()["search"]["deflation"] == {"found": more.deflated[0], "attempts": 12}
    assert len(more.states) == len(few.states) + len(added)
    assert len(added) > 0
    for state in added:
        assert min(abs(state.solution["energy"] - s.solution["energy"]) for s in few.states) > 1e-5
        assert index_of(state.solution).trusted
        assert state.solution.error < 1e-7


def test_estimates_of_what_was_not_met():
    """Chao: f1 (f1 - 1) / (2 (f2 + 1)); Good: f1 / n."""
    assert unseen(np.array([1, 1, 1, 2, 5])) == pytest.approx((1.5, 0.3))
    assert unseen(np.array([4, 5])) == (0.0, 0.0)
    np.testing.assert_array_equal(species(np.array([[0.0, 1.0], [2.0, 1.0], [1e-8, 1.0]])), [0, 1, 0])


def test_json_of_the_command(capsys):
    arguments = ["states", "--angle", "15", "--shear", "0.2", "--class", "+", "--starts", "64", "--stable-only"]
    with pytest.raises(SystemExit) as leave:
        main([*arguments, "--json", "-"])
    assert not leave.value.code
    plain = json.loads(capsys.readouterr().out)
    assert plain["schema"] == "rodatlas/states/1"
    assert set(plain["search"]) >= {"starts", "converged", "distinct", "unseen_estimate"}
    assert (plain["angle_deg"], plain["shear"], plain["search"]["starts"]) == (15.0, 0.2, 64)
    assert {s["name"] for s in plain["states"]} >= {"U", "W"}
    keys = {"name", "class", "stable", "index", "height", "energy", "symmetric", "pair", "N0", "M0", "inflections"}
    assert all(keys <= set(s) for s in plain["states"])


def test_a_search_that_found_nothing_says_so(tmp_path, capsys):
    """At 0.993 of the limiting shear no start converges: one line and exit code 1, and the JSON all the same."""
    path = tmp_path / "states.json"
    arguments = ["--angle", "15", "--shear", "0.86", "--class", "+", "--starts", "4", "--stable-only"]
    with pytest.raises(SystemExit) as leave:
        main(["states", *arguments, "--json", str(path)])
    assert leave.value.code == 1
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("rodatlas:")]
    assert lines == [
        "rodatlas: search: class +: none of 4 starts converged: raise the number of starts, or keep away from the "
        "limiting shear (this shear is 0.993 of it)"
    ]
    plain = json.loads(path.read_text())
    assert (plain["states"], plain["search"]["unseen_estimate"], plain["search"]["unseen_probability"]) == (
        [], None, None,
    )  # fmt: skip
    assert plain["warnings"][0].startswith("search: class +: none of 4 starts")
    assert plain["warnings"][-1].startswith("limiting shear: 0.86 is 0.993 of")


def test_too_few_solutions_are_no_estimate(tmp_path, capsys):
    found = find_states(Ends(15.0, 0.5, 0.2), classes="+", starts=4, stable_only=True)
    assert found.states
    assert not found.failed
    assert found.unseen_estimate is None
    assert found.warnings == (
        "search: the states listed were met 4 times in all, too few to tell how many were not met: raise the number of "
        "starts",
    )
    save_discovery(tmp_path / "states.h5", found)
    assert load_discovery(tmp_path / "states.h5").warnings == found.warnings
    with pytest.raises(SystemExit):
        main(["states", "--angle", "15", "--shear", "0.2", "--class", "+", "--starts", "4", "--stable-only"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "Too few were met to tell how many were not" in shown
    assert "0.0 more" not in shown


def test_bands_through_themselves_and_shared_names_are_remarked():
    """At dL = 0.95 U and both W cross themselves near zero shear, and so do two states without a name."""
    found = find_states(Ends(15.0, 0.95, 0.01), classes="+", starts=512, stable_only=True)
    assert found.remarks == (
        "contact: a band L/80 wide passes through itself in stable states (U, W:1, W:2, 2 without a name); forces of "
        "contact are not modeled",
        "names: 2 states are called W, numbered in order of energy",
    )
    assert found.to_json()["warnings"] == list(found.remarks)


def test_a_class_of_which_nothing_is_listed_is_said():
    """Two starts of class + meet states that are wound up only, although U and W are stable there."""
    found = find_states(Ends(22.0, 0.5, 0.3), starts=2, stable_only=True)
    assert [s.cls for s in found.states] == ["-"]
    assert found.warnings[0] == (
        "search: class +: all that 2 starts met is wound up or not stable, so that no state of it is listed: raise the "
        "number of starts"
    )


def test_estimates_of_missed_states_read_as_numbers(at_30):
    for number, text in ((0.0, "0"), (0.5, "0.5"), (9.96, "10"), (20.0, "20"), (123.4, "123")):
        found = replace(at_30, unseen_estimate=number, unseen_probability=0.01)
        assert f"about {text} more were not met" in completeness(found)


def test_solutions_that_collocation_does_not_confirm_are_said(monkeypatch):
    monkeypatch.setattr("rodatlas.states.discover._confirmed", lambda *arguments: [])
    found = find_states(ENDS, classes="+", starts=16, stable_only=True)
    assert found.failed
    assert re.match(r"search: class \+: none of \d+ different solutions of 16 starts was confirmed", found.warnings[0])


@pytest.mark.parametrize(("option", "value", "field"), [
    ("--shear", "2", "shear"), ("--angle", "x", "angle"), ("--class", "*", "class"), ("--starts", "0", "starts"),
    ("--threads", "no", "threads"),
])  # fmt: skip
def test_wrong_input_is_one_line(option, value, field, capsys):
    arguments = {"--angle": "15", "--shear": "0.2", option: value}
    with pytest.raises(SystemExit) as leave:
        main(["states", *[text for pair in arguments.items() for text in pair]])
    assert leave.value.code == 2
    message = capsys.readouterr().err
    assert message.startswith(f"rodatlas: {field}: expected")
    assert message.count("\n") == 1
