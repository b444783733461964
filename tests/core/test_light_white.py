"""Irradiance from a white target: E = π L / (R n·l) for a Lambertian plane of reflectance R."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.light.white import irradiance_from_white
from patina.core.scan import Camera, Pose

WIDTH, HEIGHT = 80, 60
CAMERA = Camera(
    "c", WIDTH, HEIGHT, "SIMPLE_PINHOLE", (90.0, 40.0, 30.0), Pose(np.eye(3), np.zeros(3))
)
NORMAL = np.array([0.2, -0.1, -1.0])  # faces the camera, which looks along +z
LIGHT = np.array([0.5, -0.6, -0.8])
CORNERS = np.array([[20.0, 12], [60, 12], [60, 48], [20, 48]])
TRUE_IRRADIANCE = np.array([3.0, 2.0, 1.0])


def target_photo(rho=0.9, noise=0.0, gradient=0.0, seed=0) -> np.ndarray:
    """A photo of a Lambertian plane of reflectance ``rho`` on black, under TRUE_IRRADIANCE."""
    cosine = NORMAL @ LIGHT / np.linalg.norm(NORMAL) / np.linalg.norm(LIGHT)
    pixels = np.zeros((HEIGHT, WIDTH, 3))
    x = np.linspace(-0.5, 0.5, 40)
    pixels[12:48, 20:60] = (
        TRUE_IRRADIANCE * rho * cosine / np.pi * (1 + gradient * x[None, :, None])
    )
    pixels *= 1 + noise * np.random.default_rng(seed).standard_normal(pixels.shape)
    return pixels


def test_irradiance_of_a_lambertian_target_is_recovered():
    found = irradiance_from_white(target_photo(), CAMERA, CORNERS, 0.9, NORMAL, LIGHT)
    assert found.irradiance == pytest.approx(TRUE_IRRADIANCE, rel=1e-9)
    assert found.notes == ()
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[15:45, 25:55] = True
    tinted = target_photo(np.array([0.9, 0.8, 0.7]))
    found = irradiance_from_white(tinted, CAMERA, mask, [0.9, 0.8, 0.7], NORMAL, LIGHT)
    assert found.irradiance == pytest.approx(TRUE_IRRADIANCE, rel=1e-9)


def test_standard_error_matches_the_spread_of_repeated_photos():
    found = [
        irradiance_from_white(target_photo(noise=0.1, seed=s), CAMERA, CORNERS, 0.9, NORMAL, LIGHT)
        for s in range(60)
    ]
    values = np.array([f.irradiance for f in found])
    errors = np.array([f.standard_error for f in found])
    assert values.mean(axis=0) == pytest.approx(TRUE_IRRADIANCE, rel=0.002)
    assert np.median(errors, axis=0) == pytest.approx(values.std(axis=0, ddof=1), rel=0.35)


def test_dust_does_not_bias_the_irradiance():
    dusty = target_photo(noise=0.02)
    dusty[20:24, 30:36] = 0.01
    dusty[40, 50] = 50.0
    found = irradiance_from_white(dusty, CAMERA, CORNERS, 0.9, NORMAL, LIGHT)
    assert found.irradiance == pytest.approx(TRUE_IRRADIANCE, rel=0.01)


def test_uneven_light_is_reported_and_measured_at_the_centre():
    found = irradiance_from_white(target_photo(gradient=0.2), CAMERA, CORNERS, 0.9, NORMAL, LIGHT)
    assert found.unevenness == pytest.approx(0.2, rel=0.05)
    assert "near" in found.notes[0]
    assert found.irradiance == pytest.approx(TRUE_IRRADIANCE, rel=0.005)
    nearly_even = irradiance_from_white(
        target_photo(gradient=0.01), CAMERA, CORNERS, 0.9, NORMAL, LIGHT
    )
    assert nearly_even.notes == ()


def test_target_without_normal_or_direction_is_assumed_to_face_the_light():
    cosine = NORMAL @ LIGHT / np.linalg.norm(NORMAL) / np.linalg.norm(LIGHT)
    for normal, light, word in ((None, LIGHT, "normal"), (NORMAL, None, "direction")):
        found = irradiance_from_white(target_photo(), CAMERA, CORNERS, 0.9, normal, light)
        assert found.irradiance == pytest.approx(TRUE_IRRADIANCE * cosine)
        assert word in found.notes[0]


def test_clipped_target_is_rejected():
    clipped = np.minimum(target_photo(noise=0.05), target_photo().max() * 0.98)
    with pytest.raises(InputError, match="clipped"):
        irradiance_from_white(clipped, CAMERA, CORNERS, 0.9, NORMAL, LIGHT)
    with pytest.raises(InputError, match="clipped"):
        irradiance_from_white(target_photo(), CAMERA, CORNERS, 0.9, NORMAL, LIGHT, saturation=0.5)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"reflectance": 0.0}, "reflectance"),
        ({"reflectance": 90}, "reflectance"),
        ({"reflectance": [0.9, 0.9]}, "reflectance"),
        ({"reflectance": float("nan")}, "reflectance"),
        ({"normal": -NORMAL}, "normal"),
        ({"normal": [0, 0, 0]}, "normal"),
        ({"normal": [0, 0, -1], "direction": [0, 0, 1]}, "normal"),
        ({"direction": [1, 2]}, "direction"),
        ({"region": np.zeros((HEIGHT, WIDTH), bool)}, "0 pixels"),
        ({"region": CORNERS[:2]}, "corners"),
        ({"region": np.array([[np.nan, 1], [2, 3], [4, 5]])}, "corner"),
        ({"region": CORNERS + 1000.0}, "0 pixels"),
        ({"pixels": np.zeros((4, 4, 3))}, "4 × 4"),
        ({"pixels": np.full((HEIGHT, WIDTH, 3), np.inf)}, "NaN"),
        ({"pixels": -target_photo(noise=0.1)}, "black"),
    ],
)
def test_invalid_targets_are_rejected(change, word):
    arguments = {
        "pixels": target_photo(noise=0.1), "camera": CAMERA, "region": CORNERS, "reflectance": 0.9,
        "normal": NORMAL, "direction": LIGHT, **change,
    }  # fmt: skip
    with pytest.raises(InputError, match=word):
        irradiance_from_white(**arguments)


corners = st.lists(st.tuples(st.floats(-20, 100), st.floats(-20, 100)), min_size=1, max_size=6)


@given(corners, st.floats(allow_nan=True), st.tuples(st.floats(), st.floats(), st.floats()))
@settings(max_examples=150, deadline=None)
@example([(20.0, 12.0), (60.0, 12.0), (20.0, 48.0), (60.0, 48.0)], 0.5, (0.0, 0.0, -1e308))
def test_any_polygon_gives_an_irradiance_or_an_input_error(polygon, reflectance, normal):
    try:
        found = irradiance_from_white(
            target_photo(noise=0.1), CAMERA, np.array(polygon), reflectance, normal, LIGHT
        )
    except InputError:
        return
    assert (found.irradiance >= 0).all()


@given(st.floats(5, 30), st.floats(5, 20))
@settings(max_examples=60, deadline=None)
def test_polygon_mask_has_the_area_of_the_polygon(half_width, half_height):
    from patina.core.light.white import _polygon

    rhombus = np.array(
        [[40 - half_width, 30.3], [40.2, 30.3 - half_height], [40 + half_width, 30.3],
         [40.2, 30.3 + half_height]]
    )  # fmt: skip
    count = _polygon(rhombus, (HEIGHT, WIDTH)).sum()
    assert count == pytest.approx(
        2 * half_width * half_height, abs=0.5 * (half_width + half_height)
    )
