"""The photo that a fit proposes to take next, shown among the cameras of the scan."""

from __future__ import annotations

from typing import Any

import bpy
import mathutils
import numpy as np

from ..property_keys import CAMERA_LABEL, CAPTURE, PROPOSED_LAMP

NAME = "Proposed Lamp"
DISTANCE = 1.2  # of the arrow's tail from the centre of the object, in its sizes
ARROW_LENGTH = 0.6  # in sizes of the object: it ends outside of it


def show_proposed_photo(
    scene: bpy.types.Scene, capture: str, photo: dict[str, Any]
) -> list[bpy.types.Object]:
    """Create or move an arrow from the lamp's direction towards the mesh; returns it and the camera
    of the photo, those of them that there are.

    photo: "proposed_photo" of result.json. With the flash on the camera there is no arrow.
    """
    mesh = scene.patina.mesh
    remove_proposed_photo(scene, capture)
    cameras = (o for o in scene.objects if o.type == "CAMERA")
    camera = next((o for o in cameras if o.get(CAMERA_LABEL) == photo["camera"]), None)
    shown = [] if camera is None else [camera]
    towards = photo["towards_light"]
    if towards is None or mesh is None:
        return shown
    corners = np.array([mesh.matrix_world @ mathutils.Vector(c) for c in mesh.bound_box])
    size = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))
    axis = (mesh.matrix_world.to_3x3() @ mathutils.Vector(towards)).normalized()
    arrow = bpy.data.objects.new(NAME, None)
    arrow.empty_display_type = "SINGLE_ARROW"
    arrow.empty_display_size = ARROW_LENGTH * size
    arrow.show_name = arrow.show_in_front = True
    arrow.hide_render = True
    arrow.location = mathutils.Vector(corners.mean(axis=0)) + DISTANCE * size * axis
    arrow.rotation_mode = "QUATERNION"
    arrow.rotation_quaternion = (-axis).to_track_quat("Z", "Y")
    arrow[PROPOSED_LAMP] = capture
    _collection_of(scene, mesh, capture).objects.link(arrow)
    return [*shown, arrow]


def remove_proposed_photo(scene: bpy.types.Scene, capture: str) -> None:
    """Remove the arrow of an earlier fit of a capture."""
    for old in [o for o in scene.objects if o.get(PROPOSED_LAMP) == capture]:
        bpy.data.objects.remove(old)


def _collection_of(
    scene: bpy.types.Scene, mesh: bpy.types.Object, capture: str
) -> bpy.types.Collection:
    """The collection of the capture, or that of the mesh."""
    for collection in scene.collection.children_recursive:
        if collection.get(CAPTURE) == capture:
            return collection
    return mesh.users_collection[0]
