"""Materials painted on the mesh in Vertex Paint mode, and materials from face sets."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.masks.strokes import strokes
from ..property_keys import SHOWN_SLOTS
from ..scan.face_slots import face_attribute
from .paint_kinds import assign_slots, paints, palette, slots_of_faces

COLOUR_ATTRIBUTE = "Patina Materials"  # colour attribute of the mesh that is painted on
FACE_SETS = ".sculpt_face_set"


def show_on_mesh(scene: bpy.types.Scene, mesh: bpy.types.Object) -> None:
    """Write the materials' colours to the mesh's active colour attribute."""
    data = mesh.data
    layer = data.color_attributes.get(COLOUR_ATTRIBUTE)
    if layer is not None and (layer.domain != "CORNER" or layer.data_type != "BYTE_COLOR"):
        data.color_attributes.remove(layer)
        layer = None
    if layer is None:
        layer = data.color_attributes.new(COLOUR_ATTRIBUTE, "BYTE_COLOR", "CORNER")
    colours = np.ones((len(data.loops), 4), np.float32)
    slots = slots_of_faces(mesh)
    colours[:, :3] = _corner_colours(scene, mesh, slots) / np.float32(255)
    layer.data.foreach_set("color_srgb", colours.ravel())
    face_attribute(data, SHOWN_SLOTS, "INT", slots)
    data.color_attributes.active_color = layer
    data.update()


def shown_on_mesh(mesh: bpy.types.Object) -> bool:
    """Whether the mesh has the colour attribute of the materials, up to date or not."""
    return mesh.type == "MESH" and COLOUR_ATTRIBUTE in mesh.data.color_attributes


def apply_mesh_strokes(scene: bpy.types.Scene, mesh: bpy.types.Object) -> int:
    """Apply strokes on the mesh to the faces' material slots; returns the number of changed faces.

    A face gets the material that more than half of its corners were painted with.
    """
    layer, shown = (
        mesh.data.color_attributes.get(COLOUR_ATTRIBUTE),
        mesh.data.attributes.get(SHOWN_SLOTS),
    )
    if layer is None or layer.domain != "CORNER" or shown is None or shown.domain != "FACE":
        return 0
    previous = np.empty(len(mesh.data.polygons), np.int32)
    shown.data.foreach_get("value", previous)
    colours = np.empty((len(mesh.data.loops), 4), np.float32)
    layer.data.foreach_get("color_srgb", colours.ravel())
    kinds = paints(scene)
    materials = [paint for paint in kinds if paint.kind == "material"]
    painted = np.round(255 * np.clip(colours[None, :, :3], 0, 1)).astype(np.uint8)
    found = strokes(_corner_colours(scene, mesh, previous)[None], painted, palette(materials))[0]
    if not (found >= 0).any():
        return 0
    face = _corner_faces(mesh)
    count = len(materials)
    given = found >= 0
    size = len(mesh.data.polygons), count
    votes = np.bincount(face[given] * count + found[given], minlength=size[0] * count).reshape(size)
    corners = np.bincount(face, minlength=size[0])
    new = 2 * votes.max(axis=1) > corners
    slots = slots_of_faces(mesh)
    changed = new & (votes.argmax(axis=1) != slots)
    assign_slots(mesh, np.where(new, votes.argmax(axis=1), slots))
    show_on_mesh(scene, mesh)
    return int(changed.sum())


def slots_of_face_sets(mesh: bpy.types.Object) -> NDArray[np.int32] | None:
    """(faces,) index of each face's face set, from 0 without gaps; None if there is only one."""
    sets = mesh.data.attributes.get(FACE_SETS)
    if sets is None or sets.domain != "FACE":
        return None
    values = np.empty(len(mesh.data.polygons), np.int32)
    sets.data.foreach_get("value", values)
    kinds, place = np.unique(values, return_inverse=True)
    return place.ravel().astype(np.int32) if len(kinds) > 1 else None


def _corner_faces(mesh: bpy.types.Object) -> NDArray[np.int64]:
    """(corners,) index of each corner's face."""
    total = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("loop_total", total)
    return np.repeat(np.arange(len(total), dtype=np.int64), total)


def _corner_colours(
    scene: bpy.types.Scene, mesh: bpy.types.Object, slots: NDArray[np.int32]
) -> NDArray[np.uint8]:
    """(corners, 3) 8-bit sRGB colour of each corner's material; slots: (faces,)."""
    materials = [paint for paint in paints(scene) if paint.kind == "material"]
    colours = palette(materials) if materials else np.full((1, 3), 128, np.uint8)
    return colours[np.minimum(slots, len(colours) - 1)[_corner_faces(mesh)]]
