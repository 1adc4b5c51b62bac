"""The perfectly anisotropic rod against published values, a second formulation, another solver and energy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipkinc

from rodatlas.continuation import MeshControl, NewtonOptions, TraceOptions, solve, trace
from rodatlas.rods import Band, Ends, RodState, from_reduced, reduced_problem, rod_problem, state_at, to_reduced
from rodatlas.rods.perfectly_anisotropic import CONSTANTS
from rodatlas.rods.planar import circle, planar_states

TIGHT = TraceOptions(mesh=MeshControl(tolerance=1e-10), newton=NewtonOptions(tolerance=1e-11))


def test_circle_is_a_solution():
    guess = circle(0.625)
    solution = solve(rod_problem(), guess, ("dL",), TIGHT)
    assert np.allclose(solution["k1"], 2 * np.pi, atol=1e-9)
    assert abs(solution["energy"] - 0.625 * (2 * np.pi) ** 2 / 2) < 1e-9
    assert np.abs(solution.values[:, :4]).max() < 1e-6


def planar_elastica(compression):
    """Load, mid-height and end curvature of the clamped first-mode elastica (EI = L = 1), by elliptic integrals.

    A quarter of the rod is an inflectional elastica from an inflection to a vertex; four of them in the length 1.
    """

    def chord(modulus):
        k2 = modulus**2
        return 2 * ellipeinc(np.pi / 2, k2) / ellipkinc(np.pi / 2, k2) - 1

    modulus = brentq(lambda k: chord(k) - (1 - compression), 0.01, 0.99, xtol=1e-15)
    quarter = ellipkinc(np.pi / 2, modulus**2)
    root_load = 4 * quarter
    return root_load**2, 2 * modulus / root_load * 2, 2 * modulus * root_load


def test_planar_elastica_has_the_closed_form_values():
    load, middle, curvature = planar_elastica(0.5)
    assert abs(load - 53.274112596) < 1e-8
    state = RodState(state_at(Ends(0.0), tolerance=1e-10))
    assert abs(state.tension[0] + 0.625 * load) < 1e-7
    assert abs(state.solution(0.5, "y")[0] - middle) < 1e-9
    assert abs(abs(state.strain[0, 0]) - curvature) < 1e-8
    assert abs(state.height - 0.186653214) < 1e-9
    assert abs(state.energy - 14.2514794) < 1e-7


@pytest.mark.parametrize(
    ("angle", "shear", "height", "energy"),
    [(15.0, 0.0, 0.201870665, 11.158228078), (45.0, 0.2, 0.215493955, 8.272356559)],
)
def test_reference_states(angle, shear, height, energy):
    state = RodState(state_at(Ends(angle, shear=shear), tolerance=1e-10))
    assert abs(state.height - height) < 2e-9
    assert abs(state.energy - energy) < 2e-8


def test_reference_end_force_and_moment():
    state = RodState(state_at(Ends(45.0, shear=0.2), tolerance=1e-10))
    assert np.allclose(state.moment_body[0], (-3.89716349, -10.43520435, 2.28785197), atol=2e-8)
    assert np.allclose(state.force_body[0], (-17.10825468, 10.49335466, -10.49335466), atol=2e-8)


@pytest.mark.parametrize(
    ("ends", "family"),
    [(Ends(15.0), "U"), (Ends(30.0, 0.3, -0.25), "U"), (Ends(20.0, 0.7, 0.5), "third mode"),
     (Ends(60.0, 0.5, 0.3), "W"), (Ends(100.0, 0.5, 0.4), "U"), (Ends(15.0, 0.5, 0.8), "U")],
)  # fmt: skip
def test_both_formulations_agree(ends, family):
    full = state_at(ends, family, tolerance=1e-10)
    reduced = solve(reduced_problem(), to_reduced(full), ("dD", *CONSTANTS), TIGHT)
    back = from_reduced(reduced)
    assert abs(back["dD"] - ends.shear) < 1e-12
    assert abs(reduced["height"] - full["height"]) < 1e-9
    assert abs(reduced["energy"] - full["energy"]) < 1e-8 * full["energy"]
    # the first row of N, M at s = 0 and the last, where both meshes have a point
    scale = np.maximum(1.0, np.abs(full.values).max(axis=0))
    assert np.abs((back.values[[0, -1]] - full.values[[0, -1]]) / scale).max() < 1e-8
    middle = np.array([0.25, 0.5, 0.75])
    assert np.abs((back(middle) - full(middle)) / scale).max() < 2e-5  # interpolation between mesh points, order m + 1


def test_both_formulations_find_the_same_pitchforks():
    start = state_at(Ends(15.0))
    options = TraceOptions(bounds={"dD": (0.0, 0.7)})
    full = trace(rod_problem(), start, ("dD",), options, both=False)
    reduced = trace(reduced_problem(), to_reduced(start), ("dD", *CONSTANTS), options, both=False)
    shears = [[x.solution["dD"] for x in b.of_kind("branch point")] for b in (full, reduced)]
    assert len(shears[0]) == len(shears[1]) == 2
    assert np.allclose(*shears, atol=1e-8)
    assert np.allclose(shears[0], (0.327675302, 0.616372198), atol=5e-9)


@pytest.mark.parametrize("backend", ["numba", "scipy"])
def test_backends_give_the_same_branch(backend):
    options = TraceOptions(bounds={"dD": (0.0, 0.7)}, backend=backend)
    branch = trace(rod_problem(), state_at(Ends(15.0)), ("dD",), options, both=False)
    assert np.allclose([x.solution["dD"] for x in branch.special], (0.327675302, 0.616372198), atol=5e-9)
    assert [x.kind for x in branch.special] == ["branch point"] * 2


def test_work_equals_change_of_energy():
    """dE/d(dD) = N_z along a branch, with E by quadrature: an error in forces, energy or geometry breaks it."""
    options = TraceOptions(bounds={"dD": (0.0, 0.75)}, locate=())
    branch = trace(rod_problem(), state_at(Ends(30.0), "W"), ("dD",), options, both=False)
    checked = branch.points[2:-2:4]
    assert len(checked) >= 5
    for point in checked:
        energies = []
        for shift in (-1e-4, 1e-4):
            moved = point.solution.with_parameters(dD=point.solution["dD"] + shift)
            energies.append(solve(rod_problem(), moved, ("dD",), TIGHT)["energy"])
        slope = (energies[1] - energies[0]) / 2e-4
        assert abs(slope - point.solution["end_force_z"]) < 1e-5 * max(1.0, abs(slope))


def test_first_integrals_are_constant():
    state = RodState(state_at(Ends(30.0, 0.6, 0.4), "W"))
    for values in state.first_integrals.values():
        assert np.ptp(values) < 1e-8 * max(1.0, np.abs(values).max())


def test_space_force_is_constant_and_frame_is_orthonormal():
    state = RodState(state_at(Ends(40.0, 0.5, 0.5)))
    assert np.ptp(state.force, axis=0).max() < 1e-7
    assert np.abs(np.linalg.norm(state.quaternion, axis=1) - 1).max() < 1e-10


def test_agrees_with_scipy_solve_bvp():
    """Another discretization, with the equations written out afresh."""
    state = state_at(Ends(30.0, 0.5, 0.35))
    a, psi = state["a"], state["psi0"]

    def rhs(s, y):
        n1, n2, n3, m2, k, t, q0, q1, q2, q3 = y[:10]
        return np.array([
            n2 * t, -n1 * t + n3 * k, -n2 * k, -a * k * t + t * k - n1, (m2 * t + n2) / a, -m2 * k,
            (-q1 * k - q3 * t) / 2, (q0 * k + q2 * t) / 2, (q3 * k - q1 * t) / 2, (-q2 * k + q0 * t) / 2,
            2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0**2 + q3**2) - 1,
        ])  # fmt: skip

    c, s = math.cos(psi / 2) / math.sqrt(2), math.sin(psi / 2) / math.sqrt(2)

    def ends(l, r):
        start = l[6:13] - [c, -s, c, s, 0, 0, -0.35]
        return np.concatenate([start, r[10:13] - [0.5, 0, 0], r[7:10] - [s, c, -s]])

    mesh = np.linspace(0, 1, 201)
    result = solve_bvp(rhs, ends, mesh, state(mesh).T * 1.001, tol=1e-8, max_nodes=20000)
    assert result.success
    assert np.abs(result.sol([0.0, 1.0]).T - state.values[[0, -1]]).max() < 1e-5


def test_anything_but_the_family_is_said():
    with pytest.raises(ValueError, match="family: expected one of U, W, third mode, got 'V'"):
        state_at(Ends(15.0), "V")
    with pytest.raises(ValueError, match=r"turns back at a fold, got 0\.8"):
        state_at(Ends(30.0, shear=0.8))
    states, missing = planar_states(0.625, math.radians(89.0), 0.5)
    assert set(states) == {"U"}
    assert "turns back" in missing


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Ends(15.0, 1.0), "compression: expected a number between 0 and 1"),
        (lambda: Ends(15.0, 0.5, 0.9), "shear: expected a number of size below 0.866025"),
        (lambda: Ends("x"), "angle: expected degrees between -180 and 180, got 'x'"),
        (lambda: Ends("15"), "angle: expected degrees between -180 and 180, got '15'"),
        (lambda: Ends(None), "angle: expected degrees between -180 and 180, got None"),
        (lambda: Ends(15.0, 0.0), "compression: expected a number between 0 and 1 .from 1e-06 to 0.999999., got 0.0"),
        (lambda: Ends(15.0, 0.5, -0.8660254037844386), "shear: expected a number of size below 0.866025"),
        (lambda: Band(poisson=-1.0), "poisson: expected a number with -1 < nu <= 0.5, got -1.0"),
        (lambda: Band(poisson=0.6), "poisson: expected a number with -1 < nu <= 0.5, got 0.6"),
        (lambda: Band(width=0.0), "band width: expected a positive length"),
    ],
)
def test_wrong_input_names_the_field(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_band_in_millimetres():
    band = Band(length=240.0, width=30.0, thickness=0.127)
    assert band.aspect == 0.125
    assert band.a == 0.625
