"""OpenPBR: its fit recovers its own inputs, and is closer than values taken from the Principled."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.appearance.closeness import FitObjective
from patina.core.appearance.open_pbr.fit import fit_open_pbr, from_principled
from patina.core.appearance.open_pbr.model import OpenPBR
from patina.core.appearance.principled import Principled
from patina.core.appearance.principled_fit import fit_principled
from patina.core.appearance.sheen import sheen_albedo
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.export.gltf_model import GLTF
from patina.core.export.preview_surface import PREVIEW_SURFACE
from tests import make_result as made

GOLD = np.array([0.9, 0.6, 0.2])
SURFACES = {
    "plastic": OpenPBR(base_color=0.5 * GOLD, specular_roughness=0.25),
    "metal": OpenPBR(base_color=GOLD, base_metalness=1.0, specular_roughness=0.4),
    "coated": OpenPBR(
        base_color=0.6 * GOLD, specular_roughness=0.6, coat_weight=1.0, coat_roughness=0.1,
        coat_color=GOLD, coat_darkening=0.0,
    ),
    "cloth": OpenPBR(
        base_color=0.3 * GOLD, specular_weight=0.3, specular_roughness=0.7, fuzz_weight=0.6,
        fuzz_roughness=0.4,
    ),
}  # fmt: skip
MEASURED = [made.BRONZE, made.FABRIC, made.ACRYLIC]


@pytest.mark.parametrize("truth", SURFACES.values(), ids=SURFACES)
def test_the_fit_finds_surfaces_of_its_own_kind(truth: OpenPBR) -> None:
    fit = fit_open_pbr(truth.evaluate, fit_principled(truth.evaluate).principled)
    assert fit.error < 0.02
    assert fit.surface.base_metalness == truth.base_metalness


@pytest.mark.parametrize("place", MEASURED, ids=["bronze", "fabric", "acrylic"])
def test_the_fit_is_closer_to_a_measured_material_than_the_values_of_the_principled(place) -> None:
    evaluate = PrincipalBRDF(default_basis(), made.coefficients(place)).evaluate
    principled = fit_principled(evaluate).principled
    objective = FitObjective.of(evaluate)
    translated = objective.cost(from_principled(principled).at(objective.where)) ** 0.5
    own = objective.cost(fit_open_pbr(evaluate, principled).surface.at(objective.where)) ** 0.5
    assert own < 0.7 * translated


@pytest.mark.parametrize("shown", [GLTF, PREVIEW_SURFACE], ids=["glTF", "UsdPreviewSurface"])
@pytest.mark.parametrize("place", MEASURED, ids=["bronze", "fabric", "acrylic"])
def test_a_fit_for_a_format_is_closer_in_it_than_the_one_for_blender(place, shown) -> None:
    evaluate = PrincipalBRDF(default_basis(), made.coefficients(place)).evaluate
    own = fit_principled(evaluate, shown=shown)
    blender = fit_principled(evaluate)
    goal = {name: _cost(evaluate, shown, fit.principled)
            for name, fit in (("own", own), ("blender", blender))}  # fmt: skip
    assert goal["own"] <= 1.02 * goal["blender"]
    if place == made.ACRYLIC:
        assert goal["own"] < 0.97 * goal["blender"]
    assert own.principled.diffuse_roughness == 0.0
    if shown is PREVIEW_SURFACE:
        assert own.principled.specular_ior_level == 0.5
        assert np.all(own.principled.specular_tint == 1.0)


def _cost(evaluate, shown, principled: Principled) -> float:
    """The objective of the fits, as the format computes the inputs."""
    objective = FitObjective.of(evaluate)
    return objective.cost(shown.at(principled, objective.where)) ** 0.5


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_sheen_reflects_more_at_grazing_angles_and_never_gains_energy(roughness) -> None:
    cos = np.linspace(0.02, 1, 50)
    albedo = sheen_albedo(cos, roughness)
    assert np.all(np.diff(albedo) < 1e-9) and albedo.max() <= 1.0


def test_surfaces_never_gain_energy() -> None:
    """Directional albedo of a white surface with every layer, by uniform directions of light."""
    white = OpenPBR(
        base_color=np.ones(3), coat_weight=1.0, coat_roughness=0.2, fuzz_weight=1.0,
        base_metalness=0.3,
    )  # fmt: skip
    rng = np.random.default_rng(0)
    light = rng.normal(size=(200_000, 3))
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    light[:, 2] = np.abs(light[:, 2])
    for angle in (0.1, 0.8, 1.3):
        view = np.array([np.sin(angle), 0.0, np.cos(angle)])
        f = white.reflectance(light, np.broadcast_to(view, light.shape))
        assert (2 * np.pi * (f * light[:, 2:]).mean(axis=0)).max() < 1.03
