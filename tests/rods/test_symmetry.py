"""Reversal and mirrors map solutions to solutions; which of them a state or a kernel has."""

from dataclasses import replace

import numpy as np
import pytest

from rodatlas.continuation import TraceOptions, solve, switch, trace
from rodatlas.continuation.curve.point import first_frame
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.problem.symmetry import checked
from rodatlas.continuation.symmetric.isotropy import broken as lost_at
from rodatlas.continuation.symmetric.isotropy import broken_at, isotropy, parity
from rodatlas.continuation.symmetric.isotropy import image as image_of
from rodatlas.rods import (
    Ends,
    index_of,
    is_symmetric,
    mirror_angle,
    mirror_shear,
    pair_member,
    planar_states,
    reverse,
    rod_problem,
    state_at,
)
from rodatlas.rods.perfectly_anisotropic import SYMMETRIES
from rodatlas.rods.symmetry import asymmetry

TO_045 = TraceOptions(bounds={"dD": (0.0, 0.45)})


@pytest.fixture(scope="module")
def sheared():
    """The branch U up to dD = 0.45, past its pitchfork 4."""
    return trace(rod_problem(), state_at(Ends(15.0)), ("dD",), TO_045, both=False)


@pytest.fixture(scope="module")
def broken(sheared):
    """A state of US, off every symmetry."""
    return switch(rod_problem(), sheared.special[0], ("dD",), TO_045).points[-1].solution


@pytest.fixture(scope="module")
def planar():
    """U, W and the third mode at dD = 0."""
    states, missing = planar_states(0.625, np.radians(15.0), 0.5)
    assert not missing
    return states


def at_special(special):
    """The discretisation and state of a special point of a branch in dD."""
    bvp, found = rod_problem(), special.solution
    colloc = Collocation(
        bvp, found.mesh, found.points, found.parameters, [bvp.parameter_index("dD")], special.scale
    )  # fmt: skip
    return colloc, colloc.state(found)


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


def test_isotropy_of_planar_and_sheared_states(planar, sheared, broken):
    every = ("reversal", "angle mirror", "shear mirror", "reversal * shear mirror")
    for state in planar.values():
        assert isotropy(rod_problem(), state, among=every) == ("reversal", "shear mirror", "reversal * shear mirror")
    assert isotropy(rod_problem(), sheared.points[-1].solution, among=every) == ("reversal",)
    assert isotropy(rod_problem(), broken, among=every) == ()


def test_the_broken_pair_are_images_of_each_other(sheared, broken):
    other = switch(rod_problem(), sheared.special[0], ("dD",), TO_045, side=-1).points[-1].solution
    reversed_one = reverse(broken)
    assert other["dD"] == broken["dD"] == 0.45
    assert np.abs(other.values[[0, -1]] - reversed_one.values[[0, -1]]).max() < 1e-5
    assert abs(other["energy"] - broken["energy"]) < 1e-7


def test_the_kernel_of_pitchfork_4_is_odd_under_the_reversal(sheared):
    (pitchfork,) = sheared.special
    assert abs(pitchfork.solution["dD"] - 0.327675302) < 1e-7
    colloc, x = at_special(pitchfork)
    along, across = pitchfork.directions
    assert [parity(colloc, "reversal", x, v) for v in (along, across)] == [1, -1]
    assert lost_at(colloc, x, across) == broken_at(rod_problem(), pitchfork) == ("reversal",)


def test_the_kernel_at_a_fold_of_w_keeps_the_reversal(planar):
    """At a fold the branch's own tangent is the kernel."""
    options = TraceOptions(bounds={"dD": (0.0, 0.8)}, max_folds=0)
    branch = trace(rod_problem(), planar["third mode"], ("dD",), options, both=False)
    fold = branch.of_kind("fold")[0]
    assert isotropy(rod_problem(), fold.solution) == ("reversal",)
    free = [rod_problem().parameter_index("dD")]
    frame = first_frame(rod_problem(), fold.solution, free, options, at_special(fold)[0].scale)[0]
    assert abs(frame.fold_test) < 1e-6
    assert parity(frame.colloc, "reversal", frame.x, frame.tangent) == 1
    assert lost_at(frame.colloc, frame.x, frame.tangent) == ()


def test_a_full_turn_of_link_changes_the_sign_of_the_reversed_quaternion(sheared):
    """A (fictitious) state with the right clamp at -q: its reversal starts at +q again, by the gauge."""
    state = sheared.points[-1].solution
    twisted = replace(state, values=state.values.copy(), stages=state.stages.copy())
    twisted.values[-1, 6:10] *= -1.0
    start = image_of(rod_problem(), "reversal", twisted).values[0, 6:10]
    assert np.allclose(start, state.values[0, 6:10], atol=1e-8)


def test_the_reversal_needs_the_sign_of_the_quaternion():
    with pytest.raises(ValueError, match="'reversal' does not respect the boundary conditions"):
        checked(rod_problem(), [s for s in SYMMETRIES if not s.gauge])


def test_a_branch_is_followed_within_its_symmetry(sheared):
    """The same branch and pitchfork, every state symmetric to the last digit; a broken guess leads to it as well."""
    inside = replace(TO_045, within=("reversal",))
    branch = trace(rod_problem(), state_at(Ends(15.0)), ("dD",), inside, both=False)
    assert [x.kind for x in branch.special] == ["branch point"]
    assert abs(branch.special[0].solution["dD"] - sheared.special[0].solution["dD"]) < 1e-9
    assert max(asymmetry(p.solution) for p in branch) < 1e-13
    assert branch.settings["within"] == ["reversal"]
    side = switch(rod_problem(), sheared.special[0], ("dD",), replace(TO_045, bounds={"dD": (0.0, 0.335)}))
    found = solve(rod_problem(), side.points[-1].solution, ("dD",), inside)
    assert asymmetry(found) < 1e-13 < 0.1 < asymmetry(side.points[-1].solution)
    with pytest.raises(ValueError, match="keep the parameter 'dD', got shear mirror"):
        trace(rod_problem(), state_at(Ends(15.0)), ("dD",), replace(TO_045, within=("shear mirror",)))
