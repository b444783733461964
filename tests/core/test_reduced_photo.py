"""A photo in fewer pixels agrees with the photo: camera, radiance, masks, prediction and shares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import patina
from patina.core.concurrency.steps import drained
from patina.core.inputs import capture_data
from patina.core.inputs.photos import LitPhoto
from patina.core.jobs import CaptureResult, FitJob, finished
from patina.core.samples import Criterion, Margins
from patina.core.views.photo_view import PhotoView, look_at_photo
from patina.core.views.reduced_photo import (
    reduced_camera,
    reduced_margins,
    reduced_masks,
    reduced_photo,
    reduction,
)


@pytest.fixture(scope="module")
def fitted() -> CaptureResult:
    capture = patina.select_photos(patina.load_capture(patina.DEMO_CAPTURE), range(3))
    job = FitJob(capture, portable=False)
    job.drain()
    return finished(job.result)


def look(result: CaptureResult, side: int | None) -> PhotoView:
    brdfs = [(m.name, m.fit.brdf, m.scale) for m in result.materials]
    return drained(look_at_photo(
        result.capture, result.scan, result.rays, result.photos, result.lights, brdfs, 0, None,
        None, side,
    ))  # fmt: skip


@pytest.mark.parametrize("factor", [2, 3, 7])
def test_a_pixel_of_the_reduced_camera_sees_the_middle_of_its_block(fitted, factor):
    camera = capture_data.camera_of(fitted.capture, fitted.scan, 0)
    small = reduced_camera(camera, factor)
    points = fitted.scan.mesh.vertices[::500]
    # pixel k of the reduced photo covers the coordinates [k, k + 1) · factor of the photo
    np.testing.assert_allclose(
        small.project(points)[0] * factor, camera.project(points)[0], atol=1e-6
    )
    assert small.width == camera.width // factor and small.height == camera.height // factor


def test_radiance_and_masks_are_those_of_blocks():
    values = np.random.default_rng(0).random((7, 8, 3)).astype(np.float32)
    usable = np.ones((7, 8), bool)
    usable[2, 2] = False
    made = reduced_photo(LitPhoto(values, usable), 3)
    assert made.radiance.shape == (2, 2, 3)
    np.testing.assert_allclose(made.radiance[1, 1], values[3:6, 3:6].mean(axis=(0, 1)), rtol=1e-6)
    np.testing.assert_array_equal(made.usable, [[False, True], [True, True]])
    mask = np.zeros((7, 8), bool)
    mask[:3, :2] = True  # six of nine pixels
    mask[3:6, :1] = True  # three of nine
    found = reduced_masks({"ignore": mask}, 3)["ignore"]
    np.testing.assert_array_equal(found, [[True, False], [False, False]])
    assert reduced_margins(Margins(2, 3, 1, 0.2), 2) == Margins(1, 2, 1, 0.2)


def test_prediction_and_shares_are_those_of_the_whole_photo(fitted):
    whole = look(fitted, None)
    longest = max(whole.measured.shape[:2])
    small = look(fitted, longest // 3)
    assert whole.factor == 1 and small.factor in (2, 3)
    assert abs(small.error - whole.error) < 0.3 * whole.error
    for criterion in Criterion:
        assert small.shares.get(criterion, 0) == pytest.approx(
            whole.shares.get(criterion, 0), abs=0.08
        )
    # the mean of the whole prediction over blocks of pixels that all lie on the surface
    k = small.factor
    top, left = (small.box[axis].start * k - whole.box[axis].start for axis in (0, 1))
    blocks = [
        (row, column)
        for row in range(small.predicted.shape[0])
        for column in range(small.predicted.shape[1])
        if top + row * k >= 0 and left + column * k >= 0
    ]
    mean, own = [], []
    for row, column in blocks:
        part = whole.predicted[
            top + row * k : top + (row + 1) * k, left + column * k : left + (column + 1) * k
        ]
        if part.size and np.isfinite(part).all() and np.isfinite(small.predicted[row, column, 0]):
            mean.append(part.mean(axis=(0, 1)))
            own.append(small.predicted[row, column])
    residual = np.abs(np.array(own) - np.array(mean)).mean(axis=1)
    assert len(own) > 500
    assert np.median(residual) < 0.02 * np.median(np.array(mean).mean(axis=1))


def test_reduction_keeps_the_object_large_enough(fitted):
    camera = capture_data.camera_of(fitted.capture, fitted.scan, 0)
    assert reduction(camera, fitted.rays, 10_000) == 1
    factor = reduction(camera, fitted.rays, 50)
    assert factor > 1 and max(look(fitted, 50).measured.shape[:2]) >= 50
    turned_away = replace(camera, pose=replace(camera.pose, rotation=-camera.pose.rotation))
    assert reduction(turned_away, fitted.rays, 50) >= 1


def test_curvature_of_the_papers_method_is_that_of_the_photo(fitted):
    """Curvature is per pixel, of which a reduced photo has larger ones."""
    paper = replace(fitted.capture.fit, method="paper")
    bent = replace(fitted, capture=replace(fitted.capture, fit=paper))
    whole = look(bent, None)
    small = look(bent, max(whole.measured.shape[:2]) // 3)
    assert small.factor > 1
    share = whole.shares.get(Criterion.CURVED, 0)
    assert share > 0.01 and abs(small.shares.get(Criterion.CURVED, 0) - share) < 0.5 * share
