"""The scanned mesh as a Blender object."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scan import Mesh

UV_LAYER, COLOURS = "UVMap", "Col"
# names of face attributes that Blender itself uses
RESERVED = {"material_index", "position", "sharp_face", "sharp_edge", "id", UV_LAYER, COLOURS}


def create_mesh_object(
    name: str, mesh: Mesh, origin: NDArray[np.float64], collection: bpy.types.Collection
) -> bpy.types.Object:
    """Create a smooth-shaded object with the scan's triangles, shifted by −origin.

    If the scan has them, the object gets the UV layer "UVMap", the colour attribute "Col", and an
    integer face attribute for each face attribute of the scan ("scan_NAME" for names that Blender
    uses itself).
    """
    data = bpy.data.meshes.new(name)
    count = len(mesh.faces)
    data.vertices.add(len(mesh.vertices))
    data.vertices.foreach_set("co", (mesh.vertices - origin).astype(np.float32).ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", mesh.faces.astype(np.int32).ravel())
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.polygons.foreach_set("use_smooth", np.ones(count, bool))
    data.update(calc_edges=True)
    data.validate()
    if len(data.polygons) == count:
        _add_attributes(data, mesh)
    result = bpy.data.objects.new(name, data)
    collection.objects.link(result)
    return result


def _add_attributes(data: bpy.types.Mesh, mesh: Mesh) -> None:
    if mesh.uv is not None:
        data.uv_layers.new(name=UV_LAYER, do_init=False)
        data.uv_layers[UV_LAYER].uv.foreach_set("vector", mesh.uv.astype(np.float32).ravel())
    if mesh.vertex_colours is not None:
        _add_colours(data, mesh.vertex_colours)
    for name, values in mesh.face_attributes.items():
        own = f"scan_{name}" if name in RESERVED or name.startswith(".") else name
        attribute = data.attributes.new(own, "INT", "FACE")
        attribute.data.foreach_set("value", values.astype(np.int32))


def _add_colours(data: bpy.types.Mesh, colours: NDArray[np.uint8]) -> None:
    """Add 8-bit sRGB colours (v, 3) as a colour attribute of the vertices."""
    attribute = data.color_attributes.new(COLOURS, "BYTE_COLOR", "POINT")
    srgb = np.concatenate([colours / 255.0, np.ones((len(colours), 1))], axis=1)
    attribute.data.foreach_set("color_srgb", srgb.astype(np.float32).ravel())


def create_points_object(
    name: str,
    positions: NDArray[np.float64],
    colours: NDArray[np.uint8],
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """Create an object with sparse points (n, 3) as vertices and a colour attribute "Col"."""
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(positions))
    data.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    _add_colours(data, colours)
    data.update()
    result = bpy.data.objects.new(name, data)
    collection.objects.link(result)
    return result


def assign_materials(
    target: bpy.types.Object,
    materials: list[bpy.types.Material],
    face_material: NDArray[np.int32],
) -> bool:
    """Assign a material to every face; the object's own materials are replaced.

    face_material: (faces,) index into ``materials``. Returns False if the object no longer has the
    scan's faces; all faces then have the first material.
    """
    if target.data.is_editmode:  # faces cannot be changed in Edit Mode
        with bpy.context.temp_override(active_object=target, object=target):
            bpy.ops.object.mode_set(mode="OBJECT")
    target.data.materials.clear()
    for material in materials:
        target.data.materials.append(material)
    matches = len(target.data.polygons) == len(face_material)
    if matches:
        target.data.polygons.foreach_set("material_index", face_material.astype(np.int32))
        target.data.update()
    return matches or len(materials) < 2
