"""Clamps of 20 and 35 degrees at dL = 1/2 through slice, states and loci; states against an independent shooting."""

import numpy as np
import pytest

from frame_shooting import Poses, shoot
from rodatlas.atlas import LociSettings, SliceSettings, coexisting_states, compute_loci
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.model import model_named
from rodatlas.model.orbit import same_state
from rodatlas.rods import Ends, RodState, rod_problem
from rodatlas.states import find_states

pytestmark = pytest.mark.slow

LEFT, RIGHT = 20.0, 35.0


def settings(left=LEFT, right=RIGHT, **more):
    half = (left - right) / 2
    return SliceSettings.of(model_named("band"), angle=(left + right) / 2, turn_left=half, turn_right=-half, **more)


@pytest.fixture(scope="module")
def found(shared):
    return obtain_slice(settings(), shared)


def test_nothing_is_left_unexplained(found):
    assert found.warnings == ()
    assert not any(b.followed.pair for b in found.branches)  # between unequal clamps there is no reversal
    assert found.to_json()["setting"] == {
        "poisson": 0.25, "compression": 0.5, "angle": 27.5, "turn_left": -7.5, "turn_right": 7.5, "offset": 0.0,
        "twist": 0.0, "angle_left": 20.0, "angle_right": 35.0,
    }  # fmt: skip


def test_no_pitchfork_is_left(found):
    """What was a pitchfork of the reversal is broken up: only folds remain, besides points of other symmetries."""
    assert {e.kind for b in found.branches for e in b.events} == {"fold"}


@pytest.mark.parametrize("shear", [0.0, 0.2, 0.6])
def test_stable_states_agree_with_an_independent_shooting(found, shear):
    there = coexisting_states(found, shear)
    assert len(there) == len(found.states_at(shear)) >= 2
    for solution in there.values():
        state = RodState(solution)
        shot = shoot(Poses.of(LEFT, RIGHT, 0.5, shear), 1.002 * state.force[0], 0.999 * state.moment[0])
        assert shot.gap < 1e-8
        assert shot.energy == pytest.approx(state.energy, abs=1e-6)
        assert shot.height == pytest.approx(state.height, abs=1e-6)


@pytest.mark.parametrize("shear", [0.0, 0.2])
def test_a_search_that_knows_no_branches_finds_the_same(found, shear):
    model = found.settings.model
    parameters = model.parameters(found.settings.whole_setting(shear))
    searched = find_states(Ends.unequal(LEFT, RIGHT, 0.5, shear), classes="+", stable_only=True, threads=1).states
    states = [s.solution.with_parameters(**parameters) for s in searched if not s.wound and abs(s.twist) < np.pi]
    on_slice = list(coexisting_states(found, shear).values())
    known = [s for s in on_slice if abs(_twist(s)) < np.pi]
    assert len(states) == len(known)
    assert all(any(same_state(model, s, other) for other in known) for s in states)


def _twist(solution):
    return solution.mean(RodState(solution).at_gauss_points().tau)


def test_ranges_are_those_of_the_reversed_clamps(found, shared):
    """35 and 20 degrees: the same states from the other end, at the same shears, heights and energies."""
    other = obtain_slice(settings(RIGHT, LEFT), shared)
    assert other.warnings == ()
    mine, theirs = ([(*s.span, s.low.response, s.high.response) for s in x.states] for x in (found, other))
    for one in mine:
        assert min(np.abs(np.subtract(one, two)).max() for two in theirs) < 1e-6, one
    assert len(mine) == len(theirs)


def test_folds_move_with_the_angle_as_slices_tell(found, shared):
    """Loci in the common angle, from the slice at 20 and 35 degrees, pass through the folds of that at 21 and 36."""
    plane = LociSettings.of(model_named("band"), turn_left=-7.5, turn_right=7.5, second_low=26.0, second_high=29.0)
    numbers = sorted({e.number for b in found.branches for e in b.events})
    loci = compute_loci(plane, lambda angle: obtain_slice(plane.slice_at(angle), shared), numbers[:6])
    assert loci.warnings == ()
    near = obtain_slice(settings(LEFT + 1.0, RIGHT + 1.0), shared)
    folds = [(e.value, e.response) for b in near.branches for e in b.events]
    told = 0
    for piece in loci.pieces:
        if piece.number in numbers[:6] and piece.span[0] < 28.5 < piece.span[1]:
            value, response = piece.at(28.5)
            assert min(max(abs(value - a), abs(response - b)) for a, b in folds) < 1e-5
            told += 1
    assert told >= 4


def test_the_problem_has_all_clamp_parameters():
    names = set(rod_problem().parameters)
    assert {c.parameter for c in model_named("band").controls} <= names
