"""The rendered sphere under environments for which the exact answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.appearance.principled import Principled
from tools.experiments import sphere_light

DISC = 10
GLOSSY = Principled(base_color=np.array([0.6, 0.1, 0.05]), roughness=0.3)


def under(radiance: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> sphere_light.Lit:
    """A disc under a synthetic environment (32, 64, 3)."""
    maps = [radiance.astype(np.float32)]
    monkeypatch.setattr(sphere_light, "pyramid", lambda name: sphere_light.Pyramid(tuple(maps)))
    sphere_light.lit.cache_clear()
    try:
        return sphere_light.lit(DISC, "made up")
    finally:
        sphere_light.lit.cache_clear()


def lambert(angles: Angles) -> np.ndarray:
    return np.full((len(angles.theta_h), 3), 1 / np.pi)


def test_white_sphere_is_invisible_in_uniform_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    light = under(np.full((32, 64, 3), 0.7), monkeypatch)
    np.testing.assert_allclose(light.table(lambert), 0.7, rtol=0.01)


def test_hemispherical_sky_gives_analytic_irradiance(monkeypatch: pytest.MonkeyPatch) -> None:
    """A uniform upper half and a black lower one: irradiance π(1 + n·up)/2."""
    world = np.zeros((64, 128, 3))
    world[:32] = 1.0
    light = under(world, monkeypatch)
    axis = (np.arange(DISC) + 0.5) / DISC * 2 - 1
    up = np.broadcast_to(-axis[:, None], (DISC, DISC))[light.inside]
    found = light.table(lambert)[0].mean(axis=-1)
    np.testing.assert_allclose(found, (1 + up) / 2, atol=0.04)


def test_mirror_reflects_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sharp metal of reflectance 1 at the disc's centre reflects what is behind the camera."""
    rows, columns = np.mgrid[0:64, 0:128]
    direction_y = np.sin((rows + 0.5) / 64 * np.pi) * np.sin((columns + 0.5) / 128 * 2 * np.pi)
    world = np.repeat((2.0 + direction_y)[..., None], 3, axis=2)
    light = under(world, monkeypatch)
    metal = Principled(base_color=np.ones(3), metallic=1.0, roughness=0.12)
    middle = np.argmax(light.cos_o[:, 0])
    assert light.model(metal.at)[0, middle] == pytest.approx(1.0, abs=0.1)  # y is -1 there


def test_model_without_reciprocity_changes_result_slightly(monkeypatch: pytest.MonkeyPatch) -> None:
    """By angles half of the directions are swapped, which changes a layered model slightly."""
    light = under(np.ones((32, 64, 3)), monkeypatch)
    by_angles, by_cosines = light.table(GLOSSY.evaluate), light.model(GLOSSY.at)
    np.testing.assert_allclose(by_angles, by_cosines, rtol=0.2)
    assert np.abs(by_angles / by_cosines - 1).max() > 1e-4
