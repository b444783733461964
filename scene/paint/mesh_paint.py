"""Materials painted on the mesh with Blender's Vertex Paint, and taken from its face sets."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.masks.strokes import strokes
from ..property_keys import SHOWN_SLOTS
from ..scan.face_slots import face_attribute
from .paint_kinds import paints, palette, wear, worn_slots

COLOURS = "Patina Materials"  # colour attribute of the mesh
FACE_SETS = ".sculpt_face_set"


def show_on_mesh(scene: bpy.types.Scene, mesh: bpy.types.Object) -> None:
    """The materials' colours as the mesh's active colour attribute."""
    data = mesh.data
    old = data.color_attributes.get(COLOURS)
    if old is not None and (old.domain != "CORNER" or old.data_type != "BYTE_COLOR"):
        data.color_attributes.remove(old)
        old = None
    if old is None:
        old = data.color_attributes.new(COLOURS, "BYTE_COLOR", "CORNER")
    colours = np.ones((len(data.loops), 4), np.float32)
    slots = worn_slots(mesh)
    colours[:, :3] = _corner_colours(scene, mesh, slots) / np.float32(255)
    old.data.foreach_set("color_srgb", colours.ravel())
    face_attribute(data, SHOWN_SLOTS, "INT", slots)
    data.color_attributes.active_color = old
    data.update()


def shown_on_mesh(mesh: bpy.types.Object) -> bool:
    """Whether it has the materials' colours, true or not any more."""
    return mesh.type == "MESH" and COLOURS in mesh.data.color_attributes


def take_from_mesh(scene: bpy.types.Scene, mesh: bpy.types.Object) -> int:
    """What was painted on the mesh since its colours were shown, as the faces' slots; how many
    faces that is. A face wears what most of its corners were given."""
    there, shown = mesh.data.color_attributes.get(COLOURS), mesh.data.attributes.get(SHOWN_SLOTS)
    if there is None or there.domain != "CORNER" or shown is None or shown.domain != "FACE":
        return 0
    was = np.empty(len(mesh.data.polygons), np.int32)
    shown.data.foreach_get("value", was)
    colours = np.empty((len(mesh.data.loops), 4), np.float32)
    there.data.foreach_get("color_srgb", colours.ravel())
    kinds = paints(scene)
    materials = [paint for paint in kinds if paint.kind == "material"]
    now = np.round(255 * np.clip(colours[None, :, :3], 0, 1)).astype(np.uint8)
    found = strokes(_corner_colours(scene, mesh, was)[None], now, palette(materials))[0]
    if not (found >= 0).any():
        return 0
    face = _corner_faces(mesh)
    count = len(materials)
    given = found >= 0
    size = len(mesh.data.polygons), count
    votes = np.bincount(face[given] * count + found[given], minlength=size[0] * count).reshape(size)
    corners = np.bincount(face, minlength=size[0])
    new = 2 * votes.max(axis=1) > corners
    slots = worn_slots(mesh)
    changed = new & (votes.argmax(axis=1) != slots)
    wear(mesh, np.where(new, votes.argmax(axis=1), slots))
    show_on_mesh(scene, mesh)
    return int(changed.sum())


def slots_of_face_sets(mesh: bpy.types.Object) -> NDArray[np.int32] | None:
    """(faces,) number of the face set of each, from 0 on without gaps; None where there is one."""
    sets = mesh.data.attributes.get(FACE_SETS)
    if sets is None or sets.domain != "FACE":
        return None
    values = np.empty(len(mesh.data.polygons), np.int32)
    sets.data.foreach_get("value", values)
    kinds, place = np.unique(values, return_inverse=True)
    return place.ravel().astype(np.int32) if len(kinds) > 1 else None


def _corner_faces(mesh: bpy.types.Object) -> NDArray[np.int64]:
    """(corners,) the face of each."""
    total = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("loop_total", total)
    return np.repeat(np.arange(len(total), dtype=np.int64), total)


def _corner_colours(
    scene: bpy.types.Scene, mesh: bpy.types.Object, slots: NDArray[np.int32]
) -> NDArray[np.uint8]:
    """(corners, 3) of what each corner's face wears, slots (faces,)."""
    materials = [paint for paint in paints(scene) if paint.kind == "material"]
    colours = palette(materials) if materials else np.full((1, 3), 128, np.uint8)
    return colours[np.minimum(slots, len(colours) - 1)[_corner_faces(mesh)]]
