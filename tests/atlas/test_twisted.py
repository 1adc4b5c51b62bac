"""The twisted states TU and TW: energies, stability, closed loops, names, numbers, and the way to other angles."""

import math

import numpy as np
import pytest

from rodatlas.atlas import MemoryCache, compute_slice, reach
from rodatlas.atlas.slices.branches import seeds
from rodatlas.atlas.slices.branches.follow import trace_options
from rodatlas.continuation import EndReason, NewtonCode, NotConverged, trace
from rodatlas.paper.model import band, band_slice
from rodatlas.rods import (
    RodState,
    half_twist,
    index_of,
    is_symmetric,
    is_twisted,
    mirror_shear,
    pair_member,
    plus_member,
    reverse,
    rod_problem,
    second_variation_index,
    twisted_states,
)

ANGLE = math.radians(15.0)
TWISTED = next(source for source in band().sources if source.name == "twisted states")


@pytest.fixture(scope="module")
def states():
    found, missing = twisted_states(0.625, ANGLE, 0.5)
    assert missing == ""
    return found


@pytest.fixture(scope="module")
def loops(states):
    """Both loops over all shears that the rod can have."""
    options = trace_options(band_slice(15.0, shear_min=-0.82))
    return {name: trace(rod_problem(), state, ("dD",), options) for name, state in states.items()}


def second_variation(state):
    """The independent count of the index, by the discretized energy."""
    rod = RodState(state).at(np.linspace(0.0, 1.0, 201))
    return second_variation_index(rod.s, rod.quaternion, rod.position, rod.strain, rod.law)


def test_energies_and_stability(states):
    """TU as published; TW by the same descent."""
    assert abs(states["TU"]["energy"] - 37.41956) < 1e-5
    assert abs(states["TU"]["height"] - 0.202848) < 1e-6
    assert abs(states["TW"]["energy"] - 46.949718) < 1e-5
    assert abs(states["TW"]["height"] + 0.181320) < 1e-6
    for state in states.values():
        assert index_of(state).index == 0
        assert second_variation(state).index == 0
        assert state.error < 1e-8
        assert state.values[-1, 6] > 0  # class q(1) = +q of the clamp


def test_other_amplitudes_give_the_same_states(states, monkeypatch):
    from rodatlas.rods import twisted

    for bending in (14.0, 18.0, 20.0):
        monkeypatch.setattr(twisted, "BENDING", (bending,))
        again, missing = twisted_states(0.625, ANGLE, 0.5)
        assert missing == ""
        assert all(abs(again[n]["energy"] - states[n]["energy"]) < 1e-7 for n in states)


def test_states_that_do_not_exist_are_said():
    """TW ends at 26.9 degrees; descent then leads elsewhere."""
    found, missing = twisted_states(0.625, math.radians(40.0), 0.5)
    assert "TW" not in found
    assert "TW" in missing


def test_symmetry_without_shear(states):
    """Reversal and shear mirror together map a state to itself; each alone to its partner."""
    s = np.linspace(0.0, 1.0, 41)
    for state in states.values():
        strain = state(s)[:, 4:6]
        assert np.allclose(mirror_shear(reverse(state))(s)[:, 4:6], strain, atol=1e-6)
        assert not is_symmetric(state)
        assert np.abs(mirror_shear(state)(s)[:, 4:6] - strain).max() > 10
        assert RodState(state).inflections["k1"] == 4
        assert 0.9 * math.pi < abs(half_twist(state)) < 1.1 * math.pi


def test_members_of_pairs_do_not_change_along_a_loop(loops):
    for name, loop in loops.items():
        stable = [p.solution for p in loop.points if p.index == 0]
        members = {pair_member(s) for s in stable}
        assert len(members) == 1
        assert {pair_member(reverse(s)) for s in stable} == {"+", "-"} - members
        assert all(is_twisted(s) for s in stable)
        for s in (s for s in stable if 0.005 < s["dD"] < 0.05):  # the rule of all other pairs
            plus = plus_member(s)
            k1 = plus.stages[..., 4]
            assert plus.mean((plus.gauss_points() - 0.5) * k1**2) > 0, name


def test_loops_are_closed(loops):
    folds = {"TU": (0.12186189, 0.05820511), "TW": (0.06554339, 0.08666359)}
    for name, loop in loops.items():
        assert loop.ends == (EndReason.CLOSED, EndReason.CLOSED)
        assert loop.discrepancies == ()
        assert [x.kind for x in loop.special] == ["fold"] * 4
        found = sorted(x.solution["dD"] for x in loop.special)
        ends, others = folds[name]
        assert np.allclose(found, sorted((-ends, -others, others, ends)), atol=1e-7)
        assert {p.index for p in loop.points} == {0, 1, 2}


def test_work_along_a_loop(loops):
    """The shear does no work on the way round; dE/d(dD) is the force."""
    loop = loops["TU"]
    shear = np.array([p.solution["dD"] for p in loop.points])
    energy = np.array([p.solution["energy"] for p in loop.points])
    force = np.array([p.solution["end_force_z"] for p in loop.points])
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(shear))
    assert np.abs(work - (energy[1:] - energy[0])).max() < 0.02 * np.ptp(energy)


def test_names_numbers_and_ends_at_15_degrees(slice_15):
    for name, number, shear in (("TU+-", 2, 0.12186189), ("TW+-", 1, 0.06554339)):
        state = next(s for s in slice_15.states if s.name == name)
        assert state.pair
        assert state.low.kind == "range"
        assert (state.high.kind, state.high.number, state.high.snap) == ("fold", number, True)
        assert state.high.value == pytest.approx(shear, abs=1e-7)
    twisted = [b for b in slice_15.branches if b.id.startswith("T")]
    assert len(twisted) == 4  # each loop leaves the range at shear_min, and is cut in two
    found = sorted(round(e.value, 6) for b in twisted for e in b.events)
    assert found == [0.058205, 0.065543, 0.086664, 0.121862]


@pytest.mark.slow
def test_whole_loops_in_a_wide_slice():
    found = compute_slice(band_slice(15.0, shear_min=-0.15, shear_max=0.15, search=0), carry=False)
    loops = [b for b in found.branches if b.id.startswith("T")]
    assert [b.id for b in loops] == ["TU", "TW"]
    assert all(b.followed.branch.closed for b in loops)
    for name, number in (("TU+-", 2), ("TW+-", 1)):
        state = next(s for s in found.states if s.name == name)
        assert [e.number for e in (state.low, state.high)] == [number, number]
        assert state.low.value == pytest.approx(-state.high.value, abs=1e-7)


def test_reach_both_members():
    plus, _ = reach(band_slice(15.0), "TU+", 0.0)
    minus, _ = reach(band_slice(15.0), "TU-", 0.0)
    assert abs(plus["energy"] - 37.41956) < 1e-5
    assert abs(plus["energy"] - minus["energy"]) < 1e-8
    assert half_twist(plus) == pytest.approx(-half_twist(minus), abs=1e-6)
    other, _ = reach(band_slice(15.0), "TW-", 0.03)
    assert pair_member(other) == "-"
    assert index_of(other).index == 0
    assert other["dD"] == 0.03


def carried(angle, compression=0.5, poisson=0.25):
    found, warnings = seeds.seeds_of(TWISTED, band_slice(angle, compression, poisson), MemoryCache())
    assert warnings == []
    stable = {name for name, state in found if index_of(state).index == 0}
    return dict(found), stable


@pytest.mark.slow
def test_where_the_states_exist():
    """TW ends in a cusp at 26.892 degrees, TU at 74.027; both at dD = 0."""
    assert carried(0.0)[1] == {"TU", "TW"}
    assert carried(26.8)[1] == {"TU", "TW"}
    assert carried(27.0)[1] == {"TU"}
    assert carried(74.0)[1] == {"TU"}
    found, stable = carried(74.1)
    assert stable == set()
    assert "TU" not in found


def test_mirror_images_at_zero_angle():
    found, _ = carried(0.0)
    assert found["TU"]["height"] == pytest.approx(-found["TW"]["height"], abs=1e-8)
    assert found["TU"]["energy"] == pytest.approx(found["TW"]["energy"], abs=1e-7)


def test_what_cannot_be_found_is_said(monkeypatch):
    monkeypatch.setattr("rodatlas.rods.twisted.twisted_states", lambda *settings: ({}, "TU, TW"))
    assert seeds.seeds_of(TWISTED, band_slice(15.0), MemoryCache()) == ([], ["twisted states not reached: TU, TW"])


def test_what_cannot_be_carried_is_said(states, monkeypatch):
    def fails(name, *others):
        raise NotConverged(NewtonCode.SLOW, f"start of {name}")

    monkeypatch.setattr(seeds, "carried", fails)
    found, warnings = seeds.seeds_of(TWISTED, band_slice(30.0), MemoryCache())
    assert found == []
    assert [w.split(":")[0] for w in warnings] == [f"branch {n}" for n in ("TU", "TU-2", "TU-3", "TW", "TW-2", "TW-3")]


def test_number_0_is_where_highly_twisted_states_begin(slice_15):
    """The third mode's branch loses one of its three unstable directions there."""
    parent = next(b for b in slice_15.branches if b.id == "M3")
    event = next(e for e in parent.events if e.number == 0)
    assert (event.kind, event.special.index) == ("pitchfork", (3, 2))
    assert event.value == pytest.approx(0.36187, abs=1e-5)
    at = next(i for i, x in enumerate(parent.followed.branch.special) if x.solution is event.special.solution)
    twist = {
        b.followed.origin[1]: max(abs(half_twist(p.solution)) for p in b.followed.branch.points)
        for b in slice_15.branches if b.followed.origin is not None and b.followed.origin[0] == "M3"
    }  # fmt: skip
    assert twist.pop(at) > 2.3
    assert max(twist.values()) < 1.5
