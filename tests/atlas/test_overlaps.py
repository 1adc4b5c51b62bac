"""Two stable states called W: at dL = 0.95 mirror images of each other coexist around dD = 0."""

import pytest

from rodatlas.atlas import coexisting_states, compute_slice
from rodatlas.atlas.contents import shapes_of
from rodatlas.atlas.slices.reach import reach
from rodatlas.atlas.slices.states.coexisting import overlaps
from rodatlas.atlas.slices.states.pick import pick_state
from rodatlas.cli import main
from rodatlas.model.orbit import same_state
from rodatlas.paper.model import band, band_slice
from rodatlas.paper.names.yu_hanna import COLORS
from rodatlas.plot import color_of, label_of
from rodatlas.rods import Ends, index_of, is_symmetric, mirror_shear
from rodatlas.states import find_states

pytestmark = pytest.mark.slow

SETTINGS = band_slice(15.0, 0.95, shear_max=0.06, shear_min=-0.06, tolerance=1e-6, search=0)
FOLD = 0.0499517


@pytest.fixture(scope="module")
def wide():
    return compute_slice(SETTINGS, carry=False)


@pytest.fixture(scope="module")
def at_rest():
    return find_states(Ends(15.0, 0.95), 0.25, "+", 256, stable_only=True)


def test_both_states_are_there_and_the_slice_says_so(wide):
    one, two = (s for s in wide.states if s.name == "W")
    assert one.high.value == pytest.approx(FOLD, abs=1e-5)
    assert two.low.value == pytest.approx(-FOLD, abs=1e-5)
    assert wide.warnings[:1] == (
        "names: two states called W exist from shear -0.04995 to 0.04995 (branches W, W); at one shear W:1 is that of "
        "less energy, W:2 the next",
    )
    assert overlaps([one], wide.settings) == []


@pytest.mark.parametrize("shear", [-0.02, 0.0, 0.02])
def test_states_at_a_shear_are_told_apart(wide, shear):
    there = coexisting_states(wide, shear)
    assert list(there) == ["U", "W:1", "W:2"]
    one, two = there["W:1"], there["W:2"]
    assert all(is_symmetric(s) and index_of(s).index == 0 for s in (one, two))
    assert not same_state(band(), one, two)  # at rest height and energy are the same
    image = coexisting_states(wide, -shear)["W:2" if shear == 0.0 else "W:1"]
    assert same_state(band(), mirror_shear(image), one)
    assert one["energy"] <= two["energy"] + 1e-6
    assert [s.name for s in wide.states_at(shear)] == ["U", "W", "W"]
    assert wide.states_at(shear, "W") == wide.states[1:]
    assert {wide.state(f"W:{k}", shear) for k in (1, 2)} == set(wide.states_at(shear, "W"))


def test_a_name_alone_does_not_choose(wide):
    told = (
        r"^state: expected one of W:1 \(height -0.178746, energy 37.1696, end_force_z -28.1287, stable from .*got 'W'$"
    )
    for pick in (lambda: wide.state("W", 0.0), lambda: pick_state(wide, "W", 0.0), lambda: shapes_of(wide, "W", 0.0)):
        with pytest.raises(ValueError, match=told):
            pick()
    assert wide.state("W", 0.055) is wide.states[2]
    assert pick_state(wide, "W:2", 0.0)["end_force_z"] == pytest.approx(28.13, abs=0.01)


def test_the_search_calls_them_the_same(at_rest, wide):
    assert {x for x in at_rest.labels if x} == {"U", "W:1", "W:2"}
    with pytest.raises(ValueError, match=r"^state: expected one of W:1 \(energy 37.1696, .*\), W:2 \(.*\), got 'W'$"):
        at_rest.named("W")
    slice_ = coexisting_states(wide, 0.0)
    for label in ("W:1", "W:2"):
        assert same_state(band(), at_rest.named(label).solution, slice_[label])
        assert label in {s["label"] for s in at_rest.to_json()["states"]}
        assert shapes_of(at_rest, label)[label] is at_rest.named(label).solution
    with pytest.raises(ValueError, match=r"^state: expected one of U, US\+"):
        at_rest.named("V")
    assert at_rest.named("w") is None


def test_solve_and_export_need_the_number(wide, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wide.save("wide.h5")
    for command in (
        ["solve", "--angle", "15", "--compression", "0.95", "--shear", "0"],
        ["export", "wide.h5", "--at", "0", "--out", "w.vtp"],
    ):
        with pytest.raises(SystemExit) as leave:
            main([*command, "--state", "W"])
        assert leave.value.code == 2
        error = capsys.readouterr().err.splitlines()[-1]
        assert error.startswith("rodatlas: state: expected one of W:1 (")
        assert "energy 37.1696" in error
        assert error.endswith("got 'W'")
    with pytest.raises(SystemExit) as leave:
        main(["export", "wide.h5", "--at", "0", "--out", "w.vtp"])
    assert not leave.value.code
    assert {p.name for p in tmp_path.glob("w-*.vtp")} == {"w-U.vtp", "w-W-1.vtp", "w-W-2.vtp"}


def test_a_numbered_state_is_reached(wide):
    solution, source = reach(SETTINGS, "W:2", 0.0)
    assert source == "search"
    assert same_state(band(), solution, coexisting_states(wide, 0.0)["W:2"])


def test_numbers_do_not_change_colors():
    assert color_of("W:2", COLORS) == color_of("W", COLORS)
    assert color_of("US-:1", COLORS) == color_of("US+-", COLORS)
    assert (label_of("US+-:2"), label_of("W:2")) == ("US±:2", "W:2")
