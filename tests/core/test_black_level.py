"""Lifted blacks are in the background too, which ambient light on the object is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.diagnose.effects.black_level import BOUND, TOLERANCE, BlackLevel
from patina.core.diagnose.pixels.background import background_radiance
from patina.core.geometry.cover import ROWS
from tests.make_lit_ball import lit_ball

LEVEL = np.array([0.004, 0.006, 0.008], np.float32)
HEIGHT, WIDTH = 5 * ROWS + 3, 120
MESH = np.tile([[40, 80]], (6, 1))  # columns that may show the mesh


def photo(background) -> np.ndarray:
    """A bright object before a background, with noise of a hundredth."""
    rng = np.random.default_rng(1)
    out = np.full((HEIGHT, WIDTH, 3), background, np.float32)
    out[:, 40:80] = 0.5
    return np.asarray(out * (1 + 0.01 * rng.standard_normal(out.shape)), np.float32)


def with_background(*levels):
    """The lit ball, of which each photo has one of these backgrounds."""
    context = lit_ball(0)
    each = np.asarray(levels, np.float32)[context.pixels.photo % len(levels)]
    return replace(context, pixels=replace(context.pixels, background=each))


def test_background_is_what_cannot_show_the_mesh():
    assert background_radiance(photo(LEVEL), MESH) == pytest.approx(LEVEL, rel=0.03)


def test_a_table_in_the_background_does_not_matter():
    image = photo(LEVEL)
    image[HEIGHT // 2 :, 80:] = 0.3
    assert background_radiance(image, MESH) == pytest.approx(LEVEL, rel=0.03)


@pytest.mark.parametrize("columns", [MESH, np.tile([[0, WIDTH]], (6, 1))])
def test_a_photo_that_is_cut_out_or_full_has_no_background(columns):
    assert np.isnan(background_radiance(photo([0.0] * 3), columns)).all()


def test_no_pixel_is_darker_than_the_black_level():
    found = BlackLevel.of(with_background(LEVEL, 2 * LEVEL))
    assert found.parameters.high * found.white == pytest.approx((1 + TOLERANCE) * LEVEL)
    assert np.all(found.parameters.low == -BOUND)
    assert np.all(BlackLevel.of(lit_ball(0)).parameters.high == BOUND)


@pytest.mark.parametrize(
    ("backgrounds", "shown"),
    [
        ((LEVEL,), True),
        ((0.9 * LEVEL, 1.1 * LEVEL), True),
        ((LEVEL, 2 * LEVEL), False),  # a wall that one lamp lights
        ((3 * LEVEL,), False),
        ((np.full(3, np.nan),), False),
    ],
)
def test_a_background_as_bright_as_the_level_in_every_photo_shows_it(backgrounds, shown):
    found = BlackLevel.of(with_background(*backgrounds))
    assert found.is_shown(LEVEL / found.white) == shown
    assert not found.is_shown(np.zeros(3))
