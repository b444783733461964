"""The environment as a sum of lobes, with finer lobes where it is bright."""

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
WINDOW_RADIUS = np.radians(20)


def fitted_lobes(
    effect: EnvironmentReflection, radiance_shown: np.ndarray
) -> tuple[np.ndarray, float]:
    """Nonnegative parameters that fit ``radiance_shown`` (n, 3), and the relative RMS residual."""
    matrix = effect.reflected.reshape(len(effect.parameters), -1).T.astype(float)
    x, residual = nnls(matrix, radiance_shown.ravel().astype(float))
    return x, float(residual / np.linalg.norm(radiance_shown))


def test_finer_lobes_resolve_the_edge_of_a_window():
    context = lit_ball()
    surroundings = context.surroundings
    inside = (
        surroundings.towards @ WINDOW.astype(np.float32) > np.cos(WINDOW_RADIUS)
    ) & surroundings.open
    radiance_shown = (
        context.pixel_level / np.pi * surroundings.reflected_light(inside.astype(np.float32))
    )
    effect = EnvironmentReflection.of(context)
    x, residual = fitted_lobes(effect, radiance_shown)
    finer = effect.rebuilt(context, x)
    x_finer, residual_finer = fitted_lobes(finer, radiance_shown)
    assert LOBES < len(finer.parameters) <= LOBES + MAX_FINE_LOBES
    assert len(set(finer.parameters.names)) == len(finer.parameters)
    assert residual_finer < 0.5 * residual
    angle = np.radians(np.arange(0, 90, 1.0))
    perpendicular = np.cross(WINDOW, [0.0, 0.0, 1.0])
    perpendicular /= np.linalg.norm(perpendicular)
    directions = np.cos(angle)[:, None] * WINDOW + np.sin(angle)[:, None] * perpendicular
    radiance = finer.radiance(directions, x_finer)
    assert abs(radiance[angle < 0.5 * WINDOW_RADIUS].mean() - 1) < 0.15
    assert radiance[angle > 2 * WINDOW_RADIUS].max() < 0.1


def test_uniform_environment_respects_the_maximum_lobe_count():
    context = lit_ball()
    finer = EnvironmentReflection.of(context).rebuilt(context, np.ones(LOBES))
    assert len(finer.parameters) == LOBES + MAX_FINE_LOBES
