"""Figure 11: what the paper says of the five stable states at 30 degrees and dD = 0.625."""

import numpy as np
import pytest

from rodatlas.paper.profiles import draw, share_near_clamps, stable_states, tension_range
from rodatlas.rods import index_of


@pytest.fixture(scope="module")
def states(sources):
    return stable_states(sources)


def test_there_are_five_and_all_are_stable(states):
    assert sorted(states) == ["US+", "US-", "uUu", "uUui", "w"]
    assert all(index_of(s).index == 0 for s in states.values())
    assert abs(states["uUui"]["energy"] - 21.988286) < 1e-6


def test_uuu_is_purely_tensile_and_uuui_compressed_near_the_ends(states):
    assert tension_range(states["uUu"])[0] > 0
    tension = states["uUui"](np.linspace(0.0, 1.0, 401), "N3")
    assert tension[:60].max() < 0 > tension[-60:].max()
    assert 0 < tension[200] < 0.3 * abs(tension.min())  # slightly tensile in the middle
    assert np.abs(tension - tension[::-1]).max() < 1e-6


def test_every_state_stores_more_near_the_clamps(states):
    assert min(share_near_clamps(s) for s in states.values()) > 0.6


def test_the_figure_shows_both_members_of_the_pair(sources, states):
    drawn = draw(sources)
    for ax in drawn.figure.axes:
        lines = {line.get_gid(): line for line in ax.lines if line.get_gid()}
        assert set(lines) == set(states)
        plus, minus = lines["US+"].get_ydata(), lines["US-"].get_ydata()
        assert np.allclose(plus, minus[::-1], atol=1e-6)
        assert not np.allclose(plus, minus, atol=0.1)
    assert [n.value for n in drawn.numbers if n.known] == pytest.approx([5.0, 21.988286, -0.00727986], abs=1e-6)
