"""Rods of any law between any clamps: limits, closed forms, an independent shooting, and what refuses them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from rod_shooting import Equilibrium
from scipy.optimize import root

from rodatlas.continuation import MeshControl, NewtonOptions, TraceOptions, solve, trace
from rodatlas.rods import (
    Clamps,
    Ends,
    LinearLaw,
    Pose,
    RodState,
    anisotropic_rod,
    elastic_rod,
    index_of,
    is_symmetric,
    state_at,
)
from rodatlas.rods.elastic import ANISOTROPIC, SYMMETRIES
from rodatlas.rods.formulation import Sections
from rodatlas.rods.unknowns import CIRCLE, clamps_of
from rodatlas.states.descent import descend

TIGHT = TraceOptions(mesh=MeshControl(tolerance=1e-10), newton=NewtonOptions(tolerance=1e-11))
EULER = 4 * np.pi**2  # P L^2 / EI of the first mode between clamps


def softened(solution, c2):
    """The state of the anisotropic rod that a state of the band becomes, followed in c2."""
    rod = anisotropic_rod()
    start = RodState(solution).rewritten(rod.formulation, c2=0.0)
    if c2 == 0.0:
        return solve(rod.problem, start, ("dD",), TIGHT)
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"c2": (0.0, c2)}, locate=())
    return trace(rod.problem, start, ("c2",), options, both=False).points[-1].solution


@pytest.fixture(scope="module")
def band():
    return state_at(Ends(45.0, shear=0.2), tolerance=1e-10)


def test_a_rigid_k2_is_the_perfectly_anisotropic_rod(band):
    state = softened(band, 0.0)
    assert state["energy"] == pytest.approx(8.272356559, abs=2e-9)
    assert state["height"] == pytest.approx(0.215493955, abs=1e-9)
    one, two = RodState(band).at([0.0, 1.0]), RodState(state).at([0.0, 1.0])
    assert two.force == pytest.approx(one.force, abs=1e-7)
    assert two.moment == pytest.approx(one.moment, abs=1e-7)
    assert index_of(state).index == index_of(band).index == 0
    assert index_of(state).margin == pytest.approx(index_of(band).margin, abs=1e-6)


def test_softness_lowers_the_energy_by_the_reaction(band):
    """dE/dc2 = -int M2^2/2 ds at c2 = 0, with a remainder of first order: the limit b -> infinity."""
    stiff = softened(band, 0.0)
    slope = -stiff.mean(RodState(stiff).at_gauss_points().moment_body[..., 1] ** 2) / 2
    sizes = np.array([4e-3, 2e-3, 1e-3, 5e-4])
    rod = anisotropic_rod()
    energies = [solve(rod.problem, stiff.with_parameters(c2=c), ("dD",), TIGHT)["energy"] for c in sizes]
    errors = np.abs((np.array(energies) - stiff["energy"]) / sizes - slope)
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.05)
    assert errors[-1] < 2e-3 * abs(slope)


def test_a_rod_that_bends_alike_to_all_sides_has_constant_twist(band):
    """tau' = k1 k2 (EI1 - EI2)/GJ: with EI1 = EI2 the twisting moment is constant."""
    rod = RodState(softened(band, 1 / 0.625))
    assert np.ptp(rod.tau) < 1e-8
    assert np.ptp(rod.k2) > 1.0
    assert rod.energy == pytest.approx(0.5 * rod.solution.mean(np.einsum(
        "nmi,nmi->nm", rod.at_gauss_points().moment_body, rod.at_gauss_points().strain)), rel=1e-12)  # fmt: skip


@pytest.mark.parametrize("c2", [0.1, 1.6])
def test_a_planar_state_does_not_bend_about_the_normal(c2):
    state = softened(state_at(Ends(15.0), tolerance=1e-10), c2)
    assert state["energy"] == pytest.approx(11.158228078, abs=2e-8)
    assert np.abs(RodState(state).k2).max() < 1e-8


def test_a_column_buckles_in_both_planes_at_the_loads_of_euler():
    """4 pi^2 and 80.762914226 times EI2 = 0.3, and 4 pi^2 times EI1 = 0.625, in the order of their size."""
    s = np.linspace(0.0, 1.0, 41)
    pose = Pose.tilted(0.0, (0.0, 0.0, 0.0))
    nothing = np.zeros((len(s), 3))

    def index(thrust):
        sections = Sections(nothing - [0.0, 0.0, thrust], nothing, nothing, np.tile(pose.quaternion, (len(s), 1)),
                            np.outer(s, pose.directors[2]))  # fmt: skip
        parameters = {**anisotropic_rod().problem.parameters, "c2": 1 / 0.3, "psi0": 0.0, "dL": 0.0}
        return index_of(ANISOTROPIC.guess(s, sections, parameters)).index

    loads = [0.3 * EULER, 0.3 * 80.762914226, 0.625 * EULER]
    for number, load in enumerate(loads):
        assert [index(factor * load) for factor in (0.999, 1.001)] == [number, number + 1]


def test_the_ring_of_michell_and_zajac_through_the_reader():
    """Unstable at the total twist 2 pi sqrt(3) EI/GJ, in two directions at once."""
    bending, s = 1.3, np.linspace(0.0, 1.0, 201)
    for factor, expected in ((0.99, 0), (1.01, 2)):
        twist = factor * 2 * np.pi * np.sqrt(3.0) * bending
        ring = Equilibrium(
            np.array(Pose.tilted(0.0, (0.0, 0.0, 0.0)).quaternion), np.array([2 * np.pi * twist, 0.0, 0.0]),
            np.array([2 * np.pi * bending, 0.0, twist]), np.diag([1 / bending, 1 / bending, 1.0]),
        )  # fmt: skip
        quaternion, position, force, moment, strain = ring.fields(s)
        sections = Sections.loaded(LinearLaw(bending, 1 / bending), force, moment, quaternion, position)
        assert sections.strain == pytest.approx(strain, abs=1e-12)
        parameters = {**anisotropic_rod().problem.parameters, "a": bending, "c2": 1 / bending, "psi0": 0.0}
        assert index_of(ANISOTROPIC.guess(s, sections, parameters)).index == expected


def test_unequal_clamps_against_shooting():
    """Angles of 20 and 35 degrees, sheared, with k2 soft: six unknowns (N(0), M(0)) that reach the right clamp."""
    rod = elastic_rod(
        lambda p: LinearLaw(p.a, p.c2),
        lambda p: Clamps(Pose.tilted(p.left, (0.0, 0.0, -p.dD)), Pose.tilted(-p.right, (1.0 - p.dL, 0.0, 0.0))),
        {"a": 0.625, "c2": 0.0, "left": 0.3, "right": 0.3, "dL": 0.5, "dD": 0.0},
    )
    angle = np.radians(20.0)
    band = RodState(state_at(Ends(20.0, shear=0.2), tolerance=1e-10))
    state = band.rewritten(rod.formulation, c2=0.0, left=angle, right=angle)
    for name, value in (("right", np.radians(35.0)), ("c2", 0.4)):
        options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={name: (0.0, value)}, locate=())
        state = trace(rod.problem, state, (name,), options, both=False).points[-1].solution
    found = RodState(state, rod.formulation)
    assert found.clamps.right.directors[2] == pytest.approx([np.cos(0.610865238), -np.sin(0.610865238), 0.0])

    def shot(loads):
        start = np.array(found.clamps.left.quaternion)
        return Equilibrium(start, loads[:3], loads[3:], np.diag([1 / 0.625, 0.4, 1.0]))

    def missed(loads):
        q, x, *_ = shot(loads).fields(np.array([1.0]))
        away = x[0] - (np.array(found.clamps.right.position) - found.clamps.left.position)
        t0, *t = found.clamps.right.quaternion
        return np.concatenate([away, t0 * q[0, 1:] - q[0, 0] * np.array(t) - np.cross(t, q[0, 1:])])

    loads = np.concatenate([found.force_body[0], found.moment_body[0]])
    solved = root(missed, 1.002 * loads, tol=1e-12)
    assert solved.success
    assert solved.x == pytest.approx(loads, abs=1e-6)
    assert shot(solved.x).energy == pytest.approx(found.energy, abs=1e-8)
    assert index_of(state, formulation=rod.formulation).index == 0


@dataclass(frozen=True)
class SofteningLaw:
    """H = M1^2/(2a) + e M1^4/4 + M3^2/2: bends the more the harder it is bent; W = M.k - H."""

    a: Any
    e: Any
    rigid = (False, True, False)

    def strain(self, moment):
        m1, m2, m3 = moment
        return [m1 / self.a + self.e * m1**3, 0.0 * m2, m3]

    def moment(self, strain, reaction):
        raise NotImplementedError  # not asked where moments are unknowns

    def energy_parts(self, strain, moment):
        m1, m2, m3 = moment
        return [m1**2 / (2 * self.a) + 3 * self.e * m1**4 / 4, 0.0 * m2, m3**2 / 2]

    def energy_density(self, strain, moment):
        return sum(self.energy_parts(strain, moment))

    def compliance(self, moment):
        return [[1 / self.a + 3 * self.e * moment[0] ** 2, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def test_any_law_goes_through_problem_reader_and_index(band):
    """A law that is not linear: work is the change of energy, N.N and H + N3 are constant, the index is counted."""
    rod = elastic_rod(
        lambda p: SofteningLaw(p.a, p.e), clamps_of, {"a": 0.625, "e": 0.0, **CIRCLE}, symmetries=SYMMETRIES,
    )  # fmt: skip
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"e": (0.0, 0.02)}, locate=())
    start = RodState(band).rewritten(rod.formulation, e=0.0)
    state = trace(rod.problem, start, ("e",), options, both=False).points[-1].solution
    read = RodState(state, rod.formulation)
    assert read.energy < 0.99 * band["energy"]
    assert sum(read.energy_parts) == pytest.approx(read.energy, rel=1e-12)
    for values in read.first_integrals.values():
        assert np.ptp(values) < 1e-7 * np.abs(values).max()
    before, here, after = (read.at(0.3 + ds) for ds in (-1e-4, 0.0, 1e-4))
    strains, moments = ((getattr(after, x) - getattr(before, x))[0] / 2e-4 for x in ("strain", "moment_body"))
    assert strains == pytest.approx(here.compliance[0] @ moments, abs=1e-3)
    moved = [solve(rod.problem, state.with_parameters(dD=0.2 + d), ("dD",), TIGHT)["energy"] for d in (-1e-4, 1e-4)]
    assert (moved[1] - moved[0]) / 2e-4 == pytest.approx(state["end_force_z"], rel=1e-5)
    assert state["end_force_z"] == pytest.approx(read.force[0, 2], rel=1e-12)
    assert index_of(state, formulation=rod.formulation).index == 0


def test_what_knows_the_band_only_refuses_other_rods(band):
    state = softened(band, 0.1)
    with pytest.raises(ValueError, match=r"law: expected that of the perfectly .*, got LinearLaw\(a=0.625, c2=0.1\)"):
        descend(state)
    with pytest.raises(ValueError, match=r"solution: expected one with N1, .*M2, k1, tau"):
        is_symmetric(state)
    with pytest.raises(ValueError, match="parameters: expected c2 too, which this solution lacks, got none"):
        RodState(band).rewritten(ANISOTROPIC)
