"""MaterialX documents: well-formed, and valid by the MaterialX library where that is at hand."""

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
from patina.core.appearance.principled import Principled
from patina.core.export import materialx

STACK = LobeStack(
    diffuse=np.array([0.3, 0.2, 0.1]),
    diffuse_roughness=0.25,
    lobes=(
        Lobe(np.full(3, 0.04), np.ones(3), 0.1),
        Lobe(np.array([0.2, 0.1, 0.05]), np.array([0.9, 0.8, 0.7]), 0.4),
    ),
)
TURNED = LobeStack(
    diffuse=np.array([0.3, 0.2, 0.1]),
    diffuse_roughness=0.0,
    lobes=(Lobe(np.full(3, 0.1), np.ones(3), 0.3, f0_edge=np.array([0.5, 0.4, 0.3])),),
    diffuse_mid=np.array([0.2, 0.3, 0.4]),
    diffuse_edge=np.array([0.1, 0.5, 0.9]),
)
# runs on its own: the library carries what other modules of the tests may carry in other versions
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


def document(tmp_path: Path, stack: LobeStack = STACK) -> Path:
    root = materialx.document()
    materialx.add_lobe_stack(root, "gold", stack)
    materialx.add_open_pbr(root, "gold_openpbr", Principled(coat_weight=0.3, metallic=0.2))
    materialx.write(tmp_path / "gold.mtlx", root)
    return tmp_path / "gold.mtlx"


def checked(file: Path) -> list:
    """What the MaterialX library says of a document."""
    if importlib.util.find_spec("MaterialX") is None:
        pytest.skip("the MaterialX package is not installed")
    done = subprocess.run(
        [sys.executable, "-c", CHECK, file], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_every_reference_leads_to_a_node_of_its_type(tmp_path: Path) -> None:
    root = ET.parse(document(tmp_path)).getroot()
    nodes = {node.get("name"): node for node in root}
    assert len(nodes) == len(root) and root.get("version") == "1.39"
    for node in root:
        for entry in node.findall("input"):
            named = entry.get("nodename")
            assert (named is None) != (entry.get("value") is None)
            if named is not None:
                assert nodes[named].get("type") == entry.get("type")
    materials = [n.get("name") for n in root if n.tag == "surfacematerial"]
    assert materials == ["gold", "gold_openpbr"]
    assert not list(tmp_path.glob("*.part"))


def test_roughness_is_alpha_and_the_top_lobe_lies_on_top(tmp_path: Path) -> None:
    root = ET.parse(document(tmp_path)).getroot()
    nodes = {node.get("name"): node for node in root}

    def told(node: ET.Element, name: str) -> str | None:
        found = node.find(f"input[@name='{name}']")
        return None if found is None else found.get("value") or found.get("nodename")

    surface = nodes["gold_surface"]
    first = nodes[told(surface, "bsdf")]
    top = nodes[told(first, "top")]
    alpha = [float(v) for v in told(top, "roughness").split(",")]
    assert alpha == pytest.approx([0.01, 0.01])
    second = nodes[told(first, "base")]
    assert nodes[told(second, "base")].tag == "oren_nayar_diffuse_bsdf"


def test_a_stack_without_lobes_is_its_diffuse_base(tmp_path: Path) -> None:
    bare = LobeStack(np.full(3, 0.5), 0.0, ())
    root = ET.parse(document(tmp_path, bare)).getroot()
    assert not root.findall("layer") and root.find("oren_nayar_diffuse_bsdf") is not None


def test_colours_that_turn_are_the_stacks_own(tmp_path: Path) -> None:
    """The graph of mix nodes, computed here, against the stack's own blending."""
    root = ET.parse(document(tmp_path, TURNED)).getroot()
    nodes = {node.get("name"): node for node in root}
    cos = np.linspace(0.05, 1, 7)

    def value(name: str):
        node = nodes[name]
        told = {i.get("name"): i for i in node.findall("input")}

        def of(key: str):
            entry = told[key]
            if entry.get("nodename"):
                return value(entry.get("nodename"))
            return np.array([float(v) for v in entry.get("value").split(",")])

        if node.tag == "facingratio":
            return cos[:, None]
        if node.tag == "subtract":
            return of("in1") - of("in2")
        if node.tag == "multiply":
            return of("in1") * of("in2")
        assert node.tag == "mix"
        return of("bg") * (1 - of("mix")) + of("fg") * of("mix")

    diffuse = nodes["gold_diffuse"].find("input[@name='color']").get("nodename")
    expected = blended(cos, TURNED.diffuse, TURNED.diffuse_mid, TURNED.diffuse_edge)
    assert np.allclose(value(diffuse), expected, atol=1e-6)
    lobe = TURNED.lobes[0]
    f0 = nodes["gold_lobe1"].find("input[@name='color0']").get("nodename")
    assert np.allclose(value(f0), blended(cos, lobe.f0, lobe.f0_mid, lobe.f0_edge), atol=1e-6)


def test_the_library_finds_turned_colours_valid(tmp_path: Path) -> None:
    valid, message, undefined, unknown, _ = checked(document(tmp_path, TURNED))
    assert valid, message
    assert undefined == [] and unknown == []


def test_the_library_finds_it_valid_and_reads_the_same(tmp_path: Path) -> None:
    valid, message, undefined, unknown, graph = checked(document(tmp_path))
    assert valid, message
    assert undefined == [] and unknown == []
    assert graph["gold_openpbr"][0] == "open_pbr_surface"
    kind, top, second, base = graph["gold"]
    assert kind == "surface"
    assert top[0] == second[0] == "generalized_schlick_bsdf"
    assert top[1] == pytest.approx(0.01) and second[1] == pytest.approx(0.16)
    assert second[2] == pytest.approx([0.2, 0.1, 0.05])
    assert base == ["oren_nayar_diffuse_bsdf", pytest.approx([0.3, 0.2, 0.1])]
