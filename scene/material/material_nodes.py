"""A BRDF as a Blender material: the measured shader for Cycles, portable ones for everything else.

The material has three outputs. The OSL shader is linked to one with target CYCLES, the lobe stack
to one with target EEVEE, and the Principled to the active one with target ALL. Cycles renders the
first (or the lobe stack, if OSL is missing), EEVEE shows the second, and glTF, USD and MaterialX
export the third.
"""

from __future__ import annotations

import hashlib
import importlib.util
import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.appearance import osl_atlas, osl_source
from ...core.appearance.lobe_fit import LobeStackFit
from ...core.appearance.principled import Principled
from ...core.appearance.principled_fit import PrincipledFit
from ...core.basis import Basis, PrincipalBRDF
from ...core.errors import PatinaError
from ..property_keys import BASIS_VERSION, COEFFICIENTS, NO_OSL_REASON
from .lamp_inputs import update_lamps
from .lobe_group import add_lobe_stack, fill_lobe_stack
from .osl_files import PROPERTIES, ShaderFiles, pack
from .world_inputs import update_worlds

log = logging.getLogger(__name__)

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
    "coat_tint": "Coat Tint",
    "diffuse_roughness": "Diffuse Roughness",  # Blender 4.2 has none
}


def osl_missing() -> str | None:
    """Why this build of Blender cannot run OSL; None if it can."""
    try:
        import _cycles
    except ImportError:
        return "this build of Blender has no Cycles"
    if not _cycles.with_osl:
        return "this build of Blender has no Open Shading Language"
    return None


def create_material(
    name: str,
    brdf: PrincipalBRDF,
    principled: PrincipledFit,
    files: ShaderFiles | None,
    lobes: LobeStackFit | None = None,
) -> bpy.types.Material:
    """Create a material with all branches. Without OSL it has only the portable ones, and a custom
    property states the reason.

    files: the shader's EXRs by socket (osl_files.ensure_files); None without OSL. lobes: the lobe
    stack for EEVEE; if None, EEVEE shows the Principled.
    """
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    _portable_branch(tree, principled)
    stack = None if lobes is None else _lobe_branch(tree, lobes)
    show_solid(material, principled.principled)
    material[COEFFICIENTS] = np.asarray(brdf.coefficients, float).ravel().tolist()
    material[BASIS_VERSION] = brdf.basis.version
    reason = osl_missing()
    if files is None:
        reason = reason or "the shader's EXRs were not written"
    elif reason is None:
        try:
            text = osl_text(brdf.basis, osl_atlas.traits(brdf.coefficients.shape[1]))
            _osl_branch(tree, text, brdf, files)
        except OslError as error:
            reason = str(error)
    if reason is not None or files is None:
        material[NO_OSL_REASON] = reason
        if stack is not None:
            _output(tree, stack, "CYCLES", "Cycles")
        return material
    for socket, path in files.paths.items():
        material[PROPERTIES[socket]] = path.name
        pack(path)
    # the shader returns lamp light as emission; the mesh must not be sampled as a lamp
    material.cycles.emission_sampling = "NONE"
    bpy.context.view_layer.update()  # new lamps have no world matrix before an update
    update_lamps(bpy.context.scene)
    update_worlds(bpy.context.scene)
    return material


class OslError(PatinaError):
    """The shader did not compile. The message is for the user."""


@dataclass(frozen=True)
class CompiledText:
    """OSL source as a Text data-block, and the byte code that Cycles runs."""

    text: bpy.types.Text
    bytecode: str

    @property
    def digest(self) -> str:
        return hashlib.md5(self.bytecode.encode(), usedforsecurity=False).hexdigest()


def osl_text(basis: Basis, count: int) -> CompiledText:
    """The compiled shader with ``count`` coefficients as inputs. All materials share one Text.

    Raises OslError if it does not compile.
    """
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
            raise OslError("the OSL shader did not compile; see the console for the reason")
        return Path(out).read_text(encoding="utf-8")


def _portable_branch(tree: bpy.types.NodeTree, fit: PrincipledFit) -> None:
    frame = _frame(tree, "Portable: exporters", (0, -420))
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.parent, node.location = frame, (0, -40)
    show_principled(node, fit)
    _output(tree, node, "ALL", "Portable").is_active_output = True


def _lobe_branch(tree: bpy.types.NodeTree, fit: LobeStackFit) -> bpy.types.Node:
    frame = _frame(tree, "Lobe stack: EEVEE, and Cycles without OSL", (0, -1120))
    node = add_lobe_stack(tree, fit.stack, (0, -40))
    show_lobes(node, fit)
    node.parent = frame
    _output(tree, node, "EEVEE", "EEVEE")
    return node


def _output(
    tree: bpy.types.NodeTree, node: bpy.types.Node, target: str, label: str
) -> bpy.types.Node:
    """Add an output node next to ``node`` for one kind of renderer; it is not the active one."""
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.label, output.target, output.is_active_output = label, target, False
    taken = sum(link.from_node == node for link in tree.links)
    output.parent, output.location = node.parent, (320, -40 - 160 * taken)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return output


def show_solid(material: bpy.types.Material, principled: Principled) -> None:
    """Set what Solid shading shows."""
    material.diffuse_color = (*(float(c) for c in np.clip(principled.base_color, 0, 1)), 1.0)
    material.metallic, material.roughness = principled.metallic, principled.roughness


def show_principled(node: bpy.types.Node, fit: PrincipledFit) -> None:
    """Write the fit into a Principled node, with its error in the label."""
    node.label = f"Principled fit (error {100 * fit.error:.1f} %)"
    fill_principled(node, fit.principled)


def show_lobes(node: bpy.types.Node, fit: LobeStackFit) -> None:
    """Write the fit into a node of the lobe stack's group, with its error in the label."""
    node.label = f"Lobe stack (error {100 * fit.error:.1f} %)"
    fill_lobe_stack(node, fit.stack)


def fill_principled(node: bpy.types.Node, principled: Principled) -> None:
    """Set the inputs of a Principled node to the fitted model; single-scattering GGX, as fitted."""
    node.distribution = "GGX"
    for field, socket in PRINCIPLED_SOCKETS.items():
        value = getattr(principled, field)
        if socket not in node.inputs:
            continue
        if np.ndim(value):
            node.inputs[socket].default_value = (*(float(v) for v in value), 1.0)
        else:
            node.inputs[socket].default_value = float(value)


def has_values(node: bpy.types.Node, principled: Principled) -> bool:
    """Whether the inputs of a Principled node are those of the fitted model, to the precision that
    Blender stores, and all others those of a new node."""
    fresh = bpy.data.node_groups.new("Patina Defaults", "ShaderNodeTree")
    try:
        plain = fresh.nodes.new("ShaderNodeBsdfPrincipled")
        fill_principled(plain, principled)
        return all(
            np.allclose(_value(own), _value(expected), rtol=1e-5, atol=1e-6)
            for own, expected in zip(node.inputs, plain.inputs, strict=True)
            if hasattr(own, "default_value") and own.type != "VECTOR"
        )
    finally:
        bpy.data.node_groups.remove(fresh)


def _value(socket: bpy.types.NodeSocket) -> np.ndarray:
    return np.atleast_1d(np.asarray(socket.default_value, float))


def _osl_branch(
    tree: bpy.types.NodeTree,
    compiled: CompiledText,
    brdf: PrincipalBRDF,
    files: ShaderFiles,
) -> None:
    frame = _frame(tree, "Measured: Cycles with OSL on the CPU", (0, 420))
    node = tree.nodes.new("ShaderNodeScript")
    node.label, node.width = "Measured BRDF", 240
    node.parent, node.location = frame, (0, -40)
    # code and sockets are set here because Blender sets them only if the scene's engine is Cycles
    # and there is a window
    with _no_compiling():
        node.mode, node.script = "INTERNAL", compiled.text
    node.bytecode, node.bytecode_hash = compiled.bytecode, compiled.digest
    count = osl_atlas.traits(brdf.coefficients.shape[1])
    ensure_sockets(node, count)
    sockets = {socket.identifier: socket for socket in node.inputs}
    for name, path in files.paths.items():
        sockets[name].default_value = path.resolve().as_posix()
    sockets[osl_source.ALPHAS].default_value = files.alphas
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
    """Keep Cycles from compiling the script if it cannot: the bpy wheel has no oslquery."""
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
    """Create the inputs and the output of the shader, as Blender's 'Update' button would."""
    node.inputs.clear()
    node.outputs.clear()
    for item in osl_source.inputs(count):
        socket = node.inputs.new(SOCKET_TYPES[item.kind], item.label, identifier=item.name)
        value = item.default
        socket.default_value = (*value, 1.0) if item.kind == "color" else value
        socket.hide = (
            item.hidden
        )  # written by lamp_inputs, world_inputs or with the files, not by the user
        socket.hide_value = item.name == "shading_normal"
    node.outputs.new("NodeSocketShader", "BSDF", identifier="BSDF")


def _frame(tree: bpy.types.NodeTree, label: str, location: tuple[float, float]) -> bpy.types.Node:
    frame = tree.nodes.new("NodeFrame")
    frame.label, frame.location = label, location
    return frame
