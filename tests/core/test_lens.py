"""Metashape lens models, compared with independent formulas, COLMAP's models and round trips."""

from __future__ import annotations

import math
from dataclasses import astuple

import numpy as np
import pycolmap
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.scan.camera import Camera, Pose
from patina.core.scan.lens import make_lens, resized_parameters
from patina.core.scan.lenses.fold import beyond_fold, fold_radius
from patina.core.scan.lenses.metashape_distortion import Calibration
from patina.core.scan.lenses.metashape_lens import colmap_model, metashape_lens

WIDTH, HEIGHT = 4000, 3000
FRAME, FISHEYE, EQUISOLID = "METASHAPE_FRAME", "METASHAPE_FISHEYE", "METASHAPE_EQUISOLID"
EXACT_PIXELS = 1e-3


def scalar_projection(model, p, X, Y, Z):
    """The formulas of Metashape's manual for one point, independent of the code under test."""
    x, y = X / Z, Y / Z
    if model != FRAME:
        R = math.hypot(x, y)
        theta = math.atan(R)
        distorted_radius = theta if model == FISHEYE else 2 * math.sin(theta / 2)
        x, y = (x * distorted_radius / R, y * distorted_radius / R) if R else (x, y)
    r = math.sqrt(x * x + y * y)
    radial = 1 + p.k1 * r**2 + p.k2 * r**4 + p.k3 * r**6 + p.k4 * r**8
    more = 1 + p.p3 * r**2 + p.p4 * r**4
    x1 = x * radial + (p.p1 * (r**2 + 2 * x**2) + 2 * p.p2 * x * y) * more
    y1 = y * radial + (p.p2 * (r**2 + 2 * y**2) + 2 * p.p1 * x * y) * more
    return p.cx + x1 * p.f + x1 * p.b1 + y1 * p.b2, p.cy + y1 * p.f


def bounded_float(low, high):
    return st.floats(low, high, allow_nan=False)


@st.composite
def calibrations(draw, model, full=True):
    """Realistic lenses: the distortion at the image corner is small compared with the image."""
    f = draw(bounded_float(0.6, 4.0)) * WIDTH
    corner = math.hypot(WIDTH, HEIGHT) / 2 / f  # undistorted radius at the image corner
    if model != FRAME:
        f = draw(bounded_float(0.3, 0.6)) * WIDTH
        corner = math.hypot(WIDTH, HEIGHT) / 2 / f
    k = [draw(bounded_float(-0.06, 0.06)) / corner ** (2 * i) for i in range(1, 5)]
    p = [draw(bounded_float(-0.004, 0.004)) / corner for _ in range(2)]
    more = (
        [draw(bounded_float(-0.5, 0.5)) / corner ** (2 * i) for i in (1, 2)] if full else [0.0, 0.0]
    )
    b = [draw(bounded_float(-30, 30)), draw(bounded_float(-30, 30)) if full else 0.0]
    cx, cy = WIDTH / 2 + draw(bounded_float(-80, 80)), HEIGHT / 2 + draw(bounded_float(-80, 80))
    if not full and model == FRAME:
        k[3] = 0.0
    return Calibration(f, cx, cy, *k, *p, *more, *b)


def pixels_of(seed, n=300):
    rng = np.random.default_rng(seed)
    inside = rng.uniform((0, 0), (WIDTH, HEIGHT), (n - 4, 2))
    return np.r_[inside, [(0, 0), (WIDTH, 0), (0, HEIGHT), (WIDTH, HEIGHT)]]


@pytest.mark.parametrize("model", [FRAME, FISHEYE, EQUISOLID])
@given(data=st.data(), seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_projection_inverts_the_rays_of_pixels(model, data, seed):
    lens = metashape_lens(model, astuple(data.draw(calibrations(model))))
    pixels = pixels_of(seed)
    rays = lens.cam_ray_from_img(pixels)
    valid = np.isfinite(rays).all(axis=1)
    assert valid.mean() > 0.5
    projected = lens.img_from_cam(rays[valid] * np.linspace(0.1, 50, valid.sum())[:, None])
    assert np.abs(projected - pixels[valid]).max() < EXACT_PIXELS


@pytest.mark.parametrize("model", [FRAME, FISHEYE, EQUISOLID])
@given(data=st.data(), seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_projection_matches_the_manual(model, data, seed):
    p = data.draw(calibrations(model))
    lens = metashape_lens(model, astuple(p))
    rng = np.random.default_rng(seed)
    half_width = 0.6 * WIDTH / p.f
    points = np.c_[rng.uniform(-half_width, half_width, (50, 2)), np.ones(50)] * rng.uniform(
        0.1, 9, (50, 1)
    )
    points = np.r_[points, [(0.0, 0.0, 2.0)]]
    expected = [scalar_projection(model, p, *point) for point in points]
    found = lens.img_from_cam(points)
    # the projection is NaN beyond the fold radius, and defined near the axis
    defined = np.isfinite(found).all(axis=1)
    assert defined.mean() > 0.3
    np.testing.assert_allclose(found[defined], np.array(expected)[defined], atol=1e-8)


@pytest.mark.parametrize("model", [FRAME, FISHEYE])
@given(data=st.data(), seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_equivalent_colmap_model_gives_the_same_pixels(model, data, seed):
    p = data.draw(calibrations(model, full=False))
    name, parameters = colmap_model(model, p)
    assert not name.startswith("METASHAPE")
    colmap_lens = make_lens(name, WIDTH, HEIGHT, parameters)
    lens = metashape_lens(model, astuple(p))
    pixels = pixels_of(seed)
    rays = lens.cam_ray_from_img(pixels)
    valid = np.isfinite(rays).all(axis=1) & (rays[:, 2] > 0.05)
    points = np.ascontiguousarray(rays[valid])
    np.testing.assert_allclose(
        colmap_lens.img_from_cam(points), lens.img_from_cam(points), atol=1e-7, rtol=0
    )
    # COLMAP's own inverse is accurate enough to be used
    back = np.asarray(colmap_lens.cam_ray_from_img(pixels[valid]))
    reprojected = np.asarray(colmap_lens.img_from_cam(np.ascontiguousarray(back)))
    assert np.nanmax(np.abs(reprojected - pixels[valid])) < EXACT_PIXELS
    assert np.isfinite(reprojected).all(axis=1).mean() > 0.9


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "SIMPLE_PINHOLE"),
        ({"b1": 3.0}, "PINHOLE"),
        ({"p3": 0.2}, "SIMPLE_PINHOLE"),  # p3 has no effect without p1 and p2
        ({"k1": -0.1, "p2": 1e-3}, "OPENCV"),
        ({"k3": -0.1}, "FULL_OPENCV"),
        ({"k4": -0.1}, FRAME),
        ({"b2": 1.0}, FRAME),
        ({"p1": 1e-3, "p4": 0.1}, FRAME),
    ],
)
def test_choice_of_the_equivalent_colmap_model(changes, expected):
    assert colmap_model(FRAME, Calibration(3000.0, 2000.0, 1500.0, **changes))[0] == expected


def test_tangential_coefficients_are_swapped_for_opencv():
    """For a point on the x axis Metashape's p1 shifts x by 3 p1 x²; OpenCV's p2 does the same."""
    p = Calibration(1000.0, 0.0, 0.0, p1=0.01)
    name, parameters = colmap_model(FRAME, p)
    pixel = make_lens(name, 10, 10, parameters).img_from_cam(np.array([[0.5, 0.0, 1.0]]))
    np.testing.assert_allclose(pixel, [[1000 * (0.5 + 3 * 0.01 * 0.25), 0.0]], atol=1e-9)


@pytest.mark.parametrize("model", [FRAME, FISHEYE, EQUISOLID])
@given(data=st.data(), scale_x=bounded_float(0.1, 4.0), scale_y=bounded_float(0.1, 4.0))
@settings(max_examples=25, deadline=None)
def test_resized_parameters_scale_the_pixels(model, data, scale_x, scale_y):
    p = data.draw(calibrations(model))
    points = np.random.default_rng(0).uniform((-0.3, -0.3, 1), (0.3, 0.3, 2), (40, 3))
    first = metashape_lens(model, astuple(p)).img_from_cam(points)
    new = (round(WIDTH * scale_x), round(HEIGHT * scale_y))
    scaled = resized_parameters(model, astuple(p), (WIDTH, HEIGHT), new)
    expected = first * (new[0] / WIDTH, new[1] / HEIGHT)
    np.testing.assert_allclose(
        metashape_lens(model, scaled).img_from_cam(points), expected, atol=1e-7
    )


def test_fisheye_projects_points_beside_and_behind_the_camera():
    lens = metashape_lens(FISHEYE, astuple(Calibration(1000.0, 2000.0, 1500.0)))
    points = np.array([(1.0, 0.0, 0.0), (1.0, 0.0, -1.0), (0.0, 0.0, 1.0)])
    expected = [(2000 + 1000 * math.pi / 2, 1500), (2000 + 750 * math.pi, 1500), (2000, 1500)]
    pixels = lens.img_from_cam(points)
    np.testing.assert_allclose(pixels, expected, atol=1e-9)
    rays = lens.cam_ray_from_img(pixels)
    np.testing.assert_allclose(
        rays, points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-12
    )
    assert np.isnan(lens.cam_from_img(pixels)[1]).all()  # rays behind the camera have no x/z


# Agisoft's calibration of a real 50 mm lens: k1, k2, k3 (delfem2's camera.xml says −6.3 for k3)
REAL_50MM = (-0.050677067554669893, 0.49650940982018971, -1.7492542165952005)


def test_points_beyond_the_fold_radius_are_not_projected():
    k1, k2, k3 = REAL_50MM
    p = Calibration(12665.0, 4344.0, 2896.0, k1, k2, k3, k4=1e-9)
    fold = fold_radius((k1, k2, k3))
    # the derivative changes sign at the fold radius
    derivatives = [
        1 + 3 * k1 * r**2 + 5 * k2 * r**4 + 7 * k3 * r**6 for r in (0.999 * fold, 1.001 * fold)
    ]
    assert derivatives[0] > 0 > derivatives[1]
    assert 0.6 < fold < 0.75
    lens = metashape_lens(FRAME, astuple(p))
    beyond = np.array([(1.0, 0.0, 1.0), (0.0, 0.9, 1.0), (3.0, 3.0, 1.0)])
    # the plain formula would project the first point back into the image
    assert 0 < scalar_projection(FRAME, p, *beyond[0])[0] < 8688
    assert np.isnan(lens.img_from_cam(beyond)).all()
    name, parameters = colmap_model(FRAME, Calibration(12665.0, 4344.0, 2896.0, k1, k2, k3))
    assert beyond_fold(name, parameters, beyond).all()
    assert not beyond_fold(name, parameters, beyond * (0.3, 0.3, 1.0)).any() or fold < 0.9
    corner = np.array([(4344 / 12665, 2896 / 12665, 1.0)])
    assert not beyond_fold(name, parameters, corner).any()


def test_pixel_beyond_the_fold_radius_has_no_ray():
    p = Calibration(1000.0, 2000.0, 1500.0, k1=-0.3, k4=1e-12)  # r − 0.3 r³ is at most 0.703
    lens = metashape_lens(FRAME, astuple(p))
    x = np.array([(2000 + 702.0, 1500.0), (2000 + 704.0, 1500.0)])
    rays = lens.cam_ray_from_img(x)
    assert np.isfinite(rays[0]).all() and np.isnan(rays[1]).all()
    assert np.abs(lens.img_from_cam(rays[:1]) - x[:1]).max() < EXACT_PIXELS


@given(k=st.lists(bounded_float(-3, 3), min_size=1, max_size=4))
@settings(max_examples=100, deadline=None)
def test_distorted_radius_increases_up_to_the_fold(k):
    fold = fold_radius(tuple(k))
    r = np.linspace(0, min(fold, 5.0), 2001)
    distorted_radius = r + sum(c * r ** (2 * i + 3) for i, c in enumerate(k))
    assert (np.diff(distorted_radius) > -1e-9 * np.abs(distorted_radius).max()).all()


def test_fold_radius_of_colmap_models():
    inf = float("inf")
    assert fold_radius((-1 / 3,)) == pytest.approx(1.0)
    assert fold_radius((0.1, 0.1)) == inf
    # 1/(1 + r²): r/(1 + r²) grows up to 1; 1/(1 − r²) is infinite there
    assert fold_radius((), (1.0,)) == pytest.approx(1.0)
    assert fold_radius((), (-1.0,)) == pytest.approx(1.0)
    fisheye = pycolmap.Camera(
        model="OPENCV_FISHEYE", width=10, height=10, params=[1, 1, 0, 0, -1 / 3, 0, 0, 0]
    )
    points = np.array([(math.tan(0.99), 0.0, 1.0), (math.tan(1.01), 0.0, 1.0)])
    assert beyond_fold("OPENCV_FISHEYE", fisheye.params, points).tolist() == [False, True]
    assert not beyond_fold("SIMPLE_PINHOLE", (1.0, 0.0, 0.0), points).any()
    assert not beyond_fold("ORTHOGRAPHIC", (1.0, 1.0, 0.0, 0.0), points).any()


def test_extreme_parameters_do_not_hang():
    for value in (1e300, -1e300, 1e-300):
        p = Calibration(1000.0, 5.0, 5.0, value, -value, value, value, value, value, value)
        lens = metashape_lens(FRAME, astuple(p))
        with np.errstate(all="ignore"):
            lens.img_from_cam(np.array([[0.1, 0.2, 1.0]]))
            lens.cam_ray_from_img(pixels_of(0))


def test_camera_uses_a_metashape_lens():
    p = Calibration(3000.0, 2000.0, 1500.0, k4=0.01, b2=2.0)
    camera = Camera(
        "a", WIDTH, HEIGHT, FRAME, astuple(p), Pose(np.eye(3), np.array([0.0, 0.0, 5.0]))
    )
    points = np.random.default_rng(1).uniform(-1, 1, (20, 3))
    pixels = camera.project(points)
    rays = camera.rays(pixels)
    distances = np.cross(points - camera.pose.centre, rays)
    assert np.abs(distances).max() < 1e-9
    assert not camera.pinhole
    half = camera.resized(WIDTH // 2, HEIGHT // 2)
    np.testing.assert_allclose(half.project(points), pixels / 2, atol=1e-9)


def test_unknown_models_are_rejected():
    with pytest.raises(ValueError, match="METASHAPE_RPC"):
        metashape_lens("METASHAPE_RPC", [1.0] * 13)
    with pytest.raises(ValueError, match="13 parameters"):
        metashape_lens(FRAME, [1.0] * 12)
