"""Morse index of rod equilibria: known answers, and agreement of two methods that share no derivation."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from rod_shooting import E3, Equilibrium, clamp, crossed, directors, follow_shear, spin, symmetric_band

from rodatlas.rods.conjugate_points import index_nodes, morse_index
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.second_variation import second_variation_index

A = 0.625
BAND = np.diag([1 / A, 0.0, 1.0])
ANGLE = np.radians(15.0)
# (n_x, n_z, c_x, c_z) of the U state at 15 degrees without shear, found from the state at 45 degrees below.
U_START = (-29.17501873, 0.0, 0.0, 5.56233121)


def by_conjugate_points(state, intervals=50, per_interval=1):
    s = index_nodes(np.linspace(0.0, 1.0, intervals + 1), per_interval)
    _, _, force, moment, strain = state.fields(s)
    return morse_index(s, force, moment, strain, state.compliance)


def by_second_variation(state, segments=64, **options):
    s = np.linspace(0.0, 1.0, 101)
    quaternion, position, force, _, strain = state.fields(s)
    c1, c2, _ = np.diag(state.compliance)
    law = LinearLaw(1 / c1, c2)
    return second_variation_index(
        s, quaternion, position, strain, law,
        force=force[0], load=state.load, segments=segments, **options,
    )  # fmt: skip


def by_determinant(state, count=400):
    """Sign changes of det J on (0.02, 1), and the conjugate points, from the equations in body components.

    dM' = dM x w + M x dw + dN x e3, dN' = dN x w + N x dw, th' = dw - w x th, ze' = -w x ze + th x e3 with
    dw = C dM; no normalization, so for moderate forces only. Pairs of zeros between two samples are missed.
    """
    h = 1.0 / count
    s = np.linspace(0.0, 1.0, 2 * count + 1)
    force, moment, strain = (crossed(x) for x in state.fields(s)[2:])

    def rate(i, y):
        m, n, theta, zeta = y
        dw = m @ state.compliance
        w = strain[i]
        return np.array([m @ w - dw @ moment[i] + n @ E3, n @ w - dw @ force[i], dw + theta @ w, theta @ E3 + zeta @ w])

    y, signs = np.zeros((4, 6, 3)), []
    y[0, :3], y[1, 3:] = np.eye(3), np.eye(3)
    for i in range(0, 2 * count, 2):
        k1 = rate(i, y)
        k2 = rate(i + 1, y + h / 2 * k1)
        k3 = rate(i + 1, y + h / 2 * k2)
        k4 = rate(i + 2, y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if s[i + 2] > 0.02:
            columns = np.concatenate([y[2], y[3]], axis=1)
            signs.append(np.linalg.slogdet(columns / np.linalg.norm(columns, axis=1)[:, None])[0])
    changes = np.flatnonzero(np.diff(signs))
    return s[::2][-len(signs) :][changes + 1] - h / 2


@pytest.fixture(scope="module")
def u_branch():
    """The U branch at 15 degrees by shear, symmetric throughout."""
    shears = sorted({*np.arange(0.0, 0.661, 0.02).round(3), 0.3276, 0.3277, 0.6163, 0.6164})
    return dict(zip(shears, follow_shear(U_START, ANGLE, shears), strict=True))


def test_helper_reaches_the_published_states():
    state = Equilibrium(
        clamp(np.pi / 4),
        np.array([-17.10825468, 10.49335466, -10.49335466]),
        np.array([-3.89716349, -10.43520435, 2.28785197]),
        BAND,
    )
    end = state.dense(1.0)
    np.testing.assert_allclose(end[:4], clamp(-np.pi / 4), atol=2e-8)
    np.testing.assert_allclose(end[4:7], [0.5, 0.0, 0.2], atol=2e-8)
    assert state.height == pytest.approx(0.215493955, abs=1e-8)
    assert state.energy == pytest.approx(8.272356559, abs=5e-8)
    assert by_conjugate_points(state).index == by_second_variation(state).index == 0


def test_u_state_without_shear(u_branch):
    state = u_branch[0.0]
    assert state.height == pytest.approx(0.201870665, abs=1e-9)
    assert state.energy == pytest.approx(11.158228078, abs=2e-9)
    result, check = by_conjugate_points(state), by_second_variation(state)
    assert result.index == check.index == 0
    assert result.trusted
    assert check.trusted
    assert result.margin > 0.3


def test_u_branch_is_unstable_between_its_pitchforks(u_branch):
    """Pitchforks at shear 0.327675302 and 0.616372198; the index is 0, 1, 0."""
    for shear, state in u_branch.items():
        expected = int(0.327675302 < shear < 0.616372198)
        # At 0.3276, 0.3277, 0.6163, 0.6164 an eigenvalue of about 40 is down to 0.008 or less.
        result = by_conjugate_points(state, per_interval=2)
        assert result.index == expected, f"shear {shear}: {result}"
        assert result.trusted, f"shear {shear}: {result}"
    for shear in (0.1, 0.2, 0.3, 0.3276, 0.3277, 0.4, 0.5, 0.6, 0.6163, 0.6164, 0.64):
        check = by_second_variation(u_branch[shear])
        assert check.index == int(0.327675302 < shear < 0.616372198), f"shear {shear}: {check}"
        assert check.trusted, f"shear {shear}: {check}"


@pytest.mark.parametrize("shear", [0.327675302, 0.616372198])
def test_margin_vanishes_at_the_pitchforks(u_branch, shear):
    near = [s for s in u_branch if abs(s - shear) < 2e-4]
    below, above = (by_conjugate_points(u_branch[s], per_interval=2) for s in near)
    signed = np.array([below.margin, -above.margin])
    located = near[0] + (near[1] - near[0]) * signed[0] / (signed[0] - signed[1])
    assert located == pytest.approx(shear, abs=1e-7)


def test_degenerate_state_is_reported(u_branch):
    _, state = symmetric_band([*_reactions(u_branch[0.3276])], ANGLE, 0.5, 0.327675302)
    result, check = by_conjugate_points(state), by_second_variation(state)
    assert result.margin < 1e-6
    assert not result.trusted
    assert "branch point" in result.reason
    assert not check.trusted


def _reactions(state):
    """(n_x, n_z, c_x, c_z) of a state of `symmetric_band`."""
    frame = directors(state.quaternion)
    force, chord = state.force @ frame, state.dense(1.0)[4:7]
    center = state.moment @ frame - np.cross(chord / 2, force)
    return force[0], force[2], center[0], center[2]


@pytest.mark.parametrize(("copies", "index"), [(1, 0), (2, 3), (3, 7)])
def test_planar_elastica_modes(copies, index):
    """Odd modes at zero angle: n copies of the first, so E = 14.2514794 n^2 and n_x = -33.2963204 n^2.

    In the plane the index is 2 n - 2; the rest are out of plane.
    """
    guess = (-33.2963204 * copies**2, 0.0, 0.0, 6.2148652 * copies)
    _, state = symmetric_band(guess, 0.0, 0.5, 0.0)
    assert state.energy == pytest.approx(14.2514794038 * copies**2, rel=1e-7)
    result, check = by_conjugate_points(state), by_second_variation(state)
    assert result.index == check.index == len(result.conjugate_points) == index
    assert result.trusted


@pytest.mark.parametrize(
    ("reactions", "energy", "index"),
    [
        ((-70.330381, -21.366268, -13.528125, 6.223381), 66.4813, 2),
        ((37.34064, 0.0, 0.0, -2.060808), 20.7955, 0),
        ((-55.204165, -37.587558, -12.692454, -14.375868), 187.905, 4),
        ((16.584849, -5.081617, 15.166119, -4.445326), 135.7085, 2),
    ],
)
def test_twisted_states(reactions, energy, index):
    """Strongly twisted states at 15 degrees without shear, of both topological classes."""
    _, state = symmetric_band(reactions, ANGLE, 0.5, 0.0)
    assert state.energy == pytest.approx(energy, rel=1e-5)
    result, check = by_conjugate_points(state, per_interval=2), by_second_variation(state, segments=96)
    assert result.index == check.index == index
    assert result.trusted


def straight(thrust, torque, compliance):
    return Equilibrium(
        np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, -thrust]), np.array([0.0, 0.0, torque]), compliance
    )


# Clamped-clamped Euler loads P L^2 / EI; the odd ones are (2 pi m)^2.
EULER = np.array([39.478417604, 80.762914226, 157.913670418, 238.718063776])


@pytest.mark.parametrize("load", EULER)
def test_euler_loads_of_an_isotropic_rod_count_twice(load):
    below, above = (by_conjugate_points(straight(p, 0.0, np.eye(3))) for p in (load * 0.9999, load * 1.0001))
    order = 2 * int(np.searchsorted(EULER, load))
    assert (below.index, above.index) == (order, order + 2)
    # The distance of the ends cannot change to first order: reported, and left out of the margin.
    assert below.uncontrolled == above.uncontrolled == 1
    assert not above.trusted
    assert "straight" in above.reason
    assert 0.0 < above.margin < 0.01
    checks = [by_second_variation(straight(p, 0.0, np.eye(3))) for p in (load * 0.9999, load * 1.0001)]
    assert [check.index for check in checks] == [order, order + 2]
    assert checks[0].rank_deficiency == 1


def test_second_variation_of_a_straight_rod_has_the_known_spectrum():
    """int (theta'^2 - P theta^2) ds with int theta ds = 0: the lowest eigenvalues are 4 pi^2 - P and 16 pi^2 - P."""
    check = by_second_variation(straight(20.0, 0.0, np.diag([1.0, 0.5, 1.0])))
    # One bending mode of stiffness 1, the twist pi^2, another of each bending, in increasing order.
    expected = [np.pi**2, 4 * np.pi**2 - 20.0, 4 * np.pi**2, 8 * np.pi**2 - 20.0, 80.762914226 - 20.0]
    np.testing.assert_allclose(check.eigenvalues[:5], np.sort(expected), rtol=2e-5)


@pytest.mark.parametrize(("thrust", "index"), [(78.0, 1), (79.5, 2), (82.0, 3), (160.0, 4), (162.0, 5)])
def test_euler_loads_of_an_anisotropic_rod(thrust, index):
    """a = 1, b = 2: loads 39.48, 78.96 (b), 80.76, 157.9, 161.5 (b), ..."""
    state = straight(thrust, 0.0, np.diag([1.0, 0.5, 1.0]))
    assert by_conjugate_points(state).index == by_second_variation(state).index == index


def test_straight_band_buckles_once_only():
    for factor, index in ((0.999, 0), (1.001, 1)):
        state = straight(factor * EULER[0] * A, 0.0, BAND)
        result = by_conjugate_points(state)
        assert result.index == by_second_variation(state).index == index
        assert result.uncontrolled == 3


def test_clamped_twisted_rod():
    """Without thrust a clamped isotropic rod buckles at M L / EI = 8.986818916, in two directions at once."""
    for stiffness in (1.0, 0.7):
        compliance = np.diag([1 / stiffness, 1 / stiffness, 1.0])
        for factor, index in ((0.999, 0), (1.001, 2)):
            state = straight(0.0, factor * 8.986818916 * stiffness, compliance)
            assert by_conjugate_points(state).index == by_second_variation(state).index == index


def twisted_ring(twist, bending):
    """A closed ring of an isotropic rod, cut and held: a curvature 2 pi that turns in the sections, at rate `twist`."""
    force = np.array([2 * np.pi * twist, 0.0, 0.0])
    moment = np.array([2 * np.pi * bending, 0.0, twist])
    return Equilibrium(clamp(0.0), force, moment, np.diag([1 / bending, 1 / bending, 1.0]))


@pytest.mark.parametrize("bending", [1.0, 1.3])
def test_michell_zajac_ring(bending):
    """The ring is unstable at the total twist 2 pi sqrt(3) EI/GJ, in two directions at once.

    It can also turn about the held tangent freely: there is always a conjugate point at the end.
    """
    critical = 2 * np.pi * np.sqrt(3.0) * bending
    for factor, index in ((0.5, 0), (0.99, 0), (1.01, 2)):
        result = by_conjugate_points(twisted_ring(factor * critical, bending))
        assert result.index == index
        assert result.margin < 1e-5
        assert not result.trusted


def random_states(count, seed, force=60.0, moment=12.0, load=0.0):
    """Any initial force and moment give an equilibrium of the rod clamped where it happens to end."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        b = rng.choice([0.0, 0.0, 1 / 1.5, 1 / 20.0])
        vectors = rng.normal(size=(3, 3)) * [[force / 2], [moment / 2], [load]]
        yield Equilibrium(clamp(0.5), vectors[0], vectors[1], np.diag([1 / A, b, 1.0]), tuple(vectors[2]))


@pytest.mark.parametrize("load", [0.0, 20.0])
def test_both_methods_agree_on_random_rods(load):
    """With dead loads too, which enter the conjugate points through force and moment only."""
    seen = set()
    for number, state in enumerate(random_states(12, seed=3, load=load)):
        result, check = by_conjugate_points(state, per_interval=2), by_second_variation(state, segments=96)
        if not check.trusted and check.index < 0:
            continue
        seen.add(result.index)
        assert result.trusted, f"rod {number}: {result}"
        assert result.index == check.index, f"rod {number}: {result}, {check}"
    assert len(seen) >= 4


def test_conjugate_points_are_the_zeros_of_the_determinant():
    total = 0
    for state in random_states(8, seed=11):
        result, zeros = by_conjugate_points(state, 100), by_determinant(state)
        assert (result.index - len(zeros)) % 2 == 0
        if result.index == len(zeros):
            np.testing.assert_allclose(result.conjugate_points, zeros, atol=0.01)
            total += len(zeros)
    assert total >= 10


def test_index_is_invariant_under_the_symmetries():
    """Reversal, the two mirrors, and a rigid motion (which body components do not see)."""
    for state in random_states(4, seed=5):
        expected = by_conjugate_points(state).index
        s = index_nodes(np.linspace(0.0, 1.0, 51))
        _, _, force, moment, strain = state.fields(s)
        # s -> 1 - s with directors (d1, -d2, -d3): components of force change sign with the side of the cut.
        back = np.array([1.0, -1.0, -1.0])
        reverse = morse_index(
            s, -(force * back)[::-1], -(moment * back)[::-1], -(strain * back)[::-1], state.compliance
        )
        assert reverse.index == expected
        for mirror in ([-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]):
            m = np.array(mirror)
            image = morse_index(s, force * m, -moment * m, -strain * m, state.compliance)
            assert image.index == expected


def test_error_falls_with_the_sixth_power_of_the_step():
    """At a buckling load the exact margin is zero."""
    state = straight(EULER[1], 0.0, np.diag([1.0, 0.6, 1.0]))
    margins = np.array([by_conjugate_points(state, n).margin for n in (8, 12, 18)])
    np.testing.assert_allclose(np.log(margins[:-1] / margins[1:]) / np.log(1.5), 6.0, atol=0.4)
    assert margins[-1] < 2e-6


def test_extrapolated_eigenvalues_converge(u_branch):
    """Errors of order h^4 before the last extrapolation: sixteen times less on half the segments."""
    coarse, fine = (by_second_variation(u_branch[0.0], n) for n in (80, 160))
    assert coarse.error / fine.error == pytest.approx(16.0, rel=0.15)
    assert abs(fine.smallest - coarse.smallest) < 0.1 * coarse.error


def test_mesh_need_not_be_uniform(u_branch):
    mesh = np.sin(np.linspace(0.0, np.pi / 2, 51)) ** 2
    mesh[-1] = 1.0
    s = index_nodes(mesh, 2)
    _, _, force, moment, strain = u_branch[0.5].fields(s)
    uneven = morse_index(s, force, moment, strain, np.broadcast_to(BAND, (s.size, 3, 3)))
    even = by_conjugate_points(u_branch[0.5], per_interval=2)
    assert uneven.index == even.index == 1
    assert uneven.margin == pytest.approx(even.margin, rel=1e-4)


def test_coarse_mesh_is_reported(u_branch):
    result = by_conjugate_points(u_branch[0.64], 4)
    assert not result.trusted
    assert "finer mesh" in result.reason or "more steps" in result.reason


def test_huge_forces_do_not_overflow():
    """Tension 1e4 and thrust 1500 on a straight isotropic rod: none and the known number of Euler loads below."""
    assert by_conjugate_points(straight(-1e4, 0.0, np.eye(3)), 200).index == 0
    loads = [(2 * np.pi * m) ** 2 for m in range(1, 20)]
    # Even modes: tan(x) = x with x = sqrt(P) / 2, close to (m + 1/2) pi.
    x = (np.arange(1, 20) + 0.5) * np.pi
    for _ in range(50):
        x = np.arctan(x) + np.arange(1, 20) * np.pi
    expected = 2 * int(np.sum(np.array([*loads, *(4 * x**2)]) < 1500.0))
    assert by_conjugate_points(straight(1500.0, 0.0, np.eye(3)), 200).index == expected


def test_energy_that_is_not_convex_is_reported(u_branch):
    s = index_nodes(np.linspace(0.0, 1.0, 51))
    _, _, force, moment, strain = u_branch[0.0].fields(s)
    result = morse_index(s, force, moment, strain, np.diag([1 / A, 0.0, -0.1]))
    assert not result.trusted
    assert "convex" in result.reason


def test_wrong_input_is_refused(u_branch):
    s = index_nodes(np.linspace(0.0, 1.0, 11))
    q, x, force, moment, strain = u_branch[0.0].fields(s)
    with pytest.raises(ValueError, match="index_nodes"):
        morse_index(np.linspace(0.0, 1.0, 30), force, moment, strain, BAND)
    with pytest.raises(ValueError, match="moment: expected shape"):
        morse_index(s, force, moment[:-1], strain, BAND)
    with pytest.raises(ValueError, match="force: expected finite"):
        morse_index(s, force * np.nan, moment, strain, BAND)
    with pytest.raises(ValueError, match="symmetric"):
        morse_index(s, force, moment, strain, BAND + np.eye(3, k=1))
    with pytest.raises(ValueError, match="mesh"):
        index_nodes([0.0, 0.5, 0.4, 1.0])
    with pytest.raises(ValueError, match="per_interval"):
        index_nodes([0.0, 1.0], 0)
    with pytest.raises(ValueError, match="segments"):
        second_variation_index(np.linspace(0, 1, 30), q, x, strain, LinearLaw(A), segments=10)
    with pytest.raises(ValueError, match="s: expected an increasing"):
        second_variation_index(s, q, x, strain, LinearLaw(A))
    with pytest.raises(ValueError, match="quaternion"):
        second_variation_index(np.linspace(0, 1, 30), q[:, :3], x, strain, LinearLaw(A))


def test_quaternion_rate_of_the_helper():
    """q' against the derivative of the directors: d_i' = omega x d_i."""
    q, w, h = clamp(0.4), np.array([1.0, -2.0, 0.7]), 1e-6
    frame = directors(q)
    omega = w @ frame
    rate = (directors(q + h * spin(q, w)) - directors(q - h * spin(q, w))) / (2 * h)
    np.testing.assert_allclose(rate, np.cross(omega, frame), atol=1e-8)


def test_importing_the_module_does_not_import_numba():
    code = "import sys, rodatlas.rods.conjugate_points, rodatlas.rods.second_variation; print('numba' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "False"
