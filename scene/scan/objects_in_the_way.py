"""Hide objects that are in the way of a new scan, such as the cube of Blender's startup file."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..property_keys import CAPTURE

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
INNER = 0.6  # of the scan's bounding box: what its cameras must see
MAX_INSIDE = 0.5  # of an object's bounding box inside that of the scan

Array = NDArray[np.float64]


def hide_in_the_way(
    scene: bpy.types.Scene, mesh: bpy.types.Object, cameras: Sequence[bpy.types.Object]
) -> list[str]:
    """Hide the visible objects of the scene whose bounding box contains the centre of the scanned
    mesh or one of the cameras, stands between them, or lies mostly inside that of the mesh. Returns
    their names."""
    low, high = _box(mesh)
    centre = (low + high) / 2
    eyes = np.array([centre, *(camera.matrix_world.translation for camera in cameras)])
    corners = np.array([(0.5, 0.5, 0.5), *np.ndindex(2, 2, 2)])  # and the centre
    seen = centre + INNER * (corners - 0.5) * (high - low)
    own = {o for c in mesh.users_collection for o in c.all_objects}
    hidden = []
    for other in scene.objects:
        if other in own or other.type not in SURFACES or CAPTURE in other or other.hide_get():
            continue
        bottom, top = _box(other)
        blocks = _crosses(eyes[:, None], seen[None], bottom, top).any()
        size = np.maximum(top - bottom, 1e-12)
        inside = np.prod(np.clip(np.minimum(top, high) - np.maximum(bottom, low), 0, size) / size)
        if blocks or inside > MAX_INSIDE:
            other.hide_set(True)
            other.hide_render = True
            hidden.append(other.name)
    return hidden


def _crosses(start: Array, end: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    """Whether the lines from start to end (..., 3) cross a box, or lie in it."""
    along = np.where(np.abs(end - start) < 1e-12, 1e-12, end - start)
    one, other = (low - start) / along, (high - start) / along
    enter = np.maximum(np.minimum(one, other).max(axis=-1), 0.0)
    leave = np.minimum(np.maximum(one, other).min(axis=-1), 1.0)
    return np.asarray(enter <= leave)


def _box(thing: bpy.types.Object) -> tuple[Array, Array]:
    """Lowest and highest corner of the bounding box in the world."""
    corners = np.array(thing.bound_box) @ np.array(thing.matrix_world)[:3, :3].T
    corners += np.array(thing.matrix_world)[:3, 3]
    return corners.min(axis=0), corners.max(axis=0)
