"""The OSL shader with other colours, specular parts and roughness: Cycles against the model of
materials that vary over the surface (core/varying/node_model.py), summed in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.angles import Angles, half_difference  # noqa: E402
from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.basis import PrincipalBRDF  # noqa: E402
from patina.core.varying.node_model import (  # noqa: E402
    COUNT,
    GLOSS,
    SPECULAR,
    TINT,
    NodeModel,
    specular_factor,
)
from patina.scene.material import material_nodes  # noqa: E402
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402
from tests.wheel.test_osl_worlds import WORLDS  # noqa: E402
from tests.wheel.world_light import (  # noqa: E402
    VIEW,
    assert_matches_quadrature,
    assign_material,
    world,
)

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)

COATED = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)
METAL = Principled(base_color=np.array([0.8, 0.5, 0.3]), roughness=0.4, metallic=1.0)
MATERIALS = pytest.mark.parametrize("made", [COATED, METAL], ids=["coated", "metal"])
FACTORS = pytest.mark.parametrize(
    ("specular", "roughness"), [(1.0, 2.0), (1.0, 0.6), (2.5, 1.0), (0.3, 1.5)]
)
PAINT = np.array([0.3, 1.0, 1.5])
HIGHLIGHT = 0.4, -0.3  # colour of the specular part


@dataclass(frozen=True)
class Changed:
    """A node of the model, of one set of parameters."""

    model: NodeModel
    parameters: np.ndarray

    def evaluate(self, angles: Angles) -> np.ndarray:
        wide = np.broadcast_to(self.parameters, (angles.theta_h.size, COUNT))
        return self.model.reflectance(angles, wide)


def changed(brdf: PrincipalBRDF, paint: np.ndarray, specular: float, roughness: float) -> Changed:
    """The BRDF as the model of a node changes it."""
    parameters = np.zeros(COUNT, np.float32)
    parameters[:3], parameters[SPECULAR] = np.log(paint), np.log(specular)
    parameters[GLOSS], parameters[TINT] = np.log(roughness), HIGHLIGHT
    return Changed(NodeModel.of(brdf), parameters)


def assign(expected: Changed, brdf: PrincipalBRDF, sphere: bpy.types.Object) -> None:
    """Give a sphere the measured material, with the node's factors in its shader."""
    sockets = {s.identifier: s for s in assign_material(brdf, sphere).inputs}
    found = np.exp(expected.parameters)
    sockets["body"].default_value = tuple(expected.model.body)
    sockets["body_scale"].default_value = (*found[:3], 1.0)
    sockets["specular_scale"].default_value = (*specular_factor(expected.parameters[None])[0], 1.0)
    sockets["roughness_scale"].default_value = found[GLOSS]


@MATERIALS
@FACTORS
def test_sun_on_changed_material(made, specular, roughness, tmp_path):
    brdf = projected(made.evaluate, 60)
    light = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
    sphere = cycles_sphere.new_scene(size=80, osl=True)
    cycles_sphere.sun(light, 2.0)
    node = changed(brdf, PAINT, specular, roughness)
    assign(node, brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ light > 0.05) & (normal @ VIEW > 0.05)
    wide = [np.broadcast_to(v, normal[kept].shape) for v in (light, VIEW)]
    rho = node.evaluate(half_difference(normal[kept], *wide))
    expected = 2.0 * rho * (normal[kept] @ light)[:, None]
    error = np.sqrt(np.sum((image[kept] - expected) ** 2) / np.sum(expected**2))
    assert error < 0.005


@pytest.mark.parametrize(
    ("made", "specular", "roughness"),
    [(COATED, 1.0, 2.0), (METAL, 2.5, 0.6)],
    ids=["rough-coated", "sharp-metal"],
)
def test_changed_material_under_environment_image(made, specular, roughness, tmp_path):
    """The sampling of half vectors follows the roughness, and its weights stay unbiased."""
    brdf = projected(made.evaluate, 60)
    sphere = cycles_sphere.new_scene(size=32, samples=1024, osl=True)
    sky = world(WORLDS["forest"])
    node = changed(brdf, np.ones(3), specular, roughness)
    assign(node, brdf, sphere)
    assert_matches_quadrature(node, sky, tmp_path)
