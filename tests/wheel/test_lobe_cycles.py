"""The lobe stack's node group in Cycles against numpy: a sphere under one sun, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.core.appearance.lobe_fit import fit_lobe_stack  # noqa: E402
from patina.core.appearance.lobe_stack import Lobe, LobeStack  # noqa: E402
from patina.core.appearance.principled_fit import fit_principled  # noqa: E402
from patina.core.basis import PrincipalBRDF, default_basis  # noqa: E402
from patina.scene.material.lobe_group import NAME, add_lobe_stack, fill_lobe_stack  # noqa: E402
from patina.scene.material.material_nodes import create_material  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

BLACK, BROWN = np.zeros(3), np.array([0.5, 0.25, 0.1])
GLASS = Lobe(np.full(3, 0.04), np.ones(3), 0.3)
GOLD = Lobe(np.array([0.9, 0.6, 0.2]), np.ones(3), 0.25)
SATIN = Lobe(np.array([0.1, 0.02, 0.05]), np.array([0.5, 0.2, 0.3]), 0.6)
TURNING = Lobe(
    np.array([0.1, 0.3, 0.05]), np.array([0.9, 0.8, 0.7]), 0.5,
    np.array([0.5, 0.01, 0.1]), np.array([0.0, 0.6, 0.7]),
)  # fmt: skip
CASES = {
    "lambert": LobeStack(BROWN, 0.0, ()),
    "rough diffuse": LobeStack(BROWN, 0.8, ()),
    "glossy": LobeStack(BROWN, 0.0, (GLASS,)),
    "metal": LobeStack(BLACK, 0.0, (GOLD,)),
    "coloured edge": LobeStack(BLACK, 0.0, (SATIN,)),
    "three": LobeStack(BROWN, 0.4, (GLASS, SATIN, GOLD)),
    "turning": LobeStack(BROWN, 0.4, (GLASS, TURNING), BROWN[::-1], np.array([0.9, 0.1, 0.9])),
}


@pytest.fixture(scope="module")
def node():
    sphere = cycles_sphere.new_scene(size=64)
    material = bpy.data.materials.new("lobes")
    material.use_nodes = True
    sphere.data.materials.append(material)
    tree = material.node_tree
    tree.nodes.clear()
    group = add_lobe_stack(tree, CASES["lambert"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(group.outputs["BSDF"], output.inputs["Surface"])
    return group


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("light", [(0.6, 0.2, 0.77), (-0.9, 0.3, 0.25)], ids=["front", "side"])
def test_node_group_matches_cycles_rendering(node, case, light, tmp_path):
    light = np.array(light) / np.linalg.norm(light)
    lamp = cycles_sphere.sun(light, 2.0)
    stack = CASES[case]
    fill_lobe_stack(node, stack)
    image = cycles_sphere.render(tmp_path)
    bpy.data.objects.remove(lamp)
    cycles_sphere.assert_matches_model(image, stack, light, 2.0)


def test_inputs_for_maps_scale_the_stack(node, tmp_path):
    light = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
    paint, shine, rougher = np.array([0.5, 1.2, 0.8]), np.array([0.6, 0.9, 0.4]), 1.5
    lobe = Lobe(shine * GLASS.f0, shine * GLASS.f90, GLASS.roughness * np.sqrt(rougher))
    fill_lobe_stack(node, CASES["glossy"])
    factors = {"Diffuse Scale": (*paint, 1.0), "Specular Scale": (*shine, 1.0),
               "Roughness Scale": rougher}  # fmt: skip
    before = {}
    for name, value in factors.items():
        before[name] = node.inputs[name].default_value
        before[name] = before[name] if name == "Roughness Scale" else tuple(before[name])
        node.inputs[name].default_value = value
    lamp = cycles_sphere.sun(light, 2.0)
    image = cycles_sphere.render(tmp_path)
    bpy.data.objects.remove(lamp)
    for name, value in before.items():
        node.inputs[name].default_value = value
    cycles_sphere.assert_matches_model(image, LobeStack(paint * BROWN, 0.0, (lobe,)), light, 2.0)


def test_node_group_is_created_once(node):
    tree = bpy.data.materials.new("second").node_tree
    if tree is None:
        pytest.skip("materials without nodes")
    again = add_lobe_stack(tree, CASES["three"])
    assert again.node_tree == node.node_tree
    assert sum(group.name.startswith(NAME) for group in bpy.data.node_groups) == 1


def test_material_has_lobe_stack_for_eevee_and_principled_for_export():
    evaluate = CASES["glossy"].evaluate
    fit, lobes = fit_principled(evaluate), fit_lobe_stack(evaluate, most=1)
    brdf = PrincipalBRDF(default_basis(), np.zeros((3, 5)))
    material = create_material("both", brdf, fit, None, lobes)
    outputs = {n.target: n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"}
    source = {k: n.inputs["Surface"].links[0].from_node.type for k, n in outputs.items()}
    assert source == {"ALL": "BSDF_PRINCIPLED", "EEVEE": "GROUP", "CYCLES": "GROUP"}
    assert [k for k, n in outputs.items() if n.is_active_output] == ["ALL"]
    group = outputs["EEVEE"].inputs["Surface"].links[0].from_node
    assert group.inputs["Lobe 1 Roughness"].default_value == pytest.approx(0.3, abs=0.01)
    assert tuple(group.inputs["Lobe 2 F90"].default_value)[:3] == (0, 0, 0)
