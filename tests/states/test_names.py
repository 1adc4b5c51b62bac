"""Names of stable segments: mirror images, and states that are none of the named ones."""

import math

import numpy as np
import pytest

from rodatlas.continuation import StepControl, TraceOptions, trace
from rodatlas.paper.names.at_setting import at_rest
from rodatlas.paper.names.curled import is_curled, turning
from rodatlas.paper.names.segments import NAMES, OTHER, name_parts
from rodatlas.rods import Ends, is_symmetric, mirror_angle, planar_states, rod_problem
from rodatlas.rods.stability import morse_index_of
from rodatlas.states import find_states


def test_mirror_images_have_the_inverted_names(slice_15):
    """w upside down is wi, U is W; uUu on the branch of W is uUui."""
    inverted = {}
    for state in slice_15.states:
        if state.name in ("U", "uUu", "w"):
            images = [mirror_angle(s) for s in state.solutions]
            (part,) = name_parts(images, symmetric=True, inverted=True)
            inverted[state.name] = part.name
    assert inverted == {"U": "W", "uUu": "uUui", "w": "wi"}
    assert set(inverted.values()) < set(NAMES)


def test_wound_up_states_have_no_name_of_the_paper():
    """At 30 degrees and 0.625 a search meets the five named states, and others with a turn of twist and more."""
    found = find_states(Ends(30.0, 0.5, 0.625), 0.25, "+", 128, stable_only=True, wound=True).states
    names = {}
    for state in found:
        (part,) = name_parts([state.solution] * 3, is_symmetric(state.solution))
        names.setdefault(part.name == OTHER, []).append(abs(state.twist))
    assert max(names[False]) < math.pi / 2
    assert min(names[True]) > 2 * math.pi
    # the same family has less than a turn at 0.26, and one inflection
    found = find_states(Ends(15.0, 0.5, 0.26), 0.25, "+", 128, stable_only=True).states
    assert {s.name: s.stable for s in found} == {"U": True, "W": True, None: True}
    (other,) = [s.solution for s in found if s.name is None and s.pair == "+"]
    assert [part.name for part in name_parts([other] * 3, symmetric=False)] == [OTHER]


def test_names_between_steep_clamps():
    """At 89 degrees U is bent one way only. The other stable state lies in two curls at the clamps and has no name.

    Followed in angle, U keeps its stability from 0 to 90 degrees; the curled band is planar at rest, where its tangent
    turns by two full turns more than the clamps ask for.
    """
    for shear in (0.0, 0.1):
        u, curled = find_states(Ends(89.0, 0.5, shear), 0.25, "+", 128, stable_only=True).states
        assert (u.name, curled.name) == ("U", None)
        assert u.to_json()["inflections"]["k1"] == curled.to_json()["inflections"]["k1"] == 0
        assert is_curled(curled.solution)
        assert not is_curled(u.solution)
    assert u.solution["energy"] == pytest.approx(3.79557, abs=1e-5)
    rest = at_rest(curled.solution)
    assert turning(rest) == pytest.approx(2.0 * math.radians(89.0) - 4.0 * math.pi, abs=1e-5)
    assert [p.name for p in name_parts([rest] * 3, symmetric=True)] == [OTHER]
    options = TraceOptions(bounds={"psi0": (0.0, math.radians(89.9))}, index=morse_index_of)
    branch = trace(rod_problem(), u.solution, ("psi0",), options)
    assert {p.index for p in branch.points} == {0}
    assert branch.special == ()


@pytest.mark.parametrize("angle", [40.0, 80.0])
def test_u_without_inflections_is_u(angle):
    """Clamps that are steep for the compression bend the band one way only."""
    planar = planar_states(0.625, math.radians(angle), 0.05)[0]["U"]
    k1 = planar(np.linspace(0.0, 1.0, 201), "k1")
    assert np.all(k1 > 0) or np.all(k1 < 0)
    options = TraceOptions(bounds={"dD": (-0.02, 0.02)}, step=StepControl(maximum=1.0))
    points = trace(rod_problem(), planar, ("dD",), options).points
    assert [p.name for p in name_parts([p.solution for p in points], symmetric=True)] == ["U"]
