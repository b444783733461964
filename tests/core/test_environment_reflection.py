"""Surroundings as lobes: finer ones where it is bright."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from patina.core.diagnose.effects.environment_reflection import (
    LOBES,
    MAX_FINE_LOBES,
    EnvironmentReflection,
)
from tests.make_lit_ball import lit_ball

WINDOW = np.array([0.6, -0.3, 0.7]) / np.linalg.norm([0.6, -0.3, 0.7])
HALF = np.radians(20)


def described(effect: EnvironmentReflection, shown: np.ndarray) -> tuple[np.ndarray, float]:
    """Numbers that describe shown (n, 3) best, and what they leave of it, relative RMS."""
    matrix = effect.reflected.reshape(len(effect.parameters), -1).T.astype(float)
    x, left = nnls(matrix, shown.ravel().astype(float))
    return x, float(left / np.linalg.norm(shown))


def test_the_edge_of_a_window_is_found_once_it_is_known_where_it_is_bright():
    context = lit_ball()
    around = context.surroundings
    inside = (around.towards @ WINDOW.astype(np.float32) > np.cos(HALF)) & around.open
    shown = context.pixel_level / np.pi * around.reflected_light(inside.astype(np.float32))
    effect = EnvironmentReflection.of(context)
    x, left = described(effect, shown)
    finer = effect.rebuilt(context, x)
    x_finer, left_finer = described(finer, shown)
    assert LOBES < len(finer.parameters) <= LOBES + MAX_FINE_LOBES
    assert len(set(finer.parameters.names)) == len(finer.parameters)
    assert left_finer < 0.5 * left
    angle = np.radians(np.arange(0, 90, 1.0))
    aside = np.cross(WINDOW, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    away = np.cos(angle)[:, None] * WINDOW + np.sin(angle)[:, None] * aside
    radiance = finer.radiance(away, x_finer)
    assert abs(radiance[angle < 0.5 * HALF].mean() - 1) < 0.15
    assert radiance[angle > 2 * HALF].max() < 0.1


def test_a_room_that_is_bright_all_over_stays_within_bounds():
    context = lit_ball()
    finer = EnvironmentReflection.of(context).rebuilt(context, np.ones(LOBES))
    assert len(finer.parameters) == LOBES + MAX_FINE_LOBES
