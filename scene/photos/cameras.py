"""The scan's cameras as Blender cameras, with their photos as background images."""

from __future__ import annotations

from pathlib import Path

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ...core.scan import Camera
from ..property_keys import CAMERA_LABEL, RESOLUTION

SENSOR_WIDTH = 36.0  # mm
OPENCV_TO_BLENDER = np.diag([1.0, -1.0, -1.0, 1.0])  # y down, z forward → y up, z backward


def camera_matrix(camera: Camera, origin: NDArray[np.float64]) -> mathutils.Matrix:
    """matrix_world of a camera, for a scan that is shifted by −origin."""
    to_world = np.eye(4)
    to_world[:3, :3] = camera.pose.rotation.T
    to_world[:3, 3] = camera.pose.centre - origin
    return mathutils.Matrix((to_world @ OPENCV_TO_BLENDER).tolist())


def create_camera(
    camera: Camera,
    origin: NDArray[np.float64],
    distance: float,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """Create a Blender camera that projects each point to the same pixel as the scan's camera.

    A lens with distortion or non-square pixels is replaced by a similar pinhole (Camera.rectified);
    its photo must be resampled accordingly. distance: from camera to object, in scan units; sets
    the clipping range.
    """
    pinhole = camera if camera.pinhole else camera.rectified()
    lens = pinhole.lens
    width, height = pinhole.width, pinhole.height
    data = bpy.data.cameras.new(camera.label)
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = SENSOR_WIDTH
    if pinhole.orthographic:
        data.type = "ORTHO"
        data.ortho_scale = width / lens.focal_length_x
    else:
        data.lens = lens.focal_length_x * SENSOR_WIDTH / width
    data.shift_x = (width / 2 - lens.principal_point_x) / width
    data.shift_y = (lens.principal_point_y - height / 2) / width
    data.clip_start, data.clip_end = 0.01 * distance, 100.0 * distance
    data.display_size = 0.15 * distance
    result = bpy.data.objects.new(camera.label, data)
    result.matrix_world = camera_matrix(camera, origin)
    result[RESOLUTION] = (width, height)
    result[CAMERA_LABEL] = camera.label
    collection.objects.link(result)
    return result


def put_photo_behind(camera: bpy.types.Object, photo: Path, visible: bool = True) -> None:
    """Add a photo, of the camera's resolution and lens, as its background image."""
    image = bpy.data.images.load(str(photo), check_existing=True)
    background = camera.data.background_images.new()
    background.image = image
    background.frame_method = "CROP"  # STRETCH, the default, ignores the camera's shift
    background.display_depth = "BACK"
    background.alpha = 1.0
    background.show_background_image = visible
    camera.data.show_background_images = True


def look_through(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Make a camera the scene's camera, and set the render resolution to that of its photo."""
    scene.camera = camera
    width, height = camera.get(RESOLUTION, (0, 0))
    if width and height:
        scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
        scene.render.resolution_percentage = 100
        scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
