"""A BRDF as a Blender material: measured in Cycles, portable everywhere else.

Two outputs: the OSL shader goes to one with target CYCLES, the Principled to one with target ALL
that is the active one. Cycles renders the first; EEVEE shows, and glTF, USD and MaterialX export,
the second.
"""

from __future__ import annotations

import hashlib
import importlib.util
import logging
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.appearance import osl_atlas, osl_source
from ..core.appearance.principled import Principled
from ..core.appearance.principled_fit import PrincipledFit
from ..core.basis import Basis, PrincipalBRDF
from ..core.errors import PatinaError
from .lamps import update_lamps
from .osl_files import PROPERTIES, pack

log = logging.getLogger(__name__)

REASON_PROPERTY = "patina_without_osl"  # on the material: why it has no OSL branch
COEFFICIENTS = "patina_coefficients"  # on the material: all of them, R, then G, then B
BASIS = "patina_basis"  # on the material: the version of the basis they are in
SOCKET_TYPES = {
    "string": "NodeSocketString",
    "float": "NodeSocketFloat",
    "int": "NodeSocketInt",
    "vector": "NodeSocketVector",
    "color": "NodeSocketColor",
}
PRINCIPLED_SOCKETS = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "ior": "IOR",
    "specular_ior_level": "Specular IOR Level",
    "specular_tint": "Specular Tint",
    "coat_weight": "Coat Weight",
    "coat_roughness": "Coat Roughness",
    "coat_ior": "Coat IOR",
}


def osl_missing() -> str | None:
    """Why this Blender cannot run OSL, or None where it can."""
    try:
        import _cycles
    except ImportError:
        return "this Blender has no Cycles"
    if not _cycles.with_osl:
        return "this Blender was built without Open Shading Language"
    return None


def create_material(
    name: str, brdf: PrincipalBRDF, principled: PrincipledFit, files: Mapping[str, Path] | None
) -> bpy.types.Material:
    """A material of both kinds; without OSL only the portable one, and the material says why.

    files: the shader's EXRs by socket (osl_files.ensure_files); None without OSL.
    """
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    _portable_branch(tree, principled)
    seen = principled.principled  # in Solid mode
    material.diffuse_color = (*(float(c) for c in np.clip(seen.base_color, 0, 1)), 1.0)
    material.metallic, material.roughness = seen.metallic, seen.roughness
    material[COEFFICIENTS] = np.asarray(brdf.coefficients, float).ravel().tolist()
    material[BASIS] = brdf.basis.version
    reason = osl_missing()
    if files is None:
        reason = reason or "the shader's EXRs were not written"
    elif reason is None:
        try:
            text = osl_text(brdf.basis, osl_atlas.traits(brdf.coefficients.shape[1]))
            _osl_branch(tree, text, brdf, principled.principled, files)
        except OslError as error:
            reason = str(error)
    if reason is not None or files is None:
        material[REASON_PROPERTY] = reason
        return material
    for socket, path in files.items():
        material[PROPERTIES[socket]] = path.name
        pack(path)
    # lamps evaluated in the shader leave it as emission; the mesh is no lamp to aim at
    material.cycles.emission_sampling = "NONE"
    bpy.context.view_layer.update()  # lamps just made have no world matrix yet
    update_lamps(bpy.context.scene)
    return material


class OslError(PatinaError):
    """The shader did not compile; the message is for the user."""


@dataclass(frozen=True)
class CompiledText:
    """OSL as a Text data-block and the byte code that Cycles runs."""

    text: bpy.types.Text
    bytecode: str

    @property
    def digest(self) -> str:
        return hashlib.md5(self.bytecode.encode(), usedforsecurity=False).hexdigest()


def osl_text(basis: Basis, count: int) -> CompiledText:
    """The shader with ``count`` coefficients as inputs, compiled; one Text serves all materials."""
    source = osl_source.source(basis, count)
    name = f"patina_brdf_{count}.osl"
    text = bpy.data.texts.get(name)
    if text is None or text.as_string() != source:
        text = bpy.data.texts.new(name)
        text.write(source)
    return CompiledText(text, _compile(source))


def _compile(source: str) -> str:
    import _cycles

    with tempfile.TemporaryDirectory(prefix="patina_osl_") as folder:
        file, out = os.path.join(folder, "shader.osl"), os.path.join(folder, "shader.oso")
        Path(file).write_text(source, encoding="utf-8")
        if not _cycles.osl_compile(file, out):
            raise OslError("the OSL shader did not compile; the console says why")
        return Path(out).read_text(encoding="utf-8")


def _portable_branch(tree: bpy.types.NodeTree, fit: PrincipledFit) -> None:
    frame = _frame(tree, "Portable: EEVEE and exporters", (0, -420))
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.label = f"Principled fit (error {100 * fit.error:.1f} %)"
    node.parent, node.location = frame, (0, -40)
    fill_principled(node, fit.principled)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.label, output.target = "Portable", "ALL"
    output.parent, output.location = frame, (320, -40)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    output.is_active_output = True


def fill_principled(node: bpy.types.Node, principled: Principled) -> None:
    """Set a Principled node to the model that was fitted; single-scatter GGX, as fitted."""
    node.distribution = "GGX"
    for field, socket in PRINCIPLED_SOCKETS.items():
        value = getattr(principled, field)
        if np.ndim(value):
            node.inputs[socket].default_value = (*(float(v) for v in value), 1.0)
        else:
            node.inputs[socket].default_value = float(value)


def _osl_branch(
    tree: bpy.types.NodeTree,
    compiled: CompiledText,
    brdf: PrincipalBRDF,
    principled: Principled,
    files: Mapping[str, Path],
) -> None:
    frame = _frame(tree, "Measured: Cycles with OSL on the CPU", (0, 420))
    node = tree.nodes.new("ShaderNodeScript")
    node.label, node.width = "Measured BRDF", 240
    node.parent, node.location = frame, (0, -40)
    # set the code and the sockets ourselves: Blender does it only while the scene's engine is
    # Cycles and a window's context is at hand
    with _no_compiling():
        node.mode, node.script = "INTERNAL", compiled.text
    node.bytecode, node.bytecode_hash = compiled.bytecode, compiled.digest
    count = osl_atlas.traits(brdf.coefficients.shape[1])
    ensure_sockets(node, count)
    sockets = {socket.identifier: socket for socket in node.inputs}
    for name, path in files.items():
        sockets[name].default_value = path.resolve().as_posix()
    lobe = principled.roughness
    if principled.coat_weight > 0.05:
        lobe = min(lobe, principled.coat_roughness)
    # directions are drawn from a lobe somewhat wider than the fit's: measured tails are long
    sockets["lobe_roughness"].default_value = float(min(1.1 * lobe, 1.0))
    sockets["lobe_share"].default_value = 0.5
    for i, rgb in enumerate(np.asarray(brdf.coefficients).T[:count]):
        socket = sockets[osl_source.coefficient_name(i)]
        socket.default_value = tuple(float(v) for v in rgb)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.label, output.target = "Cycles", "CYCLES"
    output.parent, output.location = frame, (320, -40)
    output.is_active_output = False
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])


@contextmanager
def _no_compiling() -> Iterator[None]:
    """Keep Cycles from compiling the script where it cannot: the bpy wheel finds no oslquery."""
    render = bpy.context.scene.render
    engine = render.engine
    if engine != "CYCLES" or importlib.util.find_spec("oslquery") is not None:
        yield
        return
    render.engine = "BLENDER_WORKBENCH"
    try:
        yield
    finally:
        render.engine = engine


def ensure_sockets(node: bpy.types.Node, count: int) -> None:
    """The inputs and the output of the shader, as Blender's own 'Update' would make them."""
    node.inputs.clear()
    node.outputs.clear()
    for item in osl_source.inputs(count):
        socket = node.inputs.new(SOCKET_TYPES[item.kind], item.label, identifier=item.name)
        value = item.default
        socket.default_value = (*value, 1.0) if item.kind == "color" else value
        socket.hide = item.lamp  # written by scene/lamps, not by hand
        socket.hide_value = item.name == "shading_normal"
    node.outputs.new("NodeSocketShader", "BSDF", identifier="BSDF")


def _frame(tree: bpy.types.NodeTree, label: str, location: tuple[float, float]) -> bpy.types.Node:
    frame = tree.nodes.new("NodeFrame")
    frame.label, frame.location = label, location
    return frame
