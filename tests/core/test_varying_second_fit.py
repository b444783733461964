"""A check of a surface that varies: the variation is that of observations without the causes."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.diagnose import effects
from patina.core.jobs import FitJob, finished
from patina.core.jobs.check_job import CheckJob
from patina.core.jobs.refit_job import RefitJob
from patina.core.jobs.select_photos import select_photos
from patina.core.jobs.varying_second_fit import VaryingSecondFit
from patina.core.photo import read_radiance
from patina.core.varying.node_model import DIFFUSE
from tests import make_capture as made
from tests.core.test_varying_job import NODES, held_out_errors, paint, painted

pytestmark = pytest.mark.slow

PHOTOS, HELD_OUT = 9, 8  # all, and the place of the one that is not fitted
RIVALS = {
    "ambient_light", "camera_response", "veiling_glare", "interreflection", "light_intensity",
}  # fmt: skip
"""Causes that look similar: they raise dark pixels, or change the level of a photo."""
BLACK = 0.05  # radiance that is added to the fitted photos; their median is 0.07


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """Photos of a painted sphere whose black was not subtracted, except in the last."""
    path = made.make_capture(tmp_path_factory.mktemp("lifted"), photos=PHOTOS, brdf=painted)
    for photo in read_capture(path).photos[:HELD_OUT]:
        made.write_exr(photo.file, BLACK + read_radiance(photo.file))
    return read_capture(path)


@pytest.fixture(scope="module")
def check(capture):
    fit = FitJob(select_photos(capture, range(HELD_OUT)), portable=False)
    job = VaryingSecondFit(CheckJob(fit, pixels=8000), nodes=NODES)
    tested = tuple(kind for kind in effects.EFFECTS if kind.cause in {"black_level", *RIVALS})
    assert len(tested) == 1 + len(RIVALS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(effects, "EFFECTS", tested)
        job.drain()
    return job


@pytest.fixture(scope="module")
def uncorrected(check):
    """Fit Again with the cause switched off, which hides the variation from the automatic
    choice."""
    refit = RefitJob(check.checked, without=["black_level"], exactly=True)
    job = VaryingSecondFit(refit, mode="always", nodes=NODES)
    job.drain()
    return finished(job.result)


def colour_error(result) -> float:
    """Median error of ln colour at the nodes that three photos show; its level is the BRDF's."""
    surface = result.varying
    normal = surface.grid.points(slice(None)) - made.CENTRE
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    seen = surface.photos >= 3
    error = surface.parameters[seen][:, DIFFUSE] - np.log(paint(normal[seen]))
    return float(np.median(np.abs(error - np.median(error, axis=0))))


def test_black_level_is_named_and_the_surface_still_varies(check):
    assert finished(check.checked.found).causes[0] == "black_level"
    result = finished(check.result)
    assert [effect.cause for effect in result.effects] == ["black_level"]
    assert result.varying.materials[0].kind != "even"


def test_fit_again_without_the_cause_varies_too(uncorrected):
    assert not uncorrected.effects
    assert uncorrected.varying.materials[0].kind != "even"


def test_colour_is_nearer_to_the_paint_than_without_the_correction(check, uncorrected):
    assert colour_error(finished(check.result)) < 0.7 * colour_error(uncorrected)


def test_photo_with_its_black_subtracted_is_predicted_better(capture, check, uncorrected):
    own, without = (
        held_out_errors(capture, one, HELD_OUT) for one in (finished(check.result), uncorrected)
    )
    assert own.encoded_rmse < 0.8 * without.encoded_rmse
