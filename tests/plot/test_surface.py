"""The ribbon: its width, its edges, its frame, and how it is projected."""

import numpy as np
import pytest

from rodatlas.continuation import Solution
from rodatlas.plot.band.render import View, render_band
from rodatlas.plot.band.surface import NARROW, band_surface
from rodatlas.plot.look.style import new_figure
from rodatlas.rods.ends import Ends
from rodatlas.rods.symmetry import plus_member, reverse


@pytest.fixture(scope="module")
def planar(slice_15):
    """U at dD = 0, a plane curve."""
    branch = next(b for b in slice_15.branches if b.id == "U").followed.branch
    return next(p.solution for p in branch.points if p.solution["dD"] == 0.0)


@pytest.fixture(scope="module")
def broken(slice_15):
    """US+ or US- near dD = 0.6."""
    return min(slice_15.state("US+-", 0.6).solutions, key=lambda s: abs(s["dD"] - 0.6))


def test_planar_ribbon_has_its_width_along_z(planar):
    surface = band_surface(planar)
    across = surface.vertices[:, 1] - surface.vertices[:, 0]
    assert np.abs(np.abs(across[:, 2]) - NARROW).max() < 1e-9
    assert np.abs(across[:, :2]).max() < 1e-9


@pytest.mark.parametrize("width", [1 / 80, 1 / 8])
def test_edges_are_the_width_apart_and_normal_to_the_centerline(broken, width):
    surface = band_surface(broken, width, samples=101)
    across = surface.vertices[:, 1] - surface.vertices[:, 0]
    assert np.linalg.norm(across, axis=1) == pytest.approx(width, rel=1e-12)
    d1, d2, d3 = surface.directors
    for one, two in ((d1, d2), (d2, d3), (d1, d3)):
        assert np.abs(np.einsum("na,na->n", one, two)).max() < 1e-12
    tangent = np.gradient(surface.centerline, surface.s, axis=0, edge_order=2)
    assert np.abs(tangent - d3).max() < 0.05
    assert np.abs(np.einsum("na,na->n", tangent, across / width)).max() < 0.05


def test_ends_are_at_the_clamps(broken):
    surface = band_surface(broken)
    assert surface.centerline[0] == pytest.approx([0, 0, -broken["dD"]], abs=1e-8)
    assert surface.centerline[-1] == pytest.approx([1 - broken["dL"], 0, 0], abs=1e-8)
    assert surface.faces.shape == (240, 4)
    assert surface.faces.max() == 2 * 241 - 1
    assert np.array_equal(surface.across(0.0), surface.centerline)


def test_faces_are_oriented_along_the_normal(planar):
    surface = band_surface(planar)
    corners = surface.vertices.reshape(-1, 3)[surface.faces]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    middle = 0.5 * (surface.directors[1][1:] + surface.directors[1][:-1])
    assert (np.einsum("fa,fa->f", normals, middle) > 0).all()


@pytest.mark.parametrize(("field", "arguments"), [("width", {"width": 0.0}), ("samples", {"samples": 1})])
def test_bad_input_is_named(planar, field, arguments):
    with pytest.raises(ValueError, match=rf"^{field}: expected"):
        band_surface(planar, **arguments)


def test_view_is_a_rotation_with_y_up():
    view = View()
    assert view.axes @ view.axes.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
    right, up, toward = view.axes
    assert right[0] > 0.5
    assert right[1] == 0
    assert up[1] > 0.8
    assert toward[2] > 0.5
    near, far = View(distance=3.0).project(np.array([[0.1, 0.2, 1.0], [0.1, 0.2, -1.0]]))
    assert near[2] > far[2]


def test_drawing_contains_the_projected_band(broken):
    ax = new_figure(2, 2).add_subplot()
    assert render_band(broken, 1 / 16, ax=ax, color="#237EEB") is ax
    (drawn,) = ax.collections
    seen = View().project(band_surface(broken, 1 / 16).vertices)[..., :2].reshape(-1, 2)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert ((seen >= (left, low)) & (seen <= (right, high))).all()
    assert len(drawn.get_paths()) > 3 * 240
    (bare,) = render_band(broken, ax=new_figure(2, 2).add_subplot(), clamps=False).collections
    assert len(bare.get_paths()) == 3 * 240


def test_plus_member_is_the_same_for_both(broken):
    one, two = plus_member(broken), plus_member(reverse(broken))
    s = np.linspace(0, 1, 11)
    assert one(s, "k1") == pytest.approx(two(s, "k1"), abs=1e-9)
    density = one(np.linspace(0, 1, 2001), "k1") ** 2
    assert density[1001:].sum() > density[:1000].sum()


def test_plus_member_of_a_state_whose_halves_have_equal_energy():
    """k1 odd about the middle, as in S+-: decided by the sign of k1, not by rounding errors."""
    unknowns = ("N1", "N2", "N3", "k1", "M2", "tau", "q0", "q1", "q2", "q3", "x", "y", "z")

    def fields(s):
        out = np.ones((len(s), 13))
        out[:, 3] = -np.sin(2 * np.pi * s)
        return out

    one = Solution.from_function(fields, unknowns, {"a": 0.625, **Ends(0.0, 0.5, 0.6).parameters})
    assert plus_member(one) is one
    two = reverse(one)
    assert plus_member(two)(0.75, "k1") == pytest.approx(one(0.75, "k1"))
