"""What glTF and UsdPreviewSurface show of a Principled: by formulas with known answers."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from patina.core.angles import Angles, half_difference
from patina.core.appearance.lobe_stack import Lobe, LobeStack
from patina.core.appearance.principled import Principled
from patina.core.export import gltf_model, materialx_model, preview_surface
from patina.core.export.dropped import dropped_inputs
from patina.core.export.losses import cube_root_error

MODELS = [gltf_model.evaluate, preview_surface.evaluate]


def straight(model, principled: Principled) -> np.ndarray:
    """f where light, view and normal are one: D·f0/4 + diffuse, D = 1/(π α²)."""
    return model(principled, Angles(*(np.zeros(1),) * 3))[0]


@pytest.mark.parametrize("model", MODELS)
def test_straight_down_it_is_arithmetic(model) -> None:
    color = np.array([0.8, 0.4, 0.1])
    metal = Principled(base_color=color, metallic=1.0, roughness=0.5)
    assert straight(model, metal) == pytest.approx(color / (4 * np.pi * 0.5**4), rel=1e-6)
    plastic = Principled(base_color=color, roughness=0.5)
    expected = 0.96 * color / np.pi + 0.04 / (4 * np.pi * 0.5**4)
    assert straight(model, plastic) == pytest.approx(expected, rel=1e-6)


def test_the_specular_level_is_kept_by_gltf_and_lost_in_usd() -> None:
    dull = Principled(base_color=np.zeros(3), roughness=0.5, specular_ior_level=0.1)
    bright = Principled(base_color=np.zeros(3), roughness=0.5)
    kept = straight(gltf_model.evaluate, dull) / straight(gltf_model.evaluate, bright)
    assert kept == pytest.approx([0.2] * 3)
    lost = straight(preview_surface.evaluate, dull) / straight(preview_surface.evaluate, bright)
    assert lost == pytest.approx([1.0] * 3)
    # beyond 0.5 glTF's factor is at its end and the colour takes over
    shiny = Principled(base_color=np.zeros(3), roughness=0.5, specular_ior_level=1.0)
    more = straight(gltf_model.evaluate, shiny) / straight(gltf_model.evaluate, bright)
    assert more == pytest.approx([2.0] * 3)


@pytest.mark.parametrize("model", MODELS)
def test_close_to_the_principled_it_stands_for(model) -> None:
    """Three implementations of nearly one model: a few per cent, not tens. (UsdPreviewSurface's
    metal keeps its colour at grazing angles, Blender's turns white.)"""
    for principled in (
        Principled(base_color=np.array([0.6, 0.3, 0.1]), roughness=0.4),
        Principled(base_color=np.array([0.9, 0.6, 0.2]), metallic=1.0, roughness=0.3),
        Principled(roughness=0.6, coat_weight=1.0, coat_roughness=0.2),
    ):
        error = cube_root_error(partial(model, principled), principled.evaluate)
        assert error < 0.08


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("roughness", [0.3, 0.7])
def test_no_more_light_leaves_than_came(model, roughness: float) -> None:
    """Directional albedo of a white coated plastic by quadrature over the hemisphere."""
    white = Principled(np.ones(3), roughness=roughness, coat_weight=1.0, coat_roughness=0.3)
    view = np.array([np.sin(0.6), 0.0, np.cos(0.6)])
    mu, phi = np.meshgrid((np.arange(200) + 0.5) / 200, (np.arange(200) + 0.5) / 200 * 2 * np.pi)
    sin = np.sqrt(1 - mu**2)
    light = np.stack([sin * np.cos(phi), sin * np.sin(phi), mu], axis=-1).reshape(-1, 3)
    angles = half_difference(np.array([0.0, 0.0, 1.0]), light, np.broadcast_to(view, light.shape))
    f = model(white, angles)
    albedo = (f * light[:, 2:]).mean(axis=0) * 2 * np.pi
    assert (albedo < 1.03).all() and (albedo > 0.6).all()


def test_dropped_inputs_are_those_that_matter() -> None:
    plain = Principled()
    assert dropped_inputs(plain, gltf_model.DROPPED) == ()
    coated = Principled(coat_ior=1.8, coat_weight=0.5)
    assert dropped_inputs(coated, gltf_model.DROPPED) == ("Coat IOR (1.8)",)
    assert dropped_inputs(Principled(coat_ior=1.8), gltf_model.DROPPED) == ()  # no coat at all
    dull = Principled(specular_ior_level=0.1)
    assert dropped_inputs(dull, preview_surface.DROPPED) == ("Specular IOR Level (0.1)",)


def test_materialx_adds_what_rough_lobes_lose() -> None:
    """A white rough metal: one lobe of single scattering is dark, MaterialX brings it to white."""
    white = LobeStack(np.zeros(3), 0.0, (Lobe(np.ones(3), np.ones(3), 0.9),))
    mu, phi = np.meshgrid((np.arange(150) + 0.5) / 150, (np.arange(150) + 0.5) / 150 * 2 * np.pi)
    sin = np.sqrt(1 - mu**2)
    light = np.stack([sin * np.cos(phi), sin * np.sin(phi), mu], axis=-1).reshape(-1, 3)
    view = np.broadcast_to(np.array([np.sin(0.7), 0.0, np.cos(0.7)]), light.shape)
    angles = half_difference(np.array([0.0, 0.0, 1.0]), light, view)
    single, shown = (
        (f * light[:, 2:]).mean() * 2 * np.pi
        for f in (white.evaluate(angles), materialx_model.evaluate(white, angles))
    )
    assert single < 0.85 and shown == pytest.approx(1.0, abs=0.05)


def test_materialx_and_blender_agree_on_smooth_grey_lobes() -> None:
    grey = LobeStack(np.full(3, 0.3), 0.4, (Lobe(np.full(3, 0.05), np.ones(3), 0.2),))
    assert cube_root_error(partial(materialx_model.evaluate, grey), grey.evaluate) < 0.01
