"""Branch points of multiplicity two and more: where they are, and all branches through them."""

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, constant

from rodatlas.continuation import BVP, Solution, TraceOptions
from rodatlas.continuation.curve.multiple import MultiplePoint, search_places
from rodatlas.continuation.curve.point import first_frame
from rodatlas.continuation.curve.segment import Segment
from rodatlas.continuation.discrete.newton import newton, plane
from rodatlas.continuation.discrete.vectors import add

OPTIONS = TraceOptions()


def segment(bvp, start, step, free="lam", options=OPTIONS):
    """One step along the branch through a start, as the walker takes it."""
    return step_on(first_frame(bvp, start, [bvp.parameter_index(free)], options)[0], step, options)


def step_on(left, step, options):
    guess = left.predict(step)
    result = newton(left.colloc, guess, [plane(left.colloc, left.tangent, guess)], options.newton)
    assert result.converged
    return Segment(left, replace(left.reached(result.state, result.factorization, step), previous_step=step), step, 2.0)


def places_on(on, options=OPTIONS):
    """All singular places of a segment."""
    search = search_places(on, options)
    assert search.complete
    return search.places


def multiple_on(on, options=OPTIONS) -> MultiplePoint:
    """The one multiple branch point of a segment on which nothing else is singular."""
    (place,) = places_on(on, options)
    return place.point


def ends(point):
    """Directions as rows: the unknowns at s = 0, then the parameter."""
    return np.array([[*d.mesh[0], *d.scalars] for d in point.directions])


def same_set(found, expected, tolerance):
    """Whether two lists of vectors agree up to their order."""
    expected = np.array(expected, float)
    distance = np.linalg.norm(found[:, None] - expected[None], axis=2)
    one_each = sorted(distance.argmin(axis=1)) == list(range(len(expected)))
    return len(found) == len(expected) and one_each and distance.min(axis=1).max() < tolerance


def stepped_off(point, step=0.02):
    """States reached from the point along every direction."""
    colloc, states = point.colloc, []
    for direction in point.directions:
        guess = add(point.state, (step, direction))
        result = newton(colloc, guess, [plane(colloc, direction, guess)], OPTIONS.newton)
        assert result.converged
        assert colloc.norm(add(result.state, (-1.0, guess))) < 0.5 * step
        states.append(result.state)
    return states


def all_distinct(colloc, states, least):
    return all(colloc.norm(add(x, (-1.0, y))) > least for i, x in enumerate(states) for y in states[:i])


def square(b):
    """Symmetry of the square: x (lam - x^2 - b y^2) = 0 = y (lam - y^2 - b x^2)."""
    return algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2 - b * u.y**2), u.y * (p.lam - u.y**2 - b * u.x**2)], ("x", "y")
    )


def triangle():
    """Symmetry of the triangle: lam z + conj(z)^2 = 0."""
    return algebraic(
        lambda u, p: [p.lam * u.x + u.x**2 - u.y**2, p.lam * u.y - 2 * u.x * u.y], ("x", "y")
    )  # fmt: skip


def cube(b):
    """Three equal modes, x_i (lam - x_i^2 - b sum of the other squares) = 0."""
    return algebraic(
        lambda u, p: [v * (p.lam - (1 - b) * v**2 - b * (u.x**2 + u.y**2 + u.z**2)) for v in (u.x, u.y, u.z)],
        ("x", "y", "z"),
    )


def circular():
    """lam z = |z|^2 z."""
    return algebraic(lambda u, p: [v * (p.lam - u.x**2 - u.y**2) for v in (u.x, u.y)], ("x", "y"))


SQUARE = [(x, y, 0.0) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0)]
TRIANGLE = [(s * np.cos(a), s * np.sin(a), -s * np.cos(3 * a)) for a in np.arange(3) * 2 * np.pi / 3 for s in (1, -1)]


def unit(vectors):
    return [np.array(v) / np.linalg.norm(v) for v in vectors]


@pytest.mark.parametrize("backend", ["numba", "scipy"])
@pytest.mark.parametrize("b", [2.0, 0.5])
def test_square_symmetry(b, backend):
    """Four branches on the axes and the diagonals, and the trivial one."""
    bvp = square(b)
    options = TraceOptions(backend=backend)
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1, options=options), options)
    assert found.multiplicity == 2
    assert abs(found.state.scalars[0]) < 1e-10
    assert found.residual < 1e-9
    assert found.fraction == pytest.approx(0.3, abs=1e-9)
    assert found.arclength == pytest.approx(2.03, abs=1e-9)
    assert (found.continuum, found.unverified) == (False, 0)
    assert same_set(ends(found), unit([*SQUARE, (0, 0, 1), (0, 0, -1)]), 1e-3)
    assert np.allclose(ends(found)[:2], [(0, 0, 1), (0, 0, -1)], atol=1e-9)  # the branch walked comes first
    states = stepped_off(found)
    assert all_distinct(found.colloc, states, 0.01)
    for x in states[2:]:
        x0, y0, lam = *x.mesh[0], x.scalars[0]
        assert lam == pytest.approx(max(x0**2, y0**2) * (1 if abs(x0 * y0) < 1e-8 else 1 + b), rel=1e-6)
    assert "10 rays" in repr(found)


def test_triangle_symmetry():
    """Three straight lines cross the trivial branch: directions are exact."""
    bvp = triangle()
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1))
    assert found.multiplicity == 2
    assert same_set(ends(found), unit([*TRIANGLE, (0, 0, 1), (0, 0, -1)]), 1e-8)
    assert all_distinct(found.colloc, stepped_off(found), 0.01)


def test_the_same_point_seen_from_a_side_branch():
    bvp = triangle()
    found = multiple_on(segment(bvp, constant(bvp, [0.03, 0.0], lam=-0.03), 0.1))
    assert found.multiplicity == 2
    assert abs(found.state.scalars[0]) < 1e-10
    assert same_set(ends(found), unit([*TRIANGLE, (0, 0, 1), (0, 0, -1)]), 1e-8)
    assert np.allclose(ends(found)[0], unit([(-1, 0, 1)])[0], atol=1e-8)


def curved():
    """The square in coordinates in which no branch is straight; one is x = sin(lam), y = lam - x^2."""

    def residual(u, p):
        lam, x, y = p.lam + 0.3 * u.x - 0.2 * u.y**2, u.x - np.sin(p.lam), u.y - p.lam + u.x**2
        return [x * (lam - x**2 - 2 * y**2) + 0.5 * x * y**2 * lam, y * (lam - y**2 - 2 * x**2)]

    return algebraic(residual, ("x", "y"))


def test_a_curved_branch_through_a_multiple_point():
    """The square again, in coordinates in which no branch is straight and the trivial one has no symmetry."""
    bvp, lam = curved(), -0.1
    found = multiple_on(segment(bvp, constant(bvp, [np.sin(lam), lam - np.sin(lam) ** 2], lam=lam), 0.4))
    assert found.multiplicity == 2
    assert np.abs([*found.state.scalars, *found.state.mesh[0]]).max() < 1e-9
    # to first order x = X - lam, y = Y - lam, and lam + 0.3 X = 0 on the side branches
    sides = [(x - 0.3 * x / 1.3, y - 0.3 * x / 1.3, -0.3 * x / 1.3) for x, y, _ in SQUARE]
    assert same_set(ends(found), unit([*sides, (1, 1, 1), (-1, -1, -1)]), 1e-4)
    assert all_distinct(found.colloc, stepped_off(found, 0.005), 0.002)


@pytest.mark.parametrize("b", [2.0, 0.5])
def test_three_modes_at_once(b):
    """26 rays: to the 6 faces, 12 edges and 8 corners of the cube."""
    bvp = cube(b)
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1))
    assert (found.multiplicity, found.unverified, found.continuum) == (3, 0, False)
    places = [(x, y, z, 0) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]
    assert same_set(ends(found), unit([*places, (0, 0, 0, 1), (0, 0, 0, -1)]), 1e-3)


def test_a_continuum_of_branches_is_reported_once():
    bvp = circular()
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1))
    assert found.multiplicity == 2
    assert found.continuum
    assert len(found.directions) == 3
    x, y = found.nearby[2].mesh[0]
    assert found.nearby[2].scalars[0] == pytest.approx(x**2 + y**2, rel=1e-6)
    assert "a continuum" in repr(found)


def test_a_weakly_broken_circle_is_no_continuum():
    """Terms of fifth order leave six of the lines."""

    def residual(u, p):
        x, y, square = u.x, u.y, u.x**2 + u.y**2
        real, imaginary = x**5 - 10 * x**3 * y**2 + 5 * x * y**4, 5 * x**4 * y - 10 * x**2 * y**3 + y**5
        return [x * (p.lam - square) + real, y * (p.lam - square) - imaginary]

    bvp = algebraic(residual, ("x", "y"))
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1))
    assert not found.continuum
    angles = [(np.cos(a), np.sin(a), 0.0) for a in np.arange(12) * np.pi / 6]
    assert same_set(ends(found), unit([*angles, (0, 0, 1), (0, 0, -1)]), 1e-3)


def test_modes_that_touch_zero():
    """x (lam^2 - x^2 - y^2/2) and the same for y: straight lines, 8 on each side, and no change of sign anywhere."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam**2 - u.x**2 - u.y**2 / 2), u.y * (p.lam**2 - u.y**2 - u.x**2 / 2)],
                    ("x", "y"))  # fmt: skip
    found = multiple_on(segment(bvp, constant(bvp, lam=-0.03), 0.1))
    assert found.multiplicity == 2
    assert abs(found.state.scalars[0]) < 1e-9
    assert len(found.directions) == 18


def oscillators(b, apart=0.0):
    """u'' + (pi^2 + lam) u = u^3 + b u w^2, and the same with u and w exchanged, one of them shifted."""
    return BVP(
        lambda s, u, p: [
            u.v, -(np.pi**2 + p.lam) * u.u + u.u**3 + b * u.u * u.w**2,
            u.z, -(np.pi**2 + apart + p.lam) * u.w + u.w**3 + b * u.w * u.u**2,
        ],
        lambda left, right, p: [left.u, right.u, left.w, right.w],
        unknowns=("u", "v", "w", "z"), parameters={"lam": 0.0},
    )  # fmt: skip


def rest(bvp, **parameters):
    """The solution u = 0."""
    return Solution.from_function(
        lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, {**bvp.parameters, **parameters}
    )


@pytest.mark.parametrize("step", [0.4, 0.1, 1e-3, 6.4e-5])
def test_place_does_not_depend_on_the_step(step):
    bvp = oscillators(0.0)
    found = multiple_on(segment(bvp, rest(bvp, lam=-0.3 * step), step))
    assert found.multiplicity == 2
    assert abs(found.state.scalars[0]) < 1e-9
    assert found.fraction == pytest.approx(0.3, abs=1e-9 / step)
    assert len(found.directions) == 10


@pytest.mark.parametrize(("b", "rays"), [(0.0, 10), (0.5, 10), (2.0, 10), (-0.5, 10)])
def test_two_coupled_oscillators(b, rays):
    """On the sine modes the cubic terms are 3/4 (A^3 + b A B^2): the square, for any b but one."""
    bvp = oscillators(b)
    found = multiple_on(segment(bvp, rest(bvp, lam=-0.03), 0.1))
    assert (found.multiplicity, found.unverified, found.continuum) == (2, 0, False)
    assert len(found.directions) == rays
    slopes = ends(found)[:, [1, 3]]
    size = np.pi / np.sqrt((1 + np.pi**2) / 2)  # of v = pi cos(pi s), when sin and v have norm one together
    assert same_set(slopes[2:] / size, unit([(x, y) for x, y, _ in SQUARE]), 1e-5)
    states = stepped_off(found)
    assert all_distinct(found.colloc, states, 0.01)
    for x in states[2:]:  # (3/4) A^2 (1 + b if both modes are present) = lam
        u, w = np.abs(x.mesh[0, [1, 3]]) / np.pi
        assert x.scalars[0] == pytest.approx(0.75 * max(u, w) ** 2 * (1 + b * (min(u, w) > 1e-3)), rel=1e-2)


def test_equal_oscillators_form_a_continuum():
    bvp = oscillators(1.0)
    found = multiple_on(segment(bvp, rest(bvp, lam=-0.03), 0.1))
    assert (found.multiplicity, found.continuum, len(found.directions)) == (2, True, 3)


@pytest.mark.parametrize("apart", [1e-3, 1e-5, 1e-7])
def test_two_close_simple_branch_points(apart):
    """They are told apart from a double one, and their places returned."""
    bvp = oscillators(0.5, apart)
    on = segment(bvp, rest(bvp, lam=-0.03), 0.1)
    places = places_on(on)
    assert [p.multiplicity for p in places] == [1, 1]
    assert np.allclose([p.state.scalars[0] for p in places], (-apart, 0.0), atol=1e-9)
    assert np.allclose([p.arclength for p in places], (2.03 - apart, 2.03), atol=1e-9)


def column(stiffening):
    """w'''' + P w'' + k w + c w^3 = 0, pinned, with k = 4 pi^4: modes 1 and 2 buckle at P = 5 pi^2."""
    k = 4 * np.pi**4
    return BVP(
        lambda s, u, p: [u.t, u.m, u.q, -p.P * u.m - k * u.w - stiffening * u.w**3],
        lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"), parameters={"P": 0.0},
    )  # fmt: skip


@pytest.mark.parametrize("stiffening", [1.0, 1000.0])
def test_column_on_an_elastic_foundation(stiffening):
    """With A, B the amplitudes and D = (P - 5 pi^2) pi^2/c: A (3 A^2 + 6 B^2 - 4 D) = 0 = B (6 A^2 + 3 B^2 - 16 D).

    A branch with both modes would have B^2 = -8 D/9 and A^2 = 28 D/9, so there are the two pure modes only.
    """
    bvp = column(stiffening)
    found = multiple_on(segment(bvp, rest(bvp, P=5 * np.pi**2 - 0.04), 0.1, "P"))
    assert found.multiplicity == 2
    assert found.state.scalars[0] == pytest.approx(5 * np.pi**2, abs=1e-8)
    assert (len(found.directions), found.continuum, found.unverified) == (6, False, 0)
    ratio = np.sort(ends(found)[2:, 3] / ends(found)[2:, 1])  # w'''/w' at the end
    tolerance = 1e-5 if stiffening > 100 else 5e-5  # round-off: the branches are nearly straight
    assert np.allclose(ratio, np.repeat([-4 * np.pi**2, -(np.pi**2)], 2), rtol=tolerance)


def spatial_column():
    """Inextensible pinned column with equal bending stiffness in all planes: t' = m x t, m' = n x t, y' and z' from t.

    n = (-P, ny, nz); the first mode of every plane has P = pi^2.
    """

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def rhs(s, u, p):
        t, m = (u.tx, u.ty, u.tz), (u.mx, u.my, u.mz)
        return [*cross(m, t), *cross((-p.P, p.ny, p.nz), t), u.ty, u.tz]

    def conditions(left, right, p):
        clamped = [left.mx, left.my, left.mz, right.my, right.mz, left.tx**2 + left.ty**2 + left.tz**2 - 1]
        return [left.y, left.z, right.y, right.z, *clamped]

    return BVP(
        rhs, conditions, unknowns=("tx", "ty", "tz", "mx", "my", "mz", "y", "z"),
        parameters={"P": 9.0, "ny": 0.0, "nz": 0.0},
    )  # fmt: skip


def test_a_column_that_buckles_in_every_plane():
    bvp, load = spatial_column(), np.pi**2 - 0.03
    start = Solution.from_function(
        lambda s: np.tile([1.0, 0, 0, 0, 0, 0, 0, 0], (len(s), 1)), bvp.unknowns, {**bvp.parameters, "P": load}
    )
    left, _ = first_frame(bvp, start, [0, 1, 2], OPTIONS)
    found = multiple_on(step_on(left, 0.1, OPTIONS))
    assert (found.multiplicity, found.continuum, len(found.directions)) == (2, True, 3)
    assert found.state.scalars[0] == pytest.approx(np.pi**2, abs=1e-9)
    y, z = found.nearby[2].mesh[:, 6], found.nearby[2].mesh[:, 7]
    assert np.linalg.matrix_rank(np.stack([y, z]), tol=1e-8) == 1  # buckled in one plane


def test_a_coarse_mesh_that_separates_the_modes_is_refined():
    bvp = column(1000.0)
    start = Solution.from_function(lambda s: np.zeros((len(s), 4)), bvp.unknowns, {"P": 5 * np.pi**2 - 0.04}, 4, 4)
    found = multiple_on(segment(bvp, start, 0.1, "P"))
    assert found.multiplicity == 2
    assert len(found.colloc.step) > 4
    assert found.state.scalars[0] == pytest.approx(5 * np.pi**2, abs=1e-8)


def test_a_fold_is_not_singular():
    bvp = algebraic(lambda u, p: [u.x**2 + p.lam**2 - 1, u.y * (p.lam - 3)], ("x", "y"))
    left, _ = first_frame(bvp, constant(bvp, [0.2, 0.0], lam=np.sqrt(0.96)), [0], OPTIONS)
    assert places_on(step_on(left, 0.4, OPTIONS)) == ()


def test_simple_points_and_regular_segments():
    """One mode only, also where it touches zero or the kernel has a Jordan chain; none on a regular segment."""
    crossing = algebraic(lambda u, p: [u.x * (p.lam - u.x**2), u.y * (1 + p.lam - u.y**2)], ("x", "y"))
    touching = algebraic(lambda u, p: [u.x * (p.lam**2 - u.x**2), u.y * (1 + p.lam - u.y**2)], ("x", "y"))
    chain = algebraic(lambda u, p: [p.lam * u.x + u.y - u.x**3, p.lam * u.y - u.y**3], ("x", "y"))
    for bvp in (crossing, touching, chain):
        on = segment(bvp, constant(bvp, lam=-0.03), 0.1)
        (place,) = places_on(on)
        assert place.point is None
        assert place.multiplicity == 1
        assert place.fraction == pytest.approx(0.3, abs=1e-6)
        assert places_on(segment(bvp, constant(bvp, lam=0.1), 0.1)) == ()


def test_two_places_on_one_segment():
    """A double point at lam = 0 and a simple one at lam = 0.1."""
    bvp = algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2), u.y * (p.lam - u.y**2), u.z * (p.lam - 0.1 - u.z**2)], ("x", "y", "z")
    )
    double, simple = places_on(segment(bvp, constant(bvp, lam=-0.1), 0.3))
    assert (double.multiplicity, simple.multiplicity) == (2, 1)
    assert np.allclose([double.arclength, simple.arclength], [2.1, 2.2], atol=1e-8)
