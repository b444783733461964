"""The photo that a fit proposes to take next, shown among the cameras of the scan."""

from __future__ import annotations

from typing import Any

import bpy
import mathutils
import numpy as np

from ..property_keys import CAMERA_LABEL, PROPOSED_LAMP
from .capture_collection import collection_of
from .lamp_placement import world_matrix

NAME = "Proposed Lamp"
DISTANCE = 1.2  # of the arrow's tail from the centre of the object, in its sizes
ARROW_LENGTH = 0.6  # in sizes of the object: it ends outside of it


def camera_of_proposed_photo(
    scene: bpy.types.Scene, capture: str, photo: dict[str, Any]
) -> bpy.types.Object | None:
    """The camera of the scan that has the viewpoint of the photo; None if it was deleted. photo:
    "proposed_photo" of result.json."""
    for thing in (collection_of(scene, capture) or scene.collection).all_objects:
        if thing.type == "CAMERA" and thing.get(CAMERA_LABEL) == photo["camera"]:
            return thing
    return None


def show_proposed_lamp(
    scene: bpy.types.Scene, capture: str, photo: dict[str, Any]
) -> bpy.types.Object | None:
    """Create or move an arrow from the direction of the lamp towards the mesh; None with the flash
    on the camera, or without a mesh."""
    remove_proposed_lamp(scene, capture)
    mesh = scene.patina.mesh
    if photo["towards_light"] is None or mesh is None:
        return None
    frame = world_matrix(mesh)
    corners = np.array(mesh.bound_box) @ frame[:3, :3].T + frame[:3, 3]
    size = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))
    axis = mathutils.Vector(frame[:3, :3] @ np.array(photo["towards_light"])).normalized()
    arrow = bpy.data.objects.new(NAME, None)
    arrow.empty_display_type = "SINGLE_ARROW"
    arrow.empty_display_size = ARROW_LENGTH * size
    arrow.show_name = arrow.show_in_front = True
    arrow.hide_render = True
    arrow.location = mathutils.Vector(corners.mean(axis=0)) + DISTANCE * size * axis
    arrow.rotation_mode = "QUATERNION"
    arrow.rotation_quaternion = (-axis).to_track_quat("Z", "Y")
    arrow[PROPOSED_LAMP] = capture
    (collection_of(scene, capture) or scene.collection).objects.link(arrow)
    return arrow


def remove_proposed_lamp(scene: bpy.types.Scene, capture: str) -> None:
    """Remove the arrow of an earlier fit of a capture."""
    for old in [o for o in scene.objects if o.get(PROPOSED_LAMP) == capture]:
        bpy.data.objects.remove(old)
