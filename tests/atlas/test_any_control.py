"""Slices of the band along any of its controls: two ways through one point, and work against energy."""

import numpy as np
import pytest

from rodatlas.atlas import LociSettings, SliceSettings, coexisting_states, compute_loci, compute_slice
from rodatlas.atlas.slices.branches.search import searched_values
from rodatlas.continuation import TraceOptions, trace
from rodatlas.model import model_named
from rodatlas.model.orbit import same_state
from rodatlas.rods import Ends, RodState, rod_problem, state_at

pytestmark = pytest.mark.slow

SHEAR = 0.1
RANGES = {"compression": (0.45, 0.55), "angle": (12.0, 18.0), "poisson": (0.2, 0.3)}
HERE = {"compression": 0.5, "angle": 15.0, "poisson": 0.25}


def along(control, **more):
    low, high = RANGES[control]
    return SliceSettings.of(model_named("band"), along=control, low=low, high=high, shear=SHEAR, search=0, **more)


@pytest.mark.parametrize("control", RANGES)
def test_a_slice_along_another_control_passes_the_same_states(slice_15, control):
    """At 15 degrees, dL = 1/2 and a shear of 0.1 both slices have the same stable states."""
    found = compute_slice(along(control))
    assert [w for w in found.warnings if "passes through itself" not in w] == []
    model = found.settings.model
    mine = list(coexisting_states(found, HERE[control]).values())
    theirs = list(coexisting_states(slice_15, SHEAR).values())
    assert len(theirs) == 3  # U, W and TU+-
    for state in theirs:
        assert any(same_state(model, state, other) for other in mine)
    assert len(mine) == len(theirs)


@pytest.mark.parametrize(("control", "quantity", "sign"), [
    ("compression", "force-x", -1.0), ("offset", "force-y", 1.0), ("shear", "force-z", 1.0),
    ("turn-right", "moment-z", -1.0),
])  # fmt: skip
def test_the_energy_changes_by_the_work_of_its_conjugate_load(control, quantity, sign):
    """dE/d(displacement) is the load on the right clamp: of a pair that a diagram of force and displacement shows."""
    model = model_named("band")
    step = 0.1 if model.control(control).unit else 1e-3
    start = state_at(Ends.unequal(20.0, 35.0, 0.5, 0.2))
    free = model.free_with(control)
    here = model.value(control, start)
    bounds = {free[0]: tuple(model.control(control).raw(here + side * step, dict(zip(
        start.parameter_names, start.parameters, strict=True))) for side in (-1, 1))}  # fmt: skip
    branch = trace(rod_problem(), start, free, TraceOptions(bounds=bounds))
    low, high = branch.points[0].solution, branch.points[-1].solution
    size = high[free[0]] - low[free[0]]
    slope = (high["energy"] - low["energy"]) / size
    assert slope == pytest.approx(sign * model.quantity(quantity).read(start), rel=1e-4)
    seen = model.quantity(quantity)
    assert seen.conjugate in ("", control)
    assert seen.work == sign or not seen.conjugate


def test_the_view_is_part_of_tables_and_json():
    found = compute_slice(along("compression", against="force-x"))
    told = found.to_json()
    assert (told["along"], told["against"]) == ("compression", "force-x")
    assert told["setting"]["shear"] == SHEAR
    for state in told["states"]:
        for field in ("compression", "force-x", "energy", "height", "force", "moment"):
            assert len(state[field]) == 2
        assert len(state["force"][0]) == len(state["moment"][0]) == 3
        assert state["force-x"][0] == pytest.approx(state["force"][0][0], abs=1e-6)
    state = found.states[0]
    assert state.low.response == RodState(state.low.solution).force[-1, 0]
    assert {"compression_low", "force-x_high"} <= set(found.to_frame().columns)


def test_a_locus_in_compression_and_shear_passes_the_pitchfork_at_another_compression(slice_15):
    plane = LociSettings.of(model_named("band"), second="compression", second_low=0.42, second_high=0.5, angle=15.0)
    loci = compute_loci(plane, lambda compression: slice_15, (4,))
    assert loci.warnings == ()
    piece = loci.numbered(4)
    assert piece.kind == "pitchfork"
    branch = trace(rod_problem(), state_at(Ends(15.0, 0.44)), ("dD",), TraceOptions(bounds={"dD": (0.0, 0.4)}))
    point = branch.of_kind("branch point")[0].solution
    np.testing.assert_allclose(piece.at(0.44), (point["dD"], point["height"]), atol=1e-6)


def test_a_shear_that_only_larger_compressions_allow():
    found = SliceSettings.of(model_named("band"), along="compression", shear=0.9, low=0.6, high=0.9)
    assert found.setting["shear"] == 0.9


@pytest.mark.parametrize(("control", "low", "high", "at", "count"), [
    ("offset", -0.15, 0.15, 0.1, 6),
    pytest.param("turn-left", -15.0, 15.0, 10.0, 6, marks=pytest.mark.slow),
    pytest.param("twist", -40.0, 40.0, 30.0, 5, marks=pytest.mark.slow),
])  # fmt: skip
def test_states_of_a_pair_are_two_where_what_varies_breaks_the_reversal(control, low, high, at, count):
    """Every branch passes the equal clamps at 15 degrees, where the reversal holds; a search that knows no branches,
    away from there, finds the same states."""
    settings = SliceSettings.of(model_named("band"), along=control, low=low, high=high, angle=15.0, search=0)
    found = compute_slice(settings)
    assert found.warnings == ()
    assert not any(b.followed.pair for b in found.branches)
    there = list(coexisting_states(found, at).values())
    searched = settings.model.search.stable_states(settings.whole_setting(at), 256, 1, 1e-8)
    assert len(there) == len(searched) == count
    assert all(any(same_state(settings.local, one, other) for other in there) for one in searched)


def test_a_range_that_does_not_hold_zero_has_no_names_of_the_paper():
    settings = SliceSettings.of(model_named("band"), angle=20.0, low=0.2, high=0.4)
    assert not settings.named
    assert len(searched_values(settings)) == 6
    assert all(0.2 < value < 0.4 for value in searched_values(settings))


def test_usual_ranges_keep_inside_the_limits():
    found = SliceSettings.of(model_named("band"), along="compression", shear=0.5)
    least = 1.0 - np.sqrt(0.75)
    assert least < found.low < least + 0.03
    assert found.high == 0.95


@pytest.mark.parametrize(("values", "message"), [
    ({"along": "angle", "angle_left": 20.0, "angle_right": 35.0},
     "angle-left: expected none where angle varies, since it would vary too: give turn-left, which stays, got 20"),
    ({"along": "sheer"}, "along: expected one of poisson, .*, angle-right, got 'sheer'"),
    ({"against": "hight"}, "against: expected one of height, .*, moment-z, got 'hight'"),
    ({"along": "angle", "angle": 15.0}, "angle: expected none, since the slice goes along angle, got one"),
    ({"along": "angle-left", "turn_left": 15.0}, "turn-left: expected none, since the slice goes along angle-left, .*"),
    ({"along": "compression", "shear": 0.9, "high": 0.5}, "compression-max: expected a number between 0.56411.* 0.5"),
    ({"along": "compression", "high": 2.0}, "compression-max: expected a number between 0 and 1 .*, got 2.0"),
])  # fmt: skip
def test_wrong_views_are_told_in_a_line(values, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        SliceSettings.of(model_named("band"), **values)
