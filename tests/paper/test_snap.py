"""Figure 17: where the band goes from fold 17, and where the energy was that it releases."""

import pytest

from rodatlas.paper.snap import bending_near_end, draw, name_of, snap_at_fold
from rodatlas.rods import RodState, critical_mode, index_of
from rodatlas.states.descent import descend

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def jump(slice_60):
    return snap_at_fold(slice_60)


def test_the_band_jumps_to_the_symmetric_path(jump, slice_60):
    """US+ goes to U-w-uUui, which is uUui at this shear."""
    state = slice_60.state("uUui", jump.before["dD"])
    assert jump.name == "uUui"
    assert state.path == "U-w-uUui"
    assert RodState(jump.after).symmetric
    assert index_of(jump.after).index == 0
    assert jump.after["dD"] == pytest.approx(jump.before["dD"], abs=1e-12)


def test_the_same_state_is_reached_past_the_fold_without_a_push(jump, slice_60):
    beyond = descend(jump.before, jump.before["dD"] + 1e-3)
    assert name_of(beyond, slice_60) == "uUui"


def test_descent_from_a_stable_state_stays_there(slice_30):
    from rodatlas.atlas import coexisting_states

    for name, state in coexisting_states(slice_30, 0.5).items():
        moved = critical_mode(state).moved(0.005)
        assert descend(moved)["energy"] == pytest.approx(state["energy"], rel=1e-9), name


def test_bending_near_the_right_clamp_is_released(jump):
    """The paper: bending concentrated at s = 1 is released."""
    s = [0.999, 1.0]
    before, after = (jump.before["a"] * x(s, "k1")[1] ** 2 for x in (jump.before, jump.after))
    assert before > 50 * after
    released = jump.before["energy"] - jump.after["energy"]
    bending = RodState(jump.before).energy_parts[0] - RodState(jump.after).energy_parts[0]
    near = bending_near_end(jump.before) - bending_near_end(jump.after)
    assert released > 0
    assert near > 0.8 * bending > 0


def test_the_figure_has_both_states_in_all_panels(sources, slice_60, monkeypatch):
    monkeypatch.setitem(sources.given, 60.0, slice_60)
    drawn = draw(sources)
    panels = [ax for ax in drawn.figure.axes if ax.lines and ax.get_xlabel()]
    assert len(panels) == 3
    for ax in panels:
        assert {line.get_gid() for line in ax.lines if line.get_gid()} == {"US+", "uUui"}
    density = {line.get_gid(): line.get_ydata() for line in panels[2].lines if line.get_gid()}
    assert density["US+"].max() > 1.5 * density["uUui"].max()


def test_a_slice_without_the_fold_is_named(slice_15):
    with pytest.raises(ValueError, match=r"^slice: expected a state US\+- that ends at fold 17"):
        snap_at_fold(slice_15)
