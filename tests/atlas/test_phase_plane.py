"""The plane cut by lines: faces, chords, splines and the angles that meet all of it; without any slice."""

from types import SimpleNamespace

import numpy as np
import pytest

from rodatlas.atlas.phase.arrangement import chords, covers, cut_plane, polygon_of, united
from rodatlas.atlas.phase.cover import THIN, choose_values
from rodatlas.atlas.phase.lines import Line, locus_lines, spline
from rodatlas.paper.model import band_phase

FRAME = SimpleNamespace(  # what cutting asks of settings
    region=np.array([[0.0, -1.0], [10.0, -1.0], [10.0, 1.0], [0.0, 1.0], [0.0, -1.0]]), second_scale=100.0,
    units=(1.0, 1.0, 1.0),
)  # fmt: skip


def line(*points, label="1", kind="fold"):
    return Line(label, kind, np.array(points, dtype=float))


def areas(faces):
    return [polygon_of(f).area for f in faces]


def test_lines_that_cross():
    faces = cut_plane([line((0, -0.5), (10, 0.5)), line((0, 0.5), (10, -0.5))], FRAME)
    assert sorted(areas(faces)) == pytest.approx([2.5, 2.5, 7.5, 7.5])


def test_lines_that_end_inside_bound_nothing():
    assert areas(cut_plane([line((0, 0), (4, 0))], FRAME)) == pytest.approx([20.0])


def test_lines_that_start_on_another():
    """As the fold of US starts on pitchfork 4."""
    faces = cut_plane([line((0, 0), (3, 0.3), (10, 0)), line((3, 0.3), (10, 0.9))], FRAME)
    assert len(faces) == 3
    assert sum(areas(faces)) == pytest.approx(20.0, rel=1e-12)


def test_lines_that_touch():
    """As fold 7 touches pitchfork 9: no face of round-off size appears, whatever the vertices."""
    x = np.linspace(0, 10, 101)
    y = np.sort(np.append(np.linspace(0, 10, 97), 5.0))
    curves = [line(*zip(x, 0.01 * (x - 5) ** 2, strict=True)), line(*zip(y, -0.01 * (y - 5) ** 2, strict=True))]
    faces = cut_plane(curves, FRAME)
    assert len(faces) == 4
    assert sum(areas(faces)) == pytest.approx(20.0, rel=1e-9)


def test_lines_that_end_on_the_frame_within_round_off():
    faces = cut_plane([line((1e-13, 0), (10 - 1e-13, 0)), line((5, 0), (5 + 1e-9, 1 - 1e-14))], FRAME)
    assert sorted(areas(faces)) == pytest.approx([5.0, 5.0, 10.0], rel=1e-6)


def test_chords_of_a_disk_with_a_hole():
    turn = np.linspace(0, 2 * np.pi, 4001)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    disk = (ring, 0.5 * ring)
    assert np.ravel(chords(disk, 0.3)) == pytest.approx(
        [-np.sqrt(0.91), -0.4, 0.4, np.sqrt(0.91)], abs=1e-5
    )  # fmt: skip
    assert chords(disk, 1.5) == []
    assert not covers(disk, 0.0, 0.0)
    assert covers(disk, 0.7, 0.0)


def test_united_faces_have_no_inner_sides():
    faces = cut_plane([line((0, -0.5), (10, 0.5)), line((0, 0.5), (10, -0.5))], FRAME)
    (whole,) = united(faces)
    assert polygon_of(whole).area == pytest.approx(20.0)
    assert len(whole) == 1


def test_splines_converge_and_pass_through_their_points():
    """Half an ellipse in the plane, whose ends have vertical tangents as loci where the angle is extreme."""

    def error(n):
        turn = np.linspace(np.pi, 0, n)
        points = np.column_stack([40 + 40 * np.cos(turn), 0.4 * np.sin(turn)])
        fine = spline(points, 100.0)
        assert np.all(np.diff(fine[:, 0]) >= 0)
        assert all(np.any(np.all(fine == p, axis=1)) for p in points)
        radius = np.hypot((fine[:, 0] - 40) / 40, fine[:, 1] / 0.4)
        return np.abs(radius - 1).max()

    assert error(33) < 1e-5
    assert error(17) / error(33) > 10


@pytest.fixture(scope="module")
def plane(loci):
    lines = locus_lines(loci.pieces, loci.events(), band_phase())
    return lines, cut_plane(lines, band_phase())


def test_faces_of_the_band_fill_the_frame(plane):
    _, faces = plane
    frame = band_phase().frame
    assert sum(areas(faces)) == pytest.approx((frame[1] - frame[0]) * (frame[3] - frame[2]), rel=1e-9)
    for angle in (0.3, 12.34, 27.72, 30.63, 44.2, 66.6, 79.9):
        spans = sorted(span for f in faces for span in chords(f, angle))
        assert spans[0][0] == pytest.approx(frame[2])
        assert spans[-1][1] == pytest.approx(frame[3])
        assert np.array([s[1] for s in spans[:-1]]) == pytest.approx(np.array([s[0] for s in spans[1:]]), abs=1e-12)


def test_loci_that_meet_share_a_vertex(loci, plane):
    lines = {x.label: x.points for x in plane[0]}
    for event in (e for e in loci.events() if e.parameter != "shear" and len(e.labels) > 1):
        for label in event.labels:
            assert np.any(np.all(lines[label] == (event.second, event.value), axis=1)), (event, label)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_loci_are_mirror_images_across_zero_shear(plane, number):
    """They are followed through dD = 0 as one curve, so that both sides are computed; points are some degrees apart."""
    lines = {x.label: x.points for x in plane[0]}
    one, two = lines[str(number)], lines[f"{number}'"]
    angles = np.linspace(two[0, 0] + 0.1, two[-1, 0] - 0.01, 40)
    shears = [np.interp(angles, x[:, 0], x[:, 1]) for x in (one, two)]
    assert shears[0] == pytest.approx(-shears[1], abs=3e-4)
    assert np.ptp(shears[0]) > 0.05


def test_chosen_angles_meet_every_face_and_cross_every_line(plane):
    lines, faces = plane
    angles, thin = choose_values(faces, lines, band_phase(), [15.0])
    used = [15.0, *angles]
    assert len(used) < 25
    for i, face in enumerate(faces):
        widths = [high - low for a in used for low, high in chords(face, a)]
        assert (i in thin) or max(widths) > THIN
        low, high = face[0][:, 0].min(), face[0][:, 0].max()
        if i in thin:
            fine = [t - b for a in np.linspace(low, high, 300)[1:-1] for b, t in chords(face, a)]
            assert max(fine) < 2 * THIN
    for x in lines:
        assert any(x.points[0, 0] < a < x.points[-1, 0] for a in used), x


@pytest.mark.parametrize(("fields", "message"), [
    ({"angle_min": -1.0}, "angle-min: expected degrees with 0 <= angle-min <= 89, got -1"),
    ({"angle_min": 30.0, "angle_max": 20.0}, "angle-max: expected degrees with 30.01 <= angle-max < 90, got 20"),
    ({"poisson": 1.0}, "poisson: expected a number with -1 < nu <= 0.5, got 1"),
])  # fmt: skip
def test_wrong_settings(fields, message):
    with pytest.raises(ValueError, match="expected") as caught:
        band_phase(**fields)
    assert message in str(caught.value)
