"""The up axis of a scan: found on cameras whose true up axis is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from patina.core.scan.camera import Camera, Pose
from patina.core.scan.mesh import Mesh
from patina.core.scan.up_axis import UpAxis, find_up, rotation_to_z, up_of_rotations

Array = NDArray[np.float64]


def looking(azimuth: float, elevation: float, roll: float) -> Array:
    """(3, 3) world → camera of a camera that looks at the origin; z is up, angles in degrees."""
    a, e, r = np.radians([azimuth, elevation, roll])
    forward = -np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    down = np.cross(forward, right)
    return np.stack(
        [np.cos(r) * right + np.sin(r) * down, -np.sin(r) * right + np.cos(r) * down, forward]
    )


def turned(seed: int) -> Array:
    """A random rotation: reconstructions have an arbitrary frame."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def angle(found: UpAxis | None, truth: Array) -> float:
    assert found is not None
    return float(np.degrees(np.arccos(np.clip(found.direction @ truth, -1, 1))))


@pytest.mark.parametrize("seed", range(8))
def test_handheld_cameras_in_any_frame(seed: int) -> None:
    """Rolls of 3°, a third of the photos in portrait format, two at a wild roll."""
    random = np.random.default_rng(seed)
    frame = turned(seed)
    views = [
        looking(a, random.uniform(-10, 60), random.normal(0, 3) + (90 if k % 3 == 0 else 0))
        for k, a in enumerate(np.linspace(0, 340, 30))
    ]
    views += [looking(50, 20, 40), looking(200, 30, -55)]
    found = up_of_rotations(np.array([view @ frame.T for view in views]))
    off = angle(found, frame[:, 2])
    assert found is not None
    assert off < 2 and off < 4 * np.degrees(found.standard_error) and found.reliable
    assert found.agreement > 0.9


def test_cameras_on_one_side_that_look_down() -> None:
    """Their mean up direction leans forward by 45°; their horizontal axes do not."""
    views = np.array(
        [looking(a, 45, r) for a, r in zip((-30, -10, 5, 25), (1, -1, 0.5, -1), strict=True)]
    )
    found = up_of_rotations(views)
    assert angle(found, np.array([0, 0, 1.0])) < 4
    assert found is not None and found.standard_error > np.radians(0.5)


def test_stated_error_is_that_of_the_estimate() -> None:
    ratios = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        views = np.array(
            [looking(*random.uniform((0, 0), (360, 50)), random.normal(0, 4)) for _ in range(15)]
        )
        found = up_of_rotations(views)
        assert found is not None
        ratios.append(np.radians(angle(found, np.array([0, 0, 1.0]))) / found.standard_error)
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_one_direction_is_not_reliable() -> None:
    found = up_of_rotations(np.array([looking(0, 45, 0), looking(0, 45, 0)]))
    assert found is not None and not found.reliable
    around = np.array([looking(0, 90, r) for r in (0, 90, 180, 270)])  # straight down, all around
    assert up_of_rotations(around) is None
    assert find_up([]) is None


def test_ground_supports_the_cameras() -> None:
    """Few cameras with rolls of 4° on a plate: its normal is more exact."""
    random = np.random.default_rng(3)
    frame = turned(3)
    views = [looking(a, 30, random.normal(0, 4)) @ frame.T for a in (0, 70, 150, 250)]
    cameras = [_camera(view) for view in views]
    grid = np.array([[x, y, 0] for x in range(5) for y in range(5)], float) @ frame.T
    faces = np.array(
        [[5 * i + j, 5 * i + j + 5, 5 * i + j + 1] for i in range(4) for j in range(4)]
    )
    with_ground = find_up(cameras, Mesh(grid, faces))
    alone = find_up(cameras)
    assert with_ground is not None and with_ground.ground
    assert angle(with_ground, frame[:, 2]) < 0.1 < angle(alone, frame[:, 2])


def test_axis_of_the_frame_is_exact() -> None:
    views = [looking(a, 20, 0.3 * (-1) ** k) for k, a in enumerate(range(0, 360, 20))]
    found = find_up([_camera(view) for view in views])
    assert found is not None and found.direction.tolist() == [0, 0, 1]


@pytest.mark.parametrize("seed", range(5))
def test_rotation_turns_up_to_z(seed: int) -> None:
    up = turned(seed)[:, 0]
    rotation = rotation_to_z(up)
    np.testing.assert_allclose(rotation @ up, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) > 0
    np.testing.assert_allclose(rotation_to_z(np.array([0, 0, -1.0]))[2], [0, 0, -1])
    assert np.array_equal(rotation_to_z(np.array([0.0, 0.0, 1.0])), np.eye(3))


def _camera(rotation: Array) -> Camera:
    pose = Pose(rotation, np.array([0.0, 0.0, 5.0]))
    return Camera("a", 100, 80, "PINHOLE", (90.0, 90.0, 50.0, 40.0), pose)
