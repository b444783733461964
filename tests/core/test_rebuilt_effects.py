"""Effects that are built again from the BRDFs of a joint fit."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.diagnose.effects.ambient_light import AmbientLight
from patina.core.diagnose.selection.effect_trials import (
    held_out_predictions,
    try_effect,
    try_rebuilt,
)
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.residual_scale import expected_deviation
from tests.make_lit_ball import GLOSSY, changed, lit_ball


class WorseWhenRebuilt(AmbientLight):
    """Its second model has the light of the room in the wrong places."""

    def rebuilt(self, context, x):
        return WorseWhenRebuilt(np.roll(self.reflected, 400, axis=0))


@pytest.mark.parametrize("kind", [AmbientLight, WorseWhenRebuilt])
def test_the_model_of_added_light_that_gains_more_is_kept(kind):
    context = lit_ball(2, GLOSSY)
    room = kind(AmbientLight.of(context).reflected)
    context = changed(context, context.pixels.observed + 0.1 * room.reflected)
    deviation = expected_deviation(context.pixels, context.brdfs, np.radians(0.2))
    now = fit(Model(context.pixels, context.brdfs), deviation)
    without = held_out_predictions(now)
    first = try_effect(now, without, room)
    found = try_rebuilt(now, without, first, context)
    assert first.gain > 0 and found.gain >= first.gain
    if kind is WorseWhenRebuilt:
        assert found.effect is room
