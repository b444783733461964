"""Put maps on the measured materials and the scanned mesh of a scene.

If a mesh has multiple materials, the portable branches of all of them use the same maps, blended by
the painted masks: a face still has one material slot, but base colour, roughness, metallic and
specular change smoothly to those of the neighbour within the soft border of the masks, so that face
edges are not visible. Inputs are blended rather than shaders, because no exporter keeps a Mix
Shader (glTF and USD have one surface per face), and within the few texels of a border both look
alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.maps.maps_result import MapsResult
from ...core.maps.write import BLEND, MapFile
from ..material.map_nodes import FACTORS, SOCKETS, assign_maps, principled_nodes
from ..material.material_nodes import fill_principled
from ..material.measured_materials import measured_materials
from ..property_keys import MAP_KIND, MEASURED_NAME
from .meshes import UV_LAYER

USED_KINDS = {*FACTORS, *SOCKETS, "normal"}
"""Kinds of maps that materials use; the others are for other programs."""


def apply_maps(
    scene: bpy.types.Scene, result: MapsResult, folder: Path, files: Sequence[MapFile]
) -> list[str]:
    """Put the maps in ``folder`` on the measured materials and the scanned mesh of a scene. Returns
    notes for the user."""
    notes = []
    mesh, uv = scene.patina.mesh, result.scan.mesh.uv
    if mesh is None or mesh.type != "MESH":
        notes.append("The scanned mesh is not in this scene, so its UVs were not set.")
    elif uv is None or not _set_uv(mesh.data, uv):
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
        own = {f.kind: f for f in files if f.material == fitted.name and f.kind in FACTORS}
        shared = BLEND if multiple else fitted.name
        own |= {f.kind: f for f in files if f.material == shared and f.kind not in FACTORS}
        own |= {f.kind: f for f in files if f.kind == "normal"}
        images = {kind: _image(folder, file) for kind, file in own.items() if kind in USED_KINDS}
        for shader in principled_nodes(material):
            fill_principled(shader, fitted.principled)
        split = result.levels[index].split
        assign_maps(material, images, split.body, split.whole, UV_LAYER)
    remove_unused_maps()
    return notes


def remove_unused_maps() -> None:
    """Remove packed maps that no node shows any more."""
    for image in [i for i in bpy.data.images if MAP_KIND in i and not i.users]:
        bpy.data.images.remove(image)


def _image(folder: Path, file: MapFile) -> bpy.types.Image:
    image = bpy.data.images.load(str((folder / file.file).absolute()), check_existing=True)
    linear = file.file.endswith(".exr")
    image.colorspace_settings.name = (
        "Non-Color" if not file.colour else "Linear Rec.709" if linear else "sRGB"
    )
    return image


def _set_uv(data: bpy.types.Mesh, uv: NDArray[np.float32]) -> bool:
    """Set the texture coordinates of the maps; False if the mesh does not have the scan's faces."""
    if len(data.polygons) != len(uv) or len(data.loops) != 3 * len(uv):
        return False
    layer = data.uv_layers.get(UV_LAYER) or data.uv_layers.new(name=UV_LAYER, do_init=False)
    layer.uv.foreach_set("vector", uv.astype(np.float32).ravel())
    layer.active = layer.active_render = True
    data.update()
    return True
