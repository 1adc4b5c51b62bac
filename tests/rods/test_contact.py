"""Self-contact of a ribbon: closed forms (helix, elastica), a second way to cross two curves, symmetries, the mesh."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipeinc, ellipk, ellipkinc

from rodatlas.continuation import MeshControl, Solution, TraceOptions, solve, trace
from rodatlas.rods import NARROW, Ends, mirror_angle, mirror_shear, reverse, rod_problem, self_contact, state_at
from rodatlas.rods.contact import width_text

CONTROL = MeshControl(tolerance=1e-8)
UNKNOWNS = ("q0", "q1", "q2", "q3", "x", "y", "z")


def framed(q0, axis_angle, position, intervals=60):
    """A ribbon whose frame q0 turns about z by an angle of s, with a center line."""

    def fields(s):
        half = 0.5 * axis_angle(s)
        turns = Rotation.from_quat(np.column_stack([0 * s, 0 * s, np.sin(half), np.cos(half)]))
        q = (turns * q0).as_quat(scalar_first=True)
        kept = np.concatenate([[1.0], np.sign(np.einsum("na,na->n", q[1:], q[:-1]))])  # q and -q are one frame
        return np.column_stack([q * np.cumprod(kept)[:, None], position(s)])

    return Solution.from_function(fields, UNKNOWNS, {"dL": 0.5}, intervals)


def helix(pitch_angle, turns=3.0):
    """A helical strip of length 1 that winds about the z axis, its width along the binormal; also radius and pitch."""
    radius = np.cos(pitch_angle) / (2 * np.pi * turns)
    pitch = np.sin(pitch_angle) / turns
    d3 = np.array([0.0, np.cos(pitch_angle), np.sin(pitch_angle)])
    d1 = np.array([0.0, -np.sin(pitch_angle), np.cos(pitch_angle)])
    q0 = Rotation.from_matrix(np.column_stack([d1, np.cross(d3, d1), d3]))

    def angle(s):
        return 2 * np.pi * turns * s

    def position(s):
        return np.column_stack([radius * np.cos(angle(s)), radius * np.sin(angle(s)), pitch * turns * s])

    return framed(q0, angle, position), radius, pitch


@pytest.mark.parametrize("pitch_angle", [0.05, 0.2, 0.6])
def test_a_helical_strip_touches_the_next_turn_where_its_edges_meet(pitch_angle):
    """The edges lie on helices of one radius; that of a turn meets the other one of the next turn when
    w cos(alpha) + (p/pi) atan(w sin(alpha)/(2 r)) = p."""
    strip, radius, pitch = helix(pitch_angle)
    sine, cosine = np.sin(pitch_angle), np.cos(pitch_angle)
    width = brentq(
        lambda w: w * cosine + pitch / np.pi * np.arctan(w * sine / (2 * radius)) - pitch, 1e-6, 2 * pitch / cosine
    )
    assert self_contact(strip, 0.995 * width) is None
    touch = self_contact(strip, 1.005 * width)
    assert touch is not None
    back = np.arctan(width * sine / (2 * radius)) / np.pi  # turns by which the two edges are ahead and behind
    assert touch.s[1] - touch.s[0] == pytest.approx((1 - back) / 3, abs=2e-3)
    assert repr(touch).startswith("Contact(s = ")


def test_a_wide_strongly_twisted_strip_does_not_touch_itself():
    """A helicoid is embedded, however wide and however close its rulings."""
    along = Rotation.from_matrix(np.column_stack([[1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    strip = framed(along, lambda s: 40.0 * s, lambda s: np.column_stack([0 * s, 0 * s, s]))
    for width in (NARROW, 0.1, 1.0):
        assert self_contact(strip, width) is None


def test_an_arc_touches_itself_once_it_is_more_than_a_circle():
    for turn, touches in ((0.995, False), (1.005, True)):
        angle = 2 * np.pi * turn
        upright = Rotation.from_matrix(np.column_stack([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]).astype(float))

        def position(s, angle=angle):
            return np.column_stack([np.cos(angle * s), np.sin(angle * s), 0 * s]) / angle

        strip = framed(upright, lambda s, angle=angle: angle * s, position)
        assert (self_contact(strip) is not None) == touches


# -- the planar elastica ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def planar():
    """U at dD = 0: (angle in degrees, dL) -> solution."""
    opened = {}
    for degrees in (0.0, 15.0):
        start = state_at(Ends(degrees, 0.7))
        options = TraceOptions(mesh=CONTROL, bounds={"dL": (0.7, 0.97)}, locate=())
        branch = trace(rod_problem(), start, ("dL",), options, both=False)
        opened[degrees] = [p.solution for p in branch.points]

    def state(degrees, compression):
        guess = min(opened[degrees], key=lambda s: abs(s["dL"] - compression))
        return solved(guess.with_parameters(dL=compression))

    return state


def solved(guess):
    return solve(rod_problem(), guess, ("dD",), TraceOptions(mesh=CONTROL))


def first_touch(degrees):
    """dL at which the strands of the first-mode elastica touch, by elliptic integrals.

    With sin(theta/2) = k sn(u) the abscissa is 2 E(am u) - u, up to a factor; the band starts at theta = psi0 and its
    middle is at u = 2 K. The left strand is furthest right at theta = 90 degrees, and meets its mirror image when this
    is the abscissa of the middle.
    """

    def x(phi, k):
        return 2 * ellipeinc(phi, k**2) - ellipkinc(phi, k**2)

    def gap(k):
        return x(np.pi, k) - x(np.arcsin(1 / (np.sqrt(2) * k)), k)

    k = brentq(gap, 0.75, 0.9, xtol=1e-14)
    phi0 = np.arcsin(np.sin(np.radians(degrees) / 2) / k)
    chord = (x(np.pi, k) - x(phi0, k)) / (2 * ellipk(k**2) - ellipkinc(phi0, k**2))
    return 1 - chord


@pytest.mark.parametrize("degrees", [0.0, 15.0])
def test_the_elastica_first_touches_itself_at_the_compression_known_from_elliptic_integrals(planar, degrees):
    low, high = 0.7, 0.97
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if self_contact(planar(degrees, middle)) else (middle, high)
    assert 0.5 * (low + high) == pytest.approx(first_touch(degrees), abs=1e-4)


def test_the_crossing_of_a_figure_eight_is_that_of_its_plane_curve(planar):
    """Against all pairs of 2000 straight pieces; the width does not matter."""
    state = planar(15.0, 0.95)
    s = np.linspace(0.0, 1.0, 2001)
    xy = np.column_stack([state(s, "x"), state(s, "y")])
    one, way = xy[:-1], np.diff(xy, axis=0)
    cross = way[:, None, 0] * way[None, :, 1] - way[:, None, 1] * way[None, :, 0]
    off = one[None] - one[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (off[..., 0] * way[None, :, 1] - off[..., 1] * way[None, :, 0]) / cross
        u = (off[..., 0] * way[:, None, 1] - off[..., 1] * way[:, None, 0]) / cross
    i, j = np.nonzero(np.triu((t >= 0) & (t < 1) & (u >= 0) & (u < 1), 2))
    pairs = np.column_stack([i + t[i, j], j + u[i, j]]) / 2000
    assert len(pairs) == 2  # on either side of the neck
    for width in (1e-4, NARROW, 0.25):
        touch = self_contact(state, width)
        assert touch is not None
        assert np.abs(pairs - touch.s).max(axis=1).min() < 2e-5
        assert touch.width == width


# -- symmetries, the mesh and input -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sheared(planar):
    """U at 15 degrees, dL = 0.95, dD = 0.01, which touches itself from a width of 0.0101 on."""
    flat = planar(15.0, 0.95)
    return solved(flat.with_parameters(dD=0.01))


def least_width(solution, sections=241):
    low, high = 1e-3, 0.1
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if self_contact(solution, middle, sections) else (middle, high)
    return high


def test_reversal_and_mirrors_keep_contact(sheared):
    here = self_contact(sheared)
    width = least_width(sheared)
    images = [reverse(sheared), mirror_angle(sheared), mirror_shear(sheared)]
    for image in images:
        assert least_width(image) == pytest.approx(width, abs=1e-5)
        touch = self_contact(image)
        assert touch.s[1] - touch.s[0] == pytest.approx(here.s[1] - here.s[0], abs=1e-3)
    back = self_contact(images[0])
    assert sum(back.s) == pytest.approx(2 - sum(here.s), abs=5e-3)


def test_neither_the_mesh_of_the_solution_nor_the_number_of_sections_matters(sheared):
    width = least_width(sheared)
    options = TraceOptions(mesh=replace(CONTROL, tolerance=1e-10))
    fine = solve(rod_problem(), sheared.remesh(np.linspace(0, 1, 101)), ("dD",), options)
    assert fine.intervals != sheared.intervals
    assert least_width(fine) == pytest.approx(width, abs=2e-6)
    assert least_width(sheared, 161) == pytest.approx(width, abs=2e-5)
    assert least_width(sheared, 1281) == pytest.approx(width, abs=2e-5)


def test_least_width_is_that_at_which_two_rulings_meet(sheared):
    """Two strands that cross meet first at their edges: where a ruling of one passes through a ruling of the other at
    equal and opposite places. Sought on the exact ribbon, without triangles."""
    from scipy.optimize import fsolve

    from rodatlas.rods.kinematics import ribbon

    def apart(unknowns):
        s1, s2, half = unknowns
        center, (d1, _, _) = ribbon(sheared, np.array([s1, s2]))
        return center[0] + half * d1[0] - center[1] + half * d1[1]

    s1, s2 = self_contact(sheared).s
    found = [fsolve(apart, (s1, s2, 0.5 * sign * NARROW)) for sign in (1, -1)]
    widths = [2 * abs(half) for _, _, half in found]
    assert np.abs(apart(found[0])).max() < 1e-9
    assert min(widths) == pytest.approx(least_width(sheared), abs=2e-5)


def test_shapes_that_do_not_touch(planar):
    for width in (NARROW, 0.5):
        assert self_contact(planar(15.0, 0.75), width) is None


def test_wrong_input_is_named(sheared):
    for width in (0.0, -1.0, 1e300, float("nan"), "wide"):
        with pytest.raises(ValueError, match=r"^width: expected the width over the length, between 0 and 10, got"):
            self_contact(sheared, width)
    with pytest.raises(ValueError, match=r"^sections: expected at least 3, got 2"):
        self_contact(sheared, NARROW, 2)


def test_widths_in_words():
    assert (width_text(NARROW), width_text(0.0301)) == ("L/80", "0.0301 L")
