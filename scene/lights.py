"""A distant light as a real lamp the artist sees."""

from __future__ import annotations

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ..core.light import DistantLight
from .properties import CAPTURE


def create_sun(
    light: DistantLight,
    centre: NDArray[np.float64],
    size: float,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """A sun lamp of the light's direction and irradiance (Blender's sun strength IS irradiance at
    normal incidence: a white matte surface shows strength / π), drawn beside the object."""
    data = bpy.data.lights.new(light.name, "SUN")
    irradiance = light.effective_irradiance
    data.energy = float(irradiance.max())
    data.color = tuple(float(x) for x in irradiance / irradiance.max())
    data.angle = 0.0
    result = bpy.data.objects.new(light.name, data)
    towards = mathutils.Vector(light.direction.tolist())
    result.rotation_mode = "QUATERNION"
    result.rotation_quaternion = towards.to_track_quat("Z", "Y")  # a lamp shines along its −Z
    result.location = (centre + light.direction * 1.2 * size).tolist()
    result["patina_light"] = light.name
    collection.objects.link(result)
    return result


def shine_only(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Of the capture's lamps, let only the one shine that lit the camera's photo."""
    for lamp in scene.objects:
        if lamp.type != "LIGHT" or "patina_light" not in lamp:
            continue
        if lamp.get(CAPTURE) != camera.get(CAPTURE):
            continue
        off = lamp["patina_light"] != camera.get("patina_light")
        lamp.hide_render = off
        lamp.hide_set(off)
