"""Lifted blacks and glare in the lens are in the background too; light on the object is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.diagnose.effects.base.shown_by_background import TOLERANCE
from patina.core.diagnose.effects.black_level import BOUND, BlackLevel
from patina.core.diagnose.effects.veiling_glare import VeilingGlare
from patina.core.diagnose.pixels.background import dark_background
from patina.core.diagnose.pixels.neighbourhood import Veil
from patina.core.geometry.cover import ROWS
from tests.make_lit_ball import lit_ball

LEVEL = np.array([0.004, 0.006, 0.008], np.float32)
HEIGHT, WIDTH = 5 * ROWS + 3, 120
MESH = np.tile([[40, 80]], (6, 1))  # columns that may show the mesh
NO_BACKGROUND = np.full(3, np.nan)
VEIL = np.array([0.05, 0.1])[:, None] * np.ones(3)  # of the first photo, around and even
PART = 0.08  # of the light that scatters in the lens


def photo(background) -> np.ndarray:
    """A bright object before a background, with noise of a hundredth."""
    rng = np.random.default_rng(1)
    out = np.full((HEIGHT, WIDTH, 3), background, np.float32)
    out[:, 40:80] = 0.5
    return np.asarray(out * (1 + 0.01 * rng.standard_normal(out.shape)), np.float32)


def with_background(*levels, veils=(VEIL,)):
    """The lit ball, of which each photo has one of these backgrounds and veils."""
    context = lit_ball(0)
    photo = context.pixels.photo
    level = np.asarray(levels, np.float32)[photo % len(levels)]
    veil = np.asarray(veils, np.float32)[photo % len(veils)]
    background = np.concatenate([level[:, None], veil], axis=1)
    return replace(context, pixels=replace(context.pixels, background=background))


def found_in(image: np.ndarray, columns: np.ndarray) -> np.ndarray:
    return dark_background(image, columns, Veil.of(image))


def test_background_is_what_cannot_show_the_mesh():
    assert found_in(photo(LEVEL), MESH)[0] == pytest.approx(LEVEL, rel=0.03)


def test_veil_of_the_background_is_that_of_its_darkest_part():
    """Far from the object, where the blur of the photo is below the photo's mean."""
    image = photo(LEVEL)
    image[:, :40] *= 2
    around, even = found_in(image, MESH)[1:]
    assert even == pytest.approx(image.mean(axis=(0, 1)), rel=1e-5)
    row, column = np.mgrid[:HEIGHT, 80:WIDTH].reshape(2, -1)
    assert around == pytest.approx(Veil.of(image).at(row, column)[:, 0].mean(axis=0), rel=0.1)


def test_a_table_in_the_background_does_not_matter():
    image = photo(LEVEL)
    image[HEIGHT // 2 :, 80:] = 0.3
    assert found_in(image, MESH)[0] == pytest.approx(LEVEL, rel=0.03)


@pytest.mark.parametrize("columns", [MESH, np.tile([[0, WIDTH]], (6, 1))])
def test_a_photo_that_is_cut_out_or_full_has_no_background(columns):
    assert np.isnan(found_in(photo([0.0] * 3), columns)).all()


def test_zeros_in_a_background_that_is_not_cut_out_are_black():
    image = photo(LEVEL)
    image[: HEIGHT // 3, 80:] = 0
    assert found_in(image, MESH)[0] == pytest.approx([0, 0, 0])


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
        ((LEVEL, 2 * LEVEL), True),  # the lamp lights a wall in half of the photos
        ((LEVEL, 2 * LEVEL, 3 * LEVEL), False),
        ((LEVEL, 0.5 * LEVEL), False),
        ((3 * LEVEL,), False),
        ((NO_BACKGROUND,), False),
    ],
)
def test_a_background_as_bright_as_the_level_in_half_of_the_photos_shows_it(backgrounds, shown):
    found = BlackLevel.of(with_background(*backgrounds))
    assert found.is_shown(LEVEL / found.white) == shown
    assert not found.is_shown(np.zeros(3))


def test_glare_adds_its_veil_to_the_background():
    dim, bright = VEIL, 3 * VEIL
    levels = [PART * 0.5 * (veil[0] + veil[1]) for veil in (dim, bright)]
    found = VeilingGlare.of(with_background(*levels, veils=(dim, bright)))
    assert found.in_background(np.array([PART, 0.0]))[:2] == pytest.approx(np.array(levels))
    assert found.is_shown(np.array([PART, 0.0]))
    assert not found.is_shown(np.array([2 * PART, 0.0]))
    assert found.parameters.high[0] == pytest.approx((1 + TOLERANCE) * PART)


def test_a_constant_in_all_photos_is_not_shown_as_glare():
    """Glare grows with the light in a photo."""
    found = VeilingGlare.of(with_background(LEVEL, veils=(VEIL, 2 * VEIL, 4 * VEIL)))
    sizes = np.geomspace(1e-3, 0.6, 50)
    assert not any(found.is_shown(np.array([size, 0.0])) for size in sizes)


def test_without_a_background_glare_is_bounded_by_its_definition():
    assert VeilingGlare.of(lit_ball(0)).parameters.high[0] == 0.6
