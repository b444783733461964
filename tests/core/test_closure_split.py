"""The split of a BRDF into Cycles closures and a remainder for the portal, and the sampling table
of the remainder."""

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
def test_hemisphere_covers_all_directions_once(degrees):
    hemisphere = Hemisphere.of(np.radians(degrees), 96, 24)
    assert hemisphere.half_solid.sum() == pytest.approx(2 * np.pi, rel=1e-9)
    # cells at the horizon are half visible
    assert hemisphere.solid.sum() == pytest.approx(2 * np.pi, rel=0.03)
    assert np.sum(hemisphere.solid * hemisphere.cos_i) == pytest.approx(np.pi, rel=0.005)
    light, view = light_view(*hemisphere.angles)
    visible = hemisphere.solid > 0
    np.testing.assert_allclose(light[visible, 2], hemisphere.cos_i[visible], atol=1e-9)
    np.testing.assert_allclose(view[visible, 2], view_at(hemisphere.theta_o)[2], atol=1e-9)


def test_lambertian_leaves_no_remainder():
    split = closure_split.split(lambert)
    assert split.rest < 1e-3
    expected = 0.6 / np.pi * np.linspace(0, 1, closure_split.KNOTS)
    np.testing.assert_allclose(split.ramp[0, :, 0], expected, atol=2e-3)


def test_rough_metal_leaves_a_small_remainder_and_its_lobe_width_is_found():
    metal = Principled(base_color=np.full(3, 0.7), metallic=1.0, roughness=0.4)
    split = closure_split.split(metal.evaluate)
    assert split.rest < 0.06
    assert np.min(np.abs(np.log(split.alpha / 0.16))) < np.log(1.5)


def test_sampling_table_is_a_probability_density():
    """The cumulative distributions of the table give each cell the probability of its density."""
    split = closure_split.split(PAINT.evaluate)
    table = sampling_table.sampling_table(PAINT.evaluate, split)
    n_h, n_p = sampling_table.CELLS
    sin2_half_theta = np.sin(theta_edges(n_h) / 2) ** 2
    solid = 2 * np.diff(sin2_half_theta)[:, None] * (2 * np.pi / n_p)
    for v in (0, 12, 22):
        mass = table.density[v] * solid
        assert mass.sum() == pytest.approx(1.0, rel=1e-6)
        marginal = np.diff(table.marginal[v], prepend=0.0)
        conditional = np.diff(table.conditional[v], prepend=0.0, axis=1)
        np.testing.assert_allclose(marginal[:, None] * conditional, mass, atol=1e-6)
        assert (marginal >= 0).all() and (conditional >= -1e-12).all()


def test_sampling_table_reduces_the_variance_of_the_remainder():
    """The second moment of remainder / density is far smaller than with cosine sampling."""
    split = closure_split.split(PAINT.evaluate)
    table = sampling_table.sampling_table(PAINT.evaluate, split)
    v = 10
    hemisphere = Hemisphere.of(split.theta_o[v], *sampling_table.CELLS)
    remainder = PAINT.evaluate(hemisphere.angles) * hemisphere.cos_i[:, None]
    weights = np.concatenate([split.ramp[v], split.lobes[v]])
    remainder = (remainder - closure_split.closures(hemisphere, tuple(split.alpha)) @ weights).mean(
        axis=1
    )
    density = table.density[v].ravel() * hemisphere.half_solid / np.maximum(hemisphere.solid, 1e-30)
    valid = (hemisphere.solid > 0) & (density > 0)
    second_moment = {
        "table": np.sum(remainder[valid] ** 2 / density[valid] * hemisphere.solid[valid]),
        "cosine": np.sum(
            (remainder**2 / (hemisphere.cos_i / np.pi + 1e-9) * hemisphere.solid)[valid]
        ),
    }
    assert second_moment["table"] < 0.5 * second_moment["cosine"]


def test_albedo_of_a_lambertian_matches_the_closed_form():
    theta = np.radians([0.0, 45.0, 80.0])
    np.testing.assert_allclose(directional_albedo(lambert, theta), 0.6, rtol=0.003)
    assert limit(np.array([[0.5, 1.6, 1.0], [0.1, 0.9, 1.0]])) == pytest.approx([1 / 1.6, 1.0])


def test_world_with_a_sun_has_one_bright_texel():
    sky = np.full((64, 128, 3), 0.5)
    sky[20, 40] = 5000.0
    texels = world_texels(sky)
    assert texels is not None
    bright_texels = np.argwhere(texels[..., 0] > 0)
    assert bright_texels.tolist() == [[20, 40]]
    solid = (np.cos(20 * np.pi / 64) - np.cos(21 * np.pi / 64)) * 2 * np.pi / 128
    assert texels[20, 40, 0] == pytest.approx(1 / solid, rel=1e-5)
    assert texels[19, 0, 2] == 0 and texels[20, 0, 2] == 1
    assert texels[20, 39, 1] == 0 and texels[20, 40, 1] == 1


def test_uniform_world_has_no_sampling_table():
    assert world_texels(np.full((32, 64, 3), 0.7)) is None
    assert world_texels(np.full((32, 64, 3), np.nan)) is None


def test_large_world_is_averaged_to_a_normalised_density():
    rng = np.random.default_rng(0)
    sky = rng.exponential(1.0, (600, 1100, 3)) ** 4
    texels = world_texels(sky)
    assert texels is not None and texels.shape == (256, 512, 3)
    edges = np.cos(np.linspace(0, np.pi, 257))
    solid = (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / 512
    assert np.sum(texels[..., 0] * solid) == pytest.approx(1.0, rel=1e-4)
