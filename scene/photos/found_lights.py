"""Move the lamps of lights that were found from the photos, and store their standard errors."""

from __future__ import annotations

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ...core.capture import LightEntry
from ..property_keys import (
    FOUND_BEAM,
    FOUND_ERROR,
    FOUND_PLACEMENT,
    FOUND_STRENGTH,
    LAMP_KIND,
    ORIGIN,
)
from .capture_collection import collection_of
from .lamp_placement import DISTANT, FROM_CAMERA, MOUNTED, Placement, world_matrix

Array = NDArray[np.float64]

MAX_DIFFERENCE = 1e-4  # of a found placement, relative: a larger one is an edit by hand


def move_to_found(
    lamp: bpy.types.Object, entry: LightEntry, mesh_frame: Array, origin: Array
) -> bool:
    """Move the lamp of a light to its found direction, position or offset; False if the lamp is of
    another kind.

    mesh_frame: (4, 4) matrix_world of the scanned mesh; origin: (3,) point of the scan's frame at
    the origin of the mesh.
    """
    kind = lamp.get(LAMP_KIND)
    if entry.distant != (kind == DISTANT) or (entry.mounted is not None) != (kind == MOUNTED):
        return False
    if entry.mounted is not None:
        lamp.location, lamp.delta_location = (entry.mounted * FROM_CAMERA).tolist(), (0, 0, 0)
        found = entry.mounted * FROM_CAMERA
    elif entry.position is not None:
        found = entry.position - origin
        _set_world(lamp, mesh_frame[:3, :3] @ found + mesh_frame[:3, 3], None)
    else:
        assert entry.direction is not None  # a found distant light has a direction
        found = entry.direction
        axis = mesh_frame[:3, :3] @ found
        _set_world(lamp, None, axis / np.linalg.norm(axis))
    lamp[FOUND_PLACEMENT] = found.tolist()
    lamp[FOUND_ERROR] = entry.standard_error if entry.standard_error is not None else -1.0
    lamp[FOUND_STRENGTH] = -1.0 if entry.relative_strength is None else entry.relative_strength
    lamp[FOUND_BEAM] = -1.0 if entry.beam is None else entry.beam
    return True


def found_values(lamp: bpy.types.Object, now: Placement) -> dict[str, float | None] | None:
    """{"standard_error", and "beam" of a flash} if the lamp is where it was found, else None.

    now: its placement in the mesh's frame, for a flash in that of its camera.
    """
    found = np.array(lamp.get(FOUND_PLACEMENT, ()), np.float64)
    if found.shape != (3,):
        return None
    kind = lamp.get(LAMP_KIND)
    here = now.axis if kind == DISTANT else now.place
    if np.abs(here - found).max() > MAX_DIFFERENCE * max(float(np.abs(found).max()), 1e-3):
        return None
    values = {"standard_error": _known(lamp.get(FOUND_ERROR, -1.0))}
    if kind == MOUNTED:
        values["beam"] = _known(lamp.get(FOUND_BEAM, -1.0))
    return values


def found_strength(lamp: bpy.types.Object) -> float | None:
    """The strength relative to the other lamps that was found; it does not depend on later edits of
    the lamp's place."""
    return _known(lamp.get(FOUND_STRENGTH, -1.0))


def scan_origin(scene: bpy.types.Scene, capture: str) -> Array:
    """(3,) point of the scan's frame at the origin of its mesh."""
    collection = collection_of(scene, capture)
    if collection is None:
        return np.zeros(3)
    return np.array(collection.get(ORIGIN, (0.0, 0.0, 0.0)), np.float64)


def _known(value: float) -> float | None:
    return float(value) if value >= 0 else None


def _set_world(lamp: bpy.types.Object, place: Array | None, axis: Array | None) -> None:
    """Move the lamp in world space, whatever its parent."""
    world = mathutils.Matrix(world_matrix(lamp).tolist())
    if place is not None:
        world.translation = place.tolist()
    if axis is not None:
        turn = mathutils.Vector(axis.tolist()).to_track_quat("Z", "Y")  # lamps emit along −Z
        world = mathutils.Matrix.LocRotScale(world.translation, turn, world.to_scale())
    lamp.matrix_world = world
