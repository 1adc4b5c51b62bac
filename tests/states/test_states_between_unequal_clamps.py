"""Searches between any clamps: independent searches agree, shooting confirms them, symmetries of the setting complete
them, and JSON and tables lead back to the states."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from frame_shooting import Poses, shoot
from rodatlas.atlas.contents import read_states_table, shapes_of, tables_of
from rodatlas.cli import main
from rodatlas.rods import Ends, RodState, index_of, mirror_shear, rod_problem, state_at, symmetries_at
from rodatlas.rods.law import LinearLaw
from rodatlas.states import find_states
from rodatlas.states.descent import descend
from rodatlas.states.images import with_images
from rodatlas.states.result import FoundState
from rodatlas.states.shooting import shoot as shoot_all
from rodatlas.states.starts import Starts, relaxed
from rodatlas.states.store import load_discovery, save_discovery
from rodatlas.states.winding import is_wound

UNEQUAL = Ends.unequal(20.0, 35.0)
GENERAL = Ends.unequal(20.0, 35.0, 0.5, shear=0.3, offset=0.15, twist_deg=70.0)
STABLE = {  # class: energy and height of all stable states at 20 and 35 degrees, dL = 1/2, without shear
    "+": [(8.9019627, 0.2110679), (20.5124793, -0.1484312), (33.9033577, 0.2060996), (33.9033577, 0.2060996)],
    "-": [(19.8612232, 0.0719563), (22.0149800, -0.0386353), (30.2210433, 0.2123931), (30.2210433, 0.2123931)],
}


@pytest.fixture(scope="module")
def found():
    return find_states(UNEQUAL, stable_only=True, threads=1)


@pytest.fixture(scope="module")
def general():
    return find_states(GENERAL, stable_only=True, starts=512, threads=1)


def told(found, cls):
    return [(s.solution["energy"], s.solution["height"]) for s in found.states if s.cls == cls]


def test_independent_searches_find_the_same_stable_states(found):
    other = find_states(UNEQUAL, stable_only=True, starts=2048, seed=5, threads=1)
    for search in (found, other):
        for cls, expected in STABLE.items():
            np.testing.assert_allclose(told(search, cls), expected, atol=2e-7)
    assert {s.name for s in found.states} == {s.pair for s in found.states} == {None}
    assert found.unseen_estimate == 0.0


@pytest.mark.parametrize("number", range(8))
def test_each_stable_state_agrees_with_an_independent_shooting(found, number):
    state = RodState(found.states[number].solution)
    shot = shoot(Poses.of(20.0, 35.0, 0.5), 1.005 * state.force[0], 0.998 * state.moment[0] + 0.01)
    assert shot.gap < 1e-8
    assert shot.energy == pytest.approx(state.energy, abs=1e-6)
    assert shot.height == pytest.approx(state.height, abs=1e-6)
    assert index_of(state.solution).trusted


def test_all_parameters_at_once(general):
    """No symmetry is left; the states that continuation reaches are among those that are met."""
    assert symmetries_at(general.states[0].solution) == ()
    poses = Poses.of(20.0, 35.0, 0.5, 0.3, 0.15, 70.0)
    for family, place in (("U", 0), ("W", 1)):
        state = general.states[place]
        assert state.cls == "+"
        assert state.solution["energy"] == pytest.approx(state_at(GENERAL, family)["energy"], abs=1e-6)
    rod = RodState(general.states[2].solution)
    shot = shoot(poses, 1.005 * rod.force[0], 0.998 * rod.moment[0])
    assert (general.states[2].cls, shot.gap < 1e-8) == ("-", True)
    assert shot.energy == pytest.approx(rod.energy, abs=1e-6)


def test_a_state_is_listed_with_all_its_images():
    """Between planar parallel clamps the group has four elements; one seldom state stands for its orbit."""
    ends = Ends.unequal(20.0, -20.0)
    found = find_states(ends, classes="+", stable_only=True, starts=256, threads=1)
    orbit = [s for s in found.states if s.solution["energy"] == pytest.approx(42.08635, abs=1e-5)]
    signs = {(np.sign(s.solution["height"]), np.sign(s.solution["end_force_z"])) for s in orbit}
    assert len(orbit) == len(signs) == 4
    (group,) = with_images([[orbit[0]]])
    assert len(group) == 4
    np.testing.assert_allclose([s.solution["energy"] for s in group], orbit[0].solution["energy"], rtol=1e-9)
    assert len({round(s.solution["height"] * s.solution["end_force_z"], 6) for s in group}) == 2
    planar = next(s for s in found.states if s.solution["energy"] < 15.0)
    assert len(with_images([[planar]])[0]) == 2  # what is planar is its own image in the shear mirror
    assert with_images([]) == []


def test_mirror_images_of_twisted_states_at_equal_clamps():
    """Without shear: of a state off every symmetry there are two pairs, and a list of one has the other added."""
    found = find_states(Ends(15.0), classes="-", starts=512, threads=1)
    state = next(s for s in found.states if s.pair and abs(s.solution["end_force_z"]) > 1.0)
    others = [s for s in found.states if s.solution["energy"] == pytest.approx(state.solution["energy"], rel=1e-8)]
    mirrored = mirror_shear(state.solution)["end_force_z"]
    assert any(s.solution["end_force_z"] == pytest.approx(mirrored, abs=1e-5) for s in others)


def test_search_kernels_take_clamps_turned_as_one():
    """Both clamps turned about an axis that is no symmetry: the same energies, forces and moments turn with them."""
    law, turn = LinearLaw(0.625), Rotation.from_rotvec([0.3, -0.5, 0.7])
    starts = relaxed(GENERAL, law, 1, range(48), partly=False)
    x, y, z, w = turn.as_quat()
    q, poses = starts.poses[..., :4], starts.poses.copy()
    poses[..., 0] = w * q[..., 0] - q[..., 1:] @ [x, y, z]
    poses[..., 1:4] = w * q[..., 1:] + q[..., :1] * [x, y, z] + np.cross([x, y, z], q[..., 1:])
    poses[..., 4:] = turn.apply(poses[..., 4:].reshape(-1, 3)).reshape(poses[..., 4:].shape)
    constants = np.hstack([turn.apply(starts.constants[:, :3]), turn.apply(starts.constants[:, 3:])])
    plain, turned = shoot_all(starts, law), shoot_all(Starts(poses, constants), law)
    assert plain.converged.all()
    assert turned.converged.all()
    np.testing.assert_allclose(turned.energy, plain.energy, rtol=1e-8)
    np.testing.assert_allclose(turned.constants[:, :3], turn.apply(plain.constants[:, :3]), atol=1e-5)


def test_a_full_turn_of_the_clamp_is_the_other_class():
    """The states of class + after a turn are those of class - before it, with no or two turns more in them."""
    plain = find_states(Ends(15.0, shear=0.2), classes="-", stable_only=True, starts=256, wound=True, threads=1)
    after = find_states(Ends(15.0, shear=0.2, twist_deg=360.0), classes="+", stable_only=True, starts=256, wound=True,
                        threads=1)  # fmt: skip
    expected = [s.solution["energy"] for s in plain.states]
    np.testing.assert_allclose([s.solution["energy"] for s in after.states], expected, rtol=1e-7)


@pytest.mark.parametrize(("cls", "turns"), [("+", 1.0), ("-", 2.0)])
def test_clamps_that_are_twisted_allow_as_much_twist_more(cls, turns, general):
    solution = general.states[0].solution
    own = RodState(solution).at_gauss_points().tau
    missing = 2.0 * np.pi * turns - solution.mean(own)
    for twist_right, more, wound in ((0.0, 0.1, True), (0.2, 0.1, False), (0.2, 0.3, True), (-0.2, 0.1, True)):
        stages = solution.stages.copy()
        stages[..., rod_problem().unknowns.index("tau")] += missing + more
        twisted = type(solution)(**{**vars(solution), "stages": stages}).with_parameters(twist_right=twist_right)
        assert is_wound(twisted, cls) is wound


def test_a_state_that_is_let_go_comes_back_to_itself(general):
    solution = general.states[0].solution
    assert descend(solution)["energy"] == pytest.approx(solution["energy"], abs=1e-6)
    with pytest.raises(ValueError, match=r"shear: expected a number of size below 0\.852936.* offset 0\.15, got 0\.86"):
        descend(solution, shear=0.86)


def test_json_says_the_setting_and_leads_back_to_the_states(capsys, tmp_path, general):
    path, out = tmp_path / "states.json", tmp_path / "general.vtp"
    arguments = ["--angle-left", "20", "--angle-right", "35", "--shear", "0.3", "--offset", "0.15", "--twist", "70"]
    with pytest.raises(SystemExit) as leave:
        main(["states", *arguments, "--stable-only", "--starts", "64", "--class", "+", "--json", str(path)])
    assert not leave.value.code
    plain = json.loads(path.read_text())
    assert plain["model"] == "band"
    assert plain["along"] is plain["angle_deg"] is None
    assert plain["setting"] == {
        "angle_left": 20.0, "angle_right": 35.0, "compression": 0.5, "shear": 0.3, "offset": 0.15, "twist": 70.0,
        "poisson": 0.25,
    }  # fmt: skip
    rod = RodState(general.states[0].solution)
    first = plain["states"][0]
    assert (first["name"], first["symmetric"], first["pair"]) == (None, False, None)
    assert first["energy"] == pytest.approx(rod.energy, abs=1e-6)
    np.testing.assert_allclose(first["force"], rod.force[0], atol=1e-5)
    np.testing.assert_allclose(first["moment"], rod.moment[0], atol=1e-5)
    table = read_states_table(path)
    shape = shapes_of(table, "+1")["+1"]
    assert shape["height"] == pytest.approx(rod.height, abs=1e-7)
    frame = tables_of(table, 3)[0][""]
    assert frame["angle_left_deg"][0] == 20.0
    assert frame["force_3"][0] == pytest.approx(rod.force[0, 2], abs=1e-5)
    with pytest.raises(SystemExit):
        main(["export", str(path), "--state", "+2", "--out", str(out)])
    assert out.stat().st_size > 1000
    capsys.readouterr()


def test_searches_between_any_clamps_are_stored(tmp_path, general):
    save_discovery(tmp_path / "states.h5", general)
    loaded = load_discovery(tmp_path / "states.h5")
    assert loaded.ends == GENERAL
    assert loaded.to_json() == general.to_json()


def test_found_states_without_a_partner(found):
    state = found.states[2]
    assert isinstance(state, FoundState)
    assert state.to_json()["symmetric"] is False
    assert len(state.to_json()["moment"]) == 3
