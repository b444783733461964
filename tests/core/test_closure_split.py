"""What goes to Cycles' closures, what to the portal, and the table it is drawn from."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles, light_view
from patina.core.appearance import closure_split, sampling_table
from patina.core.appearance.energy import directional_albedo, limit
from patina.core.appearance.hemisphere import Hemisphere, theta_edges, view_at
from patina.core.appearance.principled import Principled
from patina.core.appearance.world_table import world_texels

PAINT = Principled(base_color=np.array([0.5, 0.2, 0.1]), roughness=0.3)


def lambert(angles: Angles) -> np.ndarray:
    return np.full((angles.theta_h.size, 3), 0.6 / np.pi)


@pytest.mark.parametrize("degrees", [0.0, 35.0, 70.0, 88.0])
def test_the_hemisphere_holds_all_directions_once(degrees):
    sphere = Hemisphere.of(np.radians(degrees), 96, 24)
    assert sphere.half_solid.sum() == pytest.approx(2 * np.pi, rel=1e-9)
    assert sphere.solid.sum() == pytest.approx(2 * np.pi, rel=0.03)  # half cells at the horizon
    assert np.sum(sphere.solid * sphere.cos_i) == pytest.approx(np.pi, rel=0.005)
    light, view = light_view(*sphere.angles)
    seen = sphere.solid > 0
    np.testing.assert_allclose(light[seen, 2], sphere.cos_i[seen], atol=1e-9)
    np.testing.assert_allclose(view[seen, 2], view_at(sphere.theta_o)[2], atol=1e-9)


def test_a_lambertian_leaves_nothing_to_the_portal():
    split = closure_split.split(lambert)
    assert split.rest < 1e-3
    expected = 0.6 / np.pi * np.linspace(0, 1, closure_split.KNOTS)
    np.testing.assert_allclose(split.ramp[0, :, 0], expected, atol=2e-3)


def test_a_rough_metal_leaves_little_and_lobes_of_its_own_width_are_found():
    metal = Principled(base_color=np.full(3, 0.7), metallic=1.0, roughness=0.4)
    split = closure_split.split(metal.evaluate)
    assert split.rest < 0.06
    assert np.min(np.abs(np.log(split.alpha / 0.16))) < np.log(1.5)


def test_what_the_table_says_is_a_density():
    """Drawn by its own cumulative numbers, a cell comes as often as its density says."""
    split = closure_split.split(PAINT.evaluate)
    table = sampling_table.sampling_table(PAINT.evaluate, split)
    n_h, n_p = sampling_table.CELLS
    rise = np.sin(theta_edges(n_h) / 2) ** 2
    solid = 2 * np.diff(rise)[:, None] * (2 * np.pi / n_p)
    for v in (0, 12, 22):
        mass = table.density[v] * solid
        assert mass.sum() == pytest.approx(1.0, rel=1e-6)
        marginal = np.diff(table.marginal[v], prepend=0.0)
        conditional = np.diff(table.conditional[v], prepend=0.0, axis=1)
        np.testing.assert_allclose(marginal[:, None] * conditional, mass, atol=1e-6)
        assert (marginal >= 0).all() and (conditional >= -1e-12).all()


def test_the_rest_is_drawn_where_it_is():
    """Weights rest / density spread far less than with a cosine."""
    split = closure_split.split(PAINT.evaluate)
    table = sampling_table.sampling_table(PAINT.evaluate, split)
    v = 10
    sphere = Hemisphere.of(split.theta_o[v], *sampling_table.CELLS)
    left = PAINT.evaluate(sphere.angles) * sphere.cos_i[:, None]
    weights = np.concatenate([split.ramp[v], split.lobes[v]])
    left = (left - closure_split.closures(sphere, tuple(split.alpha)) @ weights).mean(axis=1)
    tabled = table.density[v].ravel() * sphere.half_solid / np.maximum(sphere.solid, 1e-30)
    kept = (sphere.solid > 0) & (tabled > 0)
    second = {
        "table": np.sum(left[kept] ** 2 / tabled[kept] * sphere.solid[kept]),
        "cosine": np.sum((left**2 / (sphere.cos_i / np.pi + 1e-9) * sphere.solid)[kept]),
    }
    assert second["table"] < 0.5 * second["cosine"]


def test_albedo_against_a_closed_form():
    theta = np.radians([0.0, 45.0, 80.0])
    np.testing.assert_allclose(directional_albedo(lambert, theta), 0.6, rtol=0.003)
    assert limit(np.array([[0.5, 1.6, 1.0], [0.1, 0.9, 1.0]])) == pytest.approx([1 / 1.6, 1.0])


def test_a_world_with_a_sun_has_one_bright_spot():
    sky = np.full((64, 128, 3), 0.5)
    sky[20, 40] = 5000.0
    texels = world_texels(sky)
    assert texels is not None
    bright = np.argwhere(texels[..., 0] > 0)
    assert bright.tolist() == [[20, 40]]
    solid = (np.cos(20 * np.pi / 64) - np.cos(21 * np.pi / 64)) * 2 * np.pi / 128
    assert texels[20, 40, 0] == pytest.approx(1 / solid, rel=1e-5)
    assert texels[19, 0, 2] == 0 and texels[20, 0, 2] == 1
    assert texels[20, 39, 1] == 0 and texels[20, 40, 1] == 1


def test_an_even_world_has_none():
    assert world_texels(np.full((32, 64, 3), 0.7)) is None
    assert world_texels(np.full((32, 64, 3), np.nan)) is None


def test_a_large_world_is_averaged_without_losing_light():
    rng = np.random.default_rng(0)
    sky = rng.exponential(1.0, (600, 1100, 3)) ** 4
    texels = world_texels(sky)
    assert texels is not None and texels.shape == (256, 512, 3)
    edges = np.cos(np.linspace(0, np.pi, 257))
    solid = (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / 512
    assert np.sum(texels[..., 0] * solid) == pytest.approx(1.0, rel=1e-4)
