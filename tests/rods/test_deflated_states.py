"""Deflation reaches the other states of a band from one of them."""

import numpy as np
import pytest

from rodatlas.continuation import other_solutions
from rodatlas.rods import Ends, index_of, is_symmetric, mirror_angle, reverse, rod_problem, state_at

ENDS = Ends(15.0, shear=0.4)


@pytest.fixture(scope="module")
def u_state():
    return state_at(ENDS, "U")


@pytest.mark.slow
def test_the_states_at_15_degrees_from_u_alone(u_state):
    """US, W and WS, which branches connect only by pitchforks and by other shears and angles."""
    found = other_solutions(rod_problem(), [u_state], ("dD",), images=[reverse], limit=5)
    assert all(s["dD"] == 0.4 and s["psi0"] == u_state["psi0"] for s in found)
    stable = sorted((s for s in found if index_of(s).index == 0), key=lambda s: s["energy"])
    us, ws = (s for s in stable[:2] if not is_symmetric(s))
    assert (us["energy"], us["height"]) == pytest.approx((15.43561, 0.1494), abs=1e-4)
    assert (ws["energy"], ws["height"]) == pytest.approx((18.42350, -0.1203), abs=1e-4)
    w = min((s for s in found if is_symmetric(s) and s["height"] < 0), key=lambda s: s["energy"])
    assert w["energy"] == pytest.approx(state_at(ENDS, "W")["energy"], abs=1e-8)
    energies = np.sort([s["energy"] for s in found])
    assert np.diff(energies).min() > 1e-3  # a state and its reversal count once


def test_a_mirrored_state_is_a_good_guess(u_state):
    """U turned upside down, at the unchanged clamp angle, leads to W."""
    guess = mirror_angle(u_state)
    (w,) = other_solutions(rod_problem(), [u_state], ("dD",), images=[reverse], guesses=[guess], limit=1)
    assert w["energy"] == pytest.approx(state_at(ENDS, "W")["energy"], abs=1e-8)
