"""VisualSFM's radial lens: round trip of pixels, and rays that no pixel shows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.scan.lens import make_lens, resized_parameters
from tests.make_points_scene import straightened_by

WIDTH, HEIGHT = 3000, 2000


@given(r=st.floats(-0.5, 2.0), f=st.floats(1500, 6000), seed=st.integers(0, 99))
def test_pixels_round_trip_through_lens(r: float, f: float, seed: int) -> None:
    lens = make_lens("MEASURED_RADIAL", WIDTH, HEIGHT, (f, 1480.0, 1020.0, r))
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(0, (WIDTH, HEIGHT), (500, 2))
    measured = np.linalg.norm(pixels - (1480.0, 1020.0), axis=1) / f
    pixels = pixels[1 + 3 * r * measured**2 > 0.01]  # before the fold
    rays = lens.cam_ray_from_img(pixels) * rng.uniform(0.5, 50, (len(pixels), 1))
    assert np.abs(lens.img_from_cam(rays) - pixels).max() < 1e-3


@pytest.mark.parametrize("r", [0.3, -0.3, 1e-9, 0.0])
def test_lens_matches_published_equation(r: float) -> None:
    lens = make_lens("MEASURED_RADIAL", WIDTH, HEIGHT, (2000.0, 1500.0, 1000.0, r))
    points = np.random.default_rng(1).uniform((-0.5, -0.4, 1), (0.5, 0.4, 1.2), (200, 3))
    expected = [np.array(straightened_by(r)(*p)) * 2000 + (1500, 1000) for p in points]
    assert np.abs(lens.img_from_cam(points) - expected).max() < 1e-6
    middle = lens.img_from_cam(np.array([[0.0, 0.0, 1.0]]))
    assert np.array_equal(middle, [[1500.0, 1000.0]])


def test_rays_beyond_the_fold_have_no_pixel() -> None:
    lens = make_lens("MEASURED_RADIAL", WIDTH, HEIGHT, (2000.0, 1500.0, 1000.0, -0.5))
    with np.errstate(all="raise"):
        assert np.isnan(lens.img_from_cam(np.array([[2.0, 0.0, 1.0]]))).all()
        assert np.isnan(lens.cam_from_img(np.array([[1500.0 + 1700.0, 1000.0]]))).all()


def test_lens_of_scaled_photo() -> None:
    parameters = (2000.0, 1480.0, 1020.0, 0.2)
    small = resized_parameters("MEASURED_RADIAL", parameters, (WIDTH, HEIGHT), (750, 500))
    points = np.array([[0.1, -0.3, 1.0], [0.5, 0.2, 1.1]])
    large = make_lens("MEASURED_RADIAL", WIDTH, HEIGHT, parameters).img_from_cam(points)
    assert np.allclose(
        make_lens("MEASURED_RADIAL", 750, 500, small).img_from_cam(points), large / 4
    )
