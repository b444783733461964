"""Lamps that are far from where a capture states them."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.selection.baseline import fit_baseline
from patina.core.diagnose.selection.lamp_search import fit_displaced_lamp
from tests.make_lit_ball import GLOSSY, changed, lit_ball

pytestmark = pytest.mark.slow

NORMALS = np.radians(0.3)  # expected error of the ball's exact normals
ACROSS = 8  # patches: the ball has few pixels


def test_directions_are_found_though_the_surface_may_vary():
    context = lit_ball(3, GLOSSY)
    effect = LightDirection.of(context)
    rng = np.random.default_rng(4)
    about = rng.uniform(0, 2 * np.pi, len(effect.names))
    true = np.tan(np.radians(7.0)) * np.stack([np.cos(about), np.sin(about)], axis=1).ravel()
    state = effect.shading(ShadingState.of(context.pixels), true)
    plain = ShadingState.of(context.pixels)
    shown = context.brdfs.reflected(state) / np.maximum(context.brdfs.reflected(plain), 1e-9)
    observed = np.where(plain.cos_i[:, None] > 0.05, context.pixels.observed * shown, 0.0)
    context = changed(context, observed)
    now = fit_baseline(context, NORMALS, ACROSS).fitted
    found = fit_displaced_lamp(now, LightDirection.of(context), context)
    assert found.model.causes[-1] == "light_direction"
    assert found.model.frozen == now.model.frozen
    away = (found.model.x[-1] - true).reshape(-1, 2)
    assert np.degrees(np.hypot(*away.T)) == pytest.approx(0, abs=0.7)
