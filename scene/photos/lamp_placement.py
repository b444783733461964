"""How a capture's lamp stands in Blender, and how it stood when it was made."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..material.lamp_inputs import lamp_power
from ..property_keys import CAMERA_LABEL, CAPTURE, HOLDING_CAMERA, LAMP_AS_IMPORTED, LAMP_KIND

Array = NDArray[np.float64]

# custom properties of a lamp

DISTANT, NEAR, MOUNTED = "distant", "near", "mounted"
FROM_CAMERA = np.array([1.0, -1.0, -1.0])  # right, down, forward ↔ Blender's camera axes


@dataclass(frozen=True)
class Stand:
    """place: (3,) in Blender's world, of a flash in its camera's axes there (right, up, backward).
    axis: (3,) unit, surface → light of a sun. strength: (3,) irradiance of a sun, intensity of a
    lamp. softness: a sun's angle (radians), a lamp's radius."""

    place: Array
    axis: Array
    strength: Array
    softness: float

    @property
    def numbers(self) -> list[float]:
        """As kept in a custom property."""
        return [*self.place, *self.axis, *self.strength, self.softness]

    def within(self, frame: Array) -> Stand:
        """The same seen from a frame, a (4, 4) matrix_world."""
        inverse = np.linalg.inv(frame)
        axis = inverse[:3, :3] @ self.axis
        place = inverse[:3, :3] @ self.place + inverse[:3, 3]
        return Stand(place, axis / np.linalg.norm(axis), self.strength, self.softness)


def mark_as_made(lamp: bpy.types.Object, scene: bpy.types.Scene | None = None) -> None:
    """What the lamp is now is what the capture says. scene: where the capture's cameras are."""
    lamp[LAMP_AS_IMPORTED] = stand(lamp, scene).numbers


def made_stand(lamp: bpy.types.Object) -> Stand | None:
    """How the lamp stood when it was made; None where the lamp is not one of ours."""
    numbers = np.array(lamp.get(LAMP_AS_IMPORTED, ()), np.float64)
    if numbers.shape != (10,):
        return None
    return Stand(numbers[:3], numbers[3:6], numbers[6:9], float(numbers[9]))


def stand(lamp: bpy.types.Object, scene: bpy.types.Scene | None) -> Stand:
    """How the lamp stands now."""
    world = world_matrix(lamp)
    axis = world[:3, 2] / max(float(np.linalg.norm(world[:3, 2])), 1e-30)
    data, power = lamp.data, np.array(lamp_power(lamp.data))
    place = offset_of(lamp, scene) if lamp.get(LAMP_KIND) == MOUNTED else world[:3, 3]
    if data.type == "SUN":
        return Stand(place, axis, power, data.angle)
    return Stand(place, axis, power / (4 * math.pi), data.shadow_soft_size)


def offset_of(lamp: bpy.types.Object, scene: bpy.types.Scene | None) -> Array:
    """(3,) where a flash is in the axes of the camera that it is on (right, up, backward)."""
    holder = _holder(lamp, scene)
    own = np.array(lamp.location, np.float64) + np.array(lamp.delta_location)
    if holder is None:  # on none yet, or its camera was deleted
        return own
    plain = lamp.parent == holder and np.array_equal(lamp.matrix_parent_inverse, np.eye(4))
    if plain and not lamp.constraints:
        return own  # without the rounding of two matrices
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
    """(4, 4) matrix_world as the properties say now: Blender's own lags until the next update, and
    for what lies in an excluded collection."""
    own = np.array(thing.matrix_basis, np.float64)
    if any(not c.mute for c in thing.constraints):
        return np.array(thing.matrix_world, np.float64)
    if thing.parent is None:
        return own
    if thing.parent_type != "OBJECT":
        return np.array(thing.matrix_world, np.float64)
    return world_matrix(thing.parent) @ np.array(thing.matrix_parent_inverse, np.float64) @ own
