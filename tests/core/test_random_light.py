"""Renderings under random skies: their normalisation and their similarity measure."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.appearance.closeness import FitObjective
from patina.core.appearance.cube_root import COARSE
from patina.core.appearance.principled import Principled
from patina.core.appearance.random_light import LIMB, SKIES, VIEWS, Pictures, encoded
from patina.core.errors import FitError

GLOSSY = Principled(base_color=np.array([0.6, 0.1, 0.05]), roughness=0.3)


def grey(angles: Angles) -> np.ndarray:
    return np.full((len(angles.theta_h), 3), 0.2 / np.pi)


def test_skies_have_equal_brightness() -> None:
    pictures = Pictures.of(grey)
    irradiance = np.concatenate([light.sum(axis=1) for _, light in pictures.parts])
    assert len(irradiance) == VIEWS * SKIES
    # every sky has a mean radiance of 1: irradiance π, more where its patches are above
    assert irradiance.mean() == pytest.approx(np.pi, rel=0.1)
    assert irradiance.min() > 0 and np.percentile(irradiance, 98) < 4 * np.pi
    assert pictures.where.cos_o.min() == pytest.approx((1 - LIMB * (1 - 0.5 / VIEWS)) ** 0.5)


def test_psnr_of_true_and_slightly_darker_brdf() -> None:
    pictures = Pictures.of(GLOSSY.evaluate)
    f = GLOSSY.at(pictures.where)
    assert pictures.psnr(f) > 55  # folded angles swap light and view in half of the directions
    assert 34 > pictures.psnr(0.9 * f) > 24
    assert 54 > pictures.psnr(0.99 * f) > 44


def test_derivatives_match_finite_differences() -> None:
    goal = FitObjective.of(GLOSSY.evaluate, COARSE)
    f = GLOSSY.at(goal.where)
    change = np.random.default_rng(0).normal(size=f.shape) * f
    residual, slopes = goal.residual_and_slopes(f, change[None])
    np.testing.assert_allclose(residual, goal.residual(f))
    difference = (goal.residual(f + 1e-6 * change) - residual) / 1e-6
    assert np.linalg.norm(slopes[:, 0] - difference) < 1e-3 * np.linalg.norm(difference)


def test_encoding_clips_at_white_and_zero() -> None:
    value, slope = encoded(np.array([-0.1, 0.0, 0.002, 0.5, 1.5]))
    np.testing.assert_allclose(value, [0, 0, 0.02584, 0.735357, 1], atol=1e-6)
    assert slope[-1] == 0 and slope[3] == pytest.approx(1.055 / 2.4 * 0.5 ** (1 / 2.4 - 1))


def test_invalid_brdf_is_rejected() -> None:
    with pytest.raises(FitError):
        Pictures.of(lambda angles: np.full((len(angles.theta_h), 3), np.inf))
