"""Rods of a section with weight and rest strain: reference values, work, first integrals, and both stability tests.

Values named REFERENCE come from an independent shooting on two meshes; the torsion constants of rectangles are those of
Timoshenko and Goodier (1970), section 109, table 7.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from rodatlas.continuation import MeshControl, TraceOptions, image, solve, switch, trace
from rodatlas.model import model_named
from rodatlas.model.places import crossings
from rodatlas.rods import Ends, LinearLaw, RodState, index_of, second_variation_index, state_at
from rodatlas.rods.kinematics import directors, quaternion_rate
from rodatlas.rods.law import Rested
from rodatlas.rods.loaded import loaded_rod
from rodatlas.rods.sections import CIRCLE_SECTION, ELLIPSE, RECTANGLE, torsion_factor_of

TIGHT = MeshControl(tolerance=1e-9)


def index(rod):
    def count(solution):
        found = index_of(solution, formulation=rod.formulation).index
        return found if found >= 0 else None

    return count


def u_state(rod, angle, **wanted):
    """The U state without shear, followed from the thin band to values of parameters one after the other."""
    base = state_at(Ends(angle), tolerance=1e-9)
    parameters = dict(rod.problem.parameters) | Ends(angle).parameters
    guess = RodState(base).rewritten(rod.formulation, **parameters)
    state = solve(rod.problem, guess, ("dD",), TraceOptions(mesh=TIGHT))
    for name, value in wanted.items():
        bounds = {name: tuple(sorted((state[name], value)))}
        options = TraceOptions(mesh=TIGHT, bounds=bounds, locate=())
        along = trace(rod.problem, state, (name,), options, both=False, direction=math.copysign(1, value - state[name]))
        state = along.points[-1].solution
        assert state[name] == pytest.approx(value, abs=1e-9)
    return state


def sheared(rod, state, most=0.7, direction=1.0):
    bounds = {"dD": (0.0, most) if direction > 0 else (-most, 0.0)}
    options = TraceOptions(mesh=TIGHT, bounds=bounds, index=index(rod))
    return trace(rod.problem, state, ("dD",), options, both=False, direction=direction)


def pitchforks(branch):
    assert branch.discrepancies == ()
    return [x.solution["dD"] for x in branch.special if x.kind == "branch point"]


def at(rod, branch, shear):
    """The state of a branch at a shear, and the same as a rod."""
    (state,) = crossings(rod.problem, branch, "dD", (shear,), 1e-9, most=99)
    return state, RodState(state, rod.formulation)


# -- sections ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("ratio", "factor"), [(1, 0.1406), (1.5, 0.1958), (2, 0.2287), (3, 0.2633), (10, 0.3123)])
def test_torsion_of_rectangles_as_published(ratio, factor):
    assert torsion_factor_of(1 / ratio) == pytest.approx(factor, abs=6e-5)


def test_proportions_of_sections():
    for section in (RECTANGLE, ELLIPSE):
        a, c2 = section.stiffness(0.25, 0.0)
        assert (a, c2) == (pytest.approx(0.625, abs=1e-12), 0.0)  # the thin band
        a, c2 = section.stiffness(0.3, 1.0)
        assert a * c2 == pytest.approx(1.0, abs=1e-12)  # bends alike to all sides
        a, c2 = section.stiffness(0.3, 0.25)
        assert 1 / c2 == pytest.approx(16 * a, rel=1e-12)  # I2/I1 = (D/t)^2
    assert ELLIPSE.stiffness(0.3, 1.0)[0] == pytest.approx(1.3)
    assert CIRCLE_SECTION.stiffness(0.3) == (1.3, pytest.approx(1 / 1.3))


def test_a_thickness_is_a_smooth_parameter_down_to_zero():
    rod = loaded_rod(RECTANGLE)
    state = u_state(rod, 15.0)
    branch = trace(rod.problem, state, ("thickness",), TraceOptions(mesh=TIGHT, bounds={"thickness": (0.0, 0.2)}),
                   both=False)  # fmt: skip
    assert branch.special == ()
    assert branch.points[-1].solution["thickness"] == pytest.approx(0.2)


# -- reference values -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def paper_band():
    """D/t = 23.6, sheared from 15 degrees."""
    rod = loaded_rod(RECTANGLE)
    return rod, sheared(rod, u_state(rod, 15.0, thickness=1 / 23.6))


def test_the_rectangle_of_the_paper(paper_band):
    rod, branch = paper_band
    assert pitchforks(branch) == pytest.approx([0.331245594, 0.617774807], abs=4e-9)
    assert [p.index for p in branch.points if p.index is not None][:: len(branch) - 2] == [0, 0]
    state, rod_state = at(rod, branch, 0.2)
    assert (state["height"], state["energy"]) == (
        pytest.approx(0.19543525, abs=1e-8), pytest.approx(12.3614555, abs=1e-7)
    )  # fmt: skip
    assert rod_state.force[:, 2] == pytest.approx(10.3446679, abs=1e-6)
    assert np.abs(rod_state.k2).max() > 1e-3


def test_the_rectangle_without_angle_and_a_thinner_one():
    rod = loaded_rod(RECTANGLE)
    assert pitchforks(sheared(rod, u_state(rod, 0.0, thickness=1 / 23.6))) == pytest.approx(
        [0.361927124, 0.604395341], abs=4e-9
    )  # fmt: skip
    assert pitchforks(sheared(rod, u_state(rod, 15.0, thickness=0.01))) == pytest.approx(
        [0.328056874, 0.616435504], abs=4e-9
    )  # fmt: skip


def test_the_limit_of_a_stiff_normal_is_reached_with_the_square():
    """REFERENCE: a = 0.625 held, b = (20, 40, 80)^2 a; the error falls as 1.463 (t/D)^2."""
    rod, found = loaded_rod(), []
    for ratio, known in ((20, 0.331334512), (40, 0.328589835), (80, 0.327903919)):
        branch = sheared(rod, u_state(rod, 15.0, c2=1 / (0.625 * ratio**2)), most=0.4)
        assert pitchforks(branch) == pytest.approx([known], abs=4e-9)
        found.append((pitchforks(branch)[0] - 0.327675302) * ratio**2)
    assert found == pytest.approx([1.463] * 3, abs=5e-3)


def test_a_rod_that_bends_alike_to_all_sides():
    rod = loaded_rod()
    # without shear and angle its states are turned about the x axis at will: the last step comes at this shear
    state = u_state(rod, 0.0, a=1.478, dD=0.3, c2=1 / 1.478)
    rod_state = RodState(state, rod.formulation)
    assert state["height"] == pytest.approx(0.14760391, abs=1e-8)
    assert state["energy"] == pytest.approx(23.9935403, abs=1e-7)
    assert rod_state.tau == pytest.approx(-2.41639726, abs=1e-7)  # constant: M3' = (1/a - 1/b) M1 M2
    tilted = sheared(rod, u_state(rod, 15.0, a=1.478, c2=1 / 1.478), most=0.82)
    assert pitchforks(tilted) == []
    for shear, energy in ((0.3, 19.2431626), (0.6, 10.2564068)):
        assert at(rod, tilted, shear)[0]["energy"] == pytest.approx(energy, abs=1e-7)


def test_weight_along_the_shear_and_across():
    rod = loaded_rod(RECTANGLE)
    heavy = u_state(rod, 0.0, gravity_z=-20.0)
    state, rod_state = at(rod, sheared(rod, heavy, most=0.3), 0.2)
    assert state["height"] == pytest.approx(0.177893553, abs=1e-8)
    assert state["potential"] == pytest.approx(-2.39626927, abs=1e-7)
    assert state["energy"] - state["potential"] == pytest.approx(14.8307755, abs=2e-7)
    assert sum(rod_state.energy_parts) == pytest.approx(14.8307755, abs=2e-7)
    for weight, height in ((-5.0, 0.179104091), (5.0, 0.18042955)):
        across = sheared(rod, u_state(rod, 0.0, gravity_y=weight), most=0.3)
        assert at(rod, across, 0.2)[0]["height"] == pytest.approx(height, abs=1e-8)


def test_a_weight_along_the_shear_cuts_off_one_member_of_the_pair():
    """REFERENCE: with a weight of 5 along -z at angle 0 the US branch below ends at a fold, index 0 and 1."""
    rod = loaded_rod(RECTANGLE)
    upper = sheared(rod, u_state(rod, 0.0), most=0.5)
    (fork,) = (x for x in upper.special if x.kind == "branch point")
    assert fork.solution["dD"] == pytest.approx(0.359236, abs=1e-6)
    side = switch(rod.problem, fork, ("dD",), TraceOptions(mesh=TIGHT, bounds={"dD": (0.0, 0.5)}))
    (us,) = crossings(rod.problem, side, "dD", (0.45,), 1e-9, most=99)
    found = []
    for member in (us, image(rod.problem, "reversal", us)):
        options = TraceOptions(mesh=TIGHT, bounds={"gravity_z": (-5.0, 0.0)}, locate=())
        heavy = trace(rod.problem, member, ("gravity_z",), options, both=False, direction=-1.0).points[-1].solution
        assert heavy["gravity_z"] == -5.0
        options = TraceOptions(mesh=TIGHT, bounds={"dD": (0.0, 0.8)}, index=index(rod), max_folds=1)
        branch = trace(rod.problem, heavy, ("dD",), options)
        found.append([(x.kind, x.solution["dD"], {*x.index}) for x in branch.special])
    connected, cut = sorted(found, key=len)
    assert connected == []  # U passes into it without a bifurcation
    assert ("fold", pytest.approx(0.390849134, abs=2e-8), {0, 1}) in cut


def test_curvature_at_rest():
    rod = loaded_rod(RECTANGLE)
    start = u_state(rod, 15.0, rest_k1=1.0)
    branch = sheared(rod, start)
    assert at(rod, branch, 0.2)[0]["energy"] == pytest.approx(12.1648338, abs=1e-7)
    assert pitchforks(branch) == pytest.approx([0.329909736, 0.626226834], abs=4e-9)
    assert pitchforks(sheared(rod, start, direction=-1.0)) == pytest.approx([-0.329909736, -0.626226834], abs=4e-9)


# -- what holds for all -----------------------------------------------------------------------------------------------

EVERYTHING = {
    "thickness": 0.3, "gravity_x": 3.0, "gravity_y": -4.0, "gravity_z": 5.0, "rest_k1": 0.7, "rest_k2": 0.2,
    "rest_tau": -0.4, "dD": 0.15,
}  # fmt: skip


@pytest.fixture(scope="module")
def loaded():
    """A rod with a section, weight and rest strain of all directions."""
    rod = loaded_rod(RECTANGLE)
    return rod, u_state(rod, 20.0, **EVERYTHING)


@pytest.mark.parametrize("name", ["gravity_x", "gravity_y", "gravity_z", "rest_k1", "rest_k2", "rest_tau", "dD", "dL"])
def test_the_energy_changes_by_the_work_of_what_changes(loaded, name):
    """dE/d(weight) = -int X ds, dE/d(rest) = -int M ds, dE/d(dD) = n_z(0), dE/d(dL) = -n_x(1)."""
    rod, state = loaded
    step, energies = 1e-4, []
    for change in (-step, step):
        near = state.with_parameters(**{name: state[name] + change})
        energies.append(solve(rod.problem, near, ("psi0",), TraceOptions(mesh=TIGHT))["energy"])
    slope = (energies[1] - energies[0]) / (2 * step)
    gauss, ends = RodState(state, rod.formulation).at_gauss_points(), RodState(state, rod.formulation)
    if name.startswith("gravity"):
        work = -state.mean(gauss.position[..., "xyz".index(name[-1])])
    elif name.startswith("rest"):
        work = -state.mean(gauss.moment_body[..., ("k1", "k2", "tau").index(name[5:])])
    else:
        work = ends.force[0, 2] if name == "dD" else -ends.force[-1, 0]
    assert slope == pytest.approx(work, abs=3e-6 * max(1.0, abs(work)))


def test_first_integrals_of_a_loaded_rod(loaded):
    rod, state = loaded
    found = RodState(state, rod.formulation).first_integrals
    assert set(found) == {"nx+fxs", "ny+fys", "nz+fzs", "H+N3+f.X"}
    assert all(np.ptp(values) < 1e-6 for values in found.values())


@pytest.mark.parametrize("name", ["reversal", "angle mirror", "shear mirror"])
def test_images_of_a_loaded_rod_are_states_of_the_image_of_its_load(loaded, name):
    """A reversal exchanges the clamps: the weight then lies elsewhere, and its potential differs by a constant."""
    rod, state = loaded
    other = image(rod.problem, name, state)
    again = solve(rod.problem, other, ("dD",), TraceOptions(mesh=TIGHT))
    lifted = state["gravity_x"] * (1 - state["dL"]) - state["gravity_z"] * state["dD"] if name == "reversal" else 0.0
    assert again["energy"] == pytest.approx(state["energy"] + lifted, abs=1e-7)
    s = np.linspace(0.0, 1.0, 11)
    one, two = (RodState(x, rod.formulation).at(s) for x in (again, other))
    assert np.abs(one.strain - two.strain).max() < 1e-5
    assert np.abs(one.position - two.position).max() < 1e-7
    assert index_of(again, formulation=rod.formulation).index == index_of(state, formulation=rod.formulation).index


def test_an_independent_shooting_finds_the_loaded_state(loaded):
    """Marching with SciPy, written from the balance in space: n' = -f, m' = -d3 x n, q' = q o (0, strain)/2."""
    rod, state = loaded
    reader = RodState(state, rod.formulation)
    a, c2 = RECTANGLE.stiffness(state["nu"], state["thickness"])
    rest, f = np.array([0.7, 0.2, -0.4]), np.array([3.0, -4.0, 5.0])

    def rate(s, u):
        q, n, m = u[:4], u[7:10], u[10:]
        frame = np.array(directors(q))
        strain = rest + frame @ m * [1 / a, c2, 1.0]
        return [*quaternion_rate(q, *strain), *frame[2], *(-f), *(-np.cross(frame[2], n))]

    def end(loads):
        start = [*reader.quaternion[0], *reader.position[0], *loads]
        return solve_ivp(rate, (0.0, 1.0), start, method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]

    target = np.concatenate([reader.quaternion[-1], reader.position[-1]])
    guess = np.concatenate([reader.force[0], reader.moment[0]])
    found = root(lambda loads: (end(loads)[:7] - target)[[0, 1, 2, 4, 5, 6]], guess * (1 + 1e-3), tol=1e-11)
    assert found.success
    assert found.x == pytest.approx(guess, abs=1e-5)


def test_both_stability_tests_agree_on_loaded_rods(loaded):
    rod, state = loaded
    states = [state]
    for change in ({"gravity_z": -20.0}, {"rest_k1": 1.0, "thickness": 0.3}):
        start = u_state(rod, 15.0, **change)
        states += [p.solution for p in sheared(rod, start).points[3::6]]
    seen = set()
    for one in states:
        rod_state = RodState(one, rod.formulation)
        second = second_variation_index(
            rod_state.s, rod_state.quaternion, rod_state.position, rod_state.strain, rod_state.law, load=rod_state.load,
            segments=160,
        )
        counted = index_of(one, formulation=rod.formulation)
        assert second.trusted
        assert counted.trusted
        assert second.index == counted.index
        seen.add(counted.index)
    assert {0, 1} <= seen


def test_a_law_at_rest_is_its_law_shifted():
    law = Rested(LinearLaw(0.7, 0.3), (0.5, -0.2, 0.1))
    moment = [1.0, 2.0, 3.0]
    strain = law.strain(moment)
    assert strain == pytest.approx([1 / 0.7 + 0.5, 0.4, 3.1])
    assert law.moment(strain, reaction=moment) == pytest.approx(moment)
    step = 1e-6
    for i in range(3):
        ahead = [k + step * (i == j) for j, k in enumerate(strain)]
        behind = [k - step * (i == j) for j, k in enumerate(strain)]
        energy = [law.energy_density(k, law.moment(k, moment)) for k in (ahead, behind)]
        assert (energy[0] - energy[1]) / (2 * step) == pytest.approx(moment[i], abs=1e-8)
    assert sum(law.energy_parts(strain, moment)) == pytest.approx(law.energy_density(strain, moment))
    assert law.rigid == (False, False, False)


@pytest.mark.parametrize("name", ["rod", "elliptic-rod", "round-rod", "given-rod"])
def test_models_of_sections_have_their_controls(name):
    model = model_named(name)
    assert {"gravity", "rest"} == set(model.groups)
    setting = model.setting(angle=15.0, gravity_z=-5.0)
    assert model.parameters(setting)["gravity_z"] == -5.0
    for source in model.sources[:1]:
        seeds, warnings = source.find(setting, 1e-8, lambda key, make: make())
        assert warnings == []
        for seed in seeds:
            state = solve(model.problem, seed.solution, ("dD",))
            assert state["energy"] == pytest.approx(seed.solution["energy"], 1e-6)
