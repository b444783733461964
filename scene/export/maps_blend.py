"""Assign maps to the measured materials of a .blend.

The portable branch gets them as image textures. If a mesh has multiple materials, all of them use
the same maps, blended by the painted masks: a face still has one material slot, but base colour,
roughness, metallic and specular change smoothly to those of the neighbour within the soft border of
the masks, so that face edges are not visible. Inputs are blended rather than shaders, because no
exporter keeps a Mix Shader (glTF and USD have one surface per face), and within the few texels of a
border both look alike.

The OSL branch takes the level of the diffuse body and the factors of FACTORS, if its shader has
these inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ...core.appearance import osl_source
from ...core.errors import PatinaError
from ...core.jobs import Stage
from ...core.maps.maps_result import MapsResult
from ...core.maps.write import BLEND, MapFile
from ..material import osl_files
from ..material.material_nodes import fill_principled
from ..material.measured_materials import measured_materials
from ..material.packed_exr import write_packed
from ..property_keys import MAP_KIND, MEASURED_NAME
from ..scan.meshes import UV_LAYER
from .blend_file import save, write_blend

NORMAL = "Normal"  # input of the OSL shader and of the Principled
FACTORS = {
    "scale": osl_source.BODY_SCALE,
    "specular_scale": osl_source.SPECULAR_SCALE,
    "roughness_scale": osl_source.ROUGHNESS_SCALE,
}
"""Kind of map → input of the OSL shader."""
SOCKETS = {
    "base_color": "Base Color",
    "roughness": "Roughness",
    "metallic": "Metallic",
    "specular": "Specular IOR Level",
}


def write_mapped_blend(
    path: Path,
    final: Path,
    result: MapsResult,
    files: Sequence[MapFile],
    source: Path | None,
    stages: Sequence[Stage],
) -> list[str]:
    """Save a scene with the maps on its materials as ``path``; returns notes for the user.

    The maps are in the same folder and move with the file to ``final``. The scene is that of the
    refit without painted texture, if there was one, else ``source``, the .blend of the fit. If
    ``source`` is None as well, nothing is written.
    """
    notes: list[str] = []
    if result.refit is not None:
        notes += write_blend(path, final, result.refit, stages)
    elif source is not None:
        _open(source)
        _own_shader_files(path, final)
    else:
        return ["The result has no scene.blend, so the maps were not assigned to materials."]
    notes += apply_maps(bpy.context.scene, result, path.parent, files)
    save(path, final)
    return notes


def _open(source: Path) -> None:
    """Open a .blend and make its image paths absolute, so that it can be saved elsewhere."""
    try:
        bpy.ops.wm.open_mainfile(filepath=str(source.resolve()), load_ui=False)
    except RuntimeError as error:
        raise PatinaError(f"{source}: cannot be opened ({error})") from error
    for image in bpy.data.images:
        own_file = image.source == "FILE" and image.packed_file is None
        if own_file and image.filepath.startswith("//"):
            image.filepath = bpy.path.abspath(image.filepath)


def apply_maps(
    scene: bpy.types.Scene, result: MapsResult, folder: Path, files: Sequence[MapFile]
) -> list[str]:
    """Put the maps in ``folder`` on the measured materials and the scanned mesh of a scene. Returns
    notes for the user."""
    notes = []
    mesh = scene.patina.mesh
    if mesh is None or mesh.type != "MESH":
        notes.append("The scanned mesh is not in this scene, so its UVs were not set.")
    elif not _set_uv(mesh.data, result):
        notes.append(f"{mesh.name} no longer has the faces of the scan, so its UVs were not set.")
    multiple = len(result.materials) > 1
    by_name = {str(m[MEASURED_NAME]): m for m in measured_materials()}
    for index, fitted in enumerate(result.materials):
        material = by_name.get(fitted.name)
        if material is None:
            notes.append(
                f"{fitted.name}: the scene has no such material, so its maps are not used."
            )
            continue
        own = {f.kind: f for f in files if f.material == (BLEND if multiple else fitted.name)}
        own |= {f.kind: f for f in files if f.kind == "normal"}
        factors = {f.kind: f for f in files if f.material == fitted.name and f.kind in FACTORS}
        for shader in _principled(material):
            fill_principled(shader, fitted.principled)
        _assign_maps(material, own, factors, result.levels[index].split.body, folder)
    return notes


def _principled(material: bpy.types.Material) -> list[bpy.types.Node]:
    return [n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"]


def _assign_maps(
    material: bpy.types.Material,
    own: dict[str, MapFile],
    factors: dict[str, MapFile],
    body: np.ndarray,
    folder: Path,
) -> None:
    tree = material.node_tree
    for node in [n for n in tree.nodes if MAP_KIND in n]:
        tree.nodes.remove(node)
    place = tree.nodes.new("ShaderNodeUVMap")
    place.uv_map, place.location, place[MAP_KIND] = UV_LAYER, (-900, -420), "uv"
    shaders = _principled(material)
    for number, (kind, socket) in enumerate(SOCKETS.items()):
        if kind not in own or not shaders:
            continue
        node = _image_node(tree, own[kind], folder, place, (-640, -420 - 300 * number))
        for shader in shaders:
            tree.links.new(node.outputs["Color"], shader.inputs[socket])
    bump = own.get("normal")
    if bump is not None:
        node = _image_node(tree, bump, folder, place, (-640, -1700))
        turn = tree.nodes.new("ShaderNodeNormalMap")
        turn.uv_map, turn.location, turn[MAP_KIND] = UV_LAYER, (-320, -1700), "normal"
        tree.links.new(node.outputs["Color"], turn.inputs["Color"])
        for shader in shaders:
            tree.links.new(turn.outputs["Normal"], shader.inputs[NORMAL])
        for script in osl_files.script_nodes(material):
            tree.links.new(turn.outputs["Normal"], script.inputs[NORMAL])
    scripts = [
        n for n in osl_files.script_nodes(material)
        if {osl_source.BODY, *FACTORS.values()} <= {s.identifier for s in n.inputs}
    ]  # fmt: skip
    for script in scripts:
        body_socket = next(s for s in script.inputs if s.identifier == osl_source.BODY)
        body_socket.default_value = tuple(float(v) for v in body)
    for number, (kind, name) in enumerate(FACTORS.items() if scripts else ()):
        if kind not in factors:
            continue
        node = _image_node(tree, factors[kind], folder, place, (-640, 1020 - 300 * number))
        for script in scripts:
            sockets = {s.identifier: s for s in script.inputs}
            tree.links.new(node.outputs["Color"], sockets[name])


def _image_node(
    tree: bpy.types.NodeTree,
    file: MapFile,
    folder: Path,
    place: bpy.types.Node,
    location: tuple[float, float],
) -> bpy.types.Node:
    image = bpy.data.images.load(str((folder / file.file).absolute()), check_existing=True)
    linear = file.file.endswith(".exr")
    image.colorspace_settings.name = (
        "Non-Color" if not file.colour else "Linear Rec.709" if linear else "sRGB"
    )
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.label, node.location = image, file.kind.replace("_", " "), location
    node[MAP_KIND] = file.kind
    tree.links.new(place.outputs["UV"], node.inputs["Vector"])
    return node


def _set_uv(data: bpy.types.Mesh, result: MapsResult) -> bool:
    """Set the texture coordinates of the maps; False if the mesh does not have the scan's faces."""
    uv = result.scan.mesh.uv
    if uv is None or len(data.polygons) != len(uv) or len(data.loops) != 3 * len(uv):
        return False
    layer = data.uv_layers.get(UV_LAYER) or data.uv_layers.new(name=UV_LAYER, do_init=False)
    layer.uv.foreach_set("vector", uv.astype(np.float32).ravel())
    layer.active = layer.active_render = True
    data.update()
    return True


def _own_shader_files(path: Path, final: Path) -> None:
    """Write the shader's packed EXRs next to the new file, and point its nodes to them."""

    def moved(file: Path) -> bool:
        image = bpy.data.images.get(file.name)
        return write_packed(image, path.parent / file.name)

    for material in measured_materials():
        osl_files.redirect_files(material, final.parent, moved)
