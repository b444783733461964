"""A near lamp replaces the wrong directions and intensities that were found before it."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.selection.baseline import fit_baseline
from patina.core.diagnose.selection.composed_effects import with_parts_replaced, without_parts
from patina.core.diagnose.selection.trial import Trial
from patina.core.diagnose.solver.gauss_newton import fit
from tests.make_lit_ball import GLOSSY, changed, lit_ball

NORMALS = np.radians(0.3)  # expected error of the ball's exact normals
GAINS = np.exp([0.3, -0.2, 0.1, -0.3, 0.2, -0.1])  # of the six photos


@pytest.fixture(scope="module")
def now():
    """The fit of photos whose intensities drift, with the gains and the directions in the model."""
    context = lit_ball(5, GLOSSY)
    pixels = context.pixels
    context = changed(context, pixels.observed * GAINS[pixels.photo, None].astype(np.float32))
    now = fit_baseline(context, NORMALS, 8).fitted
    model = now.model
    for effect in (LightIntensity.of(context), LightDirection.of(context)):
        model = model.with_effect(effect, np.zeros(len(effect.parameters)))
    return fit(model, now.deviation)


def trial(effect, gain: float) -> Trial:
    size = len(effect.parameters)
    return Trial(effect, np.zeros(size), np.ones(size), np.full(10, gain), 10, 0.02, 0.0)


def test_parts_leave_the_model_before_the_whole_is_fitted(now):
    assert now.cost < 0.8 * without_parts(now, NearLight.cause).cost
    assert "light_intensity" not in without_parts(now, NearLight.cause).model.causes
    assert "light_direction" not in without_parts(now, NearLight.cause).model.causes
    kept = set(without_parts(now, NearLight.cause).model.causes)
    assert kept == set(now.model.causes) - {"light_intensity", "light_direction"}


@pytest.mark.parametrize("cause", ["vignetting", "light_direction", "light_intensity"])
def test_other_effects_start_from_the_whole_model(now, cause):
    assert without_parts(now, cause) is now


def test_the_whole_takes_the_place_and_the_gain_of_its_parts():
    context = lit_ball(5)
    part, other, whole = (
        trial(effect.of(context), gain)
        for effect, gain in ((LightIntensity, 3.0), (Vignetting, 2.0), (NearLight, 1.0))
    )
    assert with_parts_replaced([part, other], whole)[0] is other
    assert with_parts_replaced([part, other], whole)[1].gain == pytest.approx(40)
    assert [each.gain for each in with_parts_replaced([part], other)] == [30.0, 20.0]
