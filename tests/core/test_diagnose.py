"""Effects, the joint fit and the judgement of gains, on pixels whose truth is written down here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.concurrency.steps import drained
from patina.core.concurrency.thread_pool import thread_pool
from patina.core.diagnose.effects import EFFECTS
from patina.core.diagnose.effects.base.parameters import parameter_columns
from patina.core.diagnose.effects.camera_response import CameraResponse
from patina.core.diagnose.effects.cast_shadow import CastShadow
from patina.core.diagnose.effects.clipping import Clipping
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.normal_error import NormalError
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.pixels import Pixels
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.pixels.refined_pixels import pixels_near_unexplained_shadows
from patina.core.diagnose.pixels.unexplained_shadows import unexplained_shadows
from patina.core.diagnose.selection import search as searching
from patina.core.diagnose.selection import significance
from patina.core.diagnose.selection.cross_validation import (
    parameter_variances,
    predict_held_out_regions,
)
from patina.core.diagnose.selection.diagnosis import Diagnosis
from patina.core.diagnose.selection.effect_subset import with_contradicted
from patina.core.diagnose.selection.held_out_error import held_out_photo_error
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.jacobian import jacobian_of
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.residual_scale import expected_deviation, rescaled_deviation
from tests.make_lit_ball import NOISE, SIZE, changed, lit_ball, shadowed


def searched(
    context: DiagnosisContext,
    kinds=(LightDirection, LightIntensity, NearLight, CameraResponse, Vignetting),
    pool=None,
) -> Diagnosis:
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    effects = [kind.of(context) for kind in kinds]
    model = Model(context.pixels, context.brdfs)
    return drained(searching.search(model, deviation, effects, context, pool))


def test_nothing_is_named_where_nothing_is_wrong():
    found = searched(lit_ball())
    assert found.causes == ()
    assert found.held_out_after.mean == found.held_out_before.mean


def test_a_lamp_that_drifts_is_named_and_measured():
    context = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    gains = np.exp(drift)[context.pixels.photo]
    found = searched(changed(context, context.pixels.observed * gains[:, None]))
    assert found.causes == ("light_intensity",)
    x = found.accepted[0].x
    np.testing.assert_allclose(x - x.mean(), drift - drift.mean(), atol=0.02)
    assert found.held_out_after.mean < found.held_out_before.mean
    # how bright each lamp was nobody knows of a photo but itself; what all have in common is better
    assert found.error_after.photos < 0.7 * found.error_before.photos
    doubted = replace(found, contradicted={"light_intensity": "errors grow by 8 %"})
    assert doubted.causes == () and doubted.accepted == found.accepted
    assert "errors grow by 8 %" in doubted.sentence(found.accepted[0])


def test_left_out_photos_are_predicted_with_their_own_exposure_and_shadows():
    """As many pixels as a diagnosis looks at: every photo's gain is far better known than a prior,
    and still it is known of its own photo alone."""
    one = lit_ball(1)
    pixels = Pixels.join([one.pixels, *(lit_ball(k).pixels for k in (20, 21, 22))])
    context = replace(one, pixels=pixels)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    drifting = changed(context, pixels.observed * np.exp(drift)[pixels.photo][:, None])
    shaded = shadowed(context, 2, 0.2, 0.8)
    for there, kind in ((drifting, LightIntensity), (shaded, CastShadow)):
        deviation = expected_deviation(there.pixels, there.brdfs, np.radians(0.2))
        plain = fit(Model(there.pixels, there.brdfs), deviation)
        effect = kind.of(there)
        start = effect.initial(there.pixels.observed - plain.predicted, plain.predicted)
        with_it = fit(plain.model.with_effect(effect, start), deviation)
        before, after = held_out_photo_error(plain), held_out_photo_error(with_it)
        known = replace(
            with_it, model=with_it.model.with_patches_frozen()
        )  # pixels of no spot stay as dark
        assert after < 1.05 * held_out_photo_error(known) < 0.6 * before
        if kind is LightIntensity:
            bare = fit(Model(context.pixels, context.brdfs), deviation)
            assert after < 1.2 * held_out_photo_error(bare)


def test_without_what_is_doubted_the_rest_is_told_as_it_is_then_found():
    """A drift beside a dark corner: the corner doubted, the photos miss it again."""
    context = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    r2 = np.square(context.pixels.x) + np.square(context.pixels.y)
    gains = np.exp(drift)[context.pixels.photo] * (1 - 0.6 * r2)
    found = searched(changed(context, context.pixels.observed * gains[:, None]))
    assert set(found.causes) == {"light_intensity", "vignetting"}
    left = with_contradicted(found, {"vignetting": "errors grow by 8 %"})
    assert left.causes[:1] == ("light_intensity",) and "vignetting" not in left.causes
    assert [t.effect.cause for t in left.named] == ["light_intensity"]
    assert left.after.model.causes == ["light_intensity"]
    assert left.named[0].fitted is left.after
    np.testing.assert_allclose(left.named[0].x - left.named[0].x.mean(), drift - drift.mean(),
                               atol=0.04)  # fmt: skip
    both, one = found.held_out_after.mean, left.held_out_after.mean
    assert both < one < found.held_out_before.mean
    assert left.residual.gain > found.residual.gain
    assert with_contradicted(found, {}) is found


def test_a_curve_that_one_material_contradicts_is_doubted():
    """Two materials, one of them shown as if by a curve: a camera would do it to both."""
    context = lit_ball(7)
    pixels = context.pixels
    upper = pixels.point[:, 2] > 0
    grey = pixels.observed.mean()
    curved = pixels.observed * (pixels.observed / grey) ** -0.2
    brdfs = MaterialBRDFs.of(
        [PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])] * 2
    )
    two = replace(
        changed(context, np.where(upper[:, None], curved, pixels.observed)),
        brdfs=brdfs, scale=np.ones(2, np.float32), materials=("glaze", "clay"),
    )  # fmt: skip
    two = replace(two, pixels=replace(two.pixels, material=np.where(upper, 0, 1).astype(np.int16)))
    found = searched(two, kinds=(CameraResponse, Vignetting))
    assert "camera_response" not in found.causes
    assert "clay" in found.contradicted["camera_response"]
    (trial,) = [t for t in found.reported if t.effect.cause == "camera_response"]
    assert trial.gain > 0 and trial.contradicted_by == (1,) and "clay" in found.sentence(trial)
    both = replace(two, pixels=replace(two.pixels, observed=curved.astype(np.float32)))
    assert searched(both, kinds=(CameraResponse, Vignetting)).causes == ("camera_response",)


def test_a_dark_corner_is_named_and_measured():
    context = lit_ball(2)
    r2 = np.square(context.pixels.x) + np.square(context.pixels.y)
    gain = 1 - 0.6 * r2  # 10 % at the ball's outline
    found = searched(changed(context, context.pixels.observed * gain[:, None]))
    assert found.causes == ("vignetting",)
    ours = found.accepted[0].effect.gain(found.accepted[0].x)
    np.testing.assert_allclose(ours / ours.max(), gain / gain.max(), atol=0.015)


def test_a_near_lamp_is_named_and_its_distance_found():
    context = lit_ball(3)
    pixels, distance = context.pixels, 8.0
    offset = distance * pixels.light - pixels.point
    away = np.linalg.norm(offset, axis=1, keepdims=True)
    towards = (offset / away).astype(np.float32)
    rho = MaterialBRDFs.of(
        [PrincipalBRDF(default_basis(), default_basis().training[30:33])]
    ).evaluate(replace(ShadingState.of(pixels), light=towards).angles, pixels.material)
    cosine = np.maximum(np.sum(pixels.normal * towards, axis=1, keepdims=True), 0)
    radiance = rho * np.pi * (distance / away) ** 2 * cosine
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(radiance.shape)
    found = searched(changed(context, radiance * noise))
    assert found.causes == ("near_light",)
    trial = found.accepted[0]
    np.testing.assert_allclose(SIZE / trial.effect.nearness(trial.x), distance, rtol=0.15)


def test_slopes_are_those_of_finite_differences():
    context = lit_ball()
    effect = LightDirection.of(context)
    x = np.array([0.02, -0.01, 0.0, 0.01, 0.03, 0.0])
    model = Model(context.pixels, context.brdfs, (effect,), (x,))
    fitted = fit(model, np.ones((len(context.pixels), 3)), steps=0)
    slopes = jacobian_of(fitted)
    rng = np.random.default_rng(0)
    step = 3e-4 * rng.standard_normal(context.brdfs.coefficients.shape)
    moved = replace(model, brdfs=replace(model.brdfs, coefficients=model.brdfs.coefficients + step))
    found = moved.predicted() - model.predicted()
    expected = slopes.rho * (slopes.q @ step[0].T)
    scale = np.abs(found).max()
    np.testing.assert_allclose(expected / scale, found / scale, atol=0.02)


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.cause)
def test_no_effect_is_no_change(kind):
    """All numbers 0: the model as it was; and every effect has something to say."""
    context = lit_ball()
    if kind is CastShadow:
        context = shadowed(context, 1, 0.15, 0.6)
    effect = kind.of(context)
    if effect is None:
        pytest.skip("cannot be there on a ball alone")
    zero = np.zeros(len(effect.parameters))
    plain = Model(context.pixels, context.brdfs)
    with_it = replace(plain, effects=(effect,), x=(zero,))
    np.testing.assert_allclose(with_it.predicted(), plain.predicted(), rtol=2e-3, atol=1e-6)
    small = effect.parameters.step
    assert (
        len(effect.sentence(np.clip(small, effect.parameters.low, effect.parameters.high), small))
        > 20
    )


def test_a_spot_without_light_is_a_shadow():
    """One spot of one photo: named, with the light that is lost there."""
    context = shadowed(lit_ball(8), 3, 0.12, 0.6)
    found = searched(context, (LightDirection, LightIntensity, CastShadow))
    assert found.causes == ("cast_shadow",)
    trial = found.accepted[0]
    np.testing.assert_allclose(trial.identified, -0.6, atol=0.03)
    assert (np.abs(trial.identified + 0.6) < 3 * trial.standard_errors).all()


def test_a_shadow_may_touch_the_objects_own():
    """A spot beside whose end the object's own shadow begins is one; a band along that shadow is
    that shadow, a little larger than the mesh makes it."""
    context = shadowed(lit_ball(8), 3, 0.12, 0.6)
    pixels, shown = context.pixels, lit_ball(8).pixels.observed
    whole = unexplained_shadows(pixels, shown) >= 0
    for part, kept in ((0.3, True), (0.7, False)):
        near = whole & (pixels.x < np.quantile(pixels.x[whole], part))
        beside = replace(pixels, edge=np.where(near, np.float32(4), pixels.edge))
        assert np.array_equal(unexplained_shadows(beside, shown) >= 0, whole & kept)


def test_highlights_that_end_at_a_plateau_are_clipped():
    """The brightest percent: named, with where it lies; on the ball as it is there is nothing."""
    context = lit_ball(9)
    top = float(np.percentile(context.pixels.observed, 99))
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(context.pixels.observed.shape)
    flat = np.minimum(context.pixels.observed, top * noise)
    found = searched(changed(context, flat), (LightDirection, LightIntensity, Clipping))
    assert found.causes == ("clipping",)
    trial = found.accepted[0]
    assert isinstance(trial.effect, Clipping)
    level = trial.effect.plateau(trial.x)
    clipped = (context.pixels.observed > 1.1 * top).sum(axis=0) > 12
    assert clipped.any()
    np.testing.assert_allclose(level[clipped], top, rtol=0.02)
    assert searched(context, (LightDirection, LightIntensity, Clipping)).causes == ()


def test_side_by_side_nothing_else_is_found():
    """On threads as on one."""
    context = lit_ball(1)
    drift = np.exp([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])[context.pixels.photo]
    context = changed(context, context.pixels.observed * drift[:, None])
    with thread_pool(3) as pool:
        one, several = searched(context), searched(context, pool=pool)
    assert one.causes == several.causes == ("light_intensity",)
    np.testing.assert_allclose(one.accepted[0].x, several.accepted[0].x, atol=1e-9)
    gains = [[t.gain for t in f.rounds[0]] for f in (one, several)]
    np.testing.assert_allclose(*gains, rtol=1e-6)


def test_a_small_spot_is_looked_at_as_a_whole():
    """All of its pixels, and those about it, but no more than there is room for; nothing where
    there is none."""
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


def test_single_dark_pixels_are_no_shadow():
    """As much light is lost, in as many pixels, here and there."""
    context = lit_ball(8)
    spot = np.random.default_rng(2).random(len(context.pixels)) < 0.02
    dusty = changed(context, np.where(spot[:, None], 0.4, 1) * context.pixels.observed)
    assert CastShadow.of(dusty) is None


def test_what_is_not_understood_is_no_proof():
    """Residuals ten times too large for no reason: deviations grow, nothing is named."""
    context = lit_ball(4)
    rng = np.random.default_rng(5)
    wild = context.pixels.observed * (1 + 0.15 * rng.standard_normal((len(context.pixels), 3)))
    found = searched(changed(context, wild))
    assert found.causes == ()
    assert found.error_before.not_noise > 0.8
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    shown = Model(context.pixels, context.brdfs).predicted()
    residual = (wild - shown) / deviation
    found = rescaled_deviation(deviation, residual, shown, context.pixels)
    assert np.median(found / shown) == pytest.approx(0.15, rel=0.1)


def test_unseen_squares_cost_more_than_seen_ones():
    context = lit_ball(6)
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    fitted = fit(Model(context.pixels, context.brdfs), deviation)
    unseen = predict_held_out_regions(fitted)
    assert unseen.cost.sum() > fitted.cost
    assert unseen.cost.sum() < 1.3 * fitted.cost


class Whole(NormalError):
    """The same numbers, solved for as if every pixel might feel every one."""

    patch = None

    @property
    def feels(self):
        return parameter_columns(self.parts, len(self.prior))


def test_patches_eliminated_first_are_the_same_optimum():
    context = replace(lit_ball(7), size=2.0)  # so that patches hold enough pixels
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    found = []
    dark = Vignetting.of(context)
    for kind in (NormalError, Whole):
        model = Model(context.pixels, context.brdfs).with_effect(dark)
        fitted = fit(model.with_effect(kind.of(context)), deviation, steps=0)
        found.append(
            (predict_held_out_regions(fitted).cost, *fitted.model.x, *parameter_variances(fitted))
        )
    assert len(found[0][2]) > 100
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-5)


def test_an_effect_that_nothing_asks_for_is_chance():
    """A convex body lights nothing of itself: no pull, no draw, no division by it."""
    assert significance._tail(np.zeros(10), np.zeros(2)).tolist() == [1, 1]
