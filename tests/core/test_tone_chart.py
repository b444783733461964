"""Tone curve from a photo of a chart: known curves are recovered, wrong corners are rejected."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.calibrate.chart import COLORCHECKER_GREYS, chart_tone
from patina.core.errors import PatinaError
from patina.core.photo.transfer import SRGB

GREYS = np.array(COLORCHECKER_GREYS)  # white to black
CORNERS = np.array([[60, 40], [300, 55], [290, 190], [50, 205]], float)  # an oblique view


def srgb(linear):
    """The sRGB encoding, implemented independently of the code under test."""
    linear = np.asarray(linear, float)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def chart_photo(encode, noise=0.0, balance=(1, 1, 1)):
    """A photo of a chart of 4 × 6 patches, mapped by the homography of its corners."""
    image = np.full((240, 360, 3), 0.3)
    rng = np.random.default_rng(0)
    rows, columns = np.indices((240, 360)) + 0.5
    # homography from the photo to the 5 × 3 lattice of patch centres
    lattice = np.array([[0, 0], [5, 0], [5, 3], [0, 3]], float)
    a, b = [], []
    for (x, y), (u, v) in zip(lattice, CORNERS, strict=True):
        a += [[u, v, 1, 0, 0, 0, -x * u, -x * v], [0, 0, 0, u, v, 1, -y * u, -y * v]]
        b += [x, y]
    h = np.append(np.linalg.solve(np.array(a), np.array(b)), 1).reshape(3, 3)
    lattice_point = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ h.T
    x, y = (
        lattice_point[..., 0] / lattice_point[..., 2],
        lattice_point[..., 1] / lattice_point[..., 2],
    )
    column, row = np.round(x).astype(int), np.round(y).astype(int)
    in_patch = (np.abs(x - column) < 0.4) & (np.abs(y - row) < 0.4)
    grey = in_patch & (row == 3) & (column >= 0) & (column < 6)
    image[grey] = encode(GREYS[column[grey]][:, None] * np.asarray(balance))
    return np.clip(image + noise * rng.normal(size=image.shape), 0, 1)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.6, 1.6), st.floats(0.5, 0.95))
def test_known_tone_curve_is_recovered(gamma: float, white: float) -> None:
    """Encoded = sRGB(white · (ρ / ρ_white)^gamma): decoding recovers ρ at and between greys."""

    def encode_curve(rho):
        return srgb(white * (rho / GREYS[0]) ** gamma)

    found = chart_tone(chart_photo(encode_curve), CORNERS)
    rho = np.geomspace(GREYS[-1], GREYS[0], 40)
    decoded = found.transfer.decode(np.repeat(encode_curve(rho)[:, None], 3, axis=1))
    assert np.abs(decoded / rho[:, None] - 1).max() < 0.03
    assert found.gamma == pytest.approx(1 / gamma, rel=0.02)


def test_white_balance_makes_grey_patches_neutral() -> None:
    balance = np.array([0.7, 1.0, 0.8])
    found = chart_tone(chart_photo(srgb, balance=balance), CORNERS)
    decoded = found.transfer.decode(srgb(0.2 * balance)[None, None])[0, 0]
    assert np.abs(decoded / decoded.mean() - 1).max() < 0.01


def test_decoding_is_proportional_below_the_darkest_patch() -> None:
    found = chart_tone(chart_photo(srgb), CORNERS)
    dark = srgb(np.array([0.02, 0.01, 0.005]))
    decoded = found.transfer.decode(np.repeat(dark[:, None], 3, axis=1))
    assert decoded[:, 1] == pytest.approx([0.02, 0.01, 0.005], rel=0.1)


def test_noisy_grey_scale_is_decoded() -> None:
    greys = (0.05, 0.1, 0.2, 0.4, 0.8)
    image = np.full((40, 200, 3), 0.1)
    for i, grey in enumerate(greys):
        image[:, 40 * i : 40 * i + 40] = srgb(grey)
    image += np.random.default_rng(2).normal(0, 0.01, image.shape)
    found = chart_tone(image, np.array([[20.0, 20.0], [180.0, 20.0]]), greys)
    decoded = found.transfer.decode(np.repeat(srgb(np.array([0.3]))[:, None], 3, axis=1))
    assert decoded[0] == pytest.approx(0.3, rel=0.03)


def test_clipped_patches_are_excluded_and_too_few_are_rejected() -> None:
    bright = chart_tone(chart_photo(lambda rho: srgb(np.minimum(2 * rho, 1))), CORNERS)
    assert len(bright.reflectance) == 4 and "clipped" in bright.notes[0]
    with pytest.raises(PatinaError, match="neither clipped nor black"):
        chart_tone(chart_photo(lambda rho: srgb(np.minimum(20 * rho, 1))), CORNERS)


def test_wrong_corners_are_rejected() -> None:
    with pytest.raises(PatinaError, match="check its corners"):
        chart_tone(chart_photo(srgb), CORNERS[[2, 3, 0, 1]])
    with pytest.raises(PatinaError, match="outside the photo"):
        chart_tone(chart_photo(srgb), CORNERS + 200)


def test_srgb_transfer_inverts_the_encoding() -> None:
    x = np.linspace(0, 1, 50)
    assert np.abs(srgb(SRGB(x)) - x).max() < 1e-6
