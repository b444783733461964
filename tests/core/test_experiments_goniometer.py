"""The experiment with goniometer measurements: its file, its coordinates, and lost readings."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from patina.core.angles import half_difference
from tools.experiments import goniometer


def directions(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    found = rng.normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2]) + 0.1
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_file_holds_directions_and_means_of_three_bands(tmp_path):
    file = tmp_path / "paint.brdf"
    file.write_text(
        "# num wls\n4\n# wls\n450 550 650 700\n"
        "0.5 0.0 0.5 3.14159265 0.1 0.2 0.3 9.0\n"
        "0.5 0.0 0.2 1.0 # the values follow\n0.4 0.5 0.6 9.0\n"
    )
    angles, rho = goniometer.read(file)
    assert angles.theta_h[0] == pytest.approx(0.0, abs=1e-6), "the mirror direction"
    assert angles.theta_d[0] == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(rho, [[0.3, 0.2, 0.1], [0.6, 0.5, 0.4]])


def test_coordinates_are_those_of_an_isotropic_reciprocal_brdf():
    light, view = directions(200, 0), directions(200, 1)
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    expected = goniometer.coordinates(half_difference(normal, light, view))
    flip = np.array([1.0, -1.0, 1.0])
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    for one, other in ((view, light), (light * flip, view * flip), (light @ turn, view @ turn)):
        found = goniometer.coordinates(half_difference(normal, one, other))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_lost_readings_are_found_and_a_highlight_is_none():
    light, view = directions(1500, 2), directions(1500, 3)
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    angles = half_difference(normal, light, view)
    rho = 0.05 + 2.0 * np.exp(-((angles.theta_h / 0.2) ** 2))
    rho = np.repeat(np.asarray(rho)[:, None], 3, axis=1)
    broken = np.zeros(len(rho), bool)
    broken[::50] = True
    rho[broken] = 0.0
    found = goniometer.lost(angles, rho)
    assert found[broken].mean() > 0.95
    assert found[~broken].mean() < 0.02
