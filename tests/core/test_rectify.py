"""Photos are resampled as the lens says: the lattice is compared with the lens at every pixel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from patina.core.geometry.rectify import rectify
from patina.core.scan import Camera, Pose

WIDTH, HEIGHT = 320, 240


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("RADIAL", (290.0, 158.0, 122.0, -0.18, 0.04)),
        ("OPENCV_FISHEYE", (200.0, 202.0, 160.0, 120.0, 0.02, -0.01, 0.0, 0.0)),
        ("PINHOLE", (300.0, 301.0, 160.0, 120.0)),
    ],
)
def test_resampling_equals_that_with_the_lens_at_every_pixel(model, parameters):
    camera = Camera("a", WIDTH, HEIGHT, model, parameters, Pose(np.eye(3), np.zeros(3)))
    target = camera.rectified()
    pixels = np.random.default_rng(0).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    columns, rows = np.meshgrid(np.arange(target.width) + 0.5, np.arange(target.height) + 0.5)
    ray = target.lens.cam_from_img(np.stack([columns.ravel(), rows.ravel()], axis=1))
    column, row = camera.lens.img_from_cam(np.c_[ray, np.ones(len(ray))]).T - 0.5
    exact = [map_coordinates(pixels[..., k], [row, column], order=1) for k in range(3)]
    found = rectify(pixels, camera, target).reshape(-1, 3)
    # an error of 0.01 pixels changes white noise by at most 0.01 in each direction
    assert np.abs(found - np.stack(exact, axis=1)).max() < 0.02
    assert found.std() > 0.1
