"""The capture's lights as Blender lamps, which the user can see and edit."""

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
from .lamp_placement import DISTANT, FROM_CAMERA, MOUNTED, NEAR, mark_as_imported, offset_of

__all__ = ["LIGHT_NAME", "create_lamp", "shine_only", "with_dragged_lamps"]


def create_lamp(
    light: Light,
    origin: NDArray[np.float64],
    centre: NDArray[np.float64],
    size: float,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """Create a lamp that lights the scene as the light lit the object.

    origin: (3,) point of the scan's frame at Blender's origin; centre: (3,) centre of the object in
    Blender; size: of the object. A distant light becomes a sun drawn near the object, a near or
    mounted one a point lamp. A mounted lamp moves to the camera that is looked through
    (shine_only); its beam profile is in nodes that only Cycles evaluates. Raises TypeError for
    another kind of light.
    """
    data = bpy.data.lights.new(light.name, "SUN" if isinstance(light, DistantLight) else "POINT")
    result = bpy.data.objects.new(light.name, data)
    result.rotation_mode = "QUATERNION"
    if isinstance(light, DistantLight):
        result[LAMP_KIND] = DISTANT
        # the strength of a Blender sun is its irradiance at normal incidence
        _set_strength(data, light.effective_irradiance)
        data.angle = 2 * light.angular_radius
        towards = mathutils.Vector(light.direction.tolist())
        result.rotation_quaternion = towards.to_track_quat(
            "Z", "Y"
        )  # a lamp emits along its −Z axis
        result.location = (centre + light.direction * 1.2 * size).tolist()
    elif isinstance(light, NearLight | MountedLight):
        known = np.ones(3) * size**2 if light.intensity is None else light.intensity
        _set_strength(data, 4 * math.pi * known)  # E = P / (4π d²)
        data.shadow_soft_size = light.radius
        if hasattr(data, "use_soft_falloff"):
            data.use_soft_falloff = False  # soft falloff deviates from E = I / d²
        if isinstance(light, MountedLight):
            result[LAMP_KIND] = MOUNTED
            result.location = (light.offset * FROM_CAMERA).tolist()
            result.lock_rotation = (True, True, True)  # its beam points in the viewing direction
            if light.beam is not None:
                lamp_beam.add_beam_nodes(result, light.beam)
        else:
            result[LAMP_KIND] = NEAR
            result.location = (light.position - origin).tolist()
    else:
        raise TypeError(f"no lamp for a {type(light).__name__}")
    result[LIGHT_NAME], result[INTENSITY_KNOWN] = light.name, light.known
    mark_as_imported(result)
    collection.objects.link(result)
    return result


def shine_only(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Switch on only the lamp that lit the camera's photo; a flash moves to that camera."""
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
    """Move a flash to another camera, with the same offset as on the last one."""
    offset = offset_of(lamp, scene)
    lamp.parent, lamp.parent_type = camera, "OBJECT"
    lamp.matrix_parent_inverse.identity()
    lamp.rotation_mode, lamp.rotation_quaternion = "QUATERNION", (1, 0, 0, 0)
    if (
        np.abs(offset - np.array(lamp.location)).max() > 0
    ):  # the user had detached it from its camera
        lamp.location, lamp.delta_location = offset.tolist(), (0, 0, 0)
    lamp[HOLDING_CAMERA] = camera.get(CAMERA_LABEL, camera.name)


def _set_strength(data: bpy.types.Light, strength: NDArray[np.float64]) -> None:
    data.energy = float(strength.max())
    data.color = tuple(float(x) for x in strength / strength.max())
