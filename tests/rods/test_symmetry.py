"""Reversal and mirrors map solutions to solutions."""

import numpy as np
import pytest

from rodatlas.continuation import TraceOptions, solve, switch, trace
from rodatlas.rods import (
    Ends,
    index_of,
    is_symmetric,
    mirror_angle,
    mirror_shear,
    pair_member,
    reverse,
    rod_problem,
    state_at,
)


@pytest.fixture(scope="module")
def broken():
    """A state of US, off every symmetry."""
    branch = trace(rod_problem(), state_at(Ends(15.0)), ("dD",), TraceOptions(bounds={"dD": (0.0, 0.45)}), both=False)
    side = switch(rod_problem(), branch.special[0], ("dD",), TraceOptions(bounds={"dD": (0.0, 0.45)}))
    return side.points[-1].solution


def newton_moves(solution):
    """How far Newton moves an image under a symmetry, at the ends, relative to each unknown."""
    moved = solve(rod_problem(), solution, ("dD",), TraceOptions())
    scale = np.maximum(1.0, np.abs(solution.values).max(axis=0))
    return np.abs((moved.values[[0, -1]] - solution.values[[0, -1]]) / scale).max(), moved


@pytest.mark.parametrize("image", [reverse, mirror_angle, mirror_shear])
def test_images_are_solutions(broken, image):
    moved, solved = newton_moves(image(broken))
    assert moved < 1e-6
    assert abs(solved["energy"] - broken["energy"]) < 1e-6
    assert index_of(solved).index == index_of(broken).index


@pytest.mark.parametrize("image", [reverse, mirror_angle, mirror_shear])
def test_images_are_involutions(broken, image):
    twice = image(image(broken))
    # the shear mirror squares to -1 on quaternions: the same frame
    assert np.allclose(np.abs(twice.values), np.abs(broken.values), atol=1e-12)
    assert np.allclose(twice.parameters, broken.parameters)


def test_members_of_a_pair(broken):
    assert not is_symmetric(broken)
    assert {pair_member(broken), pair_member(reverse(broken))} == {"+", "-"}
    assert is_symmetric(state_at(Ends(15.0, shear=0.4)))


def test_heights_under_the_mirrors(broken):
    flipped = newton_moves(mirror_angle(broken))[1]
    assert abs(flipped["height"] + broken["height"]) < 1e-9
    assert flipped["psi0"] == -broken["psi0"]
    across = newton_moves(mirror_shear(broken))[1]
    assert abs(across["height"] - broken["height"]) < 1e-9
    assert across["dD"] == -broken["dD"]
