"""The capture's lights as real lamps: what the artist sees, drags, and the next fit reads back."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ..core.capture import Capture, LightEntry
from ..core.light import DistantLight, Light, MountedLight, NearLight
from .properties import CAPTURE

LIGHT = "patina_light"  # custom property: the light's name
MADE = "patina_made"  # and where its lamp stood when it was made: x, y, z, then its axis
MOVED = 1e-4  # of the object's size, or radians: less than this is no drag
FROM_CAMERA = np.array([1.0, -1.0, -1.0])  # right, down, forward → Blender's camera axes


def create_lamp(
    light: Light,
    origin: NDArray[np.float64],
    centre: NDArray[np.float64],
    size: float,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """A lamp that lights the scene as the light lit the object.

    origin: what the scan was shifted by; centre: (3,) of the object in Blender; size: its own. A
    distant light is a sun drawn beside the object, a near or mounted one a point lamp; a mounted
    one belongs to whichever camera is looked through (shine_only).
    """
    data = bpy.data.lights.new(light.name, "SUN" if isinstance(light, DistantLight) else "POINT")
    result = bpy.data.objects.new(light.name, data)
    result.rotation_mode = "QUATERNION"
    if isinstance(light, DistantLight):
        # Blender's sun strength IS irradiance at normal incidence
        _shine(data, light.effective_irradiance)
        data.angle = 2 * light.angular_radius
        towards = mathutils.Vector(light.direction.tolist())
        result.rotation_quaternion = towards.to_track_quat("Z", "Y")  # a lamp shines along its −Z
        result.location = (centre + light.direction * 1.2 * size).tolist()
    elif isinstance(light, NearLight | MountedLight):
        known = np.ones(3) * size**2 if light.intensity is None else light.intensity
        _shine(data, 4 * math.pi * known)  # E = P / (4π d²)
        data.shadow_soft_size = light.radius
        at = light.offset * FROM_CAMERA if isinstance(light, MountedLight) else None
        result.location = (light.position - origin if at is None else at).tolist()
    else:
        raise TypeError(f"no lamp for a {type(light).__name__}")
    result[LIGHT] = light.name
    result[MADE] = _place(result)
    collection.objects.link(result)
    return result


def shine_only(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Of the capture's lamps, let only the one shine that lit the camera's photo; a flash goes
    where that camera is."""
    for lamp in scene.objects:
        if lamp.type != "LIGHT" or LIGHT not in lamp:
            continue
        if lamp.get(CAPTURE) != camera.get(CAPTURE):
            continue
        off = lamp[LIGHT] != camera.get(LIGHT)
        lamp.hide_render = off
        lamp.hide_set(off)
        if not off and lamp.get("patina_mounted"):
            lamp.parent = camera
            lamp.matrix_parent_inverse.identity()


def with_dragged_lamps(capture: Capture, scene: bpy.types.Scene) -> tuple[Capture, list[str]]:
    """(the capture with its lights where the artist has put their lamps, names of those moved).

    A moved lamp overrides the sphere, the sun or the numbers of the capture file.
    """
    lamps = {
        o[LIGHT]: o
        for o in scene.objects
        if o.type == "LIGHT" and o.get(CAPTURE) == str(capture.file) and LIGHT in o
    }
    origin = np.zeros(3)
    for collection in scene.collection.children_recursive:
        if collection.get(CAPTURE) == str(capture.file):
            origin = np.array(collection.get("patina_origin", (0.0, 0.0, 0.0)))
    entries, moved = [], []
    for entry in capture.lights:
        lamp = lamps.get(entry.name)
        if lamp is None or not _dragged(lamp, entry):
            entries.append(entry)
            continue
        entries.append(_from_lamp(entry, lamp, origin))
        moved.append(entry.name)
    return replace(capture, lights=tuple(entries)), moved


def _shine(data: bpy.types.Light, strength: NDArray[np.float64]) -> None:
    data.energy = float(strength.max())
    data.color = tuple(float(x) for x in strength / strength.max())


def _place(lamp: bpy.types.Object) -> list[float]:
    axis = lamp.rotation_quaternion.to_matrix().col[2]
    return [*lamp.location, *axis]


def _dragged(lamp: bpy.types.Object, entry: LightEntry) -> bool:
    made = np.array(lamp.get(MADE, [0.0] * 6))
    if entry.distant:  # a sun may be moved about: only its direction counts
        axis = np.array(lamp.matrix_world.to_3x3().normalized().col[2])
        return bool(np.linalg.norm(axis - made[3:]) > MOVED)
    here = np.array(lamp.location)
    return bool(np.linalg.norm(here - made[:3]) > MOVED * max(1e-6, np.linalg.norm(made[:3])))


def _from_lamp(
    entry: LightEntry, lamp: bpy.types.Object, origin: NDArray[np.float64]
) -> LightEntry:
    if entry.mounted is not None:
        return replace(entry, mounted=np.array(lamp.location) * FROM_CAMERA)
    if entry.position is not None:
        return replace(entry, position=np.array(lamp.matrix_world.translation) + origin)
    axis = np.array(lamp.matrix_world.to_3x3().normalized().col[2])
    return replace(entry, direction=axis, sphere=None, sun=None)
