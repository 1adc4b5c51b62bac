"""The slice at psi0 = 0, which the angle mirror maps to itself: S+-, coincident pairs, every curve once."""

import numpy as np
import pytest

from rodatlas.atlas import compute_slice
from rodatlas.atlas.slices.branches.match import crossings, lies_on
from rodatlas.paper.model import band_slice
from rodatlas.rods import RodState, critical_mode, index_of, mirror_angle, reverse

pytestmark = pytest.mark.slow
SETTINGS = band_slice(0.0, search=0)


@pytest.fixture(scope="module")
def found():
    return compute_slice(SETTINGS, carry=False)


def branch(found, ident):
    return next(b for b in found.branches if b.id == ident)


def test_every_branch_has_one_mirror_image(found):
    """Image of the image is the branch itself; its bifurcations are the same at the opposite height."""
    assert found.warnings == ()
    partners = {b.id: b.mirror for b in found.branches}
    assert all(partners[partners[ident]] == ident for ident in partners)
    assert {k: v for k, v in partners.items() if k in ("U", "TU", "M3")} == {"U": "W", "TU": "TW", "M3": "M3i"}
    for b in found.branches:
        here, there = events(b), events(branch(found, b.mirror))
        assert len(here) == len(there)
        for row in here * [1, -1, 1]:
            assert np.abs(there - row).max(axis=1).min() < 2e-6, (b, row)


def events(b):
    """Shear, height and larger index of the bifurcations inside a branch, (n, 3), without those at which it ends."""
    inside = [e for e in b.events if b.followed.symmetric or "reversal" not in e.special.breaks]
    return np.array([[e.value, e.response, max(e.special.index)] for e in inside]).reshape(-1, 3)


def test_no_curve_is_listed_twice(found):
    """States in the inside of one branch are on no other, reversed or not."""
    for b in found.branches:
        points = b.followed.branch.points
        for part in (0.3, 0.7):
            state = points[int(part * len(points))].solution
            assert [c.id for c in found.branches if lies_on(c.followed.branch, state, SETTINGS)] == [b.id]


def test_bifurcations_of_u_and_w_coincide(found):
    numbers = {e.number: e for b in found.branches for e in b.events if b.id in ("U", "W")}
    assert numbers[4].value == pytest.approx(0.359236, abs=1e-6)
    assert numbers[11].value == pytest.approx(0.603240, abs=1e-6)
    for one, two in ((3, 4), (10, 11)):
        assert numbers[one].value == pytest.approx(numbers[two].value, abs=1e-8)
        assert numbers[one].response == pytest.approx(-numbers[two].response, abs=1e-8)


def test_s_is_one_curve_of_zero_height(found):
    """S+- begins at 0.531, where US+- and WS+- meet, one pair for each member; below it is the planar second mode."""
    s = next(x for x in found.states if x.name == "S+-")
    us, ws = (next(x for x in found.states if x.name == name) for name in ("US+-", "WS+-"))
    assert s.low.value == pytest.approx(0.531, abs=1e-3)
    assert us.branch == ws.branch
    assert [x.value for x in (us.high, ws.high)] == pytest.approx([s.low.value] * 2, abs=1e-8)
    assert [x.snap for x in (us.high, ws.high, s.low)] == [False] * 3
    curve = branch(found, s.branch)
    assert curve.mirror == curve.id
    assert max(abs(p.solution["height"]) for p in curve.followed.branch.points) < 1e-9
    (pitchfork,) = curve.events
    assert (pitchfork.kind, pitchfork.special.index, pitchfork.criticality) == ("pitchfork", (1, 0), "super")
    assert pitchfork.special.breaks == ("angle mirror * reversal",)
    (planar,) = crossings(curve.followed.branch, (0.0,), SETTINGS)
    assert np.abs(planar["z"]).max() < 1e-7
    assert index_of(planar).index == 1
    k1 = planar(np.linspace(0, 1, 401)[1:-1], "k1")
    assert np.sum(np.diff(np.sign(k1)) != 0) == 3  # second mode of the clamped elastica
    # its image is its reversal: S- for S+
    strain = s.solutions[-1](np.linspace(0, 1, 21))[:, 4:6]
    image, partner = mirror_angle(s.solutions[-1]), reverse(s.solutions[-1])
    assert np.allclose(image(np.linspace(0, 1, 21))[:, 4:6], partner(np.linspace(0, 1, 21))[:, 4:6], atol=1e-6)
    assert np.abs(partner(np.linspace(0, 1, 21))[:, 4:6] - strain).max() > 10


def test_the_third_mode_has_three_branch_points(found):
    """Numbered as the loci that end there; their images have none."""
    numbers = [(e.number, e.special.index) for e in branch(found, "M3").events]
    assert numbers == [(0, (3, 2)), (8, (2, 1)), (9, (1, 2))]
    assert [e.number for e in branch(found, "M3i").events] == [None] * 3


def test_each_twisted_loop_has_four_pairs_without_shear(found):
    for family in ("TU", "TW"):
        loop = [b.followed.branch for b in found.branches if b.id.startswith(family)]
        there = [s for b in loop for s in crossings(b, (1e-5,), SETTINGS, most=5)]
        assert len(there) == 4
        indices = sorted(index_of(s).index for s in there)
        assert indices[0] == 0
        assert indices[1] > 0
        assert len({round(s["energy"], 6) for s in there}) == 4


def test_branches_without_symmetry_cross_where_the_band_can_slide(found):
    """A band moved along itself, and turned back, keeps its ends where both strains agree and the axis of turning is
    the chord: at psi0 = 0 no symmetry is needed for this branch point. Everything in space, from the shape alone.
    """
    crossings_ = [e for b in found.branches for e in b.events if e.kind == "branch point"]
    assert {round(e.value, 4) for e in crossings_} == {0.5012}
    for event in crossings_:
        assert event.special.isotropy == ()
        mode, rod = critical_mode(event.special.solution), RodState(event.special.solution)
        tangent = rod.directors[:, 2]
        strain = rod.in_space(rod.strain)
        turned = np.cross(strain[0], rod.position - rod.position[0])
        slide = tangent - tangent[0] - turned
        size = np.sum(slide * mode.displacement) / np.sum(slide**2)
        assert np.abs(size * slide - mode.displacement).max() < 1e-6
        assert np.abs(size * (strain - strain[0]) - mode.rotation).max() < 1e-6 * np.abs(mode.rotation).max()
