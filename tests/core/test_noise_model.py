"""The noise model: variances carried from photos to samples and cells, and the basis' error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.fit.measured.cells import gather
from patina.core.noise import MergedNoise, PhotoNoise
from patina.core.noise.basis_error import basis_variance
from patina.core.noise.pixel_error import bright_parts, pixel_variance
from tests.core.test_measured_limits import samples

SHOT, READ = 2e-4, 1e-3


@settings(max_examples=30, deadline=None)
@given(exposure=st.floats(1e-3, 1e3), light=st.floats(0, 10))
def test_noise_follows_the_division_by_exposure(exposure: float, light: float) -> None:
    """Dividing a photo by its exposure divides its standard deviation by it."""
    noise = PhotoNoise(np.full(3, SHOT), np.full(3, READ))
    recorded = np.full((1, 3), light)
    divided = noise.per_exposure(exposure).variance(recorded / exposure)
    assert np.allclose(divided, noise.variance(recorded) / exposure**2, rtol=1e-5)


def test_merged_noise_is_read_at_the_pixels() -> None:
    variance = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
    pixel = np.array([5, 0])
    found = MergedNoise(variance).at(pixel, np.zeros((2, 3)))
    assert np.array_equal(found, variance[[1, 0], [1, 0]])


def test_cells_carry_the_variance_of_their_samples() -> None:
    """The variance of a cell's mean, predicted from the noise of its pixels, is that of repeated
    photos of the same surface."""
    table = samples(count=4000)
    noise = PhotoNoise(np.full(3, SHOT), np.full(3, READ))
    variance = noise.variance(table.radiance)
    rng = np.random.default_rng(3)
    means = []
    for _ in range(300):
        drawn = table.radiance + np.sqrt(variance) * rng.standard_normal(variance.shape)
        means.append(gather(replace(table, radiance=drawn, variance=variance), 0.0).reflected)
    cells = gather(replace(table, variance=variance), 0.0)
    predicted = cells.noise / cells.count[:, None]
    ratio = np.var(means, axis=0) / predicted
    assert abs(np.median(ratio) - 1) < 0.02
    assert np.all(np.abs(ratio - 1) < 0.6)  # five standard errors of 300 draws are 0.41


def test_pixel_variance_of_dark_and_bright_pixels() -> None:
    """Stray light dominates in black parts, the proportional error in bright ones; each term is
    independent of the unit of the photo."""
    radiance = np.array([[0.0] * 3, [1.0] * 3])
    bright = np.ones((2, 1))
    found = pixel_variance(np.zeros((2, 3)), radiance, bright)
    assert np.allclose(np.sqrt(found[0]), 0.004) and np.all(found[1] > 10 * found[0])
    scaled = pixel_variance(np.zeros((2, 3)), 7 * radiance, 7 * bright)
    assert np.allclose(scaled, 49 * found)


def test_bright_parts_belong_to_each_photo() -> None:
    photo = np.repeat([0, 2], 1000)
    radiance = np.concatenate([np.linspace(0, 1, 1000), np.linspace(0, 10, 1000)])
    assert np.allclose(bright_parts(radiance, photo), [0.9, 0, 9])


def test_basis_error_grows_near_black_only() -> None:
    level = np.array([1e-3, 1e-2, 1.0])
    found = np.sqrt(basis_variance(level))
    assert found[0] > 1 and np.allclose(found[1:], 0.15, rtol=0.25)
