"""Samples rid of an effect are those of photos without it; the same numbers, other pixels."""

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
from patina.core.fit.held_out import prediction_errors as unseen_photo
from patina.core.samples import SampleTable
from tests.make_lit_ball import EACH, GLOSSY, SHARP, changed, lit_ball, shadowed


def table_of(context: DiagnosisContext) -> SampleTable:
    """The samples that a fit would take at the pixels of the context."""
    pixels = context.pixels
    angles = half_difference(pixels.normal, pixels.light, pixels.view)
    cos_i = np.sum(pixels.normal * pixels.light, axis=1)
    own = {f.name: getattr(pixels, f.name, None) for f in fields(SampleTable)}
    own |= {
        "theta_h": angles.theta_h, "theta_d": angles.theta_d, "phi_d": angles.phi_d,
        "cos_i": cos_i, "cos_o": np.sum(pixels.normal * pixels.view, axis=1),
        "radiance": pixels.observed, "weight": np.ones(len(pixels), np.float32),
        "response": np.ones((len(pixels), 3), np.float32),
        "rho": pixels.observed / (pixels.irradiance * cos_i[:, None]),
    }  # fmt: skip
    return SampleTable(**own)


def rid_of(
    table: SampleTable, model: Model, context: DiagnosisContext, tilt: float = 0.0
) -> tuple[SampleTable, Mapping[int, float]]:
    """Samples of the context's pixels without a model's effects, highlights deconvolved with the
    model's own BRDF; each photo's light (CorrectedSamples.light)."""
    found = drained(correct_samples(table, context.pixels, model, context, tilt))
    if found.blur is None:
        return found.table, found.light
    brdf = PrincipalBRDF(model.brdfs.basis, model.brdfs.coefficients[0])
    return found.blur.sharpened(found.table, brdf), found.light


EXAMPLES = {
    LightIntensity: np.array([0.1, -0.1, 0.2, 0.0, -0.25, 0.05]),
    LightDirection: np.array([0.02, -0.03, 0.01, 0.04, 0.0, -0.02]),
    NearLight: np.array([0.2, 0.01, 0.0, 0.1, 0.2, 0.0, 0.0, -0.1, 0.2, 0.0, 0.01, 0.0]),
    CameraResponse: np.array([0.2, 0.01]),
    Vignetting: np.array([-0.3, 0.1]),
    AreaLight: np.array([0.1]),
}


@pytest.mark.parametrize("kind", EXAMPLES, ids=lambda k: k.cause)
def test_samples_rid_of_an_effect_show_the_brdf(kind):
    """Photos made with an effect, corrected with the same numbers: ρ is the BRDF's, at the
    directions that the effect says."""
    context = lit_ball(3)
    bare = MaterialBRDFs.of([_brdf_of(context)])
    model = Model(context.pixels, bare).with_effect(kind.of(context), EXAMPLES[kind])
    shown = model.predicted()
    context = changed(context, shown)
    model = replace(model, pixels=context.pixels, footprint=None)
    found, light = rid_of(table_of(context), model, context)
    assert len(found) > 0.85 * len(shown)
    truth = bare.evaluate(found.angles, np.zeros(len(found), np.int16))
    np.testing.assert_allclose(found.rho, truth, rtol=2e-3, atol=1e-5)
    assert np.all(found.cos_i > 0)
    key = context.pixels.photo.astype(int) * EACH + context.pixels.pixel
    rows = np.searchsorted(key, found.photo.astype(int) * EACH + found.pixel)
    brighter = replace(model.pixels, irradiance=np.float32(1.01) * model.pixels.irradiance)
    more = replace(model, pixels=brighter, footprint=None).predicted() - shown
    np.testing.assert_allclose(0.01 * found.response * found.radiance, more[rows], rtol=0.02)
    assert sorted(light) == np.unique(found.photo).tolist()
    for photo, part in light.items():
        mine = found.photo == photo
        ours = np.sqrt(np.mean(np.square((found.response * found.radiance)[mine])))
        assert part == pytest.approx(ours / np.sqrt(np.mean(shown[rows][mine] ** 2)), rel=1e-3)


def _brdf_of(context: DiagnosisContext):
    brdfs = context.brdfs
    return PrincipalBRDF(brdfs.basis, brdfs.coefficients[0])


def clipped_ball(
    seed: int, part: float, channels: tuple[int, ...] = (0,), material: int = SHARP
) -> tuple[DiagnosisContext, Model, np.ndarray]:
    """A ball whose channels end at a plateau, which this part of its pixels reaches, the model that
    knows it, and what photos that are not clipped show (n, 3)."""
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
    """Of a table's samples in the pixels of the context."""
    key = context.pixels.photo.astype(int) * EACH + context.pixels.pixel
    return np.searchsorted(key, table.photo.astype(int) * EACH + table.pixel)


def test_what_is_clipped_is_predicted_and_no_evidence():
    """A red channel that ends at a plateau: red stands as the BRDF has it, and the sample counts
    for nothing where unseen photos are judged; the other channels stay what the photo says."""
    context, model, truth = clipped_ball(4, 0.15)
    top = context.pixels.observed[:, 0].max()
    found, light = rid_of(table_of(context), model, context)
    for k, part in light.items():
        mine = found.photo == k
        seen = np.sum(context.pixels.observed[rows_of(found, context)][mine] ** 2, axis=1)
        told = np.sum(seen * found.read[mine]) / np.sum(seen)  # what is clipped is no miss
        assert part == pytest.approx(np.sqrt(told), rel=1e-3) and part < 1
    above = int(np.sum(truth[:, 0] > 1.02 * top))
    filled = found.select(~found.read)
    assert len(filled) > 0.95 * above > 40
    predicted = context.brdfs.evaluate(filled.angles, np.zeros(len(filled), np.int16))
    level = top / (filled.irradiance * filled.cos_i[:, None])[:, 0]
    beyond = predicted[:, 0] > level  # the rest is at the plateau by its noise alone
    assert beyond.sum() > 0.8 * above
    np.testing.assert_allclose(filled.rho[beyond, 0], predicted[beyond, 0], rtol=1e-3)
    np.testing.assert_allclose(filled.rho[~beyond, 0], level[~beyond], rtol=0.02)
    own = truth[rows_of(filled, context)]
    np.testing.assert_allclose(filled.radiance[:, 1:], own[:, 1:], rtol=1e-3)
    photo = int(filled.photo[0])
    judged = unseen_photo(found, photo, _brdf_of(context))
    read = found.select((found.photo == photo) & found.read)
    assert judged.size == pytest.approx(float(np.sum(read.radiance**2)), rel=1e-3)


@pytest.mark.parametrize("channels", [(0,), (0, 1, 2)])
def test_what_was_clipped_is_as_high_as_a_scan_of_such_normals_would_have_it(channels):
    """Normals are 1.5° off: what is clipped beside the highlight's middle is so since its normal is
    another one, and the BRDF at the scan's would be too dark."""
    context, model, bright = clipped_ball(5, 0.04, channels, GLOSSY)
    rng = np.random.default_rng(1)
    tilt = np.radians(1.5)
    told = context.pixels.normal + tilt * rng.standard_normal(context.pixels.normal.shape)
    told = (told / np.linalg.norm(told, axis=1, keepdims=True)).astype(np.float32)
    pixels = replace(context.pixels, normal=told)
    off = replace(context, pixels=pixels)
    model = replace(model, pixels=pixels, footprint=None)
    errors = []
    for known in (0.0, tilt):
        found, _ = rid_of(table_of(off), model, off, known)
        filled = found.select(~found.read)
        true = bright[rows_of(filled, off), 0]
        inner = filled.theta_h < np.median(filled.theta_h)
        ratio = [filled.radiance[part, 0].mean() / true[part].mean() for part in (inner, ~inner)]
        errors.append(np.abs(np.log(ratio)).max())
    assert errors[1] < 0.12 and errors[1] < 0.5 * errors[0]


def test_what_is_clipped_of_a_brushed_surface_stands_unstretched():
    """As its other samples do: ρ of the highlight that it has across and along alike."""
    context = lit_ball(5, GLOSSY)
    numbers = np.array([0.5, -0.2, -0.3])
    whole = Model(context.pixels, context.brdfs).with_effect(Anisotropy.of(context), numbers)
    shown = whole.predicted()
    top = np.percentile(shown[:, 0], 94)
    seen = shown.copy()
    seen[:, 0] = np.minimum(seen[:, 0], top)
    there = changed(context, seen)
    effect = Clipping.of(there)
    level = np.log(8.0) + np.log(effect.top / np.minimum([top, np.inf, np.inf], 8 * effect.top))
    model = Model(there.pixels, there.brdfs).with_effect(Anisotropy.of(there), numbers)
    model = model.with_effect(effect, level)
    found, _ = rid_of(table_of(there), model, there)
    filled = found.select(~found.read)
    clear = shown[rows_of(filled, there), 0] > 1.05 * top
    truth = there.brdfs.evaluate(filled.angles, np.zeros(len(filled), np.int16))
    assert clear.sum() > 40
    np.testing.assert_allclose(filled.rho[clear], truth[clear], rtol=0.01)


def test_a_photo_that_is_not_clipped_says_what_arrived_though_the_prediction_is_beyond():
    """The scan's normal puts a highlight where the photo shows none."""
    context, model, truth = clipped_ball(6, 0.1)
    dark = (truth * np.float32(0.5)).astype(np.float32)
    pixels = replace(context.pixels, observed=np.minimum(dark, context.pixels.observed))
    off = replace(context, pixels=pixels)
    model = replace(model, pixels=pixels, footprint=None)
    found, _ = rid_of(table_of(off), model, off)
    beyond = truth[rows_of(found, off), 0] > context.pixels.observed[:, 0].max()
    beyond &= found.read
    assert beyond.sum() > 30
    own = pixels.observed[rows_of(found, off)][beyond]
    np.testing.assert_allclose(found.radiance[beyond], own, rtol=0.02)


def test_the_same_numbers_speak_of_other_pixels():
    """Every effect of half of the pixels, moved to the other half, shows what it would have."""
    context = lit_ball(5)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(context.pixels))
    one = replace(context, pixels=context.pixels.select(np.sort(order[: len(order) // 2])))
    near = nearest(context.pixels, one.pixels, context.size)
    assert (one.pixels.photo[near.photo] == context.pixels.photo).all()
    for kind, numbers in EXAMPLES.items():
        whole, half = kind.of(context), kind.of(one)
        told = Model(one.pixels, one.brdfs).with_effect(half, numbers)
        moved = model_at_pixels(told, context, near).predicted()
        if kind is CameraResponse:  # what is grey was said when the numbers were found
            whole = half
        x = whole.identified(numbers)
        plain = Model(context.pixels, context.brdfs).with_effect(whole, x).predicted()
        np.testing.assert_allclose(moved, plain, rtol=1e-5, atol=1e-7)


def test_a_shadow_is_where_its_photo_was_looked_at():
    context = shadowed(lit_ball(5), 2, 0.15, 0.6)
    effect = CastShadow.of(context)
    rows = np.flatnonzero(np.arange(len(context.pixels)) % 2)
    here = replace(context, pixels=context.pixels.select(rows))
    moved = effect.at_pixels(here, nearest(here.pixels, context.pixels, context.size))
    np.testing.assert_array_equal(moved.patch, effect.patch[rows])
    assert set(context.pixels.photo[effect.patch >= 0]) == {2}


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda k: k.cause)
def test_every_effect_can_be_moved(kind):
    context = lit_ball(6)
    if kind is CastShadow:
        context = shadowed(context, 1, 0.15, 0.6)
    effect = kind.of(context)
    if effect is None:
        pytest.skip("cannot be there on a ball alone")
    near = nearest(context.pixels, context.pixels, context.size)
    moved = effect.at_pixels(context, near)
    assert moved is not None and len(moved.parameters) == len(effect.parameters)


def test_a_gain_that_all_photos_share_is_the_brdfs():
    effect = LightIntensity.of(lit_ball(0))
    np.testing.assert_allclose(effect.identified(np.full(6, 0.3)), 0, atol=1e-12)
    drift = np.array([0.1, -0.1, 0.2, 0.0, -0.25, 0.05])
    np.testing.assert_allclose(effect.identified(drift + 1.0), drift, atol=1e-12)
