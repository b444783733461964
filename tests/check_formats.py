"""Check for tests of the formats: do the points project to the pixels that the writer used?"""

from __future__ import annotations

import numpy as np

from patina.core.scan.reconstruction import Reconstruction
from tests.make_points_scene import FOCAL, HEIGHT, WIDTH, Distort, Scene, Vector, pixels

CLOSE = 0.01  # pixels
CX, CY = 333.0, 222.0
K = (-0.12, 0.05, -0.02, 0.01)
P = (0.002, -0.003)
Pixels = dict[str, list[Vector]]


def seen(
    scene: Scene, distort: Distort, fx: float = FOCAL, fy: float = FOCAL,
    cx: float = CX, cy: float = CY,
) -> Pixels:  # fmt: skip
    return pixels(scene, distort, fx, fy, cx, cy)


def check(found: Reconstruction, expected: Pixels, scene: Scene, close: float = CLOSE) -> None:
    """Check the projections of all points in all cameras, and their inverse."""
    by_stem = {name.removesuffix(".png"): rows for name, rows in expected.items()}
    assert len(found.cameras) == len(expected) == 8
    points = np.array(scene.points)
    for camera in found.cameras:
        assert (camera.width, camera.height) == (WIDTH, HEIGHT)
        want = np.array(by_stem[camera.label.removesuffix(".png")])
        off = np.abs(camera.project(points) - want)
        assert off.max() < close, camera.label
        straight = points - camera.pose.centre
        straight /= np.linalg.norm(straight, axis=1, keepdims=True)
        angle = np.linalg.norm(np.cross(camera.rays(want), straight), axis=1)
        assert angle.max() * FOCAL < 2 * close, camera.label


def check_points(found: Reconstruction, scene: Scene, colours: bool = True) -> None:
    assert np.allclose(found.points, scene.points, atol=1e-8)
    if colours:
        assert np.array_equal(found.colours, scene.colours)
