"""MaterialX documents are well-formed, and valid for the MaterialX library if it is installed."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from patina.core.appearance.lobe_stack import Lobe, LobeStack, blended
from patina.core.appearance.open_pbr.model import OpenPBR
from patina.core.export import materialx

PLAIN_STACK = LobeStack(
    diffuse=np.array([0.3, 0.2, 0.1]),
    diffuse_roughness=0.25,
    lobes=(
        Lobe(np.full(3, 0.04), np.ones(3), 0.1),
        Lobe(np.array([0.2, 0.1, 0.05]), np.array([0.9, 0.8, 0.7]), 0.4),
    ),
)
ANGLE_DEPENDENT_STACK = LobeStack(
    diffuse=np.array([0.3, 0.2, 0.1]),
    diffuse_roughness=0.0,
    lobes=(Lobe(np.full(3, 0.1), np.ones(3), 0.3, f0_edge=np.array([0.5, 0.4, 0.3])),),
    diffuse_mid=np.array([0.2, 0.3, 0.4]),
    diffuse_edge=np.array([0.1, 0.5, 0.9]),
)
# runs in its own process: the library may bundle other versions of modules that tests load
CHECK = """
import json, sys
import MaterialX as mx
doc = mx.createDocument()
mx.readFromXmlFile(doc, sys.argv[1])
library = mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
doc.setDataLibrary(library) if hasattr(doc, "setDataLibrary") else doc.importLibrary(library)
valid, message = doc.validate()
undefined = [n.getName() for n in doc.getNodes() if n.getNodeDef() is None]
unknown = [f"{n.getName()}.{i.getName()}" for n in doc.getNodes() if n.getNodeDef()
           for i in n.getInputs() if n.getNodeDef().getActiveInput(i.getName()) is None]
graph = {}
for material in doc.getMaterialNodes():
    shaders = mx.getShaderNodes(material)
    node = shaders[0]
    chain = [node.getCategory()]
    node = node.getConnectedNode("bsdf")
    while node is not None and node.getCategory() == "layer":
        top = node.getConnectedNode("top")
        chain.append([top.getCategory(), top.getInputValue("roughness")[0],
                      list(top.getInputValue("color0") or [])])
        node = node.getConnectedNode("base")
    if node is not None:
        chain.append([node.getCategory(), list(node.getInputValue("color") or [])])
    graph[material.getName()] = chain
print(json.dumps([valid, message, undefined, unknown, graph]))
"""


def document(tmp_path: Path, stack: LobeStack = PLAIN_STACK) -> Path:
    root = materialx.document()
    materialx.add_lobe_stack(root, "gold", stack)
    materialx.add_open_pbr(root, "gold_openpbr", OpenPBR(coat_weight=0.3, base_metalness=0.2))
    materialx.write(tmp_path / "gold.mtlx", root)
    return tmp_path / "gold.mtlx"


def library_report(file: Path) -> list:
    """[valid, message, undefined nodes, unknown inputs, graph] from the MaterialX library."""
    if importlib.util.find_spec("MaterialX") is None:
        pytest.skip("the MaterialX package is not installed")
    completed = subprocess.run(
        [sys.executable, "-c", CHECK, file], capture_output=True, text=True, timeout=60
    )
    assert completed.returncode == 0, completed.stderr
    return json.loads(completed.stdout.splitlines()[-1])


def test_every_reference_names_a_node_of_its_type(tmp_path: Path) -> None:
    root = ET.parse(document(tmp_path)).getroot()
    nodes = {node.get("name"): node for node in root}
    assert len(nodes) == len(root) and root.get("version") == "1.39"
    for node in root:
        for entry in node.findall("input"):
            reference = entry.get("nodename")
            assert (reference is None) != (entry.get("value") is None)
            if reference is not None:
                assert nodes[reference].get("type") == entry.get("type")
    materials = [n.get("name") for n in root if n.tag == "surfacematerial"]
    assert materials == ["gold", "gold_openpbr"]
    assert not list(tmp_path.glob("*.part"))


def test_roughness_is_alpha_and_lobes_are_layered_in_order(tmp_path: Path) -> None:
    root = ET.parse(document(tmp_path)).getroot()
    nodes = {node.get("name"): node for node in root}

    def entry_of(node: ET.Element, name: str) -> str | None:
        found = node.find(f"input[@name='{name}']")
        return None if found is None else found.get("value") or found.get("nodename")

    surface = nodes["gold_surface"]
    first = nodes[entry_of(surface, "bsdf")]
    top = nodes[entry_of(first, "top")]
    alpha = [float(v) for v in entry_of(top, "roughness").split(",")]
    assert alpha == pytest.approx([0.01, 0.01])
    second = nodes[entry_of(first, "base")]
    assert nodes[entry_of(second, "base")].tag == "oren_nayar_diffuse_bsdf"


def test_stack_without_lobes_has_only_a_diffuse_base(tmp_path: Path) -> None:
    diffuse_only = LobeStack(np.full(3, 0.5), 0.0, ())
    root = ET.parse(document(tmp_path, diffuse_only)).getroot()
    assert not root.findall("layer") and root.find("oren_nayar_diffuse_bsdf") is not None


def test_angle_dependent_colours_match_the_stack(tmp_path: Path) -> None:
    """The graph of mix nodes, evaluated here, gives the colours of the stack's own blending."""
    root = ET.parse(document(tmp_path, ANGLE_DEPENDENT_STACK)).getroot()
    nodes = {node.get("name"): node for node in root}
    cos = np.linspace(0.05, 1, 7)

    def node_value(name: str):
        node = nodes[name]
        inputs = {i.get("name"): i for i in node.findall("input")}

        def input_value(key: str):
            entry = inputs[key]
            if entry.get("nodename"):
                return node_value(entry.get("nodename"))
            return np.array([float(v) for v in entry.get("value").split(",")])

        if node.tag == "facingratio":
            return cos[:, None]
        if node.tag == "subtract":
            return input_value("in1") - input_value("in2")
        if node.tag == "multiply":
            return input_value("in1") * input_value("in2")
        assert node.tag == "mix"
        return input_value("bg") * (1 - input_value("mix")) + input_value("fg") * input_value("mix")

    diffuse = nodes["gold_diffuse"].find("input[@name='color']").get("nodename")
    expected = blended(
        cos,
        ANGLE_DEPENDENT_STACK.diffuse,
        ANGLE_DEPENDENT_STACK.diffuse_mid,
        ANGLE_DEPENDENT_STACK.diffuse_edge,
    )
    assert np.allclose(node_value(diffuse), expected, atol=1e-6)
    lobe = ANGLE_DEPENDENT_STACK.lobes[0]
    f0 = nodes["gold_lobe1"].find("input[@name='color0']").get("nodename")
    assert np.allclose(node_value(f0), blended(cos, lobe.f0, lobe.f0_mid, lobe.f0_edge), atol=1e-6)


def test_library_accepts_angle_dependent_colours(tmp_path: Path) -> None:
    valid, message, undefined, unknown, _ = library_report(
        document(tmp_path, ANGLE_DEPENDENT_STACK)
    )
    assert valid, message
    assert undefined == [] and unknown == []


def test_library_accepts_the_document_and_reads_its_values(tmp_path: Path) -> None:
    valid, message, undefined, unknown, graph = library_report(document(tmp_path))
    assert valid, message
    assert undefined == [] and unknown == []
    assert graph["gold_openpbr"][0] == "open_pbr_surface"
    kind, top, second, base = graph["gold"]
    assert kind == "surface"
    assert top[0] == second[0] == "generalized_schlick_bsdf"
    assert top[1] == pytest.approx(0.01) and second[1] == pytest.approx(0.16)
    assert second[2] == pytest.approx([0.2, 0.1, 0.05])
    assert base == ["oren_nayar_diffuse_bsdf", pytest.approx([0.3, 0.2, 0.1])]
