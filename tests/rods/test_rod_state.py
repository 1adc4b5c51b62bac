"""A state read by names: against balance, the other formulation, another way to the same number, and wrong input."""

import numpy as np
import pytest

from rodatlas.continuation import Solution
from rodatlas.rods import Ends, RodState, reverse, state_at, to_reduced
from rodatlas.rods.formulation import parameters_of
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.perfectly_anisotropic import FULL


@pytest.fixture(scope="module")
def broken():
    """A state without a symmetry: every component of force and moment is in play."""
    return state_at(Ends(40.0, 0.5, 0.5), "W", tolerance=1e-11)


@pytest.fixture(scope="module")
def rod(broken):
    return RodState(broken)


def test_the_force_in_space_is_constant_and_the_moment_turns_about_it(rod):
    """m(s) = m(0) - (X(s) - X(0)) x n, at the mesh points."""
    assert np.abs(rod.force - rod.force[0]).max() < 1e-8 * np.abs(rod.force).max()
    expected = rod.moment[0] - np.cross(rod.position - rod.position[0], rod.force[0])
    assert np.abs(rod.moment - expected).max() < 1e-8 * np.abs(rod.moment).max()


def test_the_directors_are_a_frame_that_turns_with_the_strain(rod):
    """d_i' = (k1 d1 + k2 d2 + tau d3) x d_i, by central differences, and X' = d3.

    Between mesh points the slope of the polynomials is good to their order m only: to 1e-6 of the rates here, which
    depends on where the mesh points happen to lie.
    """
    frame = rod.directors
    assert np.abs(np.einsum("kia,kja->kij", frame, frame) - np.eye(3)).max() < 1e-14
    s, h = np.linspace(0.1, 0.9, 7), 1e-4
    here, left, right = rod.at(s), rod.at(s - h), rod.at(s + h)
    rate = (right.directors - left.directors) / (2 * h)
    spin = here.in_space(here.strain)
    assert np.abs(rate - np.cross(spin[:, None], here.directors)).max() < 5e-6 * np.abs(rate).max()
    assert np.abs((right.position - left.position) / (2 * h) - here.directors[:, 2]).max() < 1e-5


def test_strain_moment_and_energy_obey_the_law(rod, broken):
    a = broken["a"]
    assert np.abs(rod.moment_body[:, [0, 2]] - rod.strain[:, [0, 2]] * [a, 1.0]).max() < 1e-12
    assert np.abs(np.einsum("kij,kj->ki", rod.compliance, rod.moment_body) - rod.strain).max() < 1e-12
    assert np.abs(rod.k2).max() == 0.0
    assert np.abs(rod.energy_density - np.einsum("ki,ki->k", rod.moment_body, rod.strain) / 2).max() < 1e-10
    assert sum(rod.energy_parts) == pytest.approx(broken["energy"], rel=1e-13)
    gauss = rod.at_gauss_points()
    assert broken.mean(gauss.energy_density) == pytest.approx(broken["energy"], rel=1e-13)
    assert broken.mean(gauss.position[..., 1]) == pytest.approx(rod.height, rel=1e-12)
    assert gauss.compliance.shape == (*gauss.s.shape, 3, 3)


def test_both_formulations_are_read_alike(rod, broken):
    """The reduced one knows the force and the moment at the left clamp, and the poses; all else follows from them."""
    other = RodState(to_reduced(broken))
    for name in ("force", "moment", "strain", "directors", "energy_density", "tension"):
        one, two = getattr(rod, name), getattr(other, name)
        assert np.abs(one - two).max() < 1e-7 * max(1.0, np.abs(one).max()), name


def test_the_reversed_rod_has_the_reversed_fields(rod, broken):
    """Half a turn about y with s -> 1 - s: n and m at the other end change sign and turn."""
    s = np.linspace(0.0, 1.0, 9)
    here, there = rod.at(s), RodState(reverse(broken)).at(1.0 - s)
    turn = np.array([-1.0, 1.0, -1.0])
    assert np.abs(there.force + turn * here.force).max() < 1e-6
    assert np.abs(there.moment + turn * here.moment).max() < 1e-6
    assert np.abs(there.strain - here.strain).max() < 1e-6


def test_what_is_read_is_written_back(broken):
    sections = FULL.sections(broken, broken.values)
    assert np.array_equal(FULL.values(sections, parameters_of(broken)), broken.values)


def test_only_rods_are_read():
    guess = Solution.from_function(lambda s: np.zeros((len(s), 2)), ("u", "v"), {"lam": 1.0})
    with pytest.raises(ValueError, match=r"solution: expected one with N1, .*, z, a, psi0, dL, .*, got one with u"):
        RodState(guess)
    with pytest.raises(ValueError, match="a: expected a positive stiffness in units of GJ, got 0"):
        LinearLaw(0.0)
    with pytest.raises(ValueError, match="c2: expected a compliance of at least 0 in units of 1/GJ, got nan"):
        LinearLaw(0.5, float("nan"))


def test_the_examples_of_the_law():
    band = LinearLaw(0.625)
    assert band.strain((1.25, 3.0, 0.5)) == [2.0, 0.0, 0.5]
    assert band.moment((2.0, 0.0, 0.5), reaction=(0.0, 3.0, 0.0)) == [1.25, 3.0, 0.5]
    soft = LinearLaw(0.625, c2=0.1)
    assert soft.strain((1.25, 3.0, 0.5)) == pytest.approx([2.0, 0.3, 0.5], rel=1e-15)
    assert soft.energy_density((2.0, 0.3, 0.5), (1.25, 3.0, 0.5)) == pytest.approx(1.825, rel=1e-15)
    assert soft.stiffness == (0.625, 10.0, 1.0)
