"""A sphere in Cycles, seen by the camera of the viewer."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector

from tests.browser.viewer_camera import EYE, FIELD, SIDE, rays
from tests.wheel import cycles_sphere


def new_scene(samples: int) -> bpy.types.Object:
    """The sphere of cycles_sphere, seen by the viewer's camera."""
    sphere = cycles_sphere.new_scene(size=SIDE, samples=samples, osl=True)
    scene = bpy.context.scene
    scene.cycles.filter_width = 1.0
    scene.render.film_transparent = True
    camera = scene.camera
    camera.data.type = "PERSP"
    camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(FIELD)
    camera.location = Vector(EYE)
    camera.rotation_euler = Vector(EYE).to_track_quat("Z", "Y").to_euler()
    # its poles are not in the picture then
    sphere.rotation_euler = (math.pi / 2, 0.0, 0.0)
    return sphere


def inside() -> np.ndarray:
    """(SIDE, SIDE) pixels of the sphere that are not close to its outline."""
    miss = np.linalg.norm(np.cross(EYE, rays()), axis=-1)
    return np.asarray(miss < 0.97)


def relative_rms(found: np.ndarray, expected: np.ndarray) -> float:
    kept = inside()
    return float(np.sqrt(np.sum((found - expected)[kept] ** 2) / np.sum(expected[kept] ** 2)))
