"""Slices of the atlas against the paper and the published values; the bookkeeping adds up."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rodatlas.atlas import MemoryCache, SliceSettings, coexisting_states, compute_slice, reach
from rodatlas.atlas.slices.states.pick import pick_state
from rodatlas.continuation import NewtonCode, NotConverged, Status
from rodatlas.model.model import Source
from rodatlas.model.orbit import same_state
from rodatlas.paper.model import band, band_slice
from rodatlas.rods import index_of, is_symmetric
from rodatlas.states.labels import parse_label


def events(slice_, number):
    """Events of a number; one pitchfork may be met by two branches."""
    return [e for b in slice_.branches for e in b.events if e.number == number]


def shear_of(slice_, number):
    found = {round(e.special.solution["dD"], 6): e.special.solution["dD"] for e in events(slice_, number)}
    assert len(found) == 1, f"bifurcation {number} found at {sorted(found)}"
    return next(iter(found.values()))


def test_u_branch_at_15_degrees(slice_15):
    """Both pitchforks to 1e-6, and nothing else up to 0.82."""
    u = next(b for b in slice_15.branches if b.id == "U")
    assert [e.kind for e in u.events] == ["pitchfork", "pitchfork"]
    shears = [e.special.solution["dD"] for e in u.events]
    heights = [e.special.solution["height"] for e in u.events]
    assert np.allclose(shears, (0.327675302, 0.616372198), atol=1e-8)
    assert np.allclose(heights, (0.1828002, 0.1074736), atol=1e-7)
    assert [e.criticality for e in u.events] == ["super", "sub"]
    assert [e.special.index for e in u.events] == [(0, 1), (1, 0)]


def test_bookkeeping_adds_up(slice_15, slice_30):
    for found in (slice_15, slice_30):
        assert found.warnings == ()
        for b in found.branches:
            assert not b.followed.branch.discrepancies
            for e in b.events:
                assert e.special.status is Status.CONVERGED
                assert abs(e.special.index[1] - e.special.index[0]) == 1


def test_criticality_from_the_branches_agrees_with_the_normal_form(slice_15, slice_30):
    """Told once by the indices of the branches that meet, once by second and third derivatives at the point alone."""
    compared = 0
    for found in (slice_15, slice_30):
        for b in found.branches:
            for e in b.events:
                if e.kind == "pitchfork":
                    assert e.special.breaks == ("reversal",)
                if e.criticality and e.special.criticality:
                    assert e.special.criticality == e.criticality + "critical"
                    compared += 1
    assert compared >= 12


def test_every_step_is_verified(slice_15):
    for b in slice_15.branches:
        record = b.followed.branch.verification
        assert record.complete
        assert record.indexed == record.steps


def test_named_states_at_15_degrees(slice_15):
    ends = {s.name: [(e.kind, e.number, e.snap) for e in (s.low, s.high)] for s in slice_15.states}
    edge = ("range", None, False)
    assert ends == {
        "U": [edge, ("pitchfork", 4, False)],
        "US+-": [("pitchfork", 4, False), edge],
        "uUu": [("pitchfork", 11, True), edge],
        "w": [("fold", 7, True), ("fold", 6, True)],
        "W": [edge, ("pitchfork", 3, False)],
        "WS+-": [("pitchfork", 3, False), ("fold", 5, True)],
        "uUui": [("pitchfork", 10, True), edge],
        "TU+-": [edge, ("fold", 2, True)],
        "TW+-": [edge, ("fold", 1, True)],
    }
    assert {s.name for s in slice_15.states if s.pair} == {"US+-", "WS+-", "TU+-", "TW+-"}


def test_thirty_degrees(slice_30):
    """Five states coexist at 0.625; U passes into w, which ends at fold 6."""
    present = {s.name for s in slice_30.states if s.span[0] <= 0.625 <= s.span[1]}
    assert present == {"uUui", "w", "uUu", "US+-"}
    w, u = slice_30.state("w", 0.625), slice_30.state("U", 0.2)
    assert (w.path, u.path, w.branch) == ("U-w", "U-w", u.branch)
    assert (w.high.kind, w.high.number, w.high.snap) == ("fold", 6, True)
    assert u.high.kind == w.low.kind == "smooth"
    us = slice_30.state("US+-", 0.625)
    assert (us.low.kind, us.low.number) == ("fold", 12)
    assert slice_30.state("uUu", 0.7).low.number == 11
    assert slice_30.state("uUui", 0.7).low.number == 10
    solution, _ = reach(band_slice(30.0), "uUui", 0.625)
    assert abs(solution["energy"] - 21.988286) < 1e-6
    assert abs(solution["height"] + 0.00727986) < 1e-8
    assert index_of(solution).index == 0


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_nothing_is_missed_when_steps_change(slice_15, factor, monkeypatch):
    """The lists of bifurcations are the same when all steps are scaled."""
    from rodatlas.atlas.slices.branches import follow, seeds

    def scaled(**settings):
        from rodatlas.continuation import StepControl

        base = StepControl(**settings)
        return StepControl(
            initial=base.initial * factor, maximum=base.maximum * factor, target=base.target * factor**3,
            min_cosine=base.min_cosine if factor < 1 else 0.8,
        )  # fmt: skip

    for module in (follow, seeds):
        monkeypatch.setattr(module, "StepControl", scaled)
    again = compute_slice(band_slice(15.0, search=0))
    assert listed(again) == listed(slice_15)


def listed(slice_):
    return sorted(
        (b.followed.symmetric, e.kind, str(e.number), round(e.special.solution["dD"], 6), sorted(e.special.index))
        for b in slice_.branches for e in b.events
    )  # fmt: skip


def test_json_has_the_documented_fields(slice_15):
    data = json.loads(json.dumps(slice_15.to_json()))
    assert data["schema"] == "rodatlas/slice/1"
    assert {"angle_deg", "compression", "poisson", "seconds", "warnings", "states", "branches"} <= set(data)
    state = data["states"][0]
    assert {"name", "shear", "height", "ends", "pair"} <= set(state)
    assert set(state["ends"][0]) == {"kind", "number", "shear", "height", "snap"}
    for branch in data["branches"]:
        assert {"id", "points", "symmetric", "closed", "end_reasons", "special"} <= set(branch)
        for special in branch["special"]:
            assert set(special) == {"kind", "number", "shear", "height", "index", "criticality", "status"}


def test_other_members_and_names(slice_15):
    plus = pick_state(slice_15, "US+", 0.5)
    minus, _ = reach(band_slice(15.0), "US-", 0.5)
    assert abs(plus["energy"] - minus["energy"]) < 1e-9
    assert np.allclose(plus.values[0, 4], minus.values[-1, 4], atol=1e-7)
    assert parse_label("WS") == ("WS+-", "+", None)
    assert parse_label("uUui") == ("uUui", "", None)
    for wrong in ("us", "U+", "S*", ""):
        with pytest.raises(ValueError, match=r"state: expected one of U, US\+, US-"):
            parse_label(wrong)


def test_names_that_no_state_has(slice_15):
    """A known name without a state there is None; anything else is wrong input."""
    assert slice_15.state("US+-", 0.1) is None
    with pytest.raises(ValueError, match="state: expected U without a number, there is one, got 'U:2'"):
        slice_15.state("U:2", 0.1)
    for wrong in ("V", "US+", "u", "W:0", "W:x", ""):
        with pytest.raises(ValueError, match=r"^name: expected one of U, US\+-, uUu, w, wi, .*, other, got"):
            slice_15.state(wrong, 0.1)
    with pytest.raises(ValueError, match=r"^name: expected one of U"):
        slice_15.states_at(0.1, "V")
    assert [s.name for s in slice_15.states_at(0.1)] == ["U", "W", "TU+-"]


def test_a_range_near_the_limiting_shear_is_said(slice_15):
    assert slice_15.remarks == ()
    near = replace(slice_15, settings=replace(slice_15.settings, high=0.85))
    (told,) = near.to_json()["warnings"]
    assert told.startswith("limiting shear: 0.85 is 0.981 of the limiting shear 0.866025; beyond 0.95 of it")


@pytest.mark.slow
def test_smooth_cuts_do_not_depend_on_the_steps(slice_30):
    """U becomes w exactly where k1(1/2) = 0."""
    w = slice_30.state("w", 0.625)
    assert abs(w.low.solution(0.5, "k1")[0]) < 1e-6
    coarse = compute_slice(band_slice(30.0, tolerance=1e-6, search=0), carry=False)
    assert abs(coarse.state("w", 0.625).low.value - w.low.value) < 1e-6


def test_what_goes_wrong_at_the_reference_angle_is_said(monkeypatch):
    from rodatlas.atlas.slices.branches import follow

    def nothing(setting, tolerance, keep):
        return [], [f"nothing at {setting['angle']:g}"]

    alone = replace(band(), sources=(Source("nothing", nothing),))
    frontier = follow.follow_slice(replace(band_slice(30.0, search=0), model=alone))
    *told, last = frontier.warnings
    assert told == ["nothing at 30", "reference slice: nothing at 15"]
    assert last.startswith("no branch: no start of the model could be followed")


def test_a_state_that_cannot_be_carried_over_is_said(slice_15, monkeypatch):
    from rodatlas.atlas.slices.branches import seeds

    def fails(*arguments, **options):
        raise NotConverged(NewtonCode.SLOW, "start of the run")

    monkeypatch.setattr(seeds, "trace", fails)
    reference = [(b.id, b.followed.branch) for b in slice_15.branches if b.id == "U"]
    found, warnings = seeds.carried_seeds(reference, band_slice(15.0), band_slice(30.0), MemoryCache())
    assert found == []
    assert len(warnings) == 3  # U is stable at the lowest and at the two highest of the shears
    assert all(w.startswith(f"branch U@15.{k + 1}: not carried over: ") for k, w in enumerate(warnings))


@pytest.mark.slow
def test_states_on_small_loops_are_carried_to_large_angles():
    """US lives on an isolated loop up to about 72.6 degrees, and at small compressions."""
    found = compute_slice(band_slice(70.0, search=0))
    us = next(s for s in found.states if s.name == "US+-")
    assert (us.low.number, us.high.number) == (12, 17)
    assert us.span == pytest.approx((0.3696, 0.5507), abs=1e-3)


@pytest.mark.slow
def test_a_symmetric_branch_met_only_from_its_side_is_followed():
    """At 40 degrees a reversal-broken branch ends on a symmetric one that nothing else reaches."""
    found = compute_slice(band_slice(40.0), carry=False)
    symmetric = [b.followed for b in found.branches if b.followed.symmetric]
    for b in found.branches:
        last = b.followed.branch.special[-1:] if not b.followed.symmetric else ()
        for special in last:
            if special.kind == "branch point" and is_symmetric(special.solution):
                ends = [x.solution for f in symmetric for x in f.bifurcations]
                ends += [f.branch.points[0].solution for f in symmetric]
                assert any(same_state(band(), special.solution, other) for other in ends)
    assert found.warnings == ()


@pytest.mark.slow
def test_residual_inverted_state_keeps_its_name():
    """At 44 degrees the last of uUui lies between pitchfork 10 and fold 14."""
    found = compute_slice(band_slice(44.0, search=0), carry=False)
    short = next(s for s in found.states if s.name == "uUui" and s.path == "uUui")
    assert (short.low.number, short.high.number) == (10, 14)


@pytest.mark.slow
def test_stability_is_known_close_to_the_limiting_shear():
    found = compute_slice(band_slice(15.0, shear_max=0.858, search=0))
    assert found.warnings == ()
    assert {s.name for s in found.states if s.span[1] == pytest.approx(0.858)} == {"US+-", "uUu", "uUui"}


@pytest.mark.slow
def test_nearly_straight_band():
    """At dL = 0.01 the clamps bend the band over: U is U at zero shear, then dimples without a bifurcation."""
    found = compute_slice(band_slice(15.0, 0.01, shear_max=0.13, shear_min=-0.008, search=0), carry=False)
    assert [s.name for s in found.states] == ["U", "w", "uUui"]
    assert found.states[0].span[0] == -0.008
    assert any("turns back" in w for w in found.warnings)


@pytest.mark.slow
def test_shears_above_the_pitchforks_have_what_the_whole_slice_has(slice_15):
    """From 0.4 to 0.8 without a search: US+- and the branch beyond uUu start at pitchforks below that range."""
    settings = SliceSettings.of(band(), angle=15.0, low=0.4, high=0.8, search=0)
    short = compute_slice(settings)
    assert short.warnings == ()
    for value in (0.45, 0.5, 0.52, 0.57, 0.65, 0.75):
        wanted, met = (coexisting_states(of, value).values() for of in (slice_15, short))
        connected = [s for s in wanted if any(same_state(band(), s, m) for m in met)]
        assert len(met) == len(connected)
        assert {label for label, s in coexisting_states(slice_15, value).items()
                if not any(same_state(band(), s, m) for m in met)} <= {"TU+", "TW+"}  # fmt: skip
