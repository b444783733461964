"""The assessment of a joint fit: calibration, correlations, impact and residuals on the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.diagnose.assessment.assessment import Assessment
from patina.core.diagnose.assessment.calibration import Calibration
from patina.core.diagnose.assessment.joint_parameters import JointParameters
from patina.core.diagnose.assessment.sensor_residuals import SensorResiduals
from patina.core.diagnose.assessment.surface_correlation import surface_correlations
from patina.core.diagnose.effects.ambient_light import AmbientLight
from patina.core.diagnose.effects.black_level import BlackLevel
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.nuisances.pose_jitter import PoseJitter
from patina.core.diagnose.nuisances.surface_variation import SurfaceVariation
from patina.core.diagnose.selection.cross_validation import predict_held_out_regions
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.model_fit import ModelFit
from patina.core.diagnose.solver.residual_scale import expected_deviation
from patina.core.report.assessment_section import assessment_section
from patina.core.statistics.student_t import DEGREES_OF_FREEDOM
from tests.make_lit_ball import GLOSSY, changed, lit_ball

DRIFT = 0.06  # ln, of the first photo


@pytest.fixture(scope="module")
def drifted() -> ModelFit:
    context = lit_ball(1, GLOSSY)
    factor = np.where(context.pixels.photo == 0, np.exp(DRIFT), 1.0)[:, None]
    context = changed(context, factor * context.pixels.observed)
    return _fitted(context, PoseJitter.of(context), LightIntensity.of(context))


def _fitted(context, *effects) -> ModelFit:
    model = Model(context.pixels, context.brdfs)
    for effect in effects:
        model = model.with_effect(effect)
    return fit(model, expected_deviation(context.pixels, context.brdfs, np.radians(0.3)))


def _with_residual(fitted: ModelFit, residual):
    return replace(predict_held_out_regions(fitted), residual=residual)


def test_right_errors_are_calibrated(drifted):
    rng = np.random.default_rng(0)
    drawn = rng.standard_t(DEGREES_OF_FREEDOM, drifted.residual.shape)
    found = Calibration.of(drifted, _with_residual(drifted, drawn))
    assert found.is_calibrated
    assert found.covered == pytest.approx(0.9, abs=0.01)
    assert found.density.mean() == pytest.approx(1)


@pytest.mark.parametrize(("factor", "covered"), [(2.0, 0.654), (0.5, 0.987)])
def test_wrong_errors_are_not_calibrated(drifted, factor, covered):
    """Twice as large: ends too high; half as large: ends too low. Coverage by the quantiles of
    Student's t with four degrees of freedom."""
    drawn = np.random.default_rng(1).standard_t(DEGREES_OF_FREEDOM, drifted.residual.shape)
    found = Calibration.of(drifted, _with_residual(drifted, factor * drawn))
    assert not found.is_calibrated
    assert found.covered == pytest.approx(covered, abs=0.01)
    assert (found.density[[0, -1]] > 1).all() == (factor > 1)


def test_a_drift_has_a_pull_and_a_drift_free_photo_has_none(drifted):
    found = JointParameters.of(drifted)
    mine = [k for k, cause in enumerate(found.cause) if cause == LightIntensity.cause]
    count = len(mine)
    truth = np.full(count, -DRIFT / count)
    truth[0] += DRIFT
    assert found.estimate[mine] == pytest.approx(truth, abs=0.01)
    assert found.pull[mine[0]] == pytest.approx(truth[0] / found.prior[mine[0]], rel=0.2)
    assert np.abs(found.pull[mine[1:]]).max() < 0.3 < found.pull[mine[0]]


def test_correlations_are_correlations(drifted):
    matrix = JointParameters.of(drifted).correlation
    assert matrix == pytest.approx(matrix.T)
    assert np.diag(matrix) == pytest.approx(1)
    assert np.linalg.eigvalsh(matrix).min() > -1e-9


def test_impact_is_the_change_of_the_brdf_by_one_standard_error(drifted):
    """By brute force: the gains are held one standard error off along their most uncertain
    direction, and everything else is fitted again."""
    found = JointParameters.of(drifted)
    place = drifted.model.place_of(LightIntensity.cause)
    error = found.error[[c == LightIntensity.cause for c in found.cause]].mean()
    x = list(drifted.model.x)
    x[place] = x[place] + error
    moved = replace(drifted.model, x=tuple(x), frozen=frozenset({place}))
    again = fit(moved, drifted.deviation)
    rows = drifted.model.basis_rows(drifted.model.lamp_light.state)
    change = again.model.brdfs.coefficients - drifted.model.brdfs.coefficients
    brute = np.sqrt(np.mean(np.einsum("nk,ck->nc", rows, change[0]) ** 2))
    assert found.impact[LightIntensity.cause] == pytest.approx(brute, rel=0.3)


def test_ambient_light_and_black_level_are_confusable_on_a_matte_ball():
    context = lit_ball(2)
    both = [kind.of(context) for kind in (AmbientLight, BlackLevel)]
    assert all(effect is not None for effect in both)
    pairs = JointParameters.of(_fitted(context, *both)).confusable
    assert {AmbientLight.cause, BlackLevel.cause} in [set(pair[:2]) for pair in pairs]


def test_what_a_varying_surface_could_imitate():
    """On a ball photographed from all sides, a drift of single photos is no texture. Dark corners
    of photos that all show the same view are."""
    context = lit_ball(1, GLOSSY)
    drift = np.array([0.1, -0.1, 0.1, -0.1, 0.1, -0.1])
    variation, drifting = SurfaceVariation.across(context, 6), LightIntensity.of(context)
    model = Model(context.pixels, context.brdfs).with_effect(variation)
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.3))
    fitted = ModelFit.of(model.with_effect(drifting, drift), deviation)
    of_drift = surface_correlations(fitted)[LightIntensity.cause]
    corners = Vignetting(context.pixels.point[:, 0] ** 2 / 0.16)  # the same in all photos
    fitted = ModelFit.of(model.with_effect(corners, np.array([-0.5, 0.0])), deviation)
    of_corners = surface_correlations(fitted)[Vignetting.cause]
    assert of_drift < 0.75 < 0.9 < of_corners <= 1


def test_a_dark_corner_shows_on_the_sensor():
    context = lit_ball(3, GLOSSY)
    pixels = context.pixels
    corner = (pixels.x > 0.3 * pixels.x.max()) & (pixels.y > 0.3 * pixels.y.max())
    fitted = _fitted(context)
    dark = np.where(corner[:, None], 0.9, 1.0) * fitted.predicted
    residual = (dark - fitted.predicted) / fitted.deviation
    found = SensorResiduals.of(replace(fitted, residual=residual))
    down, across = (2 * (np.arange(n) + 0.5) / n - 1 for n in found.mean.shape)
    known = np.isfinite(found.mean)
    inside = known & (down[:, None] > 0.37) & (across > 0.37)
    outside = known & ((down[:, None] < 0.23) | (across < 0.23))
    assert found.mean[inside] == pytest.approx(-0.1, abs=1e-3)
    assert found.mean[outside] == pytest.approx(0, abs=1e-9)
    assert np.count_nonzero(inside) > 5


def test_the_report_states_every_view(drifted):
    page = assessment_section(Assessment.of(drifted, predict_held_out_regions(drifted)))
    for heading in ("Impact on the BRDF", "Parameters", "Correlations", "Calibration", "sensor"):
        assert heading in page
    assert "nan" not in page and "Wrong Light Intensity" in page
