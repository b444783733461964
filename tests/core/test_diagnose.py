"""Effects, the joint fit and the judgement of gains, on pixels whose truth is written down here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.basis import Basis, PrincipalBRDF
from patina.core.diagnose import chance
from patina.core.diagnose import search as searching
from patina.core.diagnose.brdfs import BRDFs
from patina.core.diagnose.chosen import doubting
from patina.core.diagnose.closer_look import about_dark_spots
from patina.core.diagnose.dark_spots import dark_spots
from patina.core.diagnose.deviation import as_found, pixel_deviation
from patina.core.diagnose.effect import Setting, felt_by
from patina.core.diagnose.effects import EFFECTS
from patina.core.diagnose.effects.camera_response import CameraResponse
from patina.core.diagnose.effects.cast_shadow import CastShadow
from patina.core.diagnose.effects.clipping import Clipping
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.normal_error import NormalError
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.found import Found
from patina.core.diagnose.held_out import predict_unseen, variances
from patina.core.diagnose.model import Model
from patina.core.diagnose.pixels import Pixels
from patina.core.diagnose.situation import Situation
from patina.core.diagnose.slopes import slopes_of
from patina.core.diagnose.solve import fit
from patina.core.diagnose.unseen_error import unseen_photos_error
from patina.core.job.crew import crew
from patina.core.steps import drained
from tests.make_lit_ball import NOISE, SIZE, changed, lit_ball, shadowed


def searched(setting: Setting, kinds=(LightDirection, LightIntensity, NearLight, CameraResponse,
                                      Vignetting), pool=None) -> Found:  # fmt: skip
    deviation = pixel_deviation(setting.pixels, setting.brdfs, np.radians(0.2))
    effects = [kind.of(setting) for kind in kinds]
    model = Model(setting.pixels, setting.brdfs)
    return drained(searching.search(model, deviation, effects, setting, pool))


def test_nothing_is_named_where_nothing_is_wrong():
    found = searched(lit_ball())
    assert found.causes == ()
    assert found.unseen_after.mean == found.unseen_before.mean


def test_a_lamp_that_drifts_is_named_and_measured():
    setting = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    gains = np.exp(drift)[setting.pixels.photo]
    found = searched(changed(setting, setting.pixels.observed * gains[:, None]))
    assert found.causes == ("light_intensity",)
    x = found.accepted[0].x
    np.testing.assert_allclose(x - x.mean(), drift - drift.mean(), atol=0.02)
    assert found.unseen_after.mean < found.unseen_before.mean
    # how bright each lamp was nobody knows of a photo but itself; what all have in common is better
    assert found.error_after.photos < 0.7 * found.error_before.photos
    doubted = replace(found, doubted={"light_intensity": "errors grow by 8 %"})
    assert doubted.causes == () and doubted.accepted == found.accepted
    assert "errors grow by 8 %" in doubted.sentence(found.accepted[0])


def test_left_out_photos_are_predicted_with_their_own_exposure_and_shadows():
    """As many pixels as a diagnosis looks at: every photo's gain is far better known than a prior,
    and still it is known of its own photo alone."""
    one = lit_ball(1)
    pixels = Pixels.join([one.pixels, *(lit_ball(k).pixels for k in (20, 21, 22))])
    setting = replace(one, pixels=pixels)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    drifting = changed(setting, pixels.observed * np.exp(drift)[pixels.photo][:, None])
    shaded = shadowed(setting, 2, 0.2, 0.8)
    for there, kind in ((drifting, LightIntensity), (shaded, CastShadow)):
        deviation = pixel_deviation(there.pixels, there.brdfs, np.radians(0.2))
        plain = fit(Model(there.pixels, there.brdfs), deviation)
        effect = kind.of(there)
        start = effect.guess(there.pixels.observed - plain.shown, plain.shown)
        with_it = fit(plain.model.with_effect(effect, start), deviation)
        before, after = unseen_photos_error(plain), unseen_photos_error(with_it)
        known = replace(with_it, model=with_it.model.settled())  # pixels of no spot stay as dark
        assert after < 1.05 * unseen_photos_error(known) < 0.6 * before
        if kind is LightIntensity:
            bare = fit(Model(setting.pixels, setting.brdfs), deviation)
            assert after < 1.2 * unseen_photos_error(bare)


def test_without_what_is_doubted_the_rest_is_told_as_it_is_then_found():
    """A drift beside a dark corner: the corner doubted, the photos miss it again."""
    setting = lit_ball(1)
    drift = np.array([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])
    r2 = np.square(setting.pixels.x) + np.square(setting.pixels.y)
    gains = np.exp(drift)[setting.pixels.photo] * (1 - 0.6 * r2)
    found = searched(changed(setting, setting.pixels.observed * gains[:, None]))
    assert set(found.causes) == {"light_intensity", "vignetting"}
    left = doubting(found, {"vignetting": "errors grow by 8 %"})
    assert left.causes[:1] == ("light_intensity",) and "vignetting" not in left.causes
    assert [t.effect.cause for t in left.named] == ["light_intensity"]
    assert left.after.model.causes == ["light_intensity"]
    assert left.named[0].fitted is left.after
    np.testing.assert_allclose(left.named[0].x - left.named[0].x.mean(), drift - drift.mean(),
                               atol=0.04)  # fmt: skip
    both, one = found.unseen_after.mean, left.unseen_after.mean
    assert both < one < found.unseen_before.mean
    assert left.left.gain > found.left.gain
    assert doubting(found, {}) is found


def test_a_curve_that_one_material_contradicts_is_doubted():
    """Two materials, one of them shown as if by a curve: a camera would do it to both."""
    setting = lit_ball(7)
    pixels = setting.pixels
    upper = pixels.point[:, 2] > 0
    grey = pixels.observed.mean()
    curved = pixels.observed * (pixels.observed / grey) ** -0.2
    brdfs = BRDFs.of([PrincipalBRDF(setting.brdfs.basis, setting.brdfs.coefficients[0])] * 2)
    two = replace(
        changed(setting, np.where(upper[:, None], curved, pixels.observed)),
        brdfs=brdfs, scale=np.ones(2, np.float32), materials=("glaze", "clay"),
    )  # fmt: skip
    two = replace(two, pixels=replace(two.pixels, material=np.where(upper, 0, 1).astype(np.int16)))
    found = searched(two, kinds=(CameraResponse, Vignetting))
    assert "camera_response" not in found.causes
    assert "clay" in found.doubted["camera_response"]
    (trial,) = [t for t in found.noted if t.effect.cause == "camera_response"]
    assert trial.gain > 0 and trial.against == (1,) and "clay" in found.sentence(trial)
    both = replace(two, pixels=replace(two.pixels, observed=curved.astype(np.float32)))
    assert searched(both, kinds=(CameraResponse, Vignetting)).causes == ("camera_response",)


def test_a_dark_corner_is_named_and_measured():
    setting = lit_ball(2)
    r2 = np.square(setting.pixels.x) + np.square(setting.pixels.y)
    gain = 1 - 0.6 * r2  # 10 % at the ball's outline
    found = searched(changed(setting, setting.pixels.observed * gain[:, None]))
    assert found.causes == ("vignetting",)
    ours = found.accepted[0].effect.gain(found.accepted[0].x)
    np.testing.assert_allclose(ours / ours.max(), gain / gain.max(), atol=0.015)


def test_a_near_lamp_is_named_and_its_distance_found():
    setting = lit_ball(3)
    pixels, distance = setting.pixels, 8.0
    offset = distance * pixels.light - pixels.point
    away = np.linalg.norm(offset, axis=1, keepdims=True)
    towards = (offset / away).astype(np.float32)
    rho = BRDFs.of([PrincipalBRDF(Basis.default(), Basis.default().training[30:33])]).evaluate(
        replace(Situation.of(pixels), light=towards).angles, pixels.material
    )
    cosine = np.maximum(np.sum(pixels.normal * towards, axis=1, keepdims=True), 0)
    radiance = rho * np.pi * (distance / away) ** 2 * cosine
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(radiance.shape)
    found = searched(changed(setting, radiance * noise))
    assert found.causes == ("near_light",)
    trial = found.accepted[0]
    np.testing.assert_allclose(SIZE / trial.effect.nearness(trial.x), distance, rtol=0.15)


def test_slopes_are_those_of_finite_differences():
    setting = lit_ball()
    effect = LightDirection.of(setting)
    x = np.array([0.02, -0.01, 0.0, 0.01, 0.03, 0.0])
    model = Model(setting.pixels, setting.brdfs, (effect,), (x,))
    fitted = fit(model, np.ones((len(setting.pixels), 3)), steps=0)
    slopes = slopes_of(fitted)
    rng = np.random.default_rng(0)
    step = 3e-4 * rng.standard_normal(setting.brdfs.coefficients.shape)
    moved = replace(model, brdfs=replace(model.brdfs, coefficients=model.brdfs.coefficients + step))
    found = moved.predicted() - model.predicted()
    expected = slopes.rho * (slopes.q @ step[0].T)
    scale = np.abs(found).max()
    np.testing.assert_allclose(expected / scale, found / scale, atol=0.02)


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.cause)
def test_no_effect_is_no_change(kind):
    """All numbers 0: the model as it was; and every effect has something to say."""
    setting = lit_ball()
    if kind is CastShadow:
        setting = shadowed(setting, 1, 0.15, 0.6)
    effect = kind.of(setting)
    if effect is None:
        pytest.skip("cannot be there on a ball alone")
    zero = np.zeros(len(effect.numbers))
    plain = Model(setting.pixels, setting.brdfs)
    with_it = replace(plain, effects=(effect,), x=(zero,))
    np.testing.assert_allclose(with_it.predicted(), plain.predicted(), rtol=2e-3, atol=1e-6)
    small = effect.numbers.step
    assert len(effect.sentence(np.clip(small, effect.numbers.low, effect.numbers.high), small)) > 20


def test_a_spot_without_light_is_a_shadow():
    """One spot of one photo: named, with the light that is lost there."""
    setting = shadowed(lit_ball(8), 3, 0.12, 0.6)
    found = searched(setting, (LightDirection, LightIntensity, CastShadow))
    assert found.causes == ("cast_shadow",)
    trial = found.accepted[0]
    np.testing.assert_allclose(trial.told, -0.6, atol=0.03)
    assert (np.abs(trial.told + 0.6) < 3 * trial.deviation).all()


def test_a_shadow_may_touch_the_objects_own():
    """A spot beside whose end the object's own shadow begins is one; a band along that shadow is
    that shadow, a little larger than the mesh makes it."""
    setting = shadowed(lit_ball(8), 3, 0.12, 0.6)
    pixels, shown = setting.pixels, lit_ball(8).pixels.observed
    whole = dark_spots(pixels, shown) >= 0
    for part, kept in ((0.3, True), (0.7, False)):
        near = whole & (pixels.x < np.quantile(pixels.x[whole], part))
        beside = replace(pixels, edge=np.where(near, np.float32(4), pixels.edge))
        assert np.array_equal(dark_spots(beside, shown) >= 0, whole & kept)


def test_highlights_that_end_at_a_plateau_are_clipped():
    """The brightest percent: named, with where it lies; on the ball as it is there is nothing."""
    setting = lit_ball(9)
    top = float(np.percentile(setting.pixels.observed, 99))
    noise = 1 + NOISE * np.random.default_rng(3).standard_normal(setting.pixels.observed.shape)
    flat = np.minimum(setting.pixels.observed, top * noise)
    found = searched(changed(setting, flat), (LightDirection, LightIntensity, Clipping))
    assert found.causes == ("clipping",)
    trial = found.accepted[0]
    assert isinstance(trial.effect, Clipping)
    level = trial.effect.plateau(trial.x)
    clipped = (setting.pixels.observed > 1.1 * top).sum(axis=0) > 12
    assert clipped.any()
    np.testing.assert_allclose(level[clipped], top, rtol=0.02)
    assert searched(setting, (LightDirection, LightIntensity, Clipping)).causes == ()


def test_side_by_side_nothing_else_is_found():
    """On threads as on one."""
    setting = lit_ball(1)
    drift = np.exp([0.0, 0.08, -0.05, 0.03, 0.06, -0.12])[setting.pixels.photo]
    setting = changed(setting, setting.pixels.observed * drift[:, None])
    with crew(3) as pool:
        one, several = searched(setting), searched(setting, pool=pool)
    assert one.causes == several.causes == ("light_intensity",)
    np.testing.assert_allclose(one.accepted[0].x, several.accepted[0].x, atol=1e-9)
    gains = [[t.gain for t in f.rounds[0]] for f in (one, several)]
    np.testing.assert_allclose(*gains, rtol=1e-6)


def test_a_small_spot_is_looked_at_as_a_whole():
    """All of its pixels, and those about it, but no more than there is room for; nothing where
    there is none."""
    setting = lit_ball(8)
    width, step = 400, 12
    pixels = setting.pixels.select(setting.pixels.photo == 3)
    row, column = (np.round((v + 0.5) * width).astype(np.int32) for v in (pixels.y, pixels.x))
    pixels = replace(pixels, pixel=row * width + column)
    setting = replace(setting, pixels=pixels)
    assert not len(about_dark_spots(pixels, setting.brdfs, width, step, 500))
    dark = shadowed(setting, 3, 0.09, 0.6).pixels
    spot = np.flatnonzero(dark.observed[:, 1] < 0.9 * pixels.observed[:, 1])
    found = about_dark_spots(dark, setting.brdfs, width, step, 500)
    assert len(spot) > 12 and np.isin(spot, found).mean() > 0.8
    far = np.hypot(dark.x[found] - 0.1, dark.y[found])
    assert 0.1 < far.max() < 0.09 + 4 * step / width
    assert len(about_dark_spots(dark, setting.brdfs, width, step, 5)) == 5


def test_single_dark_pixels_are_no_shadow():
    """As much light is lost, in as many pixels, here and there."""
    setting = lit_ball(8)
    spot = np.random.default_rng(2).random(len(setting.pixels)) < 0.02
    dusty = changed(setting, np.where(spot[:, None], 0.4, 1) * setting.pixels.observed)
    assert CastShadow.of(dusty) is None


def test_what_is_not_understood_is_no_proof():
    """Residuals ten times too large for no reason: deviations grow, nothing is named."""
    setting = lit_ball(4)
    rng = np.random.default_rng(5)
    wild = setting.pixels.observed * (1 + 0.15 * rng.standard_normal((len(setting.pixels), 3)))
    found = searched(changed(setting, wild))
    assert found.causes == ()
    assert found.error_before.not_noise > 0.8
    deviation = pixel_deviation(setting.pixels, setting.brdfs, np.radians(0.2))
    shown = Model(setting.pixels, setting.brdfs).predicted()
    residual = (wild - shown) / deviation
    found = as_found(deviation, residual, shown, setting.pixels)
    assert np.median(found / shown) == pytest.approx(0.15, rel=0.1)


def test_unseen_squares_cost_more_than_seen_ones():
    setting = lit_ball(6)
    deviation = pixel_deviation(setting.pixels, setting.brdfs, np.radians(0.2))
    fitted = fit(Model(setting.pixels, setting.brdfs), deviation)
    unseen = predict_unseen(fitted)
    assert unseen.cost.sum() > fitted.cost
    assert unseen.cost.sum() < 1.3 * fitted.cost


class Whole(NormalError):
    """The same numbers, solved for as if every pixel might feel every one."""

    patch = None

    @property
    def feels(self):
        return felt_by(self.parts, len(self.usual))


def test_patches_eliminated_first_are_the_same_optimum():
    setting = replace(lit_ball(7), size=2.0)  # so that patches hold enough pixels
    deviation = pixel_deviation(setting.pixels, setting.brdfs, np.radians(0.2))
    found = []
    dark = Vignetting.of(setting)
    for kind in (NormalError, Whole):
        model = Model(setting.pixels, setting.brdfs).with_effect(dark)
        fitted = fit(model.with_effect(kind.of(setting)), deviation, steps=0)
        found.append((predict_unseen(fitted).cost, *fitted.model.x, *variances(fitted)))
    assert len(found[0][2]) > 100
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-5)


def test_an_effect_that_nothing_asks_for_is_chance():
    """A convex body lights nothing of itself: no pull, no draw, no division by it."""
    assert chance._tail(np.zeros(10), np.zeros(2)).tolist() == [1, 1]
