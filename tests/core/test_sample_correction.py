"""Corrected samples equal those of photos without the effect; effects apply to other pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
import pytest

from patina.core.angles import half_difference
from patina.core.basis import PrincipalBRDF
from patina.core.concurrency.steps import drained
from patina.core.diagnose.correction.sample_correction import correct_samples, model_at_pixels
from patina.core.diagnose.correction.sample_pixels import nearest
from patina.core.diagnose.effects import EFFECTS
from patina.core.diagnose.effects.anisotropy import Anisotropy
from patina.core.diagnose.effects.area_light import AreaLight
from patina.core.diagnose.effects.black_level import BlackLevel
from patina.core.diagnose.effects.camera_response import CameraResponse
from patina.core.diagnose.effects.cast_shadow import CastShadow
from patina.core.diagnose.effects.clipping import Clipping
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.solver.model import Model
from patina.core.fit.held_out import prediction_errors as prediction_errors
from patina.core.samples import SampleTable
from tests.make_lit_ball import EACH, GLOSSY, SHARP, changed, lit_ball, shadowed


def table_of(context: DiagnosisContext) -> SampleTable:
    """The samples that a fit would use at the pixels of the context."""
    pixels = context.pixels
    angles = half_difference(pixels.normal, pixels.light, pixels.view)
    cos_i = np.sum(pixels.normal * pixels.light, axis=1)
    own = {f.name: getattr(pixels, f.name, None) for f in fields(SampleTable)}
    own |= {
        "theta_h": angles.theta_h, "theta_d": angles.theta_d, "phi_d": angles.phi_d,
        "cos_i": cos_i, "cos_o": np.sum(pixels.normal * pixels.view, axis=1),
        "radiance": pixels.observed, "variance": pixels.noise,
        "weight": np.ones(len(pixels), np.float32),
        "response": np.ones((len(pixels), 3), np.float32),
        "rho": pixels.observed / (pixels.irradiance * cos_i[:, None]),
    }  # fmt: skip
    return SampleTable(**own)


def corrected_samples(
    table: SampleTable, model: Model, context: DiagnosisContext, tilt: float = 0.0
) -> tuple[SampleTable, Mapping[int, float]]:
    """Samples of the context's pixels without the effects of a model, with highlights deconvolved
    by the model's own BRDF; and the light of each photo (CorrectedSamples.light)."""
    found = drained(correct_samples(table, context.pixels, model, context, tilt))
    if found.blur is None:
        return found.table, found.light
    brdf = PrincipalBRDF(model.brdfs.basis, model.brdfs.coefficients[0])
    return found.blur.sharpened(found.table, brdf), found.light


EXAMPLE_PARAMETERS = {
    LightIntensity: np.array([0.1, -0.1, 0.2, 0.0, -0.25, 0.05]),
    LightDirection: np.array([0.02, -0.03, 0.01, 0.04, 0.0, -0.02]),
    NearLight: np.array([0.2, 0.01, 0.0, 0.1, 0.2, 0.0, 0.0, -0.1, 0.2, 0.0, 0.01, 0.0]),
    CameraResponse: np.array([0.2, 0.01]),
    Vignetting: np.array([-0.3, 0.1]),
    BlackLevel: np.array([0.01, 0.02, -0.005]),
    AreaLight: np.array([0.1]),
}


@pytest.mark.parametrize("kind", EXAMPLE_PARAMETERS, ids=lambda k: k.cause)
def test_corrected_samples_equal_the_brdf(kind):
    """Photos are simulated with an effect and corrected with the same parameters: ρ equals the BRDF
    at the directions that the effect gives."""
    context = lit_ball(3)
    true_brdfs = MaterialBRDFs.of([_brdf_of(context)])
    model = Model(context.pixels, true_brdfs).with_effect(
        kind.of(context), EXAMPLE_PARAMETERS[kind]
    )
    simulated = model.predicted()
    context = changed(context, simulated)
    model = replace(model, pixels=context.pixels, footprint=None)
    found, light = corrected_samples(table_of(context), model, context)
    assert len(found) > 0.85 * len(simulated)
    truth = true_brdfs.evaluate(found.angles, np.zeros(len(found), np.int16))
    np.testing.assert_allclose(found.rho, truth, rtol=2e-3, atol=1e-5)
    assert np.all(found.cos_i > 0)
    key = context.pixels.photo.astype(int) * EACH + context.pixels.pixel
    rows = np.searchsorted(key, found.photo.astype(int) * EACH + found.pixel)
    brighter_pixels = replace(model.pixels, irradiance=np.float32(1.01) * model.pixels.irradiance)
    added_radiance = replace(model, pixels=brighter_pixels, footprint=None).predicted() - simulated
    np.testing.assert_allclose(
        0.01 * found.response * found.radiance, added_radiance[rows], rtol=0.02
    )
    assert sorted(light) == np.unique(found.photo).tolist()
    for photo, part in light.items():
        in_photo = found.photo == photo
        rms = np.sqrt(np.mean(np.square((found.response * found.radiance)[in_photo])))
        assert part == pytest.approx(
            rms / np.sqrt(np.mean(simulated[rows][in_photo] ** 2)), rel=1e-3
        )


def _brdf_of(context: DiagnosisContext):
    brdfs = context.brdfs
    return PrincipalBRDF(brdfs.basis, brdfs.coefficients[0])


def clipped_ball(
    seed: int, part: float, channels: tuple[int, ...] = (0,), material: int = SHARP
) -> tuple[DiagnosisContext, Model, np.ndarray]:
    """A ball whose given channels are clipped in this fraction of the pixels, the model with the
    true clipping level, and the radiance before clipping (n, 3)."""
    context = lit_ball(seed, material)
    truth = context.pixels.observed
    top = np.full(3, np.inf)
    for channel in channels:
        top[channel] = np.percentile(truth[:, channel], 100 * (1 - part))
    context = changed(context, np.minimum(truth, top).astype(np.float32))
    effect = Clipping.of(context)
    level = np.log(8.0) + np.log(effect.top / np.minimum(top, 8 * effect.top))
    return context, Model(context.pixels, context.brdfs).with_effect(effect, level), truth


def rows_of(table: SampleTable, context: DiagnosisContext) -> np.ndarray:
    """Row indices of a table's samples in the pixels of the context."""
    key = context.pixels.photo.astype(int) * EACH + context.pixels.pixel
    return np.searchsorted(key, table.photo.astype(int) * EACH + table.pixel)


def test_clipped_channels_are_imputed_and_excluded_from_the_held_out_error():
    """The red channel is clipped: red is imputed from the BRDF and the sample is excluded from the
    held-out error; the other channels keep the values of the photo."""
    context, model, truth = clipped_ball(4, 0.15)
    top = context.pixels.observed[:, 0].max()
    found, light = corrected_samples(table_of(context), model, context)
    for k, part in light.items():
        in_photo = found.photo == k
        seen = np.sum(context.pixels.observed[rows_of(found, context)][in_photo] ** 2, axis=1)
        # clipped samples do not count as residual
        read_share = np.sum(seen * found.read[in_photo]) / np.sum(seen)
        assert part == pytest.approx(np.sqrt(read_share), rel=1e-3) and part < 1
    above = int(np.sum(truth[:, 0] > 1.02 * top))
    imputed = found.select(~found.read)
    assert len(imputed) > 0.95 * above > 40
    predicted = context.brdfs.evaluate(imputed.angles, np.zeros(len(imputed), np.int16))
    level = top / (imputed.irradiance * imputed.cos_i[:, None])[:, 0]
    beyond = predicted[:, 0] > level  # the rest reaches the plateau by noise alone
    assert beyond.sum() > 0.8 * above
    np.testing.assert_allclose(imputed.rho[beyond, 0], predicted[beyond, 0], rtol=1e-3)
    np.testing.assert_allclose(imputed.rho[~beyond, 0], level[~beyond], rtol=0.02)
    own = truth[rows_of(imputed, context)]
    np.testing.assert_allclose(imputed.radiance[:, 1:], own[:, 1:], rtol=1e-3)
    photo = int(imputed.photo[0])
    errors = prediction_errors(found, photo, _brdf_of(context))
    read = found.select((found.photo == photo) & found.read)
    assert errors.size == pytest.approx(float(np.sum(read.radiance**2)), rel=1e-3)


@pytest.mark.parametrize("channels", [(0,), (0, 1, 2)])
def test_imputation_accounts_for_normal_errors(channels):
    """Normals are off by 1.5°: pixels clipped away from the highlight's centre have a true normal
    other than the scan's, and the BRDF at the scan's normal would be too dark."""
    context, model, unclipped = clipped_ball(5, 0.04, channels, GLOSSY)
    rng = np.random.default_rng(1)
    tilt = np.radians(1.5)
    scan_normal = context.pixels.normal + tilt * rng.standard_normal(context.pixels.normal.shape)
    scan_normal = (scan_normal / np.linalg.norm(scan_normal, axis=1, keepdims=True)).astype(
        np.float32
    )
    pixels = replace(context.pixels, normal=scan_normal)
    shifted = replace(context, pixels=pixels)
    model = replace(model, pixels=pixels, footprint=None)
    errors = []
    for assumed_tilt in (0.0, tilt):
        found, _ = corrected_samples(table_of(shifted), model, shifted, assumed_tilt)
        imputed = found.select(~found.read)
        true = unclipped[rows_of(imputed, shifted), 0]
        near_peak = imputed.theta_h < np.median(imputed.theta_h)
        ratio = [
            imputed.radiance[part, 0].mean() / true[part].mean() for part in (near_peak, ~near_peak)
        ]
        errors.append(np.abs(np.log(ratio)).max())
    assert errors[1] < 0.12 and errors[1] < 0.5 * errors[0]


def test_imputed_samples_are_corrected_for_anisotropy():
    """Imputed samples are corrected for anisotropy, as the other samples are."""
    context = lit_ball(5, GLOSSY)
    parameters = np.array([0.5, -0.2, -0.3])
    brushed = Model(context.pixels, context.brdfs).with_effect(Anisotropy.of(context), parameters)
    simulated = brushed.predicted()
    top = np.percentile(simulated[:, 0], 94)
    seen = simulated.copy()
    seen[:, 0] = np.minimum(seen[:, 0], top)
    clipped_context = changed(context, seen)
    effect = Clipping.of(clipped_context)
    level = np.log(8.0) + np.log(effect.top / np.minimum([top, np.inf, np.inf], 8 * effect.top))
    model = Model(clipped_context.pixels, clipped_context.brdfs).with_effect(
        Anisotropy.of(clipped_context), parameters
    )
    model = model.with_effect(effect, level)
    found, _ = corrected_samples(table_of(clipped_context), model, clipped_context)
    imputed = found.select(~found.read)
    clearly_clipped = simulated[rows_of(imputed, clipped_context), 0] > 1.05 * top
    truth = clipped_context.brdfs.evaluate(imputed.angles, np.zeros(len(imputed), np.int16))
    assert clearly_clipped.sum() > 40
    np.testing.assert_allclose(imputed.rho[clearly_clipped], truth[clearly_clipped], rtol=0.01)


def test_unclipped_samples_keep_the_photo_value_below_the_plateau():
    """The scan's normal predicts a highlight where the photo has none; the photo is used."""
    context, model, truth = clipped_ball(6, 0.1)
    dimmed = (truth * np.float32(0.5)).astype(np.float32)
    pixels = replace(context.pixels, observed=np.minimum(dimmed, context.pixels.observed))
    shifted = replace(context, pixels=pixels)
    model = replace(model, pixels=pixels, footprint=None)
    found, _ = corrected_samples(table_of(shifted), model, shifted)
    beyond = truth[rows_of(found, shifted), 0] > context.pixels.observed[:, 0].max()
    beyond &= found.read
    assert beyond.sum() > 30
    own = pixels.observed[rows_of(found, shifted)][beyond]
    np.testing.assert_allclose(found.radiance[beyond], own, rtol=0.02)


@pytest.mark.parametrize("kind", [LightIntensity, CameraResponse], ids=lambda k: k.cause)
def test_limits_of_clipped_pixels_are_corrected(kind):
    """A clipped pixel that shows hardly more than the white level has a corrected limit of hardly
    less than the truth; no limit exceeds the truth."""
    context = lit_ball(3)
    brdfs = MaterialBRDFs.of([_brdf_of(context)])
    model = Model(context.pixels, brdfs).with_effect(kind.of(context), EXAMPLE_PARAMETERS[kind])
    recorded = model.predicted()
    white = np.float32(np.percentile(recorded[:, 0], 90))
    limited = recorded > white
    context = changed(context, np.minimum(recorded, white).astype(np.float32))
    model = replace(model, pixels=context.pixels, footprint=None)
    clipped = replace(table_of(context), response=(~limited).astype(np.float32))
    some = np.flatnonzero(limited.any(axis=1))
    clipped, pixels = clipped.select(some), context.pixels.select(some)
    found = drained(correct_samples(clipped, pixels, model, context, 0.0)).table
    rows = rows_of(found, context)
    assert len(found) > 0.9 * len(clipped)
    assert np.array_equal(found.response == 0, limited[rows])
    truth = brdfs.evaluate(found.angles, np.zeros(len(found), np.int16))
    limit = found.response == 0
    assert np.all(found.rho[limit] < 1.001 * truth[limit])
    slightly = limit & (recorded[rows] < 1.02 * white)
    assert slightly.sum() > 5
    np.testing.assert_allclose(found.rho[slightly], truth[slightly], rtol=0.03)
    np.testing.assert_allclose(found.rho[~limit], truth[~limit], rtol=2e-3)


def test_fitted_parameters_apply_to_other_pixels():
    """An effect fitted on half of the pixels predicts the rest as an effect of all pixels does."""
    context = lit_ball(5)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(context.pixels))
    half_context = replace(context, pixels=context.pixels.select(np.sort(order[: len(order) // 2])))
    nearest_pixels = nearest(context.pixels, half_context.pixels, context.size)
    assert (half_context.pixels.photo[nearest_pixels.photo] == context.pixels.photo).all()
    for kind, parameters in EXAMPLE_PARAMETERS.items():
        full_effect, half_effect = kind.of(context), kind.of(half_context)
        fitted = Model(half_context.pixels, half_context.brdfs).with_effect(half_effect, parameters)
        transferred = model_at_pixels(fitted, context, nearest_pixels).predicted()
        if kind in (CameraResponse, BlackLevel):  # grey and white are those of the fitted pixels
            full_effect = half_effect
        x = full_effect.identified(parameters)
        expected = Model(context.pixels, context.brdfs).with_effect(full_effect, x).predicted()
        np.testing.assert_allclose(transferred, expected, rtol=1e-5, atol=1e-7)


def test_cast_shadow_transfers_to_pixels_of_its_photo():
    context = shadowed(lit_ball(5), 2, 0.15, 0.6)
    effect = CastShadow.of(context)
    rows = np.flatnonzero(np.arange(len(context.pixels)) % 2)
    half_context = replace(context, pixels=context.pixels.select(rows))
    transferred = effect.at_pixels(
        half_context, nearest(half_context.pixels, context.pixels, context.size)
    )
    np.testing.assert_array_equal(transferred.patch, effect.patch[rows])
    assert set(context.pixels.photo[effect.patch >= 0]) == {2}


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda k: k.cause)
def test_every_effect_can_be_transferred_to_other_pixels(kind):
    context = lit_ball(6)
    if kind is CastShadow:
        context = shadowed(context, 1, 0.15, 0.6)
    effect = kind.of(context)
    if effect is None:
        pytest.skip("this effect cannot occur on a single ball")
    nearest_pixels = nearest(context.pixels, context.pixels, context.size)
    transferred = effect.at_pixels(context, nearest_pixels)
    assert transferred is not None and len(transferred.parameters) == len(effect.parameters)


def test_gain_common_to_all_photos_is_not_identified():
    effect = LightIntensity.of(lit_ball(0))
    np.testing.assert_allclose(effect.identified(np.full(6, 0.3)), 0, atol=1e-12)
    drift = np.array([0.1, -0.1, 0.2, 0.0, -0.25, 0.05])
    np.testing.assert_allclose(effect.identified(drift + 1.0), drift, atol=1e-12)
