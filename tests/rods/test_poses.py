"""Poses of clamps: the published quaternions, the frames that they mean, and conditions that hold them."""

from types import SimpleNamespace

import numpy as np
import pytest

from rodatlas.rods import Ends, RodState, state_at
from rodatlas.rods.kinematics import POSE
from rodatlas.rods.poses import Clamps, Pose


def test_the_published_quaternions_and_positions():
    """q(0) = (c, -s, c, s), q(1) = (c, s, c, -s), X(0) = (0, 0, -dD), X(1) = (1 - dL, 0, 0) of Yu and Hanna."""
    clamps = Ends(30.0, 0.4, 0.25).clamps
    c, s = np.cos(np.pi / 12) / np.sqrt(2), np.sin(np.pi / 12) / np.sqrt(2)
    assert clamps.left.numbers == pytest.approx([c, -s, c, s, 0.0, 0.0, -0.25], abs=1e-15)
    assert clamps.right.numbers == pytest.approx([c, s, c, -s, 0.6, 0.0, 0.0], abs=1e-15)
    assert clamps.right.of_class(-1).numbers == pytest.approx([-c, -s, -c, s, 0.6, 0.0, 0.0], abs=1e-15)


def test_a_clamp_is_parallel_to_the_width_and_tilted_by_its_angle():
    angle = np.radians(25.0)
    width, normal, tangent = Pose.tilted(angle, (0.0, 0.0, 0.0)).directors
    assert width == pytest.approx([0.0, 0.0, -1.0], abs=1e-15)
    assert tangent == pytest.approx([np.cos(angle), np.sin(angle), 0.0], abs=1e-15)
    assert normal == pytest.approx(np.cross(tangent, width), abs=1e-15)
    assert np.array_equal(Pose.tilted(angle, (0.0, 0.0, 0.0)).of_class(-1).directors, [width, normal, tangent])


def test_a_state_ends_in_its_clamps():
    ends = Ends(20.0, 0.5, 0.3)
    rod = RodState(state_at(ends, tolerance=1e-10))
    for clamps in (ends.clamps, rod.clamps):
        assert rod.position[[0, -1]] == pytest.approx(np.array([p.position for p in (clamps.left, clamps.right)]))
        assert rod.directors[[0, -1]] == pytest.approx(np.array([p.directors for p in (clamps.left, clamps.right)]))


def test_what_is_no_pose():
    with pytest.raises(ValueError, match=r"quaternion: expected one of length 1, got \(1, 0, 0, 1\) of 1\.41421"):
        Pose((1, 0, 0, 1), (0, 0, 0))
    with pytest.raises(ValueError, match="position: expected 3 components, got 2"):
        Pose((1, 0, 0, 0), (0, 0))
    with pytest.raises(ValueError, match=r"quaternion: expected one of length 1, got .*nan"):
        Pose.tilted(float("nan"), (0, 0, 0))


def test_conditions_vanish_in_the_poses_only_and_are_independent():
    """Thirteen for fourteen numbers, since the equations keep the length of the quaternion: rank 13."""
    clamps = Clamps(Pose.tilted(0.3, (0.1, 0.2, -0.3)), Pose.tilted(-1.1, (0.5, -0.1, 0.2)))

    def residual(numbers):
        left, right = (SimpleNamespace(**dict(zip(POSE, part, strict=True))) for part in np.split(numbers, 2))
        return np.array(clamps.residual(left, right))

    held = np.concatenate([clamps.left.numbers, clamps.right.numbers])
    assert np.abs(residual(held)).max() < 1e-15
    other = np.concatenate([clamps.left.numbers, clamps.right.of_class(-1).numbers])
    assert np.abs(residual(other)).max() < 1e-15
    slope = np.array([(residual(held + e) - residual(held - e)) / 2e-6 for e in 1e-6 * np.eye(14)]).T
    sizes = np.linalg.svd(slope, compute_uv=False)
    assert len(sizes) == 13
    assert sizes[-1] == pytest.approx(1.0, abs=1e-8)
