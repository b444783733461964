"""Principled BSDFs as rendered by glTF, UsdPreviewSurface and MaterialX: known values."""

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


def normal_incidence(model, principled: Principled) -> np.ndarray:
    """f with light and view along the normal: D·f0/4 + diffuse, D = 1/(π α²)."""
    return model(principled, Angles(*(np.zeros(1),) * 3))[0]


@pytest.mark.parametrize("model", MODELS)
def test_normal_incidence_matches_the_formula(model) -> None:
    color = np.array([0.8, 0.4, 0.1])
    metal = Principled(base_color=color, metallic=1.0, roughness=0.5)
    assert normal_incidence(model, metal) == pytest.approx(color / (4 * np.pi * 0.5**4), rel=1e-6)
    plastic = Principled(base_color=color, roughness=0.5)
    expected = 0.96 * color / np.pi + 0.04 / (4 * np.pi * 0.5**4)
    assert normal_incidence(model, plastic) == pytest.approx(expected, rel=1e-6)


def test_gltf_keeps_the_specular_level_and_usd_loses_it() -> None:
    dull = Principled(base_color=np.zeros(3), roughness=0.5, specular_ior_level=0.1)
    bright = Principled(base_color=np.zeros(3), roughness=0.5)
    kept = normal_incidence(gltf_model.evaluate, dull) / normal_incidence(
        gltf_model.evaluate, bright
    )
    assert kept == pytest.approx([0.2] * 3)
    lost = normal_incidence(preview_surface.evaluate, dull) / normal_incidence(
        preview_surface.evaluate, bright
    )
    assert lost == pytest.approx([1.0] * 3)
    # above 0.5 glTF's specular factor is at its maximum and the specular colour increases
    shiny = Principled(base_color=np.zeros(3), roughness=0.5, specular_ior_level=1.0)
    more = normal_incidence(gltf_model.evaluate, shiny) / normal_incidence(
        gltf_model.evaluate, bright
    )
    assert more == pytest.approx([2.0] * 3)


@pytest.mark.parametrize("model", MODELS)
def test_models_are_close_to_the_principled_bsdf(model) -> None:
    """Implementations of nearly the same model differ by less than 8 %. (At grazing angles
    UsdPreviewSurface's metal keeps its colour, while Blender's turns white.)"""
    for principled in (
        Principled(base_color=np.array([0.6, 0.3, 0.1]), roughness=0.4),
        Principled(base_color=np.array([0.9, 0.6, 0.2]), metallic=1.0, roughness=0.3),
        Principled(roughness=0.6, coat_weight=1.0, coat_roughness=0.2),
    ):
        error = cube_root_error(partial(model, principled), principled.evaluate)
        assert error < 0.08


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("roughness", [0.3, 0.7])
def test_models_conserve_energy(model, roughness: float) -> None:
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


def test_only_effective_inputs_are_reported_as_dropped() -> None:
    plain = Principled()
    assert dropped_inputs(plain, gltf_model.DROPPED) == ()
    coated = Principled(coat_ior=1.8, coat_weight=0.5)
    assert dropped_inputs(coated, gltf_model.DROPPED) == ("Coat IOR (1.8)",)
    # without a coat its IOR has no effect
    assert dropped_inputs(Principled(coat_ior=1.8), gltf_model.DROPPED) == ()
    dull = Principled(specular_ior_level=0.1)
    assert dropped_inputs(dull, preview_surface.DROPPED) == ("Specular IOR Level (0.1)",)


def test_materialx_compensates_for_multiple_scattering() -> None:
    """Single scattering darkens a rough white metal; MaterialX compensates for the loss."""
    white = LobeStack(np.zeros(3), 0.0, (Lobe(np.ones(3), np.ones(3), 0.9),))
    mu, phi = np.meshgrid((np.arange(150) + 0.5) / 150, (np.arange(150) + 0.5) / 150 * 2 * np.pi)
    sin = np.sqrt(1 - mu**2)
    light = np.stack([sin * np.cos(phi), sin * np.sin(phi), mu], axis=-1).reshape(-1, 3)
    view = np.broadcast_to(np.array([np.sin(0.7), 0.0, np.cos(0.7)]), light.shape)
    angles = half_difference(np.array([0.0, 0.0, 1.0]), light, view)
    single_scattering, compensated = (
        (f * light[:, 2:]).mean() * 2 * np.pi
        for f in (white.evaluate(angles), materialx_model.evaluate(white, angles))
    )
    assert single_scattering < 0.85 and compensated == pytest.approx(1.0, abs=0.05)


def test_materialx_and_blender_agree_on_smooth_grey_lobes() -> None:
    grey = LobeStack(np.full(3, 0.3), 0.4, (Lobe(np.full(3, 0.05), np.ones(3), 0.2),))
    assert cube_root_error(partial(materialx_model.evaluate, grey), grey.evaluate) < 0.01
