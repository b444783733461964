"""Camera poses from pixels and points, against known poses: exact data, outliers, noise."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.scan import Camera, Pose
from patina.core.solve.pairs import EXHAUSTIVE, choose_pairs
from patina.core.solve.pose import find_pose, refine_pose

LENSES = [
    ("SIMPLE_PINHOLE", (900.0, 400.0, 300.0)),
    ("OPENCV", (900.0, 905.0, 410.0, 295.0, -0.12, 0.05, 0.001, -0.002)),
    ("OPENCV_FISHEYE", (500.0, 500.0, 400.0, 300.0, 0.02, -0.004, 0.0, 0.0)),
]


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def scene(model, parameters, seed, count=300, origin=(0.0, 0.0, 0.0)):
    """(camera with the true pose, pixels, points): points in front of it."""
    rng = np.random.default_rng(seed)
    turn = rotation(seed)
    centre = np.asarray(origin) + rng.normal(size=3)
    camera = Camera("x", 800, 600, model, parameters, Pose(turn, -turn @ centre))
    flat = rng.uniform((-0.35, -0.25), (0.35, 0.25), (count, 2))
    depth = rng.uniform(2.0, 5.0, count)
    points = np.column_stack([flat * depth[:, None], depth]) @ turn + centre
    return camera, camera.project(points), points


def apart(pose, truth):
    """(angle in radians, distance of the centres)."""
    turn = pose.rotation @ truth.rotation.T
    sine = 0.5 * np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0],
                                 turn[1, 0] - turn[0, 1]])  # fmt: skip
    return np.arctan2(sine, 0.5 * (np.trace(turn) - 1)), np.linalg.norm(pose.centre - truth.centre)


@pytest.mark.parametrize(("model", "parameters"), LENSES)
def test_exact_pixels_give_exact_pose_despite_outliers(model, parameters) -> None:
    camera, pixels, points = scene(model, parameters, 3)
    wrong = np.random.default_rng(4).permutation(len(points))[: 2 * len(points) // 3]
    pixels[wrong] = np.random.default_rng(5).uniform((0, 0), (800, 600), (len(wrong), 2))
    found = find_pose(camera, pixels, points, 3.0)
    assert found is not None
    refined = refine_pose(camera, found.pose, pixels, points, 3.0)
    right = np.setdiff1d(np.arange(len(points)), wrong)
    assert refined.inliers[right].all() and refined.inliers[wrong].sum() < 3
    angle, place = apart(refined.pose, camera.pose)
    assert angle < 2e-5 and place < 1e-4


def test_no_precision_loss_far_from_origin() -> None:
    far = (4.1e6, 6.2e5, 4.8e6)
    camera, pixels, points = scene(*LENSES[1], 8, origin=far)
    found = find_pose(camera, pixels, points, 3.0)
    assert np.linalg.norm(found.pose.centre - camera.pose.centre) < 1e-4


def test_stated_standard_errors_match_repeated_trials() -> None:
    """Half a pixel of noise, 200 trials: errors scatter as the covariance predicts, to a fifth."""
    camera, exact, points = scene(*LENSES[0], 11, count=150)
    rng = np.random.default_rng(12)
    angles, places, stated = [], [], []
    for _ in range(200):
        found = refine_pose(
            camera, camera.pose, exact + 0.5 * rng.normal(size=exact.shape), points, 10.0
        )
        angle, place = apart(found.pose, camera.pose)
        angles.append(angle)
        places.append(place)
        stated.append((found.angle_deviation, found.place_deviation, found.pixel_deviation))
    angle, place, pixel = np.mean(stated, axis=0)
    assert np.sqrt(np.mean(np.square(angles))) == pytest.approx(angle, rel=0.2)
    assert np.sqrt(np.mean(np.square(places))) == pytest.approx(place, rel=0.2)
    # six parameters from 300 values of σ = 0.5: the fitted points shift by σ·sqrt(6 / 150)
    assert pixel == pytest.approx(0.5 * np.sqrt(6 / 150), rel=0.1)


def test_random_pairs_give_no_pose() -> None:
    rng = np.random.default_rng(1)
    camera, _, points = scene(*LENSES[0], 2)
    found = find_pose(camera, rng.uniform((0, 0), (800, 600), (300, 2)), points, 3.0)
    assert found is None or found.inliers.sum() < 15
    assert find_pose(camera, np.zeros((4, 2)), points[:4], 3.0) is None
    assert find_pose(camera, np.full((50, 2), np.nan), points[:50], 3.0) is None


def test_few_photos_are_all_matched_and_many_with_similar_ones() -> None:
    rng = np.random.default_rng(0)
    few = [rng.integers(0, 255, (5, 128), np.uint8) for _ in range(EXHAUSTIVE)]
    assert len(choose_pairs(few)) == EXHAUSTIVE * (EXHAUSTIVE - 1) // 2
    # 90 photos in 2 rounds of 45 around an object: photos i and i + 45 show the same view, in any
    # order
    round_ = [rng.integers(0, 255, (40, 128), np.uint8) for _ in range(45)]
    noisy = [
        np.clip(d + rng.normal(0, 8, d.shape), 0, 255).astype(np.uint8) for d in round_ + round_
    ]
    pairs = set(choose_pairs(noisy))
    assert {(i, i + 45) for i in range(45)} <= pairs  # not neighbours by name, but similar
    assert {(i, i + 1) for i in range(89)} <= pairs
    assert len(pairs) < 90 * 89 / 2 / 3
