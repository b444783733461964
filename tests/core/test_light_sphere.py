"""Light from a mirror sphere, on images of a sphere that are ray traced analytically here.

Realistic images (rim, reflected table) are rendered by Cycles in tests/wheel/test_sphere_light.py;
photos of chrome spheres are tested in test_light_sphere_photos.py.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.light.sphere import light_from_sphere, relative_strengths
from patina.core.light.sphere_outline import Circle, fit_sphere
from patina.core.scan import Camera, Pose

WIDTH, HEIGHT = 320, 240
# a camera that is not aligned with the axes of the scan
FORWARD = np.array([0.36, 0.48, 0.8])
RIGHT = np.cross(FORWARD, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(FORWARD, [0.0, 0.0, 1.0]))
ROTATION = np.stack([RIGHT, np.cross(FORWARD, RIGHT), FORWARD])
CAMERA_CENTRE = np.array([3.0, -2.0, 1.0])
POSE = Pose(ROTATION, -ROTATION @ CAMERA_CENTRE)
WIDE = Camera("wide", WIDTH, HEIGHT, "SIMPLE_PINHOLE", (230.0, 160.0, 120.0), POSE)
CAMERAS = {
    "wide": WIDE,
    "distorted": Camera(
        "d", WIDTH, HEIGHT, "OPENCV", (230, 231, 158, 121, -0.2, 0.05, 1e-3, -2e-3), POSE
    ),
    "fisheye": Camera(
        "f", WIDTH, HEIGHT, "OPENCV_FISHEYE", (170, 170, 160, 120, 0.01, 0, 0, 0), POSE
    ),
    "orthographic": Camera("o", WIDTH, HEIGHT, "ORTHOGRAPHIC", (60.0, 60.0, 160.0, 120.0), POSE),
}
LIGHTS = [(0.2, -0.4, -0.9), (-0.7, -0.2, -0.4), (0.1, 0.6, -0.5)]  # in the camera's frame


def angle(a, b) -> float:
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def scene(camera: Camera, place=(-0.9, 0.6, 4.0), lights=LIGHTS[:1], brightness=(1.0,), size=2.0,
          behind=0.3, per_pixel=3):  # fmt: skip
    """(pixels, mask, centre, directions) of a unit mirror sphere at ``place`` (camera frame), lit
    by discs of angular radius ``size`` degrees, before a uniform wall that it does not reflect."""
    centre = ROTATION.T @ np.array(place) + camera.pose.centre
    directions = [ROTATION.T @ np.array(v) / np.linalg.norm(v) for v in lights]
    subpixel = (np.arange(per_pixel) + 0.5) / per_pixel
    y, x = np.meshgrid(
        (np.arange(HEIGHT)[:, None] + subpixel).ravel(),
        (np.arange(WIDTH)[:, None] + subpixel).ravel(),
        indexing="ij",
    )  # fmt: skip
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)
    rays = camera.rays(pixels)
    starts = np.broadcast_to(camera.ray_starts(pixels), rays.shape)
    to_centre = centre - starts
    along = (to_centre * rays).sum(axis=1)
    inside = along**2 - (to_centre**2).sum(axis=1) + 1
    hit = inside > 0
    distance = along - np.sqrt(np.maximum(inside, 0))
    normals = starts + distance[:, None] * rays - centre
    mirrored = rays - 2 * (rays * normals).sum(axis=1, keepdims=True) * normals
    image = np.full(len(rays), behind)
    image[hit] = 0.02
    for direction, factor in zip(directions, brightness, strict=True):
        lit = hit & (mirrored @ direction > np.cos(np.radians(size)))
        image[lit] = 50.0 * factor
    shape = (HEIGHT, per_pixel, WIDTH, per_pixel)
    grey = image.reshape(shape).mean(axis=(1, 3))
    mask = hit.reshape(shape).mean(axis=(1, 3))
    return np.repeat(grey[..., None], 3, axis=2), mask, centre, directions


@pytest.mark.parametrize("light", range(len(LIGHTS)))
@pytest.mark.parametrize("name", CAMERAS)
def test_light_direction_for_every_lens_model(name, light):
    camera = CAMERAS[name]
    pixels, mask, centre, (direction,) = scene(camera, lights=[LIGHTS[light]])
    found = light_from_sphere(pixels, camera, mask)
    assert angle(found.direction, direction) < 0.25
    assert found.highlights[0].angular_radius == pytest.approx(np.radians(2.0), rel=0.2)
    if name != "orthographic":
        to_centre = centre - camera.pose.centre
        assert angle(found.sphere.centre - camera.pose.centre, to_centre) < 0.05
        radii = np.linalg.norm(found.sphere.centre - camera.pose.centre)
        assert radii == pytest.approx(np.linalg.norm(to_centre), rel=0.005)
    else:
        assert found.sphere.radius == pytest.approx(1.0, rel=0.005)


def test_orthographic_formula_is_inaccurate_for_perspective_cameras():
    """The orthographic formula l = 2 (n·v) n − v, with n from the circle and v the camera's axis
    (as in PSBox), is wrong by more than 5° for a wide-angle camera."""
    pixels, mask, _, (direction,) = scene(WIDE)
    found = light_from_sphere(pixels, WIDE, mask)
    rows, columns = np.nonzero(mask > 0.5)
    outline_centre = np.array([columns.mean(), rows.mean()]) + 0.5
    radius = np.sqrt((mask > 0.5).sum() / np.pi)
    x, y = (np.array(found.highlights[0].pixel) - outline_centre) / radius
    normal = np.array([x, y, -np.sqrt(1 - x * x - y * y)])
    shortcut = 2 * -normal[2] * normal - np.array([0, 0, -1.0])
    assert angle(ROTATION.T @ shortcut, direction) > 5.0


@pytest.mark.parametrize("name", CAMERAS)
def test_rough_circle_is_refined(name):
    """The rim is a plain step here, since the sphere does not reflect the wall; the rim model does
    not describe that, which leaves an error of 0.2 pixels."""
    camera = CAMERAS[name]
    pixels, mask, _, (direction,) = scene(camera)
    rows, columns = np.nonzero(mask > 0.5)
    radius = float(np.sqrt((mask > 0.5).sum() / np.pi))
    rough_circle = Circle(
        (columns.mean() + 0.06 * radius, rows.mean() - 0.05 * radius), 1.06 * radius
    )
    found = light_from_sphere(pixels, camera, rough_circle)
    assert found.refined
    assert angle(found.direction, direction) < 0.5
    unrefined = light_from_sphere(pixels, camera, rough_circle, refine=False)
    assert not unrefined.refined
    assert angle(unrefined.direction, direction) > 2.0


def test_sphere_is_detected_without_an_outline():
    pixels, _, _, (direction,) = scene(WIDE)
    found = light_from_sphere(pixels, WIDE)
    assert angle(found.direction, direction) < 0.5


def test_invisible_outline_is_used_without_refinement():
    pixels, mask, _, (direction,) = scene(WIDE, behind=0.02)
    edge = np.argwhere(mask > 0.5)[:, ::-1] + 0.5
    outline_centre = 0.5 * (edge.min(axis=0) + edge.max(axis=0))
    circle = Circle(tuple(outline_centre), float(np.sqrt((mask > 0.5).sum() / np.pi)))
    found = light_from_sphere(pixels, WIDE, circle)
    assert not found.refined
    assert "used without refinement" in found.notes[0]
    assert angle(found.direction, direction) < 2.0


def test_all_highlights_are_reported_and_the_strongest_is_used():
    pixels, mask, _, directions = scene(WIDE, lights=LIGHTS, brightness=(0.4, 1.0, 0.05))
    found = light_from_sphere(pixels, WIDE, mask)
    assert angle(found.direction, directions[1]) < 0.25
    assert len(found.highlights) >= 2
    assert angle(found.highlights[1].direction, directions[0]) < 0.25
    assert found.highlights[1].strength == pytest.approx(0.4, rel=0.1)
    assert "2 highlights" in found.notes[0] and "40 %" in found.notes[0]
    single_light = light_from_sphere(*scene(WIDE)[:1], WIDE, mask)
    assert single_light.notes == ()


def test_irradiance_is_radiance_times_solid_angle_of_the_light():
    """A disc of radiance 50 and radius 2° gives E = 50 · 2π (1 − cos 2°) from every direction."""
    lights = []
    for direction in LIGHTS:
        pixels, mask, _, _ = scene(WIDE, lights=[direction])
        lights.append(light_from_sphere(pixels, WIDE, mask))
        expected = 50 * 2 * np.pi * (1 - np.cos(np.radians(2.0)))
        assert lights[-1].highlights[0].irradiance == pytest.approx(np.full(3, expected), rel=0.03)
    assert relative_strengths(lights) == pytest.approx(np.ones((3, 3)), abs=0.04)


def test_clipped_highlight_gives_a_direction_but_no_irradiance():
    pixels, mask, _, (direction,) = scene(WIDE, size=4.0)
    clipped = np.minimum(pixels, 1.0)
    found = light_from_sphere(clipped, WIDE, mask)
    assert found.highlights[0].clipped and found.highlights[0].irradiance is None
    # pixels half covered by the edge of the light are clipped too
    assert angle(found.direction, direction) < 0.6
    assert any("clipped" in note for note in found.notes)
    assert relative_strengths([found, found]) is None
    unclipped = light_from_sphere(pixels, WIDE, mask, saturation=1e6)
    assert not unclipped.highlights[0].clipped
    glossy = light_from_sphere(pixels, WIDE, mask, surface="glossy", saturation=1e6)
    assert glossy.highlights[0].irradiance is None
    assert angle(glossy.direction, direction) < 0.4


def test_mask_with_a_stand_and_specks():
    pixels, mask, _, (direction,) = scene(WIDE)
    rows, columns = np.nonzero(mask > 0.5)
    dirty_mask = mask.copy()
    dirty_mask[rows.max() - 4 :, int(columns.mean()) - 10 : int(columns.mean()) + 10] = 1
    dirty_mask[5:8, 300:303] = 1
    found = light_from_sphere(pixels, WIDE, dirty_mask)
    assert angle(found.direction, direction) < 0.5


def test_stated_uncertainty_matches_errors_of_a_perturbed_outline():
    """The circle's centre and radius are perturbed by 1 pixel (standard deviation): the RMS error
    of the direction is within a factor of 2 of the stated uncertainty."""
    pixels, mask, _, _ = scene(WIDE)
    base = np.argwhere(mask > 0.5)[:, ::-1] + 0.5
    outline_centre, radius = base.mean(axis=0), float(np.sqrt(len(base) / np.pi))
    rng = np.random.default_rng(3)
    reference = light_from_sphere(pixels, WIDE, Circle(tuple(outline_centre), radius), refine=False)
    errors, stated = [], []
    for _ in range(40):
        x, y, radius_change = rng.standard_normal(3)
        circle = Circle((outline_centre[0] + x, outline_centre[1] + y), radius + radius_change)
        found = light_from_sphere(pixels, WIDE, circle, refine=False)
        errors.append(np.radians(angle(found.direction, reference.direction)))
        stated.append(found.uncertainty)
    ratio = np.sqrt(np.mean(np.square(errors))) / np.mean(stated)
    assert 0.5 < ratio < 2.0


@given(
    st.floats(-1.5, 1.5),
    st.floats(-1.0, 1.0),
    st.floats(2.5, 40.0),
    st.sampled_from(sorted(CAMERAS)),
)
@settings(max_examples=60, deadline=None)
def test_sphere_fit_to_exact_outline_points_is_exact(x, y, z, name):
    camera = CAMERAS[name]
    place = np.array([x * z / 4, y * z / 4, z])
    centre = ROTATION.T @ place + camera.pose.centre
    if camera.orthographic:
        centre = ROTATION.T @ np.array([x, y, z]) + camera.pose.centre
        axis, ring_at, ring_radius = ROTATION[2], centre, 1.0
    else:
        axis = (camera.pose.centre - centre) / np.linalg.norm(place)
        ring_at = centre + axis / np.linalg.norm(place)
        ring_radius = np.sqrt(1 - 1 / (place @ place))
    perpendicular = np.cross(axis, [0.3, 0.1, 0.9])
    perpendicular /= np.linalg.norm(perpendicular)
    angles = np.linspace(0, 2 * np.pi, 25)[:-1, None]
    ring = np.cos(angles) * perpendicular + np.sin(angles) * np.cross(axis, perpendicular)
    pixels = camera.project(ring_at + ring_radius * ring)
    sphere = fit_sphere(camera, pixels)
    if camera.orthographic:
        offset = sphere.centre - centre
        assert offset - (offset @ axis) * axis == pytest.approx(np.zeros(3), abs=1e-6)
        assert sphere.radius == pytest.approx(1.0, rel=1e-6)
    else:
        expected = centre - camera.pose.centre
        assert sphere.centre - camera.pose.centre == pytest.approx(expected, rel=1e-4, abs=1e-3)


BLACK = np.zeros((HEIGHT, WIDTH, 3))
SPHERE_MASK = scene(WIDE)[1]


@pytest.mark.parametrize(
    ("pixels", "outline", "word"),
    [
        (BLACK[:100], SPHERE_MASK, "320 × 100"),
        (BLACK, SPHERE_MASK, "no highlight"),
        (BLACK, None, "found no sphere"),
        (BLACK, SPHERE_MASK[:, :50], "50 × 240"),
        (BLACK, np.zeros_like(SPHERE_MASK), "has 0 points"),
        (BLACK, np.ones_like(SPHERE_MASK), "has 0 points"),
        (BLACK, SPHERE_MASK * np.nan, "NaN"),
        (BLACK * np.nan, SPHERE_MASK, "NaN"),
        (BLACK, np.stack([SPHERE_MASK] * 3, axis=2), "not a grey image"),
        (BLACK, Circle((100.0, 100.0), -3.0), "expected finite pixels and a positive radius"),
        (BLACK, Circle((np.nan, 100.0), 3.0), "expected finite pixels and a positive radius"),
        (BLACK, Circle((100.0, 100.0), 3.0), "pixels"),
        (BLACK, Circle((5000.0, 100.0), 60.0), "outside"),
        (BLACK, Circle((100.0, 100.0), 1e7), "sphere"),
    ],
)
def test_invalid_sphere_photos_are_rejected(pixels, outline, word):
    with pytest.raises(InputError, match=word):
        light_from_sphere(pixels, WIDE, outline)


circle_coordinate = st.floats(-500, 800)


@given(
    circle_coordinate, circle_coordinate, st.floats(-10, 2000), st.integers(0, 10_000),
    st.sampled_from(sorted(CAMERAS)), st.booleans(),
)  # fmt: skip
@settings(max_examples=25, deadline=None)
@example(160.0, 120.0, 60.0, 0, "fisheye", True)
@example(0.0, 0.0, 119.0, 1, "distorted", True)
@example(274.0, 274.0, 266.0, 0, "distorted", True)
def test_any_circle_gives_a_direction_or_an_input_error(x, y, radius, seed, name, noise):
    pixels = np.zeros((HEIGHT, WIDTH, 3))
    if noise:
        pixels = np.random.default_rng(seed).gamma(1.0, 1.0, (HEIGHT, WIDTH, 3))
    else:
        pixels[seed % HEIGHT, seed % WIDTH] = 1.0
    start = time.process_time()
    try:
        found = light_from_sphere(pixels, CAMERAS[name], Circle((x, y), radius))
    except InputError:
        return
    finally:
        assert time.process_time() - start < 5.0
    assert np.linalg.norm(found.direction) == pytest.approx(1.0)
    assert np.isfinite(found.uncertainty)
