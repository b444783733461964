"""The numpy Principled model against Cycles: a sphere under one sun, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.core.appearance.principled import Principled  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

SOCKETS = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "ior": "IOR",
    "specular_ior_level": "Specular IOR Level",
    "specular_tint": "Specular Tint",
    "coat_weight": "Coat Weight",
    "coat_roughness": "Coat Roughness",
    "coat_ior": "Coat IOR",
    "coat_tint": "Coat Tint",
    "diffuse_roughness": "Diffuse Roughness",
}
GOLD, TINT = np.array([0.9, 0.6, 0.2]), np.array([0.2, 0.5, 1.0])
CASES = [
    {},
    {"roughness": 0.15},
    {"roughness": 1.0},
    {"roughness": 0.2, "specular_ior_level": 0.1},
    {"roughness": 0.35, "ior": 2.2},
    {"roughness": 0.3, "specular_tint": TINT},
    {"metallic": 1.0, "base_color": GOLD, "roughness": 0.3},
    {"metallic": 1.0, "base_color": GOLD, "roughness": 0.5, "specular_tint": TINT},
    {"metallic": 0.5, "base_color": GOLD, "roughness": 0.4, "specular_ior_level": 0.9},
    {"coat_weight": 0.7, "coat_roughness": 0.1, "roughness": 0.6},
    {"coat_weight": 0.7, "coat_roughness": 0.1, "roughness": 0.6, "coat_tint": TINT},
    {"diffuse_roughness": 1.0, "base_color": GOLD, "specular_ior_level": 0.0},
    {"diffuse_roughness": 0.4, "base_color": GOLD, "roughness": 0.7},
]


@pytest.fixture(scope="module")
def node():
    sphere = cycles_sphere.new_scene(size=64)
    material = bpy.data.materials.new("principled")
    material.use_nodes = True
    sphere.data.materials.append(material)
    return next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")


@pytest.mark.parametrize("case", CASES, ids=lambda c: "-".join(c) or "default")
def test_principled_matches_cycles(node, case, tmp_path):
    light = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
    lamp = cycles_sphere.sun(light, 2.0)
    node.distribution = "GGX"
    model = Principled(**case)
    for field, socket in SOCKETS.items():
        value = getattr(model, field)
        node.inputs[socket].default_value = (*value, 1.0) if np.ndim(value) else value
    image = cycles_sphere.render(tmp_path)
    bpy.data.objects.remove(lamp)
    cycles_sphere.assert_matches_model(image, model, light, 2.0)
