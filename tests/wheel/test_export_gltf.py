"""GLB export: valid by the Khronos validator, with the fitted parameters in it."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from tests import make_result as made
from tools.common import cache_dir

pytestmark = pytest.mark.blender

VALIDATE = """
const fs = require('fs'), validator = require('gltf-validator');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report.issues)));
"""


def node_modules() -> Path | None:
    """Where npm installed gltf-validator: PATINA_NODE_MODULES, or node/ in the tools' cache."""
    configured = os.environ.get("PATINA_NODE_MODULES")
    folders = [Path(configured)] if configured else [cache_dir() / "node" / "node_modules"]
    return next((f for f in folders if (f / "gltf-validator").is_dir()), None)


def read_glb(path: Path) -> dict:
    raw = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", raw)
    assert (magic, version, length) == (b"glTF", 2, len(raw))
    size, kind = struct.unpack_from("<I4s", raw, 12)
    assert kind == b"JSON"
    return json.loads(raw[20 : 20 + size])


@pytest.fixture(scope="module")
def glb(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gltf")
    result = made.two_materials(folder / "result")
    done = subprocess.run(
        [sys.executable, root / "headless.py", "material", result, "--to", "gltf", "--out",
         folder / "out"], capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "out" / "materials.glb"


def test_khronos_validator_reports_no_issues(glb: Path) -> None:
    node, modules = shutil.which("node"), node_modules()
    if node is None or modules is None:
        pytest.skip("node, or the npm package gltf-validator, is not here (PATINA_NODE_MODULES)")
    done = subprocess.run(
        [node, "-e", VALIDATE, glb], capture_output=True, text=True, timeout=60,
        env={**os.environ, "NODE_PATH": str(modules)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    issues = json.loads(done.stdout)
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]


def test_glb_contains_fitted_parameters(glb: Path) -> None:
    document = read_glb(glb)
    materials = {m["name"]: m for m in document["materials"]}
    assert set(materials) == {"bronze", "old rug"}
    for subject in made.subjects(glb.parents[1] / "result"):
        expected, material = subject.gltf.principled, materials[subject.name]
        shown = material["pbrMetallicRoughness"]
        assert shown["baseColorFactor"][:3] == pytest.approx(expected.base_color, abs=1e-5)
        assert shown.get("metallicFactor", 1) == pytest.approx(expected.metallic, abs=1e-5)
        assert shown["roughnessFactor"] == pytest.approx(expected.roughness, abs=1e-5)
        coat = material["extensions"].get("KHR_materials_clearcoat", {})
        assert coat.get("clearcoatFactor", 0) == pytest.approx(expected.coat_weight, abs=1e-5)
    assert len(document["meshes"]) == 2 and not document.get("cameras")
    worn = {p["material"] for mesh in document["meshes"] for p in mesh["primitives"]}
    assert worn == {0, 1}
    assert "TEXCOORD_0" in document["meshes"][0]["primitives"][0]["attributes"]


def test_values_changed_by_hand_are_kept(tmp_path: Path) -> None:
    import bpy

    from patina.scene.export.export_formats import fitted_materials
    from patina.scene.export.export_scene import create_materials, new_scene, preview_spheres
    from patina.scene.material.map_nodes import principled_nodes

    subjects = made.subjects(made.two_materials(tmp_path / "result"))
    new_scene()
    materials = create_materials(subjects, whole=False)
    objects = preview_spheres(materials)
    assert set(fitted_materials(objects, subjects)) == {"bronze", "old rug"}
    (node,) = principled_nodes(materials[0])
    for name, change in (("Roughness", 0.01), ("Sheen Weight", 0.2), ("Alpha", -0.5)):
        before = node.inputs[name].default_value
        node.inputs[name].default_value += change
        assert set(fitted_materials(objects, subjects)) == {"old rug"}, name
        node.inputs[name].default_value = before
    copy = materials[0].copy()
    objects[0].data.materials.append(copy)
    assert fitted_materials(objects, subjects)["bronze"] == [materials[0], copy]
    emission = copy.node_tree.nodes.new("ShaderNodeEmission")
    output = copy.node_tree.get_output_node("ALL")
    copy.node_tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    assert set(fitted_materials(objects, subjects)) == {"old rug"}
    image = materials[1].node_tree.nodes.new("ShaderNodeTexImage")
    (node,) = principled_nodes(materials[1])
    materials[1].node_tree.links.new(image.outputs["Color"], node.inputs["Base Color"])
    assert not fitted_materials(objects, subjects)
    bpy.ops.wm.read_homefile(use_empty=True)
