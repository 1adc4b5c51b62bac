"""Any two clamps through one problem: an independent shooting, work and energy, invariances, limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from frame_shooting import Poses, shoot
from rodatlas.continuation import EndReason, MeshControl, NewtonOptions, TraceOptions, solve
from rodatlas.continuation.problem.symmetry import NotRespected, Symmetry, checked
from rodatlas.rods import (
    Clamps,
    Ends,
    Pose,
    RodState,
    anisotropic_rod,
    asymmetry,
    carried,
    fixes,
    from_reduced,
    has_partner,
    index_of,
    is_symmetric,
    limiting_shear,
    mirror_angle,
    mirror_shear,
    pair_member,
    plus_member,
    reduced_problem,
    reverse,
    rod_problem,
    state_at,
    to_reduced,
)
from rodatlas.rods.band import near_limit
from rodatlas.rods.perfectly_anisotropic import SYMMETRIES
from rodatlas.rods.reach import NotReached
from rodatlas.rods.unknowns import CLAMPS, clamps_of

TIGHT = TraceOptions(mesh=MeshControl(tolerance=1e-10), newton=NewtonOptions(tolerance=1e-11))
UNEQUAL = Ends.unequal(20.0, 35.0)
GENERAL = Ends.unequal(20.0, 35.0, 0.5, shear=0.3, offset=0.15, twist_deg=70.0)


def solved(solution, **parameters):
    return solve(rod_problem(), solution.with_parameters(**parameters), ("dD",), TIGHT)


@pytest.fixture(scope="module")
def unequal():
    return state_at(UNEQUAL, tolerance=1e-10)


@pytest.fixture(scope="module")
def general():
    """Both clamps turned, displaced and twisted: no parameter is at its default."""
    end = carried(state_at(GENERAL, tolerance=1e-10), {"twist_left": 0.25}, 1e-10)
    assert end.arrived
    return end.solution


# -- independent shooting ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("family", ["U", "W"])
@pytest.mark.parametrize("ends", [UNEQUAL, GENERAL], ids=["unequal", "general"])
def test_states_agree_with_an_independent_shooting(ends, family):
    """From loads a few percent off; the clamps of the shooting are written anew from the angles."""
    state = RodState(state_at(ends, family, tolerance=1e-10))
    poses = Poses.of(ends.left_deg, ends.right_deg, ends.compression, ends.shear, ends.offset, ends.twist_deg)
    shot = shoot(poses, 1.03 * state.force[0], 0.98 * state.moment[0] + 0.1)
    assert shot.gap < 1e-8
    assert shot.energy == pytest.approx(state.energy, abs=1e-7)
    assert shot.height == pytest.approx(state.height, abs=1e-8)
    assert shot.force == pytest.approx(state.force[0], abs=1e-5)
    assert index_of(state.solution).index == 0


def test_the_clamps_are_those_of_the_angles():
    poses = Poses.of(20.0, 35.0, 0.5, 0.3, 0.15, 70.0)
    for clamps in (GENERAL.clamps, clamps_of(GENERAL.parameters)):
        assert clamps.left.directors == pytest.approx(poses.left, abs=1e-14)
        assert clamps.right.directors == pytest.approx(poses.right, abs=1e-14)
        assert clamps.left.position == pytest.approx(poses.start, abs=1e-15)
        assert clamps.right.position == pytest.approx(poses.end, abs=1e-15)
    a_turn = Pose.tilted(0.3, (0.0, 0.0, 0.0)).twisted(2.0 * math.pi)
    assert a_turn.quaternion == pytest.approx(Pose.tilted(0.3, (0.0, 0.0, 0.0)).of_class(-1).quaternion, abs=1e-15)


@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi])
def test_without_further_turns_the_clamps_are_the_symmetric_ones_bit_for_bit(angle):
    plain, changed = Clamps.symmetric(angle, 0.4, 0.2), Clamps.changed(angle, 0.4, 0.2, *[0.0] * 5)
    assert np.array_equal(plain.left.numbers, changed.left.numbers)
    assert np.array_equal(plain.right.numbers, changed.right.numbers)
    assert clamps_of({"psi0": angle, "dL": 0.4, "dD": 0.2, **dict.fromkeys(CLAMPS[3:], 0.0)}) == changed


def test_all_formulations_have_the_same_states_between_any_clamps(general):
    free = ("dD", "nx", "ny", "nz", "mx", "my", "mz")
    whole = from_reduced(solve(reduced_problem(), to_reduced(general), free, TIGHT))
    assert whole["energy"] == pytest.approx(general["energy"], abs=1e-8)
    rod = anisotropic_rod()
    stiff = solve(rod.problem, RodState(general).rewritten(rod.formulation, c2=0.0), ("dD",), TIGHT)
    assert stiff["energy"] == pytest.approx(general["energy"], abs=1e-8)
    assert stiff["height"] == pytest.approx(general["height"], abs=1e-9)


# -- work -------------------------------------------------------------------------------------------------------------


def test_the_energy_changes_by_the_work_of_every_clamp(general):
    """Difference quotients of solved states: the clamps exert n and m at s = 1, and -n and -m at s = 0."""
    state, step = RodState(general), 1e-4
    force, (start, end), (twist_left, twist_right) = state.force[0], state.moment[[0, -1]], state.tau[[0, -1]]
    work = {
        "psi0": -start[2] - end[2], "dL": -force[0], "dD": force[2], "dY": force[1], "turn_left": -start[2],
        "turn_right": -end[2], "twist_left": -twist_left, "twist_right": twist_right,
    }  # fmt: skip
    assert tuple(work) == CLAMPS
    for name, expected in work.items():
        low, high = (solved(general, **{name: general[name] + d})["energy"] for d in (-step, step))
        assert (high - low) / (2.0 * step) == pytest.approx(expected, abs=2e-5), name
    assert twist_right == pytest.approx(end @ state.directors[-1, 2], abs=1e-8)


# -- symmetries and invariances ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("image", [reverse, mirror_angle, mirror_shear])
def test_images_of_a_state_between_any_clamps_are_states(general, image):
    there = image(general)
    moved = solve(rod_problem(), there, ("dD",), TIGHT)
    assert np.abs(moved.values[[0, -1]] - there.values[[0, -1]]).max() < 1e-6
    assert moved["energy"] == pytest.approx(general["energy"], abs=1e-8)
    assert index_of(moved).index == index_of(general).index
    back = image(there)
    assert back.parameters == pytest.approx(general.parameters, abs=1e-15)
    assert np.abs(back.values) == pytest.approx(np.abs(general.values), abs=1e-12)


def test_a_state_tells_how_its_clamps_differ(general):
    said = repr(RodState(general))
    assert "dY 0.15, turn_left -0.1309, turn_right 0.1309, twist_left 0.25, twist_right 1.22173: height" in said


def test_reversal_exchanges_unequal_clamps(unequal):
    other = state_at(Ends.unequal(35.0, 20.0), tolerance=1e-10)
    image = reverse(unequal)
    assert image.parameters == pytest.approx(other.parameters, abs=1e-15)
    assert image["energy"] == pytest.approx(other["energy"], abs=1e-9)
    assert image["height"] == pytest.approx(other["height"], abs=1e-9)


def test_the_check_of_a_symmetry_tells_the_sign_of_the_twist():
    """Reversal exchanges the twists with their sign changed; without the sign the problem refuses it."""
    reversal = SYMMETRIES[0]
    wrong = {**reversal.parameters, "twist_left": "twist_right", "twist_right": "twist_left"}
    with pytest.raises(NotRespected, match="'reversal' does not respect the boundary conditions"):
        checked(rod_problem(), [replace(reversal, parameters=wrong), *SYMMETRIES[1:]])
    still = Symmetry("angle mirror", SYMMETRIES[1].unknowns, {"psi0": -1})
    with pytest.raises(NotRespected, match="'angle mirror' does not respect the boundary conditions"):
        checked(rod_problem(), [still, SYMMETRIES[3]])


@pytest.mark.parametrize(
    ("parameters", "reversal", "mirror", "both"),
    [
        (Ends(15.0, shear=0.2).parameters, True, False, False),
        (Ends(15.0).parameters, True, True, True),
        (UNEQUAL.parameters, False, True, False),
        (Ends(15.0, offset=0.1).parameters, False, True, False),
        (Ends(15.0, twist_deg=10.0).parameters, False, False, False),
        ({"psi0": 0.3, "turn_left": 0.2, "turn_right": 0.2}, True, True, True),
        ({"psi0": 0.3, "twist_left": -0.2, "twist_right": 0.2, "dD": 0.1}, True, False, False),
        ({"psi0": 0.3, "twist_left": 0.2, "twist_right": 0.2}, False, False, True),
    ],
)
def test_which_settings_have_which_symmetry_follows_from_their_parameters(parameters, reversal, mirror, both):
    names = ("reversal", "shear mirror", "reversal * shear mirror")
    assert [fixes(name, parameters) for name in names] == [reversal, mirror, both]


def test_parallel_clamps_have_a_point_symmetry():
    ends = Ends.unequal(20.0, -20.0)
    assert fixes("angle mirror * reversal", ends.parameters)
    assert not fixes("angle mirror", ends.parameters)


def test_states_have_partners_only_where_the_reversal_keeps_the_clamps(unequal):
    assert not is_symmetric(unequal)
    assert not has_partner(unequal)
    assert plus_member(unequal) is unequal
    with pytest.raises(ValueError, match="solution: expected one whose clamps the reversal leaves alone, got one with"):
        pair_member(unequal)
    turned = carried(state_at(Ends(15.0, shear=0.2)), {"twist_left": -0.3, "twist_right": 0.3}).solution
    assert is_symmetric(turned)
    assert not has_partner(turned)
    with pytest.raises(ValueError, match="symmetry: expected one of reversal, angle mirror, shear mirror, got 'turn'"):
        fixes("turn", unequal)


@pytest.mark.parametrize("shear", [0.0, 0.25])
def test_clamps_turned_as_one_about_z_hold_the_same_shapes(shear):
    """The chord turned in the clamp plane by 25 degrees: another skew, offset and compression, the same state."""
    turn, angle = math.radians(25.0), 15.0
    plain = state_at(Ends(angle, 0.5, shear), tolerance=1e-10)
    ends = Ends(angle, 1.0 - 0.5 * math.cos(turn), shear, offset=0.5 * math.sin(turn), skew_deg=25.0)
    state = state_at(ends, tolerance=1e-10)
    assert state["energy"] == pytest.approx(plain["energy"], abs=1e-8)
    along = plain.mean(RodState(plain).at_gauss_points().position[..., 0])
    expected = math.cos(turn) * plain["height"] + math.sin(turn) * along
    assert state["height"] == pytest.approx(expected, abs=1e-9)
    assert asymmetry(state) < 1e-6
    assert not is_symmetric(state)  # in the sense of the reversal, which exchanges the clamps here


def test_clamps_turned_as_one_about_x_hold_the_same_shapes():
    """At psi0 = 0 both tangents lie along x: turned about it, both clamps are twisted and the right one displaced."""
    turn, shear, offset = 0.4, 0.25, 0.1
    start = state_at(Ends(0.0, 0.5, shear, offset, 30.0), tolerance=1e-10)
    goal = {
        "twist_left": turn, "twist_right": start["twist_right"] + turn,
        "dY": offset * math.cos(turn) - shear * math.sin(turn), "dD": offset * math.sin(turn) + shear * math.cos(turn),
    }  # fmt: skip
    end = carried(start, goal, 1e-10)
    assert end.arrived
    assert end.solution["energy"] == pytest.approx(start["energy"], abs=1e-8)
    force = Rotation.from_rotvec([turn, 0.0, 0.0]).apply(RodState(start).force[0])
    assert RodState(end.solution).force[0] == pytest.approx(force, abs=1e-6)


# -- ends, limits, and ways to them -----------------------------------------------------------------------------------


def test_ends_by_their_angles():
    assert (UNEQUAL.left_deg, UNEQUAL.right_deg, UNEQUAL.angle_deg, UNEQUAL.skew_deg) == (20.0, 35.0, 27.5, -7.5)
    for left, right in ((20.1, 35.3), (-0.3, 77.7), (1e-3, -179.9), (180.0, -180.0)):
        assert (Ends.unequal(left, right).left_deg, Ends.unequal(left, right).right_deg) == (left, right)
    assert not UNEQUAL.alike
    assert Ends.unequal(30.0, 30.0) == Ends(30.0)
    assert Ends(30.0).alike
    assert GENERAL.distance == pytest.approx(math.sqrt(0.25 + 0.09 + 0.0225), rel=1e-15)
    for ends in (UNEQUAL, GENERAL, Ends(30.0, shear=0.1)):
        assert Ends.from_setting(ends.setting) == ends
    assert tuple(Ends(1.0).parameters) == CLAMPS
    with pytest.raises(ValueError, match="setting: expected angle, compression, offset, shear, twist, got angle "):
        Ends.from_setting({"angle": 1.0})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"angle_deg": 15.0, "offset": 0.87}, "offset: expected a number of size below 0.866025, the limit for compr"),
        ({"angle_deg": 15.0, "offset": 0.8, "shear": 0.4}, "shear: expected a number of size below 0.331662, the"),
        ({"angle_deg": 15.0, "twist_deg": 721.0}, "twist: expected degrees between -720 and 720, got 721"),
        ({"angle_deg": 100.0, "skew_deg": 81.0}, "skew: expected degrees of size up to 80 at angle 100, got 81"),
        ({"angle_deg": 15.0, "twist_deg": "x"}, "twist: expected degrees between -720 and 720, got 'x'"),
    ],
)
def test_wrong_ends(arguments, message):
    with pytest.raises(ValueError, match=message):
        Ends(**arguments)


def test_wrong_unequal_ends():
    with pytest.raises(ValueError, match="angle-right: expected degrees between -180 and 180, got 190"):
        Ends.unequal(20.0, 190.0)


def test_the_limiting_shear_with_an_offset():
    """A chord of length one, and with a width a straight diagonal."""
    assert limiting_shear(0.5, offset=0.3) == pytest.approx(math.sqrt(1.0 - 0.25 - 0.09), rel=1e-15)
    width = 0.1
    shear = limiting_shear(0.5, width, 0.3)
    assert math.hypot(0.5, 0.3, shear + width) == pytest.approx(math.hypot(1.0, width), rel=1e-15)
    with pytest.raises(ValueError, match=r"offset: expected a number of size up to 0\.866025"):
        limiting_shear(0.5, offset=0.9)


def test_care_is_told_where_shear_and_offset_together_come_near_the_limit():
    limit = limiting_shear(0.5)
    assert near_limit(0.0, 0.5, 0.94 * limit) == ""
    assert near_limit(0.96 * limit, 0.5) == near_limit(0.96 * limit, 0.5, 0.0) != ""
    assert near_limit(0.6, 0.5, 0.59).startswith("limiting shear: 0.6 with the offset 0.59 is 0.972 of the limiting")


def test_where_a_family_is_missing_the_mean_angle_is_said():
    with pytest.raises(NotReached, match="angle: expected one at which W exists, got 90, the mean of both"):
        state_at(Ends.unequal(100.0, 80.0), "W")


def test_a_state_is_not_carried_past_a_fold():
    """U is lost when the clamp is twisted: how far it was followed, in which parameter, and why, each in a field."""
    start = state_at(Ends(15.0))
    lost = carried(start, {"twist_right": 2.0 * math.pi})
    assert (lost.arrived, lost.parameter, lost.end) == (False, "twist_right", EndReason.FOLD_LIMIT)
    assert math.degrees(lost.limit) == pytest.approx(261.335, abs=0.001)
    assert lost.reason == "the branch in twist_right turns back at a fold at 4.56115"
    assert carried(start, {}).solution is start
    with pytest.raises(ValueError, match="parameter"):
        carried(start, {"turn": 0.1})
    with pytest.raises(NotReached, match=r"twist: expected a value short of 261\.335, where the branch of U turns"):
        state_at(Ends(15.0, twist_deg=360.0))
