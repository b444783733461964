"""The capture's lights as real lamps: what the artist sees and drags."""

from __future__ import annotations

import math

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ...core.light import DistantLight, Light, MountedLight, NearLight
from ..property_keys import (
    CAMERA_LABEL,
    CAPTURE,
    HOLDING_CAMERA,
    INTENSITY_KNOWN,
    LAMP_KIND,
    LIGHT_NAME,
)
from . import lamp_beam
from .dragged_lamps import with_dragged_lamps
from .lamp_placement import DISTANT, FROM_CAMERA, MOUNTED, NEAR, mark_as_made, offset_of

__all__ = ["LIGHT_NAME", "create_lamp", "shine_only", "with_dragged_lamps"]


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
    one belongs to whichever camera is looked through (shine_only), and its beam is in nodes that
    Cycles obeys.
    """
    data = bpy.data.lights.new(light.name, "SUN" if isinstance(light, DistantLight) else "POINT")
    result = bpy.data.objects.new(light.name, data)
    result.rotation_mode = "QUATERNION"
    if isinstance(light, DistantLight):
        result[LAMP_KIND] = DISTANT
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
        if hasattr(data, "use_soft_falloff"):
            data.use_soft_falloff = False  # a disc that faces each point: not quite E = I / d²
        if isinstance(light, MountedLight):
            result[LAMP_KIND] = MOUNTED
            result.location = (light.offset * FROM_CAMERA).tolist()
            result.lock_rotation = (True, True, True)  # its beam looks where the camera looks
            if light.beam is not None:
                lamp_beam.narrow(result, light.beam)
        else:
            result[LAMP_KIND] = NEAR
            result.location = (light.position - origin).tolist()
    else:
        raise TypeError(f"no lamp for a {type(light).__name__}")
    result[LIGHT_NAME], result[INTENSITY_KNOWN] = light.name, light.known
    mark_as_made(result)
    collection.objects.link(result)
    return result


def shine_only(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Of the capture's lamps, let only the one shine that lit the camera's photo; a flash goes
    where that camera is."""
    for lamp in scene.objects:
        if lamp.type != "LIGHT" or LIGHT_NAME not in lamp:
            continue
        if lamp.get(CAPTURE) != camera.get(CAPTURE):
            continue
        off = lamp[LIGHT_NAME] != camera.get(LIGHT_NAME)
        lamp.hide_render = off
        for layer in scene.view_layers:
            if lamp.name in layer.objects:  # its collection may be excluded
                lamp.hide_set(off, view_layer=layer)
        if not off and lamp.get(LAMP_KIND) == MOUNTED:
            _mount(scene, lamp, camera)


def _mount(scene: bpy.types.Scene, lamp: bpy.types.Object, camera: bpy.types.Object) -> None:
    """Put a flash on another camera, as it stood on the last one."""
    offset = offset_of(lamp, scene)
    lamp.parent, lamp.parent_type = camera, "OBJECT"
    lamp.matrix_parent_inverse.identity()
    lamp.rotation_mode, lamp.rotation_quaternion = "QUATERNION", (1, 0, 0, 0)
    if np.abs(offset - np.array(lamp.location)).max() > 0:  # the artist took it off its camera
        lamp.location, lamp.delta_location = offset.tolist(), (0, 0, 0)
    lamp[HOLDING_CAMERA] = camera.get(CAMERA_LABEL, camera.name)


def _shine(data: bpy.types.Light, strength: NDArray[np.float64]) -> None:
    data.energy = float(strength.max())
    data.color = tuple(float(x) for x in strength / strength.max())
