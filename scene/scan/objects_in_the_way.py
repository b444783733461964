"""Hide objects that are in the way of a new scan, such as the cube of Blender's startup file."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..property_keys import CAPTURE

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
MAX_INSIDE = 0.5  # of an object's bounding box inside that of the scan

Array = NDArray[np.float64]


def hide_in_the_way(
    scene: bpy.types.Scene, mesh: bpy.types.Object, cameras: Sequence[bpy.types.Object]
) -> list[str]:
    """Hide the visible objects of the scene whose bounding box contains the centre of the scanned
    mesh or one of the cameras, or lies mostly inside that of the mesh. Returns their names."""
    low, high = _box(mesh)
    places = np.array([(low + high) / 2, *(camera.matrix_world.translation for camera in cameras)])
    own = {o for c in mesh.users_collection for o in c.all_objects}
    hidden = []
    for other in scene.objects:
        if other in own or other.type not in SURFACES or CAPTURE in other or other.hide_get():
            continue
        bottom, top = _box(other)
        encloses = ((bottom <= places) & (places <= top)).all(axis=1).any()
        size = np.maximum(top - bottom, 1e-12)
        inside = np.prod(np.clip(np.minimum(top, high) - np.maximum(bottom, low), 0, size) / size)
        if encloses or inside > MAX_INSIDE:
            other.hide_set(True)
            other.hide_render = True
            hidden.append(other.name)
    return hidden


def _box(thing: bpy.types.Object) -> tuple[Array, Array]:
    """Lowest and highest corner of the bounding box in the world."""
    corners = np.array(thing.bound_box) @ np.array(thing.matrix_world)[:3, :3].T
    corners += np.array(thing.matrix_world)[:3, 3]
    return corners.min(axis=0), corners.max(axis=0)
