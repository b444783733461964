"""Effects, the joint fit and the selection of effects, on simulated pixels with known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.concurrency.steps import drained
from patina.core.concurrency.thread_pool import thread_pool
from patina.core.diagnose.effects import EFFECTS
from patina.core.diagnose.effects.base.image_formation import AddsRadiance, ChangesShading
from patina.core.diagnose.effects.camera_response import CameraResponse
from patina.core.diagnose.effects.cast_shadow import CastShadow
from patina.core.diagnose.effects.clipping import Clipping
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.pixels import Pixels
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.nuisances.surface_variation import SurfaceVariation
from patina.core.diagnose.pixels.refined_pixels import pixels_near_unexplained_shadows
from patina.core.diagnose.pixels.unexplained_shadows import unexplained_shadows
from patina.core.diagnose.selection.cross_validation import (
    parameter_variances,
    predict_held_out_regions,
)
from patina.core.diagnose.selection.diagnosis import Diagnosis
from patina.core.diagnose.selection.effect_subset import with_contradicted
from patina.core.diagnose.selection.held_out_error import held_out_photo_error
from patina.core.diagnose.selection.search import search
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.jacobian import jacobian_of
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.residual_scale import expected_deviation, rescaled_deviation
from tests.make_lit_ball import NOISE, SIZE, changed, lit_ball, shadowed


def diagnosis_of(
    context: DiagnosisContext,
    kinds=(LightDirection, LightIntensity, NearLight, CameraResponse, Vignetting),
    pool=None,
) -> Diagnosis:
    effects = [kind.of(context) for kind in kinds]
    return drained(search(context, np.radians(0.2), effects, pool))


def test_no_cause_is_found_without_an_effect():
    found = diagnosis_of(lit_ball())
    assert found.causes == ()
    assert found.held_out_after.mean == found.held_out_before.mean


def test_light_intensity_drift_is_found_and_measured():
    context = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    gains = np.exp(drift)[context.pixels.photo]
    found = diagnosis_of(changed(context, context.pixels.observed * gains[:, None]))
    assert found.causes == ("light_intensity",)
    x = found.accepted[0].x
    np.testing.assert_allclose(x - x.mean(), drift - drift.mean(), atol=0.02)
    assert found.held_out_after.mean < found.held_out_before.mean
    # a photo's own gain cannot be predicted from other photos; the parameters they share improve
    assert found.error_after.photos < 0.7 * found.error_before.photos
    contradicted = replace(found, contradicted={"light_intensity": "errors grow by 8 %"})
    assert contradicted.causes == () and contradicted.accepted == found.accepted
    assert "errors grow by 8 %" in contradicted.sentence(found.accepted[0])


def test_held_out_photos_are_predicted_with_their_own_gain_and_shadows():
    """With as many pixels as a diagnosis uses, each photo's gain is determined far better than by
    its prior, but only by the photo itself."""
    one = lit_ball(1)
    pixels = Pixels.join([one.pixels, *(lit_ball(k).pixels for k in (20, 21, 22))])
    context = replace(one, pixels=pixels)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    drifting_context = changed(context, pixels.observed * np.exp(drift)[pixels.photo][:, None])
    shadowed_context = shadowed(context, 2, 0.2, 0.8)
    for case, kind in ((drifting_context, LightIntensity), (shadowed_context, CastShadow)):
        deviation = expected_deviation(case.pixels, case.brdfs, np.radians(0.2))
        without_effect = fit(Model(case.pixels, case.brdfs), deviation)
        effect = kind.of(case)
        start = effect.initial(
            case.pixels.observed - without_effect.predicted, without_effect.predicted
        )
        with_effect = fit(without_effect.model.with_effect(effect, start), deviation)
        before, after = held_out_photo_error(without_effect), held_out_photo_error(with_effect)
        # pixels outside a shadow patch are unchanged
        frozen_patches = replace(with_effect, model=with_effect.model.with_patches_frozen())
        assert after < 1.05 * held_out_photo_error(frozen_patches) < 0.6 * before
        if kind is LightIntensity:
            no_drift = fit(Model(context.pixels, context.brdfs), deviation)
            assert after < 1.2 * held_out_photo_error(no_drift)


def test_remaining_effects_are_refitted_without_contradicted_ones():
    """Drift and vignetting: if vignetting is contradicted, its error returns to the residual."""
    context = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    r2 = np.square(context.pixels.x) + np.square(context.pixels.y)
    gains = np.exp(drift)[context.pixels.photo] * (1 - 0.6 * r2)
    found = diagnosis_of(changed(context, context.pixels.observed * gains[:, None]))
    assert set(found.causes) == {"light_intensity", "vignetting"}
    remaining = with_contradicted(found, {"vignetting": "errors grow by 8 %"})
    assert remaining.causes[:1] == ("light_intensity",) and "vignetting" not in remaining.causes
    assert [t.effect.cause for t in remaining.named] == ["light_intensity"]
    assert "light_intensity" in remaining.after.model.causes
    assert "vignetting" not in remaining.after.model.causes
    assert remaining.named[0].fitted is remaining.after
    np.testing.assert_allclose(
        remaining.named[0].x - remaining.named[0].x.mean(), drift - drift.mean(), atol=0.04
    )  # fmt: skip
    both, one = found.held_out_after.mean, remaining.held_out_after.mean
    assert both < one < found.held_out_before.mean
    assert remaining.residual.gain > found.residual.gain
    assert with_contradicted(found, {}) is found


def test_camera_response_contradicted_by_one_material_is_rejected():
    """Two materials, only one with a tone curve: a camera response would affect both."""
    context = lit_ball(7)
    pixels = context.pixels
    upper = pixels.point[:, 2] > 0
    grey = pixels.observed.mean()
    curved = pixels.observed * (pixels.observed / grey) ** -0.2
    brdfs = MaterialBRDFs.of(
        [PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])] * 2
    )
    two_materials = replace(
        changed(context, np.where(upper[:, None], curved, pixels.observed)),
        brdfs=brdfs, scale=np.ones(2, np.float32), materials=("glaze", "clay"),
    )  # fmt: skip
    two_materials = replace(
        two_materials,
        pixels=replace(two_materials.pixels, material=np.where(upper, 0, 1).astype(np.int16)),
    )
    found = diagnosis_of(two_materials, kinds=(CameraResponse, Vignetting))
    assert "camera_response" not in found.causes
    assert "clay" in found.contradicted["camera_response"]
    (trial,) = [t for t in found.reported if t.effect.cause == "camera_response"]
    assert trial.gain > 0 and trial.contradicted_by == (1,) and "clay" in found.sentence(trial)
    both = replace(
        two_materials, pixels=replace(two_materials.pixels, observed=curved.astype(np.float32))
    )
    assert diagnosis_of(both, kinds=(CameraResponse, Vignetting)).causes == ("camera_response",)


def test_vignetting_is_found_and_measured():
    context = lit_ball(2)
    r2 = np.square(context.pixels.x) + np.square(context.pixels.y)
    gain = 1 - 0.6 * r2  # 10 % darker at the ball's outline
    found = diagnosis_of(changed(context, context.pixels.observed * gain[:, None]))
    assert found.causes == ("vignetting",)
    fitted_gain = found.accepted[0].effect.gain(found.accepted[0].x)
    np.testing.assert_allclose(fitted_gain / fitted_gain.max(), gain / gain.max(), atol=0.015)


def test_near_light_is_found_with_its_distance():
    context = lit_ball(3)
    pixels, distance = context.pixels, 8.0
    offset = distance * pixels.light - pixels.point
    lamp_distance = np.linalg.norm(offset, axis=1, keepdims=True)
    to_lamp = (offset / lamp_distance).astype(np.float32)
    rho = MaterialBRDFs.of(
        [PrincipalBRDF(default_basis(), default_basis().training[30:33])]
    ).evaluate(replace(ShadingState.of(pixels), light=to_lamp).angles, pixels.material)
    cosine = np.maximum(np.sum(pixels.normal * to_lamp, axis=1, keepdims=True), 0)
    radiance = rho * np.pi * (distance / lamp_distance) ** 2 * cosine
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(radiance.shape)
    found = diagnosis_of(changed(context, radiance * noise))
    assert found.causes == ("near_light",)
    trial = found.accepted[0]
    np.testing.assert_allclose(SIZE / trial.effect.nearness(trial.x), distance, rtol=0.15)


def test_jacobian_matches_finite_differences():
    context = lit_ball()
    effect = LightDirection.of(context)
    x = np.array([0.02, -0.01, 0.0, 0.01, 0.03, 0.0])
    model = Model(context.pixels, context.brdfs, (effect,), (x,))
    fitted = fit(model, np.ones((len(context.pixels), 3)), steps=0)
    jacobian = jacobian_of(fitted)
    rng = np.random.default_rng(0)
    step = 3e-4 * rng.standard_normal(context.brdfs.coefficients.shape)
    changed_model = replace(
        model, brdfs=replace(model.brdfs, coefficients=model.brdfs.coefficients + step)
    )
    found = changed_model.predicted() - model.predicted()
    expected = jacobian.rho * (jacobian.q @ step[0].T)
    scale = np.abs(found).max()
    np.testing.assert_allclose(expected / scale, found / scale, atol=0.02)


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.cause)
def test_effect_with_zero_parameters_changes_nothing(kind):
    """With all parameters 0 the prediction is unchanged; every effect has a report sentence."""
    context = lit_ball()
    if kind is CastShadow:
        context = shadowed(context, 1, 0.15, 0.6)
    effect = kind.of(context)
    if effect is None:
        pytest.skip("this effect cannot occur on a single ball")
    zero = np.zeros(len(effect.parameters))
    without_effect = Model(context.pixels, context.brdfs)
    with_effect = replace(without_effect, effects=(effect,), x=(zero,))
    np.testing.assert_allclose(
        with_effect.predicted(), without_effect.predicted(), rtol=2e-3, atol=1e-6
    )
    small = effect.parameters.step
    assert (
        len(effect.sentence(np.clip(small, effect.parameters.low, effect.parameters.high), small))
        > 20
    )


def test_dark_spot_in_one_photo_is_a_cast_shadow():
    """A dark spot in one photo is reported with the fraction of light lost there."""
    context = shadowed(lit_ball(8), 3, 0.12, 0.6)
    found = diagnosis_of(context, (LightDirection, LightIntensity, CastShadow))
    assert found.causes == ("cast_shadow",)
    trial = found.accepted[0]
    np.testing.assert_allclose(trial.identified, -0.6, atol=0.03)
    assert (np.abs(trial.identified + 0.6) < 3 * trial.standard_errors).all()


def test_cast_shadow_may_touch_the_attached_shadow():
    """A spot of which a small part borders the object's own shadow is a cast shadow; a band along
    that shadow belongs to it, since the mesh's shadow is slightly too small."""
    context = shadowed(lit_ball(8), 3, 0.12, 0.6)
    pixels, shown = context.pixels, lit_ball(8).pixels.observed
    patch = unexplained_shadows(pixels, shown) >= 0
    for part, is_shadow in ((0.3, True), (0.7, False)):
        in_part = patch & (pixels.x < np.quantile(pixels.x[patch], part))
        with_shadow_edge = replace(pixels, edge=np.where(in_part, np.float32(4), pixels.edge))
        assert np.array_equal(unexplained_shadows(with_shadow_edge, shown) >= 0, patch & is_shadow)


def test_clipping_is_found_with_its_level():
    """Clipping of the brightest 1 % is reported with its level; the unclipped ball has none."""
    context = lit_ball(9)
    top = float(np.percentile(context.pixels.observed, 99))
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(context.pixels.observed.shape)
    clipped_radiance = np.minimum(context.pixels.observed, top * noise)
    found = diagnosis_of(
        changed(context, clipped_radiance), (LightDirection, LightIntensity, Clipping)
    )
    assert found.causes == ("clipping",)
    trial = found.accepted[0]
    assert isinstance(trial.effect, Clipping)
    level = trial.effect.plateau(trial.x)
    clipped = (context.pixels.observed > 1.1 * top).sum(axis=0) > 12
    assert clipped.any()
    np.testing.assert_allclose(level[clipped], top, rtol=0.02)
    assert diagnosis_of(context, (LightDirection, LightIntensity, Clipping)).causes == ()


def test_threads_do_not_change_the_result():
    """Several threads give the same result as one."""
    context = lit_ball(1)
    drift = np.exp([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])[context.pixels.photo]
    context = changed(context, context.pixels.observed * drift[:, None])
    with thread_pool(3) as pool:
        one, threaded = diagnosis_of(context), diagnosis_of(context, pool=pool)
    assert one.causes == threaded.causes == ("light_intensity",)
    np.testing.assert_allclose(one.accepted[0].x, threaded.accepted[0].x, atol=1e-9)
    gains = [[t.gain for t in f.rounds[0]] for f in (one, threaded)]
    np.testing.assert_allclose(*gains, rtol=1e-6)


def test_pixels_of_a_small_shadow_are_added():
    """The pixels of a small shadow and around it are added, up to the limit; without a shadow,
    none."""
    context = lit_ball(8)
    width, step = 400, 12
    pixels = context.pixels.select(context.pixels.photo == 3)
    row, column = (np.round((v + 0.5) * width).astype(np.int32) for v in (pixels.y, pixels.x))
    pixels = replace(pixels, pixel=row * width + column)
    context = replace(context, pixels=pixels)
    assert not len(pixels_near_unexplained_shadows(pixels, context.brdfs, width, step, 500))
    dark = shadowed(context, 3, 0.09, 0.6).pixels
    spot = np.flatnonzero(dark.observed[:, 1] < 0.9 * pixels.observed[:, 1])
    found = pixels_near_unexplained_shadows(dark, context.brdfs, width, step, 500)
    assert len(spot) > 12 and np.isin(spot, found).mean() > 0.8
    far = np.hypot(dark.x[found] - 0.1, dark.y[found])
    assert 0.1 < far.max() < 0.09 + 4 * step / width
    assert len(pixels_near_unexplained_shadows(dark, context.brdfs, width, step, 5)) == 5


def test_scattered_dark_pixels_are_no_shadow():
    """As many pixels lose as much light, but scattered over the photos."""
    context = lit_ball(8)
    spot = np.random.default_rng(2).random(len(context.pixels)) < 0.02
    scattered = changed(context, np.where(spot[:, None], 0.4, 1) * context.pixels.observed)
    assert CastShadow.of(scattered) is None


def test_unexplained_residuals_are_no_evidence_for_an_effect():
    """Ten times the expected noise, without a cause: the residual scale grows, nothing is found."""
    context = lit_ball(4)
    rng = np.random.default_rng(5)
    noisy = context.pixels.observed * (1 + 0.15 * rng.standard_normal((len(context.pixels), 3)))
    found = diagnosis_of(changed(context, noisy))
    assert found.causes == ()
    assert found.error_before.not_noise > 0.8
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    shown = Model(context.pixels, context.brdfs).predicted()
    residual = (noisy - shown) / deviation
    found = rescaled_deviation(deviation, residual, shown, context.pixels)
    assert np.median(found / shown) == pytest.approx(0.15, rel=0.1)


def test_held_out_regions_cost_more_than_fitted_ones():
    context = lit_ball(6)
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    fitted = fit(Model(context.pixels, context.brdfs), deviation)
    held_out = predict_held_out_regions(fitted)
    assert held_out.cost.sum() > fitted.cost
    assert held_out.cost.sum() < 1.3 * fitted.cost


@dataclass(frozen=True)
class DenseVariation(ChangesShading, AddsRadiance):
    """The same effect without patches: solved as if every parameter could affect every pixel."""

    inner: SurfaceVariation
    cause = "surface_variation"
    deciding_photo = ""

    @classmethod
    def of(cls, context: DiagnosisContext) -> DenseVariation:
        return cls(SurfaceVariation.of(context))

    @property
    def parameters(self):
        return self.inner.parameters

    @property
    def parameter_index(self):
        return self.inner.parameter_index

    @property
    def combined_slots(self):
        return self.inner.combined_slots

    @property
    def slots_without_lamp_light(self):
        return self.inner.slots_without_lamp_light

    def shading(self, state, x):
        return self.inner.shading(state, x)

    def added_radiance(self, state, brdfs, x):
        return self.inner.added_radiance(state, brdfs, x)

    def sentence(self, x, error):
        return self.inner.sentence(x, error)


def test_eliminating_patch_parameters_gives_the_same_optimum():
    context = replace(lit_ball(7), size=2.0)  # so that patches hold enough pixels
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    found = []
    dark = Vignetting.of(context)
    for kind in (SurfaceVariation, DenseVariation):
        model = Model(context.pixels, context.brdfs).with_effect(dark)
        fitted = fit(model.with_effect(kind.of(context)), deviation, steps=0)
        found.append(
            (predict_held_out_regions(fitted).cost, *fitted.model.x, *parameter_variances(fitted))
        )
    assert len(found[0][2]) > 100
    for eliminated, dense in zip(*found, strict=True):
        np.testing.assert_allclose(eliminated, dense, rtol=1e-3, atol=1e-5)
