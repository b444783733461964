"""One step of an effect on the baseline: it must agree with a joint fit, ignore what the baseline
explains, and find nothing where nothing is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.diagnose.effects.camera_pose import CameraPose
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.nuisances.pose_jitter import PoseJitter
from patina.core.diagnose.nuisances.surface_variation import SurfaceVariation
from patina.core.diagnose.selection.baseline import USUAL_SCALES, fit_baseline
from patina.core.diagnose.selection.one_step import ProjectedBaseline, one_step
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.jacobian import jacobian_of
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.model_fit import ModelFit
from tests.make_lit_ball import GLOSSY, changed, lit_ball

pytestmark = pytest.mark.slow

GAINS = 0.03 * np.array([1.0, -1.0, 0.5, -0.5, 1.0, -1.0])  # ln, of the photos
NORMALS = np.radians(0.3)  # expected error of the ball's exact normals
ACROSS = 8  # patches: the ball has few pixels


@pytest.fixture(scope="module")
def drifted():
    context = lit_ball(1, GLOSSY)
    factor = np.exp(GAINS)[context.pixels.photo][:, None]
    context = changed(context, factor * context.pixels.observed)
    return context, fit_baseline(context, NORMALS, ACROSS)


def test_a_step_finds_a_drift_with_the_surface_free_to_vary(drifted):
    context, baseline = drifted
    step = one_step(ProjectedBaseline.of(baseline.fitted), LightIntensity.of(context))
    assert step.effect.identified(step.x) == pytest.approx(GAINS - GAINS.mean(), abs=0.01)
    assert 0.5 < step.change / np.sqrt(np.mean(GAINS**2)) < 1.2


def test_a_step_agrees_with_a_joint_fit(drifted):
    context, baseline = drifted
    effect = LightIntensity.of(context)
    step = one_step(ProjectedBaseline.of(baseline.fitted), effect)
    joint = fit(baseline.fitted.model.with_effect(effect), baseline.fitted.deviation)
    found = effect.identified(joint.model.parameters_of(effect.cause))
    assert effect.identified(step.x) == pytest.approx(found, abs=0.006)
    assert step.gain == pytest.approx(baseline.fitted.total_cost - joint.total_cost, rel=0.25)


def test_held_out_regions_confirm_a_drift(drifted):
    context, baseline = drifted
    step = one_step(ProjectedBaseline.of(baseline.fitted), LightIntensity.of(context))
    regions = step.held_out(context.pixels.block)
    assert len(regions) == len(np.unique(context.pixels.block))
    assert regions.sum() > 0.5 * step.gain
    assert regions.sum() > 3 * np.sqrt(np.sum((regions - regions.mean()) ** 2))


@pytest.mark.parametrize("kind", [LightIntensity, LightDirection, Vignetting])
def test_nothing_is_found_where_nothing_is_hidden(kind):
    context = lit_ball(2, GLOSSY)
    baseline = fit_baseline(context, NORMALS, ACROSS)
    step = one_step(ProjectedBaseline.of(baseline.fitted), kind.of(context))
    regions = step.held_out(context.pixels.block)
    spread = np.sqrt(np.sum((regions - regions.mean()) ** 2))
    assert regions.sum() < 3 * spread
    assert step.change < 0.01


def test_the_baseline_cannot_imitate_what_is_left(drifted):
    """No step of a BRDF's coefficients or a patch explains a projected derivative: its weighted
    products with theirs are no larger than their priors leave (the normal equations)."""
    context, baseline = drifted
    projected = ProjectedBaseline.of(baseline.fitted)
    left = one_step(projected, LightIntensity.of(context)).left
    again = projected.project(left)
    assert np.linalg.norm(again - left) < 0.15 * np.linalg.norm(left)


def test_derivatives_of_a_pixel_in_the_dark_are_finite():
    """Its radiance is so small that a thousandth of it is rounded to 0."""
    context = lit_ball(2)
    irradiance = context.pixels.irradiance.copy()
    irradiance[0] = 1e-43
    context = replace(context, pixels=replace(context.pixels, irradiance=irradiance))
    fitted = ModelFit.of(Model(context.pixels, context.brdfs), np.full((len(irradiance), 3), 0.01))
    assert 0 < fitted.predicted[0].max() < 1e-40
    assert np.isfinite(jacobian_of(fitted).rho).all()


def test_scales_of_the_surface_stay_usual():
    """Also where every normal is wrong by 4°, as under a wrong light."""
    context = lit_ball(3, GLOSSY)
    pixels = context.pixels
    light = pixels.light + np.float32(0.07) * np.roll(pixels.light, 1, axis=1)
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    context = replace(context, pixels=replace(pixels, light=light))
    baseline = fit_baseline(context, NORMALS, ACROSS)
    assert (baseline.scales <= np.array(USUAL_SCALES) + 1e-12).all()
    assert baseline.fitted.model.patch_effect.prior == tuple(baseline.scales)


def test_albedo_of_patches_is_found():
    """One side of the ball reflects 20 % less; the prior's scale follows."""
    context = lit_ball(4, GLOSSY)
    factor = np.where(context.pixels.point[:, 2] > 0.1, 0.8, 1.0)[:, None]
    context = changed(context, factor * context.pixels.observed)
    baseline = fit_baseline(context, NORMALS, ACROSS)
    variation = baseline.fitted.model.patch_effect
    assert isinstance(variation, SurfaceVariation)
    # the reflectance of a patch is that of all photos: no photo's gain explains it
    reflectance = variation.at_patch(baseline.fitted.model.x[-1])[:, 5]
    dark = context.pixels.point[:, 2] > 0.15
    bright = context.pixels.point[:, 2] < 0.05
    ratio = (1 + np.median(reflectance[dark])) / (1 + np.median(reflectance[bright]))
    assert ratio == pytest.approx(0.8, abs=0.04)
    before, after = (
        np.sqrt(np.mean((one.predicted - context.pixels.observed) ** 2))
        for one in (baseline.plain, baseline.fitted)
    )
    assert after < 0.5 * before


@pytest.mark.parametrize("pixels_off", [0.3, 3.0])
def test_pose_errors_belong_to_the_baseline(pixels_off):
    """Photos of a ball with a steep gradient, shifted: the baseline says by how much, and no step
    of camera_pose explains more. Whether that is unusual is told by the size of the errors."""
    context = lit_ball(5, GLOSSY)
    pixels = context.pixels
    slope = np.zeros_like(pixels.slope)
    slope[:, 0] = 0.01 * pixels.observed.mean(axis=0) * np.sin(40 * pixels.x)[:, None]
    shift = pixels_off * np.where(pixels.photo % 2, 1, -1)
    moved = (pixels.observed + shift[:, None] * slope[:, 0]).astype(np.float32)
    edge = np.zeros(len(pixels), np.float32)  # the light is taken as linear near an edge
    context = replace(context, pixels=replace(pixels, slope=slope, observed=moved, edge=edge))
    baseline = fit_baseline(context, NORMALS, ACROSS)
    right = baseline.fitted.model.parameters_of(PoseJitter.cause)[0::3]
    signs = np.where(np.arange(len(right)) % 2, 1, -1)
    assert np.median(right * signs) == pytest.approx(pixels_off, rel=0.35)
    step = one_step(ProjectedBaseline.of(baseline.fitted), CameraPose.of(context))
    assert step.held_out(pixels.block).sum() < 30
