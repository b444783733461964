"""Noise estimated from one photo, and exposures merged with it, against synthetic noise."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import convolve, gaussian_filter, uniform_filter

from patina.core.errors import InputError
from patina.core.noise import PhotoNoise
from patina.core.photo import (
    Photo,
    PhotoInfo,
    Transfer,
    estimate_noise,
    merge_bracket,
    read_photo,
)

HEIGHT, WIDTH = 480, 640
INFO = PhotoInfo("openexr", Transfer.named("linear"), "made")
TINT = np.array([1.0, 0.6, 0.35])


def scene(seed: int, plain: float = 0.5) -> np.ndarray:
    """(h, w, 3) light 0.02 … 0.9: shading, edges, and texture except in the part ``plain``."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    light = 0.04 + 0.6 * (x / WIDTH) ** 2 + 0.15 * np.sin(y / 130) ** 2
    frequency = np.hypot(np.fft.fftfreq(HEIGHT)[:, None], np.fft.rfftfreq(WIDTH)[None])
    frequency[0, 0] = 1
    texture = np.fft.irfft2(
        np.fft.rfft2(rng.normal(size=(HEIGHT, WIDTH))) / frequency**1.2, s=(HEIGHT, WIDTH)
    )
    where = gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), 30)
    where = np.clip((where - np.quantile(where, plain)) / where.std() * 2, 0, 1)
    light = light * np.exp(0.25 * where * texture / texture.std())
    for _ in range(15):
        top, left = rng.integers(0, HEIGHT - 60), rng.integers(0, WIDTH - 60)
        light[top : top + 50, left : left + 50] *= rng.uniform(0.4, 1.4)
    return np.clip(light, 0.02, 0.9)[..., None] * TINT


def noisy(light: np.ndarray, shot: float, read: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(1000 + seed)
    return light + rng.normal(size=light.shape) * np.sqrt(read**2 + shot * light)


def photo(pixels: np.ndarray, top: float = np.inf) -> Photo:
    pixels = np.minimum(pixels, top).astype(np.float32)
    return Photo(
        pixels, (pixels >= 0.99 * top).any(axis=2), (pixels <= 0).any(axis=2), INFO
    )  # fmt: skip


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(("shot", "read"), [(1e-4, 1e-3), (1e-3, 2e-3), (1e-5, 5e-4), (0, 3e-3)])
def test_synthetic_noise_is_recovered(seed: int, shot: float, read: float) -> None:
    """Standard deviation within 10 % at every brightness in the scene; shot and read noise within
    20 % where each makes a good part of the variance, because otherwise they cannot be separated.
    """
    light = scene(seed)
    found = estimate_noise(photo(noisy(light, shot, read, seed)))
    assert found.step == 1 and found.blocks > 200
    for channel in range(3):
        levels = np.quantile(light[..., channel], (0.1, 0.5, 0.9))
        truth = read**2 + shot * levels
        got = found.variance(np.repeat(levels[:, None], 3, axis=1))[:, channel]
        assert np.allclose(np.sqrt(got / truth), 1, atol=0.1)
        if shot * levels[2] > 2 * read**2:
            assert found.shot[channel] == pytest.approx(shot, rel=0.2)
        if read**2 > shot * levels[0]:
            assert found.read[channel] == pytest.approx(read, rel=0.2)


def test_dark_background_does_not_dominate_estimate() -> None:
    light = scene(3)
    light[:, :400] = 1e-4 * TINT
    found = estimate_noise(photo(noisy(light, 1e-3, 1e-6)))
    assert np.allclose(found.shot, 1e-3, rtol=0.2)


def test_clipped_and_black_pixels_are_ignored() -> None:
    light = scene(4)
    light[:200] = 3.0  # saturated: no noise at all
    pixels = noisy(light, 1e-3, 1e-3)
    pixels[300:, :200] = 0.0
    found = estimate_noise(photo(pixels, 1.0))
    truth = 1e-3 * 0.3 + 1e-6
    assert np.allclose(found.variance(np.full(3, 0.3)), truth, rtol=0.2)


def test_correlated_noise_of_demosaiced_photo_is_recovered() -> None:
    light = scene(5)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    red, blue = (y % 2 == 0) & (x % 2 == 0), (y % 2 == 1) & (x % 2 == 1)
    full = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]]) / 4
    cross = np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4
    kernels = ((red, full), (~(red | blue), cross), (blue, full))

    def demosaiced(pixels):
        return np.stack(
            [convolve(pixels[..., c] * at, k) for c, (at, k) in enumerate(kernels)], axis=2
        )

    pixels = demosaiced(noisy(light, 3e-4, 1e-3))
    truth = (pixels - demosaiced(light)).std(axis=(0, 1))
    found = estimate_noise(photo(pixels))
    assert found.step >= 2
    assert np.allclose(np.sqrt(found.variance(light).mean(axis=(0, 1))) / truth, 1, atol=0.15)


@pytest.mark.parametrize("shape", [(5, 5), (40, 3), (20, 300), (100, 100)])
@pytest.mark.parametrize("value", [0.0, 0.3, np.inf])
def test_flat_photos_fall_back_to_quantisation_noise(shape: tuple[int, int], value: float) -> None:
    pixels = np.full((*shape, 3), min(value, 1.0))
    info = PhotoInfo("png", Transfer.named("srgb"), "made", levels=256)
    lost = np.full(shape, value == np.inf)
    found = estimate_noise(Photo(pixels.astype(np.float32), lost, pixels[..., 0] == 0, info))
    assert found.blocks == 0
    # rounding to the 256 codes of the sRGB curve causes this much by itself
    step = 1 / 255 * (2.4 / 1.055) * ((0.5 + 0.055) / 1.055) ** 1.4
    half = ((0.5 + 0.055) / 1.055) ** 2.4
    assert np.allclose(found.variance(np.full(3, half)), step**2 / 12, rtol=0.02)


def shot_of_channel_difference(pixels: np.ndarray) -> float:
    """Red and green of one material differ by a locally constant factor: the residual of the high
    pass of their difference is noise, whatever the texture. Pure shot noise is assumed.
    """

    def high(a):
        d = a[:-2] - 2 * a[1:-1] + a[2:]
        return (d[:, :-2] - 2 * d[:, 1:-1] + d[:, 2:]) / 6

    red, green = pixels[..., 0], pixels[..., 1]
    mean = uniform_filter(red, 9)
    mean = np.maximum(mean, 1e-9)
    factor = mean / np.maximum(uniform_filter(green, 9), 1e-9)
    lit = uniform_filter((pixels > 0).all(axis=2).astype(float), 15)[1:-1, 1:-1] > 0.999
    mean, factor = mean[1:-1, 1:-1], factor[1:-1, 1:-1]
    rest = (high(red) - factor * high(green)) ** 2 / (mean * (1 + factor))
    return float(np.median(rest[lit]) / 0.4549)  # median of chi-squared with one degree of freedom


@pytest.mark.parametrize("name", ["bunny_red/lit/00", "bunny_bronze/lit/00", "bunny_fabric/lit/01"])
def test_noise_of_a_scan(shared: Path, name: str) -> None:
    found = estimate_noise(read_photo(shared / "data/scans" / f"{name}.exr"))
    pixels = read_photo(shared / "data/scans" / f"{name}.exr").radiance.astype(float)
    assert np.allclose(found.shot, shot_of_channel_difference(pixels), rtol=0.15)


SHOT, READ, TOP = 1e-4, 2e-3, 1.0
EXPOSURES = (0.25, 1.0, 0.0625)
NOISE = PhotoNoise(np.full(3, SHOT), np.full(3, READ))


def bracket(light: np.ndarray, exposures=EXPOSURES) -> list[Photo]:
    """As a camera: clipped at 1 and, as in most files, at 0."""
    return [
        photo(np.maximum(noisy(light * e, SHOT, READ, i), 0), TOP) for i, e in enumerate(exposures)
    ]


def test_merged_radiance_and_its_variance() -> None:
    light = scene(6) * 8  # up to 7: seven times the clipping level of the longest exposure
    merged = merge_bracket(bracket(light), EXPOSURES, [NOISE] * 3)
    assert merged.valid.all() and merged.warnings == ()
    z = (merged.radiance - light) / np.sqrt(merged.variance)
    for low, high in ((0, 0.3), (0.3, 1), (1, 3), (3, 10)):
        part = z[(light > low) & (light <= high)]
        # two selection effects within the range: clipping of noise at the top; both are below a
        # tenth of sigma
        assert abs(part.mean()) < 0.1 and part.std() == pytest.approx(1, abs=0.05)
    assert merged.factors == pytest.approx((1, 1, 1), abs=0.003)
    assert max(merged.moved) < 1e-3


def test_merging_beats_the_best_single_exposure() -> None:
    light = scene(7) * 0.9
    exposures = (1.0, 0.8, 0.6)
    shots = bracket(light, exposures)
    merged = merge_bracket(shots, exposures, [NOISE] * 3)
    ideal = 1 / sum(e**2 / (READ**2 + SHOT * light * e) for e in exposures)
    assert np.mean((merged.radiance - light) ** 2) == pytest.approx(ideal.mean(), rel=0.05)
    assert np.mean((shots[0].radiance - light) ** 2) > 1.5 * ideal.mean()


def test_missing_noise_model_is_estimated() -> None:
    light = scene(8) * 4
    merged = merge_bracket(bracket(light), EXPOSURES)
    z = (merged.radiance - light) / np.sqrt(merged.variance)
    assert z.std() == pytest.approx(1, abs=0.1)


def test_wrong_exposures_are_measured_and_reported() -> None:
    light = scene(9) * 4
    true = (0.25 * 1.08, 1.0, 0.0625 * 0.9)
    merged = merge_bracket(bracket(light, true), EXPOSURES, [NOISE] * 3)
    assert merged.factors == pytest.approx((1.08, 1, 0.9), rel=0.005)
    assert len(merged.warnings) == 2 and "+8 %" in merged.warnings[0]
    corrected = [e * f for e, f in zip(EXPOSURES, merged.factors, strict=True)]
    again = merge_bracket(bracket(light, true), corrected, [NOISE] * 3)
    assert again.warnings == ()
    assert np.median(again.radiance / light) == pytest.approx(1, abs=0.002)


def test_movement_between_exposures_is_reported() -> None:
    light = scene(10) * 4
    shots = bracket(light)
    moved = Photo(*(np.roll(a, 12, axis=1) for a in (shots[0].radiance, shots[0].clipped,
                                                    shots[0].black)), INFO)  # fmt: skip
    merged = merge_bracket([moved, *shots[1:]], EXPOSURES, [NOISE] * 3, ["a", "b", "c"])
    assert merged.moved[0] > 0.03
    assert any(w.startswith("a ") and "moved" in w for w in merged.warnings)


def test_pixels_clipped_in_all_exposures_are_invalid() -> None:
    light = scene(11)
    light[10:20, 30:50] = 100.0
    merged = merge_bracket(bracket(light), EXPOSURES, [NOISE] * 3)
    truth = np.ones((HEIGHT, WIDTH), bool)
    truth[10:20, 30:50] = False
    assert np.array_equal(merged.valid, truth)
    assert (merged.radiance[~truth] == 0).all() and np.isinf(merged.variance[~truth]).all()
    assert np.isfinite(merged.variance[truth]).all()


def test_single_exposure_is_unchanged() -> None:
    light = scene(12)
    (shot,) = bracket(light, [0.5])
    merged = merge_bracket([shot], [0.5], [NOISE])
    assert np.allclose(merged.radiance, shot.radiance / 0.5, atol=1e-6)
    assert np.allclose(merged.variance, NOISE.variance(shot.radiance) / 0.25, rtol=1e-3)


def test_exposures_without_common_range_give_a_warning() -> None:
    light = scene(13)
    merged = merge_bracket(bracket(light, (1.0, 1e-6)), (1.0, 1e-6), [NOISE] * 2)
    assert math.isnan(merged.factors[1]) and "could not be checked" in merged.warnings[0]
    assert np.isfinite(merged.radiance).all()


@pytest.mark.parametrize("exposures", [(1.0,), (1.0, 0.0), (1.0, -1.0), (1.0, math.nan)])
def test_impossible_exposures_are_rejected(exposures) -> None:
    shots = bracket(scene(14), (1.0, 0.5))
    with pytest.raises(InputError, match="exposure"):
        merge_bracket(shots, exposures)
    with pytest.raises(InputError, match="size"):
        merge_bracket([shots[0], photo(np.ones((4, 4, 3)))], (1.0, 0.5), [NOISE] * 2)


def test_memory_does_not_grow_with_photo_count() -> None:
    light = scene(15).astype(np.float32)

    def reader(exposure: float) -> Callable[[], Photo]:
        return lambda: photo(light * np.float32(exposure), TOP)

    peaks = []
    for count in (3, 12):
        exposures = np.geomspace(1, 0.1, count)
        tracemalloc.start()
        merge_bracket([reader(e) for e in exposures], exposures.tolist(), [NOISE] * count)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]
