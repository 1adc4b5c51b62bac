"""The batch kernel against the collocation engine, and its order and Jacobian."""

import numpy as np
import pytest

from rodatlas.rods import Ends, RodState, state_at, to_reduced
from rodatlas.rods._shooting_kernel import COLUMNS, SIZE, STAGES, STATE, TABLEAU, WEIGHTS, _linearize
from rodatlas.rods.law import LinearLaw, softness_of_band
from rodatlas.states.shooting import PLANS, Plan, as_guess, shoot
from rodatlas.states.starts import PLACES, Starts

LAW = LinearLaw(0.625)


@pytest.fixture(scope="module")
def u_state():
    return state_at(Ends(45.0, 0.5, 0.2), tolerance=1e-11)


def starts_of(solution, segments=PLACES):
    reduced = to_reduced(solution)
    return Starts(reduced(np.linspace(0.0, 1.0, segments + 1))[None], reduced.parameters[None, -6:].copy())


def test_a_solution_of_the_engine_is_found_again(u_state):
    """Perturbed constants come back to the same N0, M0, height and energy; MODEL's reference case."""
    start = starts_of(u_state)
    start.constants[0] *= 1.05
    shots = shoot(start, LAW, plan=Plan(150.0, 8, 10, False))
    assert shots.converged[0]
    assert shots.defect[0] < 1e-9
    np.testing.assert_allclose(shots.constants[0], starts_of(u_state).constants[0], atol=1e-7)
    assert shots.height[0] == pytest.approx(0.215493955, abs=1e-8)
    assert shots.energy[0] == pytest.approx(8.272356559, abs=1e-8)
    rod = RodState(u_state)
    np.testing.assert_allclose(rod.force[0], shots.constants[0, :3], atol=1e-7)
    np.testing.assert_allclose(rod.moment[0], shots.constants[0, 3:], atol=1e-7)


@pytest.mark.parametrize("plan", [Plan(np.inf, 4, 20, False), Plan(np.inf, 16, 4, True), Plan(np.inf, 64, 2, True)])
def test_neither_segments_nor_elimination_matter(u_state, plan):
    """Condensed or compacted, with few or many segments, the solution is one; `as_guess` fills in the poses between."""
    start = starts_of(u_state)
    start.constants[0] *= 1.05
    start.poses[0, 1:-1, 4:] += 0.01
    shots = shoot(start, LAW, plan=plan)
    np.testing.assert_allclose(shots.constants[0], starts_of(u_state).constants[0], atol=1e-7)
    guess = as_guess(shots, 0, LAW, Ends(45.0, 0.5, 0.2))
    s = np.linspace(0.0, 1.0, PLACES + 1)
    np.testing.assert_allclose(guess(s), u_state(s), atol=1e-6)


def test_large_forces():
    """Close to the limiting shear, |N| = 1300: compaction converges from 2 percent off, and condensing does not."""
    state = state_at(Ends(60.0, 0.5, 0.82), tolerance=1e-10)
    exact = starts_of(state)
    assert np.linalg.norm(exact.constants[0, :3]) > 1000.0
    start = Starts(exact.poses, 1.02 * exact.constants)
    shots = shoot(start, LAW)
    assert (shots.converged[0], shots.segments[0]) == (True, 32)
    np.testing.assert_allclose(shots.constants, exact.constants, rtol=1e-7, atol=1e-5)
    assert shots.energy[0] == pytest.approx(state["energy"], rel=1e-8)
    assert not shoot(start, LAW, plan=PLANS[2]._replace(apart=False)).converged[0]


def march(constants, steps, poses):
    columns = np.empty((len(poses) - 1, 6, COLUMNS))
    y = np.empty(SIZE)
    _linearize(poses, constants[:3], constants[3:], softness_of_band(LAW), steps, TABLEAU, WEIGHTS,
               np.empty((STAGES, SIZE)), np.empty(SIZE), y, columns)  # fmt: skip
    return y[:STATE].copy(), columns[-1]


def test_order_of_the_integration(u_state):
    """Error of the end pose at 4, 6, 8, 12 steps falls with slope 8."""
    start = starts_of(u_state, 1)
    exact = march(start.constants[0], 200, start.poses[0])[0]
    counts = np.array([4, 6, 8, 12])
    errors = [np.abs(march(start.constants[0], k, start.poses[0])[0] - exact).max() for k in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert 7.0 < slope < 11.0


def test_columns_against_differences(u_state):
    """Every column: rotation vector and displacement of the free end by central differences."""
    start = starts_of(u_state, 1)
    constants, poses = start.constants[0], start.poses[0]
    columns = march(constants, 20, poses)[1]
    q, _ = march(constants, 20, poses)
    for c in range(6):
        step = np.zeros(6)
        step[c] = 1e-4
        d = (march(constants + step, 20, poses)[0] - march(constants - step, 20, poses)[0]) / 2e-4
        # rotation vector of the derivative: 2 vec(q' conj(q))
        turn = 2 * (q[0] * d[1:4] - d[0] * q[1:4] - np.cross(d[1:4], q[1:4]))
        np.testing.assert_allclose(columns[:, c], [*turn, *d[4:7]], atol=1e-8)


def test_hopeless_starts_are_reported(u_state):
    start = starts_of(u_state)
    shots = shoot(Starts(start.poses, start.constants * 100.0), LAW, most=3)
    assert not shots.converged[0]
