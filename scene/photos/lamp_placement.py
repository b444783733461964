"""Placement of a capture's lamp in Blender, at present and when it was imported."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..material.lamp_inputs import lamp_power
from ..property_keys import CAMERA_LABEL, CAPTURE, HOLDING_CAMERA, LAMP_AS_IMPORTED, LAMP_KIND

Array = NDArray[np.float64]

DISTANT, NEAR, MOUNTED = "distant", "near", "mounted"  # values of LAMP_KIND
FROM_CAMERA = np.array([1.0, -1.0, -1.0])  # right, down, forward ↔ Blender's camera axes


@dataclass(frozen=True)
class Placement:
    """Placement and strength of a lamp.

    place: (3,) position in world space; for a flash in the axes of its camera (right, up,
    backward). axis: (3,) unit direction surface → light of a sun. strength: (3,) irradiance of a
    sun, intensity of a lamp. softness: angle of a sun (radians), radius of a lamp.
    """

    place: Array
    axis: Array
    strength: Array
    softness: float

    @property
    def values(self) -> list[float]:
        """The ten values that a custom property stores."""
        return [*self.place, *self.axis, *self.strength, self.softness]

    def within(self, frame: Array) -> Placement:
        """The same placement in another frame, given as a (4, 4) matrix_world."""
        inverse = np.linalg.inv(frame)
        axis = inverse[:3, :3] @ self.axis
        place = inverse[:3, :3] @ self.place + inverse[:3, 3]
        return Placement(place, axis / np.linalg.norm(axis), self.strength, self.softness)


def mark_as_imported(lamp: bpy.types.Object, scene: bpy.types.Scene | None = None) -> None:
    """Record the present state of a lamp as that of its import.

    scene: the one with the capture's cameras.
    """
    lamp[LAMP_AS_IMPORTED] = placement_of(lamp, scene).values


def imported_placement(lamp: bpy.types.Object) -> Placement | None:
    """The placement of the lamp at its import; None if Patina did not create the lamp."""
    values = np.array(lamp.get(LAMP_AS_IMPORTED, ()), np.float64)
    if values.shape != (10,):
        return None
    return Placement(values[:3], values[3:6], values[6:9], float(values[9]))


def placement_of(lamp: bpy.types.Object, scene: bpy.types.Scene | None) -> Placement:
    """The present placement of the lamp."""
    world = world_matrix(lamp)
    axis = world[:3, 2] / max(float(np.linalg.norm(world[:3, 2])), 1e-30)
    data, power = lamp.data, np.array(lamp_power(lamp.data))
    place = offset_of(lamp, scene) if lamp.get(LAMP_KIND) == MOUNTED else world[:3, 3]
    if data.type == "SUN":
        return Placement(place, axis, power, data.angle)
    return Placement(place, axis, power / (4 * math.pi), data.shadow_soft_size)


def offset_of(lamp: bpy.types.Object, scene: bpy.types.Scene | None) -> Array:
    """(3,) position of a flash in the axes of its camera (right, up, backward)."""
    holder = _holder(lamp, scene)
    own = np.array(lamp.location, np.float64) + np.array(lamp.delta_location)
    if holder is None:  # on no camera yet, or its camera was deleted
        return own
    plain = lamp.parent == holder and np.array_equal(lamp.matrix_parent_inverse, np.eye(4))
    if plain and not lamp.constraints:
        return own  # avoids the rounding errors of two matrices
    seen = np.linalg.inv(world_matrix(holder)) @ world_matrix(lamp)
    return seen[:3, 3]


def _holder(lamp: bpy.types.Object, scene: bpy.types.Scene | None) -> bpy.types.Object | None:
    label = lamp.get(HOLDING_CAMERA)
    if scene is None or label is None:
        return None
    return next(
        (
            o
            for o in scene.objects
            if o.type == "CAMERA"
            and o.get(CAMERA_LABEL) == label
            and o.get(CAPTURE) == lamp.get(CAPTURE)
        ),
        None,
    )


def world_matrix(thing: bpy.types.Object) -> Array:
    """(4, 4) matrix_world from the present properties. Blender's own is outdated until the next
    update, and for objects in an excluded collection."""
    own = np.array(thing.matrix_basis, np.float64)
    if any(not c.mute for c in thing.constraints):
        return np.array(thing.matrix_world, np.float64)
    if thing.parent is None:
        return own
    if thing.parent_type != "OBJECT":
        return np.array(thing.matrix_world, np.float64)
    return world_matrix(thing.parent) @ np.array(thing.matrix_parent_inverse, np.float64) @ own
