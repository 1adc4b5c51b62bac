"""Small compressions: limits of shallow arches, in mu = psi0/sqrt(dL), that linear theory gives in closed form."""

import math

import pytest

from rodatlas.continuation import MeshControl, StepControl, TraceOptions, solve, trace
from rodatlas.rods import RodState, planar_states, rod_problem
from rodatlas.rods.shallow import SHALLOW, first_mode

PITCHFORK, FOLD = 2.0, 2.011905304  # of the inverted arch, both clamps turned
ONE_CLAMP = 1.781776041  # fold with one clamp turned
COMPRESSIONS = (1e-3, 2.5e-4)


def extrapolated(values):
    """Limit of two values at dL and dL/4 whose error is of first order in dL."""
    return (4 * values[1] - values[0]) / 3


def options(compression, name):
    return TraceOptions(
        mesh=MeshControl(tolerance=1e-9), step=StepControl(maximum=0.3), max_folds=1,
        bounds={name: (-3 * math.sqrt(compression), 1e-9)},
    )  # fmt: skip


@pytest.fixture(scope="module")
def inverted():
    """Special points of the planar arch whose clamps are turned against it, by compression."""
    found = {}
    for compression in COMPRESSIONS:
        settings = options(compression, "psi0")
        level = solve(rod_problem(), first_mode(0.625, compression), ("psi0",), settings)
        branch = trace(rod_problem(), level, ("psi0",), settings, both=False, direction=-1.0)
        assert not branch.discrepancies
        found[compression] = [(x.kind, -x.solution["psi0"] / math.sqrt(compression)) for x in branch.special]
    return found


@pytest.mark.parametrize(("number", "kind", "limit"), [(0, "branch point", PITCHFORK), (1, "fold", FOLD)])
def test_the_inverted_arch_loses_symmetry_and_turns_back_as_in_linear_theory(inverted, number, kind, limit):
    assert [points[number][0] for points in inverted.values()] == [kind, kind]
    assert extrapolated([points[number][1] for points in inverted.values()]) == pytest.approx(limit, abs=1e-7)


@pytest.mark.parametrize("turned", ["turn_left", "turn_right"])
def test_an_arch_with_one_clamp_turned_turns_back_as_in_linear_theory(turned):
    found = []
    for compression in COMPRESSIONS:
        settings = options(compression, turned)
        level = solve(rod_problem(), first_mode(0.625, compression), (turned,), settings)
        branch = trace(rod_problem(), level, (turned,), settings, both=False, direction=-1.0)
        found.append(-branch.of_kind("fold")[0].solution[turned] / math.sqrt(compression))
    assert extrapolated(found) == pytest.approx(ONE_CLAMP, abs=1e-6)


def test_the_arch_between_level_clamps_is_half_a_wave_at_the_load_of_euler():
    """Height 2 sqrt(dL)/pi and thrust 4 pi^2 a, both with an error of first order in dL."""
    for compression in (1e-2, 1e-4, 1e-6):
        states, missing = planar_states(0.625, 0.0, compression)
        arch = RodState(states["U"])
        assert not missing
        assert arch.force[0, 0] == pytest.approx(-0.625 * 4 * math.pi**2, rel=2 * compression)
        middle = arch.at([0.5]).position[0, 1]
        assert middle == pytest.approx(2 * math.sqrt(compression) / math.pi, rel=2.5 * compression)
        assert states["W"]["height"] == pytest.approx(-states["U"]["height"], rel=1e-8)


def test_both_starts_give_the_same_states(monkeypatch):
    """Just below the compression at which the start changes, the circle leads to the same states."""
    setting = (0.625, math.radians(10.0), 0.9 * SHALLOW)
    near, missing = planar_states(*setting)
    monkeypatch.setattr("rodatlas.rods.planar.SHALLOW", 0.0)
    far, _ = planar_states(*setting)
    assert (list(near), missing) == (["U", "W", "third mode"], "")
    for name, state in near.items():
        assert state["energy"] == pytest.approx(far[name]["energy"], rel=1e-7)
        assert state["height"] == pytest.approx(far[name]["height"], rel=1e-7)


def test_beyond_the_fold_only_the_arch_itself_is_left():
    compression = 1e-3
    inside, beyond = (mu * math.sqrt(compression) for mu in (2.005, 2.02))
    assert list(planar_states(0.625, inside, compression)[0]) == ["U", "W", "third mode"]
    states, missing = planar_states(0.625, beyond, compression)
    assert list(states) == ["U"]
    assert "turns back before it reaches this angle" in missing
